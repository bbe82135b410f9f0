"""DoubleIntegratorControllerVelYaw: flies a double integrator at a velocity and a heading."""

from tussle.plugins.stock.controller.double_integrator_controller_vel_yaw.plugin import (
    DoubleIntegratorControllerVelYaw,
)

__all__ = ["DoubleIntegratorControllerVelYaw"]
