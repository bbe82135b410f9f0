"""Unicycle: a vehicle that flies where its nose points, with commanded speed, turn rate and pitch rate."""

from tussle.plugins.stock.motion.unicycle.plugin import Unicycle

__all__ = ["Unicycle"]
