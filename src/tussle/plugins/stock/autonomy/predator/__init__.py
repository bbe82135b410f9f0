"""Pursuit and capture of prey."""

from __future__ import annotations

import numpy as np

from tussle.api import Autonomy, EntityRef, GroupView, Output, Param, Publish
from tussle.declare.messages import CaptureEntity
from tussle.plugins.stock.autonomy.predator import kernels


class Predator(Autonomy):
    """Pursues the nearest prey (pure pursuit) and claims every entity of another team within `capture_range`.

    It also claims those that come within that range during the step if both move straight on. Without `allow_prey_switching` a target is
    kept until it is removed. Claims include rival predators, as in the paper's code. When no prey is left, the last commands stay. With
    `pursue="false"` it only claims, and another autonomy of the entity must steer.
    """

    grade = "portable"
    named_teams = ("prey_team_id",)
    only_calls_kernels = True

    max_speed = Param(30.0, unit="m/s", ge=0.0, doc="Desired speed.")
    capture_range = Param(
        5.0, unit="m", ge=0.0, doc="Distance below which entities of other teams are claimed."
    )
    between_steps = Param(True, doc="Claim those, too, who come within range during the step.")
    allow_prey_switching = Param(True, doc="Choose the nearest prey in every step.")
    prey_team_id = Param(1, doc="Team that is hunted.")
    pursue = Param(True, structural=True, doc="Write commands; otherwise only claim.")
    target = EntityRef(doc="Prey being hunted.")
    speed = Output(unit="m/s")
    turn_rate = Output(unit="rad/s")
    pitch_rate = Output(unit="rad/s")
    desired_heading = Output(unit="rad")
    desired_speed = Output(unit="m/s")
    capture = Publish(CaptureEntity)

    def offered_outputs(self) -> list[str]:
        """Return the commands, if it pursues."""
        return list(self.outputs()) if self.pursue else []

    def step(self, g: GroupView) -> None:
        index = g.any_index()
        bodies = g.bodies
        pos = x, y, z = g.components("pos")
        rows = bodies.id, index.row_world, index.place, index.order
        table = (*index.table, g.by_place(index, "team")[0])
        target_row = g.rows_of(self.target)
        room, fits = 16 * g.n + 64, False
        while not fits:  # repeat with more room if the claims did not fit; the targets do not change
            claims, n_claims = (np.empty(room, np.int64), np.empty(room, np.int64)), np.empty(1, np.int64)
            fits = kernels.hunt(
                (x, y, z, self.capture_range), (g.team, self.prey_team_id, self.allow_prey_switching, self.between_steps),
                (bodies.vel, g.dt), (self.target, target_row, *claims, n_claims), rows, g.first, table,
            )  # fmt: skip
            room = int(n_claims[0])
        wired = self.wired
        if "speed" in wired or "turn_rate" in wired or "pitch_rate" in wired:
            commands = self.speed, self.turn_rate, self.pitch_rate
            kernels.pursue(pos, g.components("quat"), self.max_speed, target_row, bodies.pos, commands)
        if "desired_heading" in wired or "desired_speed" in wired:
            kernels.point(
                x, y, self.max_speed, target_row, bodies.pos, self.desired_heading, self.desired_speed
            )
        g.finish(lambda: self._claim(bodies.id, *claims, int(n_claims[0])))

    def _claim(self, ids: np.ndarray, claim_row: np.ndarray, claimed: np.ndarray, n: int) -> None:
        if n:
            self.capture.publish(claim_row[:n].copy(), target=ids[claimed[:n]])
