"""UUV6DOF: a torpedo-shaped underwater vehicle."""

from tussle.plugins.stock.motion.uuv_6dof.plugin import UUV6DOF

__all__ = ["UUV6DOF"]
