"""UnicyclePID: flies a unicycle to a heading, an altitude and a speed."""

from tussle.stock.controller.unicycle_pid.plugin import UnicyclePID

__all__ = ["UnicyclePID"]
