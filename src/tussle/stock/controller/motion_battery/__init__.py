"""MotionBattery: a battery that commands discharge."""

from tussle.stock.controller.motion_battery.plugin import MotionBattery

__all__ = ["MotionBattery"]
