"""Flocking."""

from __future__ import annotations

import math

import numpy as np

from tussle.api import Autonomy, GroupView, Output, Param, State, neighbors, together
from tussle.numeric import cos
from tussle.stock.autonomy.boids import kernels
from tussle.stock.autonomy.boids.kernels import push

AHEAD = 1e6  # [m]
Contributed = tuple[float, ...]


class Boids(Autonomy):
    """Goal, repulsion, cohesion and alignment (Reynolds 1987), weighed as in equations (2) to (8) of the 2018 paper.

    Each step sums over everyone nearer than `comms_range`, then `law`: the weighted sum of the five directions over the sum of their
    lengths, times `max_speed`. Mean heading and centroid are those of the team mates. With `means="historic"` they are what the code
    behind the paper computes: yaw averaged as a plain number (wrong across West) and both sums divided by the number of all
    neighbours, other teams included, which draws the centroid to the world's origin and the heading to East.

    Outputs suit a unicycle (speed, turn_rate, pitch_rate), an integrator (velocity) and heading controllers (desired_...); only what
    somebody reads is computed. The historic desired altitude was the climb speed; here it is the altitude one second ahead.
    """

    grade = "portable"

    max_speed = Param(30.0, unit="m/s", ge=0.0, doc="Wanted speed.")
    comms_range = Param(200.0, unit="m", ge=0.0, doc="Distance up to which others count.")
    fov_el = Param(
        2.0 * math.pi,
        unit="rad",
        text_unit="deg",
        ge=0.0,
        doc="Field of view in elevation; a full circle has no edge.",
    )
    fov_az = Param(2.0 * math.pi, unit="rad", text_unit="deg", ge=0.0, doc="Field of view in azimuth.")
    goal_weight = Param(0.1, ge=0.0, doc="Weight of the direction to the goal.")
    avoid_team_weight = Param(1.0, ge=0.0, doc="Weight of the repulsion from team mates.")
    avoid_nonteam_weight = Param(10.0, ge=0.0, doc="Weight of the repulsion from others.")
    centroid_weight = Param(1.0, ge=0.0, doc="Weight of the direction to the team mates' centroid.")
    align_weight = Param(0.5, ge=0.0, doc="Weight of the team mates' mean heading.")
    sphere_of_influence = Param(100.0, unit="m", ge=0.0, doc="Distance from which others repel.")
    minimum_team_range = Param(
        2.0, unit="m", ge=0.0, doc="Distance to team mates below which nothing else counts."
    )
    minimum_nonteam_range = Param(
        20.0, unit="m", ge=0.0, doc="Distance to others below which nothing else counts."
    )
    use_initial_heading = Param(True, doc="The goal lies `goal_distance` ahead of where the entity begins.")
    goal_distance = Param(AHEAD, unit="m", ge=0.0, doc="How far.")
    goal = Param((1e6, 1e6, 1e3), fields="x y z", unit="m", doc="The goal otherwise.")
    means = Param("team", choices=("team", "historic"), doc="How heading and centroid are averaged.")
    target = State("x y z", unit="m", doc="The goal in force.")
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
        """Whether azimuth and elevation of an offset [m] in body axes are inside the fields of view [rad].

        |angle| < half is cos(angle) > cos(half) up to pi, and a full circle has no edge: someone exactly astern is seen.
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

    def spawn(self, g: GroupView, rows: np.ndarray) -> None:
        ahead = g.pos[:, rows] + self.goal_distance[rows] * g.forward[:, rows]
        self.target[:, rows] = np.where(self.use_initial_heading[rows], ahead, self.goal[:, rows])

    def step(self, g: GroupView) -> None:
        wanted = np.empty((3, g.n))
        pos = g.components("pos")
        sees_all = kernels.sees_all(self.fov_az, self.fov_el)
        if self.means == "historic":
            seen = (self.historic if sees_all else self.historic_in_view)(g).values
            kernels.historic_means(pos, seen)
        else:
            seen = (self.seen if sees_all else self.seen_in_view)(g).values
        weights = (
            self.max_speed, self.goal_weight, self.avoid_team_weight, self.avoid_nonteam_weight, self.centroid_weight,
            self.align_weight,
        )  # fmt: skip
        g.split(lambda *part: kernels.law(pos, self.target, seen, weights, wanted, part))
        wired = self.wired
        if "turn_rate" in wired or "pitch_rate" in wired or "speed" in wired:
            facing = g.yaw, g.climb
            commands = self.speed, self.turn_rate, self.pitch_rate
            g.split(lambda *part: kernels.rates(wanted, *facing, self.max_speed, *commands, part))
        if "velocity" in wired:
            kernels.velocity(wanted, self.max_speed, self.velocity)
        if "desired_heading" in wired or "desired_altitude" in wired or "desired_speed" in wired:
            kernels.desired(
                wanted,
                pos[2],
                self.max_speed,
                self.desired_heading,
                self.desired_speed,
                self.desired_altitude,
            )
