"""RigidBody6DOFStateSensor as in SCRIMMAGE."""

from __future__ import annotations

from tussle.api import GroupView
from tussle.plugins.stock.sensor import rigid_body_6dof_state_sensor


class RigidBody6DOFStateSensor(rigid_body_6dof_state_sensor.RigidBody6DOFStateSensor):
    """RigidBody6DOFStateSensor that ignores its noise."""

    def step(self, g: GroupView) -> None:
        super().step(g)
        self.measured_pos[:] = g.pos
