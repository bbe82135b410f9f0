"""Still: a body that does not move."""

from tussle.plugins.stock.motion.still.plugin import Still

__all__ = ["Still"]
