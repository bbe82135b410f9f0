"""FixedWing6DOFControllerPID: controls heading, altitude and speed of a FixedWing6DOF."""

from tussle.plugins.stock.controller.fixed_wing_6dof_controller_pid.plugin import FixedWing6DOFControllerPID

__all__ = ["FixedWing6DOFControllerPID"]
