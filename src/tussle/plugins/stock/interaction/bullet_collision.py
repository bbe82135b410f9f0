"""Contacts of bodies with each other and with the scene."""

from __future__ import annotations

import numpy as np

from tussle.api import HistoricAttributes, Interaction, Param, State, WorldView, neighbors
from tussle.declare.messages import EntityCollided, EntityHitGround
from tussle.errors import ParameterError
from tussle.numeric.quaternion import quat_multiply, quat_normalize
from tussle.world.contacts import found, held
from tussle.world.contacts.solids import StaticSolids

MAX_FOLLOWED = 2.0
"""Largest relative motion per step for which pairs are followed, in sizes of the largest body. Beyond it all pairs would be candidates."""
FAR = 1e9
"""Coordinate beyond which ways are not followed [m]."""
FAST = 1e150
"""Speed beyond which a body is not followed [m/s]: the square of a velocity would overflow."""


class BulletCollision(Interaction):
    """Prevents overlaps of bodies with each other, and with walls, meshes, terrain and ground: bodies bounce, slide and rest.

    A body is a sphere of its block's radius, a box where the block has one, or a capsule inside that box for the blocks in `capsules`. The
    velocities are changed by impulses at the contacts, found by iteration (sequential impulses, Catto 2005), with Coulomb friction and
    Newton's law of restitution. Bodies with an inertia tensor turn (motion models such as FreeBody and Multirotor); all others move without
    turning. A motion model that sets its velocity from commands in each step, such as SingleIntegrator, drives into what is in its way: it
    is held there and slides along.

    Collision detection is continuous: each fast body is followed along a straight line during the step, so that it does not pass through
    other bodies or the scene, however thin. A box is followed as the sphere, or the capsule along its x axis, that fits inside.
    `EntityCollided` and `EntityHitGround` are published when a contact begins.

    In SCRIMMAGE all bodies are spheres; a contact sets the external force to 1 N along the normal, so that a SimpleCar stops.
    """

    grade = "portable"
    reads_start_positions = True
    historic_attributes = HistoricAttributes(
        unread=(
            "show_rays", "enable_ray_tracing", "publish_on_local_networks", "pcl_network_name", "pcl_topic_name",
            "prepend_pcl_topic_with_id",
        )
    )  # fmt: skip

    enable_collision_detection = Param(True, structural=True, doc="Whether the plugin does anything.")
    restitution = Param(
        0.0, ge=0.0, le=1.0, doc="Normal speed after a bounce over the speed before; 1 keeps the energy."
    )
    friction = Param(
        0.5, ge=0.0, doc="Largest tangential force over the normal force, at rest and in motion."
    )
    bounce_speed = Param(
        0.2, unit="m/s", ge=0.0, doc="Bodies that approach more slowly do not bounce, so that piles rest."
    )
    iterations = Param(
        10, ge=1, le=1000, structural=True, doc="Passes over all contacts; tall piles need more."
    )
    capsules = Param(
        "", doc="Names of the blocks whose entities are capsules along the body x axis, by commas."
    )
    fixed = Param("", doc="Names of the blocks whose entities push others and are not pushed, by commas.")
    enable_team_collisions = Param(True, doc="Team mates collide.")
    enable_non_team_collisions = Param(True, doc="Entities of different teams collide.")
    remove_on_collision = Param(False, doc="Remove entities that touch something, instead of pushing them.")
    enable_terrain = Param(
        True, structural=True, doc="Ground, terrain and meshes of the mission are solid; walls always are."
    )
    enable_ground_plane = Param(False, structural=True, doc="A further ground plane is solid.")
    ground_plane_height = Param(0.0, unit="m", structural=True, doc="Its height.")
    show_collision_shapes = Param(False, structural=True, doc="Draw points of contact and their normals.")
    reach = State(per="world", unit="m", doc="Distance of centres below which pairs are examined.")
    on_ground = State(dtype=bool, per="entity", doc="Whether the entity touched the scene in the last step.")
    memory = State(
        " ".join(f"{name}_{k}" for name in ("key", "x", "y", "z") for k in range(found.SLOTS)),
        per="entity",
        doc="Contacts of the last step and their impulses [N s]: the first guess for the next step.",
    )

    @neighbors("reach", pair="each")
    @staticmethod
    def pairs(
        id: int, other_id: int, team: int, other_team: int,  # noqa: A002 - a column
        enable_team_collisions: bool, enable_non_team_collisions: bool,
    ) -> int | None:  # fmt: skip
        if id > other_id or not (
            enable_team_collisions if team == other_team else enable_non_team_collisions
        ):
            return None
        return other_id

    def named_blocks(self) -> tuple[str, ...]:
        """Return the blocks of `capsules` and `fixed`."""
        return tuple(name for param in ("capsules", "fixed") for name in _names(self.values[param]))

    def start(self, w: WorldView) -> None:
        self._shapes(w)  # reports blocks without a box before the first step

    def step(self, w: WorldView) -> None:
        if not self.enable_collision_detection or not w.n:
            return
        self._hold(w)
        items, sizes = found.place(w.pos, w.quat, w.radius, w.block, self._shapes(w))
        contacts = found.find(
            (items, sizes), self._near(w, sizes[0]), (w.vel, w.dt, w.world), self._scene(w), w.n_worlds
        )
        impulses, is_new = found.recalled(contacts, w.id, sizes, self.memory)
        if len(contacts):
            self._respond(w, contacts, sizes, (impulses, is_new))
        touches = found.remembered(contacts, w.id, sizes, impulses, self.memory)
        self._report(w, contacts, touches, is_new)

    def _hold(self, w: WorldView) -> None:
        """Move bodies back that have moved into or through something in this step."""
        with np.errstate(over="ignore", invalid="ignore"):  # the engine reports states that are not finite
            x, y, z = ways = w.pos - w.start_pos
            far = np.sqrt(x * x + y * y + z * z)
        items, sizes = found.place(w.start_pos, w.quat, w.radius, w.block, self._shapes(w))
        is_fast = (far > held.FAST * sizes[1]) & (np.maximum(np.abs(w.pos), np.abs(w.start_pos)) < FAR).all(
            axis=0
        )
        if not is_fast.any():
            return
        share = np.where(is_fast & ~np.isin(w.block, self._blocks(w, "fixed")), 1.0, 0.0)
        row, other = self._on_the_way(w, np.where(is_fast, far, 0.0), sizes[0])
        rows = np.unique(np.concatenate([np.flatnonzero(is_fast), row, other]))
        pairs = np.searchsorted(rows, row), np.searchsorted(rows, other)
        shapes = np.ascontiguousarray(items[rows]), np.ascontiguousarray(sizes[:, rows])
        made = held.held_ways(shapes, pairs, ways[:, rows], share[rows], w.world[rows], self._scene(w))
        is_held = (made != ways[:, rows]).any(axis=0)
        rows = rows[is_held]
        w.move(rows, pos=w.start_pos[:, rows] + made[:, is_held])

    def _on_the_way(self, w: WorldView, far: np.ndarray, size: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rows of the pairs that may meet on ways of lengths `far` [m], (n,), one of them fast, ordered by ids, (m,) each."""
        largest = np.zeros(w.n_worlds)
        np.maximum.at(largest, w.world, size)
        near = w.near(np.where(far > 0.0, 1.01 * (size + largest[w.world]) + 2.1 * far, 0.0))
        row, other = near.row, near.other
        is_team, world = w.team[row] == w.team[other], w.world[row]
        counts = np.where(is_team, self.enable_team_collisions[world], self.enable_non_team_collisions[world])
        is_first = (far[row] > far[other]) | ((far[row] == far[other]) & (w.id[row] < w.id[other]))
        kept = np.flatnonzero(counts & is_first)
        row, other = row[kept], other[kept]
        order = np.lexsort((w.id[other], w.id[row], w.world[row]))
        return row[order], other[order]

    def _near(self, w: WorldView, far: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rows of the pairs that may touch, ordered by ids, (m,) each."""
        is_sane = (np.abs(w.vel) < FAST).all(axis=0)
        size, low, high = (np.full((k, w.n_worlds), v) for k, v in ((1, 0.0), (3, np.inf), (3, -np.inf)))
        vel = np.where(is_sane, w.vel, 0.0)
        np.maximum.at(size[0], w.world, far)
        for i in range(3):
            np.minimum.at(low[i], w.world, vel[i])
            np.maximum.at(high[i], w.world, vel[i])
        x, y, z = np.where(high > low, high - low, 0.0)
        motion = np.minimum(w.dt * np.sqrt(x * x + y * y + z * z), MAX_FOLLOWED * size[0])
        reach = np.maximum(2.02 * size[0] + motion, 1e-6)
        self.reach[w.world] = reach[w.world]  # unchanged in worlds without bodies
        listed_pairs = self.pairs(w)
        row, other = listed_pairs.row, listed_pairs.other
        order = np.argsort((w.id[row] << 32) + w.id[other], kind="stable")
        return row[order], other[order]

    def _shapes(self, w: WorldView) -> np.ndarray:
        """Return radius (negative to use the body's) and half lengths of the shape of each block [m], (n_blocks, 4)."""
        half = 0.5 * w.context.boxes
        is_box = half[:, 0] > 0.0
        shapes = np.concatenate([np.where(is_box, 0.0, -1.0)[:, None], half], axis=1)
        for block in self._blocks(w, "capsules"):
            if not is_box[block]:
                raise ParameterError(
                    f"BulletCollision.capsules: block {w.context.block_names[block]!r} has no box; a capsule takes its length and width "
                    "from box_x, box_y and box_z"
                )
            radius = max(half[block, 1], half[block, 2])
            shapes[block] = radius, max(half[block, 0] - radius, 0.0), 0.0, 0.0
        return shapes

    def _blocks(self, w: WorldView, param: str) -> list[int]:
        """Numbers of the blocks that a parameter names."""
        return [w.context.block_names.index(name) for name in _names(getattr(self, param))]

    def _scene(self, w: WorldView) -> StaticSolids:
        solids = w.scene.static_solids if self.enable_terrain else w.scene.static_walls
        if self.enable_ground_plane:
            return solids.with_plane((0.0, 0.0, 1.0, self.ground_plane_height))
        return solids

    def _respond(
        self,
        w: WorldView,
        contacts: found.ContactList,
        sizes: np.ndarray,
        guess: tuple[np.ndarray, np.ndarray],
    ) -> None:
        """Change velocities and positions of the bodies in contact."""
        mass, inertia, _ = w.mass_properties()
        moves = ~self.remove_on_collision[w.world] & ~np.isin(w.block, self._blocks(w, "fixed"))
        state = found.entered(mass, inertia, w.quat, (w.vel, w.omega), moves)
        materials = self.restitution, self.friction, self.bounce_speed
        shifts = found.solve(
            contacts,
            (state, sizes),
            materials,
            (w.dt, self.iterations),
            guess,
            lambda n, run: w.context.split(n, run, 1),
        )
        vel, omega, turns = state[:, :3].T, state[:, 3:6].T, state[:, 7] > 0.0
        is_moved = (vel != w.vel).any(axis=0) | (omega != w.omega).any(axis=0) | (shifts != 0.0).any(axis=1)
        # The engine reports states that are not finite.
        rows = np.flatnonzero(is_moved & np.isfinite(vel + omega).all(axis=0))
        if not len(rows):
            return
        shift, turn = shifts[:, :3].T, shifts[:, 3:].T
        w.move(rows, pos=w.pos[:, rows] + shift[:, rows], vel=vel[:, rows])
        own = rows[turns[rows]]
        if len(own):
            small = np.concatenate([np.ones((1, len(own))), 0.5 * turn[:, own]])
            quat = quat_normalize(quat_multiply(small, w.quat[:, own]))
            w.move(own, quat=quat, omega=omega[:, own])

    def _report(
        self, w: WorldView, contacts: found.ContactList, touches: np.ndarray, is_new: np.ndarray
    ) -> None:
        """Publish the contacts that begin, and remove entities with `remove_on_collision`."""
        is_body = contacts.other >= 0
        removes = self.remove_on_collision[w.world]
        began = np.flatnonzero(touches & is_new & is_body)
        if len(began):
            pair = np.stack([contacts.row[began], contacts.other[began]])
            pair = pair[:, np.lexsort((w.id[pair[1]], w.id[pair[0]], w.world[pair[0]]))]
            is_first = np.append(True, (pair[:, 1:] != pair[:, :-1]).any(axis=0))
            first, second = pair = pair[:, is_first]
            w.publish(
                EntityCollided, w.world[first], first=w.id[first], second=w.id[second],
                first_team=w.team[first], second_team=w.team[second],
            )  # fmt: skip
            if removes.any():
                both = np.unique(pair)
                w.kill(both[removes[both]], "collision")
        down = np.zeros(w.n, bool)
        down[contacts.row[touches & ~is_body]] = True
        rows = np.flatnonzero(down & ~self.on_ground)
        if len(rows):
            w.publish(EntityHitGround, w.world[rows], entity=w.id[rows], team=w.team[rows])
            w.kill(rows[removes[rows]], "ground")
        self.on_ground[:] = down
        if self.show_collision_shapes and touches.any():
            at = contacts.row[touches]
            normal = contacts.numbers[touches, :3].T
            w.draw.vectors(
                pos=w.pos[:, at] + contacts.numbers[touches, 3:6].T, direction=normal * w.radius[at],
                world=w.world[at], colour=(255, 0, 0),
            )  # fmt: skip


def _names(text: str) -> list[str]:
    return [part.strip() for part in text.split(",") if part.strip()]
