"""Convoy, Escort: a column of vehicles and its guards, which communicate by radio."""

from tussle.stock.autonomy.convoy.plugin import Convoy, ConvoyReport, Escort, IntruderAlarm

__all__ = ["Convoy", "ConvoyReport", "Escort", "IntruderAlarm"]
