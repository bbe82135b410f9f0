"""An autonomy that keeps a place behind a leader."""

from __future__ import annotations

import math

import numpy as np

from tussle.api import Autonomy, EntityRef, GroupView, Input, Output, Param
from tussle.numeric import atan2, cos, sin

AWAY = 1e-9  # [m/s], below which a leader has no course


class HoldFormation(Autonomy):
    """Follows the nearest entity of `leader_team` in a formation behind it; when that entity is removed, follows another.

    The followers of a leader take the places of the formation in the order of their ids, and move up when one of them is removed. The
    desired velocity is that of the leader plus `gain` times the offset to the place, which turns with the leader's course
    (leader-referenced formations of Balch and Arkin 1998, "Behavior-based formation control for multirobot teams", IEEE Transactions on
    Robotics and Automation 14(6)). Without a leader it keeps its course at `min_speed`. With a channel `altitude_above_terrain` it stays at
    least `clearance` above the surface.
    """

    grade = "portable"
    named_teams = ("leader_team",)

    leader_team = Param(2, doc="Team of the leaders.")
    shape = Param("vee", choices=("vee", "line", "column"), doc="Shape of the formation.")
    spacing = Param(40.0, unit="m", gt=0.0, doc="Distance of the places, along the course and across.")
    gain = Param(0.1, unit="1/s", gt=0.0, doc="Speed per distance from the place.")
    min_speed = Param(0.0, unit="m/s", ge=0.0, doc="Least desired speed.")
    max_speed = Param(30.0, unit="m/s", gt=0.0, doc="Largest desired speed.")
    clearance = Param(0.0, unit="m", ge=0.0, doc="Least height above the terrain.")
    leader = EntityRef(doc="Entity that is followed.")
    height = Input(
        "altitude_above_terrain", unit="m", optional=True, default=math.inf, doc="Height above the surface."
    )
    desired_heading = Output(unit="rad")
    desired_altitude = Output(unit="m")
    desired_speed = Output(unit="m/s")
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def check_values(self) -> None:
        """Check that no lower limit is above its upper one."""
        self.check_order("min_speed", "max_speed")

    def step(self, g: GroupView) -> None:
        bodies, row = g.bodies, g.rows_of(self.leader)
        if (row < 0).any():
            nearest = g.nearest(teams=self.leader_team).other[0]
            self.leader[:] = np.where(row < 0, np.where(nearest >= 0, bodies.id[nearest], 0), self.leader)
            row = np.where(row < 0, nearest, row)
        follows = row >= 0
        vel = np.where(follows, bodies.vel[:, row], 0.0)
        course = np.where(np.abs(vel[0]) + np.abs(vel[1]) > AWAY, atan2(vel[1], vel[0]), 0.0)
        along, across = self._place(g)
        c, s = cos(course), sin(course)
        place = bodies.pos[:, row] + self.spacing * np.stack(
            [c * along - s * across, s * along + c * across, 0.0 * c]
        )
        wanted = np.where(follows, vel + self.gain * (place - g.pos), self.min_speed * g.forward)
        speed = np.sqrt(wanted[0] * wanted[0] + wanted[1] * wanted[1] + wanted[2] * wanted[2])
        limited = np.minimum(np.maximum(speed, self.min_speed), self.max_speed)
        altitude = np.where(follows, place[2], g.pos[2])
        self.velocity[:] = wanted * (limited / np.maximum(speed, AWAY))
        self.desired_heading[:] = atan2(wanted[1], wanted[0])
        self.desired_speed[:] = limited
        self.desired_altitude[:] = np.maximum(altitude, g.pos[2] - self.height + self.clearance)

    def _place(self, g: GroupView) -> tuple[np.ndarray, np.ndarray]:
        """Places along and across the leader's course, in spacings, (n,) each; those across alternate left and right."""
        order = np.lexsort((g.id, self.leader, g.world))
        begins = np.flatnonzero(np.diff(self.leader[order], prepend=-1) | np.diff(g.world[order], prepend=-1))
        rank = np.empty(g.n, np.int64)
        rank[order] = np.arange(g.n) - np.repeat(begins, np.diff(begins, append=g.n))
        row = 0.5 * rank - 0.5 * (rank % 2) + 1.0
        side = np.where(rank % 2 == 0, row, -row)
        along = {"vee": -row, "line": 0.0 * row, "column": -1.0 - rank}[self.shape]
        return along, np.where(self.shape == "column", 0.0, side)
