"""Collisions of entities with the ground."""

from __future__ import annotations

import numpy as np

from tussle.api import Interaction, Param, State, WorldView
from tussle.declare import units
from tussle.declare.messages import EntityHitGround
from tussle.errors import ParameterError
from tussle.numeric import clip
from tussle.numeric.quaternion import quat_conjugate, quat_rotate

LEVELLING = 4.0
"""Rate at which a body that stands aslant turns level [1/s]."""


class Ground(Interaction):
    """The ground level, and who is on it; abstract: `_carry` is the law of what it does not remove."""

    grade = "portable"
    named_teams = ("team",)

    ground_collision_z = Param(0.0, unit="m", doc="Ground level above the origin's tangent plane.")
    ground_collision_altitude = Param(
        "",
        doc="Ground level as an altitude above the ellipsoid, such as '300 m'; if given, it replaces ground_collision_z.",
    )
    enable_startup_collisions = Param(True, doc="Reject initial positions at or below the ground.")
    remove_on_collision = Param(True, doc="Remove entities on the ground; else they land and stand on it.")
    friction = Param(
        0.5, ge=0.0, doc="Largest friction force of an entity on the ground, over the normal force."
    )
    team = Param("all", doc="Number of the team that collides with the ground, or 'all'.")
    is_down = State(
        dtype=bool, per="entity", doc="Whether an entity was at or below the ground level in the last step."
    )

    def check_values(self) -> None:
        """Check the team."""
        if self.team != "all":
            self._team()

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
        self._carry(w, np.where(removes, np.inf, height))

    def _carry(self, w: WorldView, height: np.ndarray) -> None:
        """Push the entities on the ground, and those that would pass it. By default it does nothing.

        Args:
            w: The view.
            height: Height of each entity above the ground [m], (n,); inf for those that it does not push.
        """

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


class GroundCollision(Ground):
    """Removes entities that reach the ground level, or lets them land and stand on it.

    Without `remove_on_collision` the ground is a contact for motion models that forces act on. Its force is chosen once in a step so that
    the entity's position arrives at the ground without passing it, and rests there. The force stops the fall in the last step and a half
    before the ground, then supports the part of the weight that the entity's own thrust and lift did not support in the last step, and
    never pulls. Friction stops what slides, with at most `friction` times the normal force. Bodies that turn stand on feet that are their
    radius apart: the contact stops their rotation and levels them, with at most the moment of the normal force about a foot. Weight, mass
    and inertia are those of the motion model.

    Publishes `EntityHitGround` when an entity touches the ground; SCRIMMAGE published it in every step on the ground. It
    also rejects initial positions at or below the ground.

    In SCRIMMAGE the ground is no contact: it pushes what is at or below it up with mass times gravity, so that what comes down with a
    speed keeps it.
    """

    stands = State(dtype=bool, per="entity", doc="Whether the ground pushed an entity in the last step.")
    known = State(dtype=bool, per="entity", doc="Whether an entity was there in the last step.")
    before = State(
        "vx vy vz fx fy fz", unit="m/s m/s m/s N N N", per="entity",
        doc="Velocity of an entity in the last step, and the force of the ground.",
    )  # fmt: skip

    def _carry(self, w: WorldView, height: np.ndarray) -> None:
        mass, inertia, weight = w.mass_properties()
        # Those that may pass the ground within two steps.
        gravity = np.maximum(weight, 0.0) / np.where(mass > 0.0, mass, 1.0)
        near = np.flatnonzero((height <= 2.0 * w.dt * (gravity * w.dt - w.vel[2])) & (mass > 0.0))
        push = np.zeros((3, len(near)))
        if len(near):
            push[:] = self._push(w, near, height[near], mass[near], np.maximum(weight[near], 0.0))
            w.bodies.force[:, near] += push
            turns = inertia[0, near] > 0.0
            if turns.any():
                rows = near[turns]
                w.bodies.torque[:, rows] += self._moment(w, rows, push[2, turns], inertia[:, rows])
        self.known[:], self.stands[:] = True, False
        self.stands[near] = push[2] > 0.0
        self.before[:3], self.before[3:] = w.vel, 0.0
        self.before[3:, near] = push

    def _push(
        self, w: WorldView, rows: np.ndarray, height: np.ndarray, mass: np.ndarray, weight: np.ndarray
    ) -> np.ndarray:
        """Force of the ground on some rows [N], (3, m)."""
        vel, dt = w.vel[:, rows], w.dt
        # What else accelerates a body is what did so in the last step, unless that is out of all proportion: it has been moved.
        gravity = weight / mass
        else_ = (vel - self.before[:3, rows]) / dt - self.before[3:, rows] / mass
        else_[2] += gravity
        else_ = np.where(self.known[rows], clip(else_, -2.0 * gravity, 2.0 * gravity), 0.0)
        # With this speed at the end of the step, the next one ends on the ground with speed 0. What is below rises slowly.
        wanted = np.where(height >= 0.0, np.minimum(0.0, -height / dt - 0.5 * vel[2]), -0.2 * height / dt)
        normal = np.maximum(0.0, mass * ((wanted - vel[2]) / dt - else_[2]) + weight)
        slide = -mass * (vel[:2] / dt + else_[:2])
        length = np.sqrt(slide[0] * slide[0] + slide[1] * slide[1])
        share = np.minimum(1.0, self.friction[w.world[rows]] * normal / np.where(length > 0.0, length, 1.0))
        return np.concatenate([share * slide, normal[None]])

    @staticmethod
    def _moment(w: WorldView, rows: np.ndarray, normal: np.ndarray, inertia: np.ndarray) -> np.ndarray:
        """Moment of the ground on some rows, world frame [N m], (3, m)."""
        quat, omega = w.quat[:, rows], w.omega[:, rows]
        up = quat_rotate(quat, np.repeat([[0.0], [0.0], [1.0]], len(rows), axis=1))
        rate = LEVELLING * np.stack([up[1], -up[0], np.zeros(len(rows))]) - omega
        x, y, z = quat_rotate(quat_conjugate(quat), rate)
        i = inertia
        change = np.stack([i[3 * k] * x + i[3 * k + 1] * y + i[3 * k + 2] * z for k in range(3)])
        moment = quat_rotate(quat, change / w.dt)
        length = np.sqrt(moment[0] * moment[0] + moment[1] * moment[1] + moment[2] * moment[2])
        share = np.minimum(1.0, normal * w.bodies.radius[rows] / np.where(length > 0.0, length, 1.0))
        return np.asarray(share * moment)
