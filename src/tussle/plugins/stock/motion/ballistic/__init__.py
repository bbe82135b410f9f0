"""Ballistic: a mass in free fall."""

from tussle.plugins.stock.motion.ballistic.plugin import Ballistic

__all__ = ["Ballistic"]
