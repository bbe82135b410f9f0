"""Flocking."""

from __future__ import annotations

import math

import numpy as np

from tussle.api import Autonomy, GroupView, Output, Param, State
from tussle.stock.autonomy.boids import kernels

AHEAD = 1e6  # [m]


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
    limits_view = Param(False, structural=True, doc="Heed fov_az and fov_el.")
    target = State("x y z", unit="m", doc="The goal in force.")
    speed = Output(unit="m/s")
    turn_rate = Output(unit="rad/s")
    pitch_rate = Output(unit="rad/s")
    desired_heading = Output(unit="rad")
    desired_speed = Output(unit="m/s")
    desired_altitude = Output(unit="m")
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def spawn(self, g: GroupView, rows: np.ndarray) -> None:
        ahead = g.pos + self.goal_distance * g.forward
        self.target[:, rows] = np.where(self.use_initial_heading, ahead, self.goal)[:, rows]

    def step(self, g: GroupView) -> None:
        wanted = np.empty((3, g.n))
        x, y, z = g.pos
        sums = self._sums(g)
        if self.means == "historic":
            kernels.historic_means(x, y, z, sums)
        kernels.law(
            x, y, z, self.target, sums, self.max_speed, self.goal_weight, self.avoid_team_weight, self.avoid_nonteam_weight,
            self.centroid_weight, self.align_weight, wanted,
        )  # fmt: skip
        wired = self.wired
        if "turn_rate" in wired or "pitch_rate" in wired or "speed" in wired:
            kernels.rates(wanted, g.yaw, g.climb, self.max_speed, self.speed, self.turn_rate, self.pitch_rate)
        if "velocity" in wired:
            kernels.velocity(wanted, self.max_speed, self.velocity)
        if "desired_heading" in wired or "desired_altitude" in wired or "desired_speed" in wired:
            kernels.desired(
                wanted, z, self.max_speed, self.desired_heading, self.desired_speed, self.desired_altitude
            )

    def _sums(self, g: GroupView) -> np.ndarray:
        index = g.index(self.comms_range)
        blocks = index.blocks(g.first, g.last)
        if self.means == "historic":
            heading_x = heading_y = g.by_place(index, "yaw")[0]
        else:
            heading_x, heading_y = g.by_place(index, "level_forward")
        sums = np.empty((kernels.N_SUMS, g.n))
        places = (
            blocks.queries, blocks.block_first, blocks.span_first, blocks.span_start, blocks.span_end, index.order,
            blocks.x, blocks.y, blocks.z, index.sx, index.sy, index.sz, heading_x, heading_y, g.by_place(index, "team")[0],
            g.team, self.comms_range, self.sphere_of_influence, self.minimum_team_range, self.minimum_nonteam_range,
        )  # fmt: skip
        if self.limits_view:
            quat = np.ascontiguousarray(g.quat)
            run = lambda a, b: kernels.neighbor_sums_in_view(  # noqa: E731
                *places, quat, self.fov_az, self.fov_el, sums, g.first, a, b, blocks.most
            )
        else:
            if g.context.threads == 1:
                kernels.neighbor_sums(*places, sums, g.first, 0, blocks.n_blocks, blocks.most)
                return sums
            run = lambda a, b: kernels.neighbor_sums(*places, sums, g.first, a, b, blocks.most)  # noqa: E731
        g.context.split(blocks.n_blocks, run)
        return sums
