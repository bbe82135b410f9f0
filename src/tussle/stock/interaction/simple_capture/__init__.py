"""The referee of captures."""

from tussle.stock.interaction.simple_capture.plugin import SimpleCapture

__all__ = ["SimpleCapture"]
