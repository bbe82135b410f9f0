"""A vehicle that turns about all three axes of its body."""

from tussle.stock.motion.unicycle_3d.plugin import Unicycle3D

__all__ = ["Unicycle3D"]
