"""RigidBody6DOF: a rigid body moved by thrust and torques."""

from tussle.plugins.stock.motion.rigid_body_6dof.plugin import RigidBody6DOF

__all__ = ["RigidBody6DOF"]
