"""The weighted mean of behaviours."""

from __future__ import annotations

import numpy as np

from tussle.api import Autonomy, Behavior, Children, GroupView, HistoricAttributes, Output, Param, service
from tussle.numeric import atan2


class MotorSchemas(Autonomy):
    """Adds up what its behaviours wish, each by its gain, over the gains of those that wish anything (Arkin 1989).

    So a behaviour that wishes nothing, such as avoidance with nobody near, does not dilute the others. With no wish at all the entity
    goes straight on at full speed. The sum is written as heading, altitude and speed, and as `velocity`: the motion model or controller
    takes what it reads.
    """

    grade = "portable"
    historic_attributes = HistoricAttributes(
        unread=("state_topic_name", "network_name", "pub_vel_vec"),
        differs={
            "behaviors": "MotorSchemas without behaviors flies straight on; "
            "in the existing system it then avoids others and goes to (100, 0, 0)"
        },
    )

    max_speed = Param(21.0, unit="m/s", gt=0.0, doc="Longest wish, and speed when there is none.")
    add_lower_bound_to_vz = Param(False, doc="Bound the vertical part of the wanted velocity from below.")
    vz_lower_bound = Param(-1.0, unit="m/s", doc="That bound.")
    behaviors = Children(Behavior, doc="What it is made of.")
    desired_heading = Output(unit="rad")
    desired_altitude = Output(unit="m")
    desired_speed = Output(unit="m/s")
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def step(self, g: GroupView) -> None:
        total = np.zeros((3, g.n))
        weight = np.zeros(g.n)
        for behavior in self.behaviors:
            g.step(behavior)
            wish = behavior.wish
            length = np.sqrt(wish[0] * wish[0] + wish[1] * wish[1] + wish[2] * wish[2])
            shorter = np.minimum(1.0, self.max_speed / np.where(length > 0.0, length, 1.0))
            total += behavior.gain * shorter * wish
            weight += np.where(length > 0.0, behavior.gain, 0.0)
        wished = weight > 0.0
        v = np.where(wished, total / np.where(wished, weight, 1.0), self.max_speed * g.forward)
        self.desired_heading[:] = atan2(v[1], v[0])
        self.desired_altitude[:] = g.pos[2] + v[2]
        self.desired_speed[:] = np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
        self.velocity[:2] = v[:2]
        self.velocity[2] = np.where(self.add_lower_bound_to_vz, np.maximum(v[2], self.vz_lower_bound), v[2])

    @service
    def longest_wish(self, g: GroupView) -> np.ndarray:
        """Length that a behaviour's wish should not exceed [m/s], (n,)."""
        return np.asarray(self.max_speed)
