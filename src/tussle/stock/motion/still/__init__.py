"""Still: a body that does not move."""

from tussle.stock.motion.still.plugin import Still

__all__ = ["Still"]
