"""What stands where it is put."""

from tussle.stock.motion.still.plugin import Still

__all__ = ["Still"]
