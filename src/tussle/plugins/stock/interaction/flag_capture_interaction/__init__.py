"""FlagCaptureInteraction: rules of capturing a flag."""

from tussle.plugins.stock.interaction.flag_capture_interaction.plugin import FlagCaptureInteraction

__all__ = ["FlagCaptureInteraction"]
