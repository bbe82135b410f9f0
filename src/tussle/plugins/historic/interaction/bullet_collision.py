"""BulletCollision as in SCRIMMAGE."""

from __future__ import annotations

import numpy as np

from tussle.api import Param, WorldView, neighbors
from tussle.declare.messages import EntityCollided, EntityHitGround
from tussle.plugins.stock.interaction import bullet_collision
from tussle.world.contacts import found

ALONG_X = np.array([[1.0], [0.0], [0.0]])
"""Normal between spheres with one centre."""


class BulletCollision(bullet_collision.BulletCollision):
    """BulletCollision in which a contact sets the external force to 1 N along its normal, from the second step on.

    All bodies are spheres. If a body has several contacts, the last one sets its force. Contacts are published only with
    `remove_on_collision`; `enable_team_collisions` and `enable_non_team_collisions` select the pairs that are removed. In tussle
    bodies bounce and slide.
    """

    enable_team_collisions = Param(False, doc="Remove team mates that touch, with remove_on_collision.")
    enable_non_team_collisions = Param(
        False, doc="Remove entities of different teams that touch, with remove_on_collision."
    )
    enable_terrain = Param(
        False, structural=True, doc="Ground, terrain and meshes are solid; walls always are."
    )

    @neighbors("reach", pair="each")
    @staticmethod
    def pairs(id: int, other_id: int) -> int | None:  # noqa: A002 - a column
        if id > other_id:
            return None
        return other_id

    def step(self, w: WorldView) -> None:
        if not self.enable_collision_detection or not w.n:
            return
        spheres = np.repeat([[-1.0, 0.0, 0.0, 0.0]], len(w.context.block_names), axis=0)
        shapes = found.place(w.pos, w.quat, w.radius, w.block, spheres)
        contacts = found.find(
            shapes, self._near(w, shapes[1][0]), (w.vel, 0.0, w.world), self._scene(w), w.n_worlds
        )
        has_bodies = w.step_count[w.world[contacts.row]] > 0
        here = np.flatnonzero((contacts.numbers[:, 9] <= 0.0) & has_bodies)
        row, other, normal = contacts.row[here], contacts.other[here], contacts.numbers[here, :3].T
        is_body = other >= 0
        way = w.pos[:, row] - w.pos[:, other]
        normal = np.where(is_body & (way == 0.0).all(axis=0), ALONG_X, normal)
        w.bodies.force[:, np.stack([row, np.where(is_body, other, row)]).T.ravel()] = np.stack(
            [normal, np.where(is_body, -normal, normal)], axis=2
        ).reshape(3, -1)
        self._remove(w, row, other)

    def _remove(self, w: WorldView, row: np.ndarray, other: np.ndarray) -> None:
        removes = self.remove_on_collision[w.world[row]]
        is_body = other >= 0
        is_own, world = w.team[row] == w.team[other], w.world[row]
        is_enabled = np.where(
            is_own, self.enable_team_collisions[world], self.enable_non_team_collisions[world]
        )
        removed = np.flatnonzero(removes & is_body & is_enabled)
        pair = np.unique(np.stack([row[removed], other[removed]]), axis=1)
        first, second = pair
        w.publish(
            EntityCollided, w.world[first], first=w.id[first], second=w.id[second],
            first_team=w.team[first], second_team=w.team[second],
        )  # fmt: skip
        w.kill(np.unique(pair), "collision")
        down = np.unique(row[removes & ~is_body])
        w.publish(EntityHitGround, w.world[down], entity=w.id[down], team=w.team[down])
        w.kill(down, "ground")
