"""MotionBattery: a battery that commands discharge."""

from tussle.plugins.stock.controller.motion_battery.plugin import MotionBattery

__all__ = ["MotionBattery"]
