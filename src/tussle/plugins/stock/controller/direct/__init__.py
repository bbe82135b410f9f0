"""DirectController: connects an autonomy directly to a motion model."""

from tussle.plugins.stock.controller.direct.plugin import DirectController

__all__ = ["DirectController"]
