"""UUV6DOFPIDController: controls heading, depth and speed of an underwater vehicle."""

from tussle.plugins.stock.controller.uuv_6dof_pid_controller.plugin import UUV6DOFPIDController

__all__ = ["UUV6DOFPIDController"]
