"""RigidBody6DOFStateSensor: position, body velocity, rates and accelerations of an entity."""

from tussle.plugins.stock.sensor.rigid_body_6dof_state_sensor.plugin import RigidBody6DOFStateSensor

__all__ = ["RigidBody6DOFStateSensor"]
