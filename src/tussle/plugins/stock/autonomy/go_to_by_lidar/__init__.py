"""Flight to a goal between obstacles that a lidar sees."""

from __future__ import annotations

import numpy as np

from tussle.api import Autonomy, GroupView, Input, Output, Param, Publish, State
from tussle.declare.messages import GoalReached
from tussle.numeric import atan2, clip, cos, sin
from tussle.numeric.quaternion import quat_rotate
from tussle.numeric.ways import closest_approach
from tussle.plugins.stock.autonomy.go_to_by_lidar import kernels


def length(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Lengths of vectors in the plane, (n,)."""
    return np.asarray(np.sqrt(x * x + y * y))


class GoToByLidar(Autonomy):
    """Flies at constant height to a goal, around obstacles that `RayTrace` sees, and stays there.

    It chooses the direction of least cost among 72. The cost has three terms: the angle to the goal, the turn from the last direction,
    and the part of the path, of length `look_ahead` at most, that is blocked for a disc of radius `clearance` (VFH+: I. Ulrich and J.
    Borenstein, ICRA 1998, with the scan in place of a grid). The speed lets it stop within the free path, whose length is
    v^2 / (2 `deceleration`) + v `reaction_time`. Directions without scan points count as free, so a lidar with too short a range leads
    to collisions. Points count if their height differs by less than `half_height`, so that a tilted lidar does not take the ground for
    an obstacle.

    `GoalReached` is published when its way comes within `tolerance` for the first time.
    """

    grade = "portable"

    goal = Param((0.0, 0.0, 0.0), fields="x y z", unit="m", doc="Goal, world frame.")
    is_relative = Param(False, doc="Measure the goal from the initial position.")
    speed = Param(10.0, unit="m/s", ge=0.0, doc="Largest speed.")
    tolerance = Param(3.0, unit="m", gt=0.0, doc="Horizontal distance at which the goal is reached.")
    clearance = Param(2.0, unit="m", gt=0.0, doc="Distance to keep from obstacles.")
    look_ahead = Param(50.0, unit="m", gt=0.0, doc="Length of the path that should be free.")
    half_height = Param(3.0, unit="m", gt=0.0, doc="Difference in height up to which a point is an obstacle.")
    deceleration = Param(3.0, unit="m/s^2", gt=0.0, doc="Braking deceleration.")
    reaction_time = Param(0.5, unit="s", ge=0.0, doc="Time from a scan to the full deceleration.")
    turn_weight = Param(0.3, ge=0.0, doc="Cost of a turn by one radian; that of the angle to the goal is 1.")
    block_weight = Param(6.0, unit="rad", ge=0.0, doc="Cost of a path that is completely blocked.")
    target = State("x y z", unit="m", doc="Current goal, world frame.")
    heading = State(unit="rad", doc="Direction of flight.")
    is_there = State(dtype=bool, doc="Whether it reached the goal.")
    reached = Publish(GoalReached)
    points = Input("raytrace", fields="x y z range in_range", unit="m m m m 1", ragged=True)
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")
    desired_heading = Output(unit="rad")
    desired_altitude = Output(unit="m")
    desired_speed = Output(unit="m/s")

    def spawn(self, g: GroupView, rows: np.ndarray) -> None:
        """Fix the goal."""
        pos = g.pos[:, rows]
        self.target[:, rows] = self.goal[:, rows] + np.where(self.is_relative[rows], pos, 0.0)
        self.heading[rows] = self._bearing(g)[rows]

    def _bearing(self, g: GroupView) -> np.ndarray:
        """Direction of the goal [rad], (n,)."""
        return np.asarray(atan2(self.target[1] - g.pos[1], self.target[0] - g.pos[0]))

    def _obstacles(self, g: GroupView) -> tuple[np.ndarray, np.ndarray]:
        """Return scan points at flight height, relative to their entities, (2, m) [m], and each entity's first one, (n + 1,)."""
        x, y, z, distance, in_range = self.points.data
        row = self.points.row
        east, north, up = quat_rotate(g.quat[:, row], np.stack([x, y, z]))
        is_seen = (in_range > 0.0) | (distance == -np.inf)
        kept = np.flatnonzero(is_seen & (np.abs(up) < self.half_height[row]))
        start = np.searchsorted(row[kept], np.arange(g.n + 1))
        return np.ascontiguousarray(np.stack([east[kept], north[kept]])), start.astype(np.int64)

    def step(self, g: GroupView) -> None:
        """Choose direction and speed."""
        distance = length(self.target[0] - g.pos[0], self.target[1] - g.pos[1])
        x, y, _ = g.vel * g.dt
        offset = np.stack([g.pos[0] - x - self.target[0], g.pos[1] - y - self.target[1], np.zeros(g.n)])
        _, nearest = closest_approach(offset, np.stack([x, y, np.zeros(g.n)]))
        rows = np.flatnonzero(~self.is_there & (nearest <= self.tolerance))
        self.is_there[rows] = True
        self.reached.publish(rows, entity=g.id[rows], team=g.team[rows], t=g.t[rows])
        free = np.empty(g.n)
        where = self._bearing(g), distance, self.turn_weight
        limits = self.clearance, self.look_ahead, self.block_weight
        kernels.choose(*self._obstacles(g), where, limits, self.heading, free)
        # The root of v^2 / (2 a) + v t = d.
        a, t = self.deceleration, self.reaction_time
        stopping = a * (np.sqrt(t * t + 2.0 * np.minimum(free, distance) / a) - t)
        speed = np.minimum(self.speed, stopping)
        self.velocity[0], self.velocity[1] = speed * cos(self.heading), speed * sin(self.heading)
        self.velocity[2] = clip(self.target[2] - g.pos[2], -0.2 * self.speed, 0.2 * self.speed)
        self.desired_heading[:], self.desired_altitude[:] = self.heading, self.target[2]
        self.desired_speed[:] = speed
