"""Hunting."""

from tussle.plugins.stock.autonomy.predator.plugin import Predator

__all__ = ["Predator"]
