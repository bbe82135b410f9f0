"""A body that is moved from outside."""

from tussle.stock.motion.external.plugin import External

__all__ = ["External"]
