"""Motor schemas, and behaviours that they combine, as in SCRIMMAGE."""

from __future__ import annotations

import numpy as np

from tussle.api import Behavior, Children, GroupView, HistoricAttributes
from tussle.numeric import cos, sin
from tussle.numeric.quaternion import quat_rotate
from tussle.plugins.historic.angles import headings
from tussle.plugins.stock.autonomy import motor_schemas, move_to_goal_ms, trail_ms
from tussle.plugins.stock.autonomy.avoid_entity_ms import AvoidEntityMS


class MoveToGoalMS(move_to_goal_ms.MoveToGoalMS):
    """MoveToGoalMS whose PID differentiates from a distance of 0 in its first call: a kick of d_gain times distance over dt.

    tussle begins with the distance at birth. SCRIMMAGE also sends waypoints as latitude and longitude, which rounds to 1e-9 m.
    """

    def spawn(self, g: GroupView, rows: np.ndarray) -> None:
        super().spawn(g, rows)
        self.previous[rows] = 0.0


class MotorSchemas(motor_schemas.MotorSchemas):
    """MotorSchemas that avoids others and goes to (100, 0, 0) where no behaviours are given; in tussle it flies straight on.

    The desired heading is not negative.
    """

    historic_attributes = HistoricAttributes(unread=("pub_vel_vec",))
    behaviors = Children(
        Behavior,
        by_state=True,
        default=(AvoidEntityMS(minimum_range=2.0), MoveToGoalMS(goal=(100.0, 0.0, 0.0))),
        doc="The combined behaviours.",
    )

    def step(self, g: GroupView) -> None:
        super().step(g)
        self.desired_heading[:] = headings(self.desired_heading)


class TrailMS(trail_ms.TrailMS):
    """TrailMS that slows down near its point, and turns the point about the leader's y axis after its azimuth.

    The desired velocity is limited to the `max_speed` of MotorSchemas; where it is longer than the way to the point, its length is
    lowered by the excess of the own speed over the leader's. So the distance does not decay exponentially as in tussle. The elevation
    turns the point down, and has no effect beside the leader. Without a leader, which ends SCRIMMAGE, the velocity is zero.
    """

    needed_services = ("max_desired_speed",)

    def step(self, g: GroupView) -> None:
        rows, pos, vel, quat = self._seen_leaders() if self.contacts == "noisy" else self._leaders(g)
        azimuth, elevation = self.trail_angle_azimuth[rows], self.trail_angle_elevation[rows]
        direction = np.stack([cos(elevation) * cos(azimuth), sin(azimuth), -sin(elevation) * cos(azimuth)])
        way = pos + quat_rotate(quat, self.trail_range[rows] * direction) - g.pos[:, rows]
        wanted = way + vel
        length, most = _length(wanted), g.call("max_desired_speed")[rows]
        limited = np.minimum(length, most)
        excess = _length(g.vel[:, rows]) - _length(vel)
        final = np.where(_length(way) < limited, limited - excess, limited)
        self.desired_velocity[:] = 0.0
        self.desired_velocity[:, rows] = wanted * (final / np.where(length > 0.0, length, 1.0))


def _length(v: np.ndarray) -> np.ndarray:
    """Lengths of vectors (3, n), (n,)."""
    return np.asarray(np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]))
