"""External: a body whose state is set from outside."""

from tussle.plugins.stock.motion.external.plugin import External

__all__ = ["External"]
