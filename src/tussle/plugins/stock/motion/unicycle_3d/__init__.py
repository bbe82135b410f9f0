"""Unicycle3D: a unicycle that rotates about all three body axes."""

from tussle.plugins.stock.motion.unicycle_3d.plugin import Unicycle3D

__all__ = ["Unicycle3D"]
