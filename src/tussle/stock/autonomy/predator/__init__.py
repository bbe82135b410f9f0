"""Hunting."""

from tussle.stock.autonomy.predator.plugin import Predator

__all__ = ["Predator"]
