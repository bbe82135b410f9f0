"""MultirotorControllerPID: controls velocity and heading of a Multirotor."""

from tussle.plugins.stock.controller.multirotor_controller_pid.plugin import MultirotorControllerPID

__all__ = ["MultirotorControllerPID"]
