"""FreeBody: a rigid body in free fall."""

from tussle.plugins.stock.motion.free_body.plugin import FreeBody

__all__ = ["FreeBody"]
