"""Unicycle3D as in SCRIMMAGE."""

from tussle.historic.motion.unicycle_3d.plugin import Unicycle3D

__all__ = ["Unicycle3D"]
