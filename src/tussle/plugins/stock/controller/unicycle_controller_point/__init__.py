"""UnicycleControllerPoint: drives a unicycle to a point."""

from tussle.plugins.stock.controller.unicycle_controller_point.plugin import UnicycleControllerPoint

__all__ = ["UnicycleControllerPoint"]
