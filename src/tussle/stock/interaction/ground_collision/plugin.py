"""Collisions of entities with the ground."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from tussle import units
from tussle.api import Interaction, Param, State, WorldView
from tussle.errors import ParameterError
from tussle.messages import EntityHitGround


class GroundCollision(Interaction):
    """Removes entities that reach the ground level, or supports them by an upward force equal to their weight.

    The weight is that of the motion model: its own mass times its own gravity, less its buoyancy. It is no contact force: what
    comes down with a speed keeps it, and what has some thrust of its own rises from the ground and comes down again.

    Publishes `EntityHitGround` when an entity touches the ground; SCRIMMAGE published it in every step on the ground. It
    also rejects initial positions at or below the ground.
    """

    grade = "portable"
    rest_height: ClassVar[float] = 1e-6
    """Height above the ground up to which it bears what stands on it [m], else rounding of weight over mass could drop it."""

    ground_collision_z = Param(0.0, unit="m", doc="Ground level above the origin's tangent plane.")
    ground_collision_altitude = Param(
        "",
        doc="Ground level as an altitude above the ellipsoid, such as '300 m'; if given, it replaces ground_collision_z.",
    )
    enable_startup_collisions = Param(True, doc="Reject initial positions at or below the ground.")
    remove_on_collision = Param(True, doc="Remove entities on the ground; else support their weight.")
    team = Param("all", doc="Number of the team that collides with the ground, or 'all'.")
    is_down = State(
        dtype=bool, per="entity", doc="Whether an entity was at or below the ground level in the last step."
    )

    def start(self, w: WorldView) -> None:
        self.step(w)

    def step(self, w: WorldView) -> None:
        height = w.pos[2] - self._level(w)[w.world]
        if self.team != "all":
            height[w.team != self._team()] = np.inf
        is_down = height <= 0.0
        rows = np.flatnonzero(is_down & ~self.is_down)
        if len(rows):
            w.publish(EntityHitGround, w.world[rows], entity=w.id[rows], team=w.team[rows])
        self.is_down[:] = is_down
        removes = self.remove_on_collision[w.world]
        w.kill(np.flatnonzero(is_down & removes), "ground")
        self._carry(w, np.flatnonzero((height <= self.rest_height) & ~removes))

    def _carry(self, w: WorldView, rows: np.ndarray) -> None:
        """Bear the weight of some entities."""
        if len(rows):
            # Not less than 0: the ground does not hold down what rises.
            w.bodies.force[2, rows] += np.maximum(w.mass_properties().weight[rows], 0.0)

    def _level(self, w: WorldView) -> np.ndarray:
        """Return the ground level [m], (n_worlds,)."""
        if not self.ground_collision_altitude:
            return np.asarray(self.ground_collision_z)
        altitude = units.parse(self.ground_collision_altitude, "m")
        return np.full(w.n_worlds, altitude - w.scene.origin.altitude)

    def _team(self) -> int:
        try:
            return int(self.team)
        except ValueError:
            raise ParameterError(
                f"GroundCollision.team = {self.team!r} is not allowed; it takes the number of a team or 'all'"
            ) from None

    def rejects(self, w: WorldView, world: int, pos: np.ndarray, taken: np.ndarray) -> bool:
        return bool(self.enable_startup_collisions[world] and pos[2] <= self._level(w)[world])
