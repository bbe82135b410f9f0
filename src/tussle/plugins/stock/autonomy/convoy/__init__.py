"""Convoy, Escort: a column of vehicles and its guards, which communicate by radio."""

from tussle.plugins.stock.autonomy.convoy.plugin import Convoy, ConvoyReport, Escort, IntruderAlarm

__all__ = ["Convoy", "ConvoyReport", "Escort", "IntruderAlarm"]
