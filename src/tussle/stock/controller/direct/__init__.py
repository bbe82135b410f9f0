"""DirectController: connects an autonomy directly to a motion model."""

from tussle.stock.controller.direct.plugin import DirectController

__all__ = ["DirectController"]
