"""Straight: an autonomy that flies straight on."""

from tussle.stock.autonomy.straight.plugin import Straight

__all__ = ["Straight"]
