"""SimpleCapture: decides capture claims."""

from tussle.plugins.stock.interaction.simple_capture.plugin import SimpleCapture

__all__ = ["SimpleCapture"]
