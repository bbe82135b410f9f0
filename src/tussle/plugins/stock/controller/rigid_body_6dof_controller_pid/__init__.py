"""RigidBody6DOFControllerPID: controls heading, altitude and speed of a RigidBody6DOF."""

from tussle.plugins.stock.controller.rigid_body_6dof_controller_pid.plugin import RigidBody6DOFControllerPID

__all__ = ["RigidBody6DOFControllerPID"]
