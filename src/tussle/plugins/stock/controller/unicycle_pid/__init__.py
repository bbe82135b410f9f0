"""UnicyclePID: controls heading, altitude and speed of a unicycle."""

from tussle.plugins.stock.controller.unicycle_pid.plugin import UnicyclePID

__all__ = ["UnicyclePID"]
