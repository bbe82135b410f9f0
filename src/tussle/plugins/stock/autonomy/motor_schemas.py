"""An autonomy that combines behaviours by their weighted mean."""

from __future__ import annotations

import numpy as np

from tussle.api import (
    Behavior,
    Children,
    GroupView,
    HistoricAttributes,
    Output,
    Param,
    StateFollower,
    service,
)
from tussle.numeric import atan2


class MotorSchemas(StateFollower):
    """Combines the velocities of its behaviours (Arkin 1989): the mean of those that are not zero, weighted by their gains.

    A behaviour whose velocity is zero, for example avoidance without other entities nearby, therefore does not dilute the others. If
    all are zero, the entity flies straight on at `max_speed`. The result is written as heading, altitude and speed, and as `velocity`.

    A behaviour with `states` acts only in these states of the entity, which messages on the topic `state_topic_name` set. In other
    states its memory does not change.
    """

    grade = "portable"
    historic_attributes = HistoricAttributes(
        unread=("pub_vel_vec",),
        differs={
            "behaviors": "MotorSchemas without behaviors flies straight on; "
            "in SCRIMMAGE it avoids others and goes to (100, 0, 0)"
        },
    )

    network_name = Param("LocalNetwork", doc="Network that carries the state.")
    max_speed = Param(
        21.0, unit="m/s", gt=0.0, doc="Largest speed of a behaviour, and speed without behaviours."
    )
    add_lower_bound_to_vz = Param(False, doc="Limit the vertical velocity to at least vz_lower_bound.")
    vz_lower_bound = Param(-1.0, unit="m/s", doc="Lowest vertical velocity, with add_lower_bound_to_vz.")
    behaviors = Children(Behavior, by_state=True, doc="The combined behaviours.")
    desired_heading = Output(unit="rad")
    desired_altitude = Output(unit="m")
    desired_speed = Output(unit="m/s")
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def step(self, g: GroupView) -> None:
        self.read_state()
        total = np.zeros((3, g.n))
        weight = np.zeros(g.n)
        for behavior in self.behaviors:
            acts = self.acts(behavior)
            g.step(behavior, acts)
            velocity = behavior.desired_velocity
            gain = behavior.gain if acts is None else np.where(acts, behavior.gain, 0.0)
            length = np.sqrt(
                velocity[0] * velocity[0] + velocity[1] * velocity[1] + velocity[2] * velocity[2]
            )
            shorter = np.minimum(1.0, self.max_speed / np.where(length > 0.0, length, 1.0))
            total += gain * shorter * velocity
            weight += np.where(length > 0.0, gain, 0.0)
        has_command = weight > 0.0
        v = np.where(has_command, total / np.where(has_command, weight, 1.0), self.max_speed * g.forward)
        self.desired_heading[:] = atan2(v[1], v[0])
        self.desired_altitude[:] = g.pos[2] + v[2]
        self.desired_speed[:] = np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
        self.velocity[:2] = v[:2]
        self.velocity[2] = np.where(self.add_lower_bound_to_vz, np.maximum(v[2], self.vz_lower_bound), v[2])

    @service
    def max_desired_speed(self, g: GroupView) -> np.ndarray:
        """Return the largest speed of a behaviour [m/s], (n,)."""
        return np.asarray(self.max_speed)
