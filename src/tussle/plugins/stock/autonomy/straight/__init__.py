"""Straight: an autonomy that flies straight on."""

from tussle.plugins.stock.autonomy.straight.plugin import Straight

__all__ = ["Straight"]
