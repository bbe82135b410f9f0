"""SimpleCapture: decides capture claims."""

from tussle.stock.interaction.simple_capture.plugin import SimpleCapture

__all__ = ["SimpleCapture"]
