"""DirectController: autonomy and motion model joined without a controller."""

from tussle.stock.controller.direct.plugin import DirectController

__all__ = ["DirectController"]
