"""Flocking by repulsion, cohesion and alignment."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from tussle.api import Autonomy, GroupView, Output, Param, State, neighbors, together
from tussle.api.laws import Contributions
from tussle.numeric import cos
from tussle.plugins.stock.autonomy.boids import kernels
from tussle.plugins.stock.autonomy.boids.kernels import push

AHEAD = 1e6  # [m]
Contributed = tuple[float, ...]


class Boids(Autonomy):
    """Flocking (Reynolds 1987) with a goal, weighted as in equations (2) to (8) of the 2018 paper.

    The neighbours are all entities nearer than `comms_range`. The desired velocity is the weighted sum of five vectors (goal,
    repulsion from team mates, repulsion from others, centroid of the team mates, mean heading of the team mates), divided by the sum
    of their lengths, times `max_speed`. With `averaging="historic"` centroid and heading are computed as in the code of the paper: yaw is
    averaged as a plain number (wrong near West), and both sums are divided by the number of all neighbours, other teams included,
    which biases the centroid towards the world's origin and the heading towards East.

    The outputs fit a unicycle (speed, turn_rate, pitch_rate), an integrator (velocity) and heading controllers (desired_...); the speed
    of all is `max_speed`. Only outputs that are wired are computed. In SCRIMMAGE the desired altitude was the climb speed; here it
    is the altitude one second ahead. There `velocity` was at most half of max_speed, and 1 m/s without neighbours.
    """

    grade = "portable"
    only_calls_kernels = True

    max_speed = Param(30.0, unit="m/s", ge=0.0, doc="Desired speed.")
    comms_range = Param(200.0, unit="m", ge=0.0, doc="Distance below which entities are neighbours.")
    fov_el = Param(
        2.0 * math.pi,
        unit="rad",
        text_unit="deg",
        ge=0.0,
        doc="Field of view in elevation; at 360 degrees no entity is excluded.",
    )
    fov_az = Param(2.0 * math.pi, unit="rad", text_unit="deg", ge=0.0, doc="Field of view in azimuth.")
    goal_weight = Param(0.1, ge=0.0, doc="Weight of the direction to the goal.")
    avoid_team_weight = Param(1.0, ge=0.0, doc="Weight of the repulsion from team mates.")
    avoid_nonteam_weight = Param(10.0, ge=0.0, doc="Weight of the repulsion from others.")
    centroid_weight = Param(1.0, ge=0.0, doc="Weight of the direction to the team mates' centroid.")
    align_weight = Param(0.5, ge=0.0, doc="Weight of the team mates' mean heading.")
    sphere_of_influence = Param(100.0, unit="m", ge=0.0, doc="Distance below which neighbours repel.")
    minimum_team_range = Param(
        2.0, unit="m", ge=0.0, doc="Distance to team mates below which the repulsion overrides all else."
    )
    minimum_nonteam_range = Param(
        20.0, unit="m", ge=0.0, doc="Distance to others below which the repulsion overrides all else."
    )
    use_initial_heading = Param(True, doc="Place the goal `goal_distance` ahead of the initial position.")
    goal_distance = Param(AHEAD, unit="m", ge=0.0, doc="Distance to the goal, with use_initial_heading.")
    goal = Param((1e6, 1e6, 1e3), fields="x y z", unit="m", doc="Goal without use_initial_heading.")
    averaging = Param("team", choices=("team", "historic"), doc="How mean heading and centroid are computed.")
    target = State("x y z", unit="m", doc="Current goal.")
    speed = Output(unit="m/s")
    turn_rate = Output(unit="rad/s")
    pitch_rate = Output(unit="rad/s")
    desired_heading = Output(unit="rad")
    desired_speed = Output(unit="m/s")
    desired_altitude = Output(unit="m")
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    @neighbors("comms_range", teams="own", x="sum", y="sum", z="sum", east="sum", north="sum", n="count")
    @staticmethod
    def mates(
        offset_x: float, offset_y: float, offset_z: float, other_level_forward_x: float, other_level_forward_y: float
    ) -> Contributed:  # fmt: skip
        return offset_x, offset_y, offset_z, other_level_forward_x, other_level_forward_y, True

    @neighbors("comms_range", teams="own", x="sum", y="sum", z="sum", yaw="sum", no="sum", n="count")
    @staticmethod
    def historic_mates(offset_x: float, offset_y: float, offset_z: float, other_yaw: float) -> Contributed:
        return offset_x, offset_y, offset_z, other_yaw, 0.0, True

    @neighbors("comms_range", teams="other", n="count")
    @staticmethod
    def others() -> bool:
        return True

    @neighbors("comms_range", "sphere_of_influence", teams="own", x="sum", y="sum", z="sum")
    @staticmethod
    def team_push(
        offset_x: float, offset_y: float, offset_z: float, distance_squared: float, inverse_distance: float,
        sphere_of_influence: float, minimum_team_range: float,
    ) -> Contributed:  # fmt: skip
        return push(
            offset_x, offset_y, offset_z, distance_squared, inverse_distance, sphere_of_influence, minimum_team_range
        )  # fmt: skip

    @neighbors("comms_range", "sphere_of_influence", teams="other", x="sum", y="sum", z="sum")
    @staticmethod
    def other_push(
        offset_x: float, offset_y: float, offset_z: float, distance_squared: float, inverse_distance: float,
        sphere_of_influence: float, minimum_nonteam_range: float,
    ) -> Contributed:  # fmt: skip
        return push(
            offset_x, offset_y, offset_z, distance_squared, inverse_distance, sphere_of_influence, minimum_nonteam_range
        )  # fmt: skip

    @staticmethod
    def in_view(
        offset_x: float, offset_y: float, offset_z: float, distance: float,
        quat_w: float, quat_x: float, quat_y: float, quat_z: float, fov_az: float, fov_el: float,
    ) -> bool:  # fmt: skip
        """Return True if azimuth and elevation of an offset [m] in body axes are inside the fields of view [rad].

        For angles up to pi, |angle| < half is equivalent to cos(angle) > cos(half). A field of view of 2 pi has no edge: an entity
        exactly astern is seen.
        """
        w, i, j, k = quat_w, quat_x, quat_y, quat_z
        ahead = (
            (1 - 2 * (j * j + k * k)) * offset_x
            + 2 * (i * j + w * k) * offset_y
            + 2 * (i * k - w * j) * offset_z
        )
        left = (
            2 * (i * j - w * k) * offset_x
            + (1 - 2 * (i * i + k * k)) * offset_y
            + 2 * (j * k + w * i) * offset_z
        )
        level = np.sqrt(ahead * ahead + left * left)
        in_azimuth = (
            ahead > cos(0.5 * min(fov_az, 2.0 * np.pi)) * level or fov_az >= 2.0 * np.pi or level == 0.0
        )
        in_elevation = level > cos(0.5 * min(fov_el, np.pi)) * distance or fov_el > np.pi
        return (in_azimuth and in_elevation) or distance == 0.0

    seen = together(mates, others, team_push, other_push)
    seen_in_view = together(mates, others, team_push, other_push, where=in_view)
    historic = together(historic_mates, others, team_push, other_push)
    historic_in_view = together(historic_mates, others, team_push, other_push, where=in_view)
    velocity_kernel = staticmethod(kernels.velocity)

    def spawn(self, g: GroupView, rows: np.ndarray) -> None:
        ahead = g.pos[:, rows] + self.goal_distance[rows] * g.column("forward", rows)
        self.target[:, rows] = np.where(self.use_initial_heading[rows], ahead, self.goal[:, rows])

    def _neighbor_sums(self, g: GroupView) -> np.ndarray:
        """Return the neighbour sums for `kernels.law`, (13, n)."""
        sees_all = g.once(kernels.sees_all, self.fov_az, self.fov_el)
        if self.averaging == "historic":
            return self._with_historic_means(g, self.historic if sees_all else self.historic_in_view)
        return np.asarray((self.seen if sees_all else self.seen_in_view)(g).values)

    def _with_historic_means(self, g: GroupView, law: Callable[[GroupView], Contributions]) -> np.ndarray:
        """Return the neighbour sums, (13, n), with the means of the paper's code."""
        seen = law(g).values
        kernels.historic_means(g.components("pos"), seen)
        return seen

    def step(self, g: GroupView) -> None:
        wanted = np.empty((3, g.n))
        pos = g.components("pos")
        seen = self._neighbor_sums(g)
        weights = (
            self.max_speed, self.goal_weight, self.avoid_team_weight, self.avoid_nonteam_weight, self.centroid_weight,
            self.align_weight,
        )  # fmt: skip
        wired = self.wired
        if "turn_rate" in wired or "pitch_rate" in wired or "speed" in wired:
            commands, quat = (self.speed, self.turn_rate, self.pitch_rate), g.components("quat")
            g.split(kernels.law_and_rates, pos, quat, self.target, seen, weights, wanted, commands)
        else:
            g.split(kernels.law, pos, self.target, seen, weights, wanted)
        if "velocity" in wired:
            self.velocity_kernel(wanted, self.max_speed, self.velocity)
        if "desired_heading" in wired or "desired_altitude" in wired or "desired_speed" in wired:
            kernels.desired(
                wanted,
                pos[2],
                self.max_speed,
                self.desired_heading,
                self.desired_speed,
                self.desired_altitude,
            )
