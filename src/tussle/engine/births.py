"""Births of the mission's blocks: times, ids, positions and headings."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from tussle.api.bodies import Bodies
from tussle.api.context import Context
from tussle.engine import kernels
from tussle.engine.params import Overrides
from tussle.errors import MissionError
from tussle.mission import Block
from tussle.numeric import rng
from tussle.numeric.rng import stream_key

POSITION, HEADING = (np.uint64(stream_key("birth", label)) for label in ("position", "heading"))
VALUES = ("heading", "climb", "roll", "speed", "heading_variance", "health", "radius", "mass")
MAX_TRIES = 10_000
"""Maximum number of attempts to find a free position for one entity."""
TRIES_BEFORE_WAIT, TRIES_PER_STEP = 100, 10
"""The same for an entity that may wait: when it is due, and in each later step."""


@dataclass
class Occupancy:
    """Occupied positions while the entities of one moment are placed.

    Attributes:
        rejects: Returns True if a position is not free. Arguments: world; position [m], (3,); positions of the other entities [m],
            (3, j).
        occupied: Returns the positions of the entities of a world [m], (3, j).
        fail: Called with a world that has no free position, and the error.
        tries: World -> number of positions redrawn so far.
        full: Worlds without a free position.
        step: Number of the next step of each world, (n_worlds,), which numbers the attempts of those that wait.
        waiting: Rows of entities, of the new table, that wait for a free position, (m,) each.
    """

    rejects: Callable[[int, np.ndarray, np.ndarray], bool]
    occupied: Callable[[int], np.ndarray]
    fail: Callable[[int, MissionError], None]
    tries: dict[int, int] = field(default_factory=lambda: defaultdict(int))
    full: set[int] = field(default_factory=set)
    step: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    waiting: list[np.ndarray] = field(default_factory=list)


def joined(parts: list[Bodies]) -> Bodies:
    """Concatenate tables into one, ordered by (world, id)."""
    floats = np.concatenate([p.floats for p in parts], axis=1)
    ints = np.concatenate([p.ints for p in parts], axis=1)
    return in_order(Bodies(floats, ints, parts[0].n_worlds))


def in_order(bodies: Bodies) -> Bodies:
    """Order rows by (world, id)."""
    key = bodies.world << 32 | bodies.id
    if (key[1:] > key[:-1]).all():
        return bodies
    order = np.lexsort((bodies.id, bodies.world))
    return Bodies(bodies.floats.take(order, axis=1), bodies.ints.take(order, axis=1), bodies.n_worlds)


def _flags(block: Block) -> np.ndarray:
    """How entities of a block are scattered, as flags of `kernels.scatter`."""
    return np.array([block.placement == "uniform", block.scatter_first])


class Births:
    """Draws positions and headings, assigns ids, and keeps the times of future births.

    Attributes:
        next_id: Next id of each world, (n_worlds,).
        n_born: Entities born so far, (n_blocks, n_worlds).
        n_left: Number of future births of blocks with a rate, (n_blocks, n_worlds).
        next_time: Time of the next birth of each slot [s], per block (n_worlds, slots).
        n_waiting: Births that are due and wait for a free position, part of `n_left`, (n_blocks, n_worlds).
        n_waited: Births that have had to wait so far, (n_blocks, n_worlds).
    """

    may_wait = True

    def __init__(self, overrides: Overrides, context: Context, start: float) -> None:
        self.overrides, self.context = overrides, context
        self.seeds = context.keys  # which may change
        self.start = start
        n_blocks, n_worlds = len(overrides.mission.blocks), overrides.n_worlds
        self.keys = [np.uint64(stream_key("block", b.name)) for b in overrides.mission.blocks]
        self.next_id = np.ones(n_worlds, np.int64)
        self.n_born = np.zeros((n_blocks, n_worlds), np.int64)
        self.n_left = np.zeros((n_blocks, n_worlds), np.int64)
        self.n_waiting, self.n_waited = np.zeros_like(self.n_left), np.zeros_like(self.n_left)
        self._n_again = np.zeros_like(self.n_left)  # of those that are due now, the ones that have waited
        self.next_time = [
            np.full((n_worlds, b.slots if b.rate else 0), np.inf) for b in overrides.mission.blocks
        ]
        self.has_rates = any(b.rate for b in overrides.mission.blocks)
        self._flags = [_flags(b) for b in overrides.mission.blocks]

    def begin(self, worlds: np.ndarray) -> dict[int, np.ndarray]:
        """Reset worlds. Returns block number -> world of each initial entity."""
        self.next_id[worlds] = 1
        self.n_born[:, worlds] = self.n_waiting[:, worlds] = self.n_waited[:, worlds] = 0
        due: dict[int, np.ndarray] = {}
        for i, block in enumerate(self.overrides.mission.blocks):
            if block.rate:
                self.n_left[i, worlds] = block.count
                self.next_time[i][worlds] = max(block.first_birth, self.start)
            else:
                due[i] = np.repeat(worlds, block.count)
        return due

    def due(self, t: np.ndarray, running: np.ndarray) -> dict[int, np.ndarray]:
        """Return block number -> worlds of the births that are due at the worlds' times t [s], (n_worlds,)."""
        found: dict[int, np.ndarray] = {}
        for i, block in enumerate(self.overrides.mission.blocks):
            if not block.rate or not self.n_left[i].any():
                continue
            parts = [self._waiting(i, running)]
            for slot in range(block.slots):
                n_in_step = 0  # more than one if the rate is above the step rate
                while True:
                    is_due = running & (self.next_time[i][:, slot] <= t + 1e-9) & (self.n_left[i] > 0)
                    worlds = np.flatnonzero(is_due)
                    if not len(worlds):
                        break
                    parts.append(worlds)
                    self.n_left[i, worlds] -= 1
                    wait = 1.0 / block.rate
                    number = self.n_born[i, worlds] + self._n_again[i, worlds] + n_in_step
                    n_in_step += 1
                    seeds = self.seeds[worlds] ^ self.keys[i]
                    jitter = rng.normal(
                        seeds, stream_key("birth", "birth"), np.full(len(worlds), slot), number
                    )[0]
                    # Counted from the due time, not from the step, so that the average rate is exact.
                    due_at = self.next_time[i][worlds, slot]
                    later = due_at + wait + block.interval_sd * jitter
                    self.next_time[i][worlds, slot] = np.where(later > due_at, later, due_at + wait)
            worlds = np.sort(np.concatenate(parts), kind="stable")
            if len(worlds):
                found[i] = worlds
        return found

    def _waiting(self, block: int, running: np.ndarray) -> np.ndarray:
        """Worlds of the births of a block that have waited and are due again, (m,)."""
        again = self._n_again[block]
        again[:] = np.where(running, self.n_waiting[block], 0)
        self.n_left[block] -= again
        self.n_waiting[block] -= again
        return np.repeat(np.arange(len(again)), again)

    def _wait(self, block: int, worlds: np.ndarray) -> None:
        """Take back the last births of a block, one per item of `worlds`, and let them wait."""
        n = np.bincount(worlds, minlength=len(self.next_id))
        self.next_id -= n
        self.n_born[block] -= n
        self.n_left[block] += n
        self.n_waiting[block] += n
        self.n_waited[block] += np.maximum(0, n - self._n_again[block])

    def space(self, n_alive: np.ndarray) -> np.ndarray:
        """Number of entities that plugins may spawn, besides those of the blocks, (n_worlds,).

        Args:
            n_alive: Number of entities of each world, (n_worlds,).
        """
        mission = self.overrides.mission
        n_own = sum(b.count for b in mission.blocks)
        n_to_come = self.n_left.sum(axis=0)
        space = max(mission.limits.rows, n_own) - n_alive - n_to_come
        if mission.update != "synchronous":  # groups and calls are kept after their entities are gone
            space = np.minimum(space, max(mission.limits.sequential, n_own) - self.next_id + 1 - n_to_come)
        return np.asarray(space)

    def is_over(self, world: int) -> bool:
        """Return True if the blocks have no future births in a world."""
        return not (self.n_left[:, world] > 0).any()

    def are_drawn(self, world: int) -> bool:
        """Return True if places, headings or times of a world's entities so far depend on its seed."""
        for block, n_born in zip(self.overrides.mission.blocks, self.n_born[:, world].tolist(), strict=True):
            scatter = "half_width" if block.placement == "uniform" else "variance"
            place, heading = (
                self.overrides.block_values(block, (name,), np.array([world])).any()
                for name in (scatter, "heading_variance")
            )
            is_late = block.rate and block.interval_sd
            if n_born and (heading or is_late or (place and (n_born > 1 or block.scatter_first))):
                return True
        return False

    def create(
        self,
        new: Bodies,
        mine: slice,
        block: int,
        worlds: np.ndarray,
        where: dict[str, np.ndarray] | None = None,
        occupancy: Occupancy | None = None,
    ) -> None:
        """Fill rows of a new table with entities of one block, one per item of `worlds` (sorted).

        Args:
            new: The table.
            mine: Rows to fill.
            block: Number of the block.
            worlds: World of each entity, (m,).
            where: Initial pos, vel, quat and team that a plugin or a recorded table specifies, by name.
            occupancy: Occupied positions; None allows all positions.
        """
        where = where or {}
        spec = self.overrides.mission.blocks[block]
        new.world[mine], new.block[mine], new.team[mine] = worlds, block, spec.team
        keys = self._keys(block, worlds)
        block_values = self.overrides.block_values(spec, VALUES, worlds)
        out = new.id, new.block_index, new.pos, new.vel, new.quat, new.health, new.radius, new.mass
        counts = self.next_id, self.n_born[block]
        kernels.place_newborn(
            (keys, worlds), (POSITION, HEADING), self._flags[block], self._shape(block, worlds), block_values, counts, out, mine.start
        )  # fmt: skip
        self._first_places(block, worlds, new.pos[:, mine])
        if "pos" not in where and occupancy is not None:
            places = keys, new.block_index[mine]
            waiting = self._separate(block, worlds, places, new.pos[:, mine], occupancy)
            if len(waiting):
                self._wait(block, worlds[waiting])
                occupancy.waiting.append(mine.start + waiting)
        if spec.velocity is not None:
            new.vel[:, mine] = np.array(spec.velocity)[:, None]
        for name, values in where.items():
            getattr(new, name)[..., mine] = values

    def _shape(self, block: int, worlds: np.ndarray) -> np.ndarray:
        """Where entities of a block are placed in the worlds `worlds`, as shape of `kernels.place_newborn`."""
        spec = self.overrides.mission.blocks[block]
        if spec.placement == "uniform":
            return self.overrides.block_values(spec, ("position", "half_width"), worlds)
        values = self.overrides.block_values(spec, ("position", "variance"), worlds)
        return np.concatenate([values[:3], np.sqrt(values[3:])])

    def _keys(self, block: int, worlds: np.ndarray) -> np.ndarray:
        """Random keys of the next entities of a block, one per item of `worlds` (sorted), (m,)."""
        keys = self.seeds[worlds] ^ self.keys[block]
        if not self.context.redraws:
            return np.asarray(keys)
        index = self.n_born[block, worlds] + np.arange(len(worlds)) - np.searchsorted(worlds, worlds)
        return self.context.redrawn(keys, ("", ""), worlds, np.full(len(worlds), block), index)

    def _first_places(self, block: int, worlds: np.ndarray, pos: np.ndarray) -> None:
        """Change the first drawn positions [m], (3, m), of entities of a block, in place. Does nothing by default."""

    def _separate(
        self,
        block: int,
        worlds: np.ndarray,
        places: tuple[np.ndarray, np.ndarray],
        pos: np.ndarray,
        occupancy: Occupancy,
    ) -> np.ndarray:
        """Redraw the positions that an interaction rejects, one entity after another, since each occupies space.

        Of the entities, `places` has the random keys and the numbers in their block, (m,) each. Returns the numbers of those that wait for
        a free position, the last ones of their worlds, (k,).
        """
        waiting = [np.zeros(0, np.int64)]
        for world in map(int, np.unique(worlds)):
            if world not in occupancy.full:
                try:
                    mine = np.flatnonzero(worlds == world)
                    n_placed = self._separate_world(block, world, mine, places, pos, occupancy)
                    waiting.append(mine[n_placed:])
                except MissionError as error:
                    occupancy.full.add(world)
                    occupancy.fail(world, error)
        return np.concatenate(waiting)

    def _separate_world(
        self,
        block: int,
        world: int,
        mine: np.ndarray,
        places: tuple[np.ndarray, np.ndarray],
        pos: np.ndarray,
        occupancy: Occupancy,
    ) -> int:
        """Place entities of one world; returns the number of those that found a free position."""
        spec, most = self.overrides.mission.blocks[block], self.overrides.mission.limits.tries
        keys, indices = places
        waits = self.may_wait and spec.rate is not None and spec.without_space == "wait"
        n_again = int(self._n_again[block, world]) if waits else 0
        before = occupancy.occupied(world)
        n = before.shape[1]
        shape = self._shape(block, np.array([world]))
        taken = np.empty((3, n + len(mine)))
        taken[:, :n] = before
        for number, i in enumerate(mine):
            attempt, has_waited = 0, number < n_again
            first = MAX_TRIES + TRIES_PER_STEP * int(occupancy.step[world]) if has_waited else 0
            tries = TRIES_PER_STEP if has_waited else TRIES_BEFORE_WAIT
            while occupancy.rejects(world, pos[:, i], taken[:, :n]):
                attempt += 1
                occupancy.tries[world] += 1
                if waits and (attempt > tries or occupancy.tries[world] > most):
                    return number
                if attempt > MAX_TRIES or occupancy.tries[world] > most:
                    others = f", and {most:,} in all" if occupancy.tries[world] > most else ""
                    raise MissionError(
                        f"block {spec.name!r}: no free position for entity {int(indices[i]) + 1} of {spec.count} "
                        f"after {attempt - 1} tries{others}; give the block more space (placement {spec.placement!r}) or fewer entities"
                    )
                redrawn = np.empty(3)
                kernels.scatter(
                    keys[i], POSITION, indices[i], first + attempt, self._flags[block], shape, redrawn
                )
                pos[:, i] = redrawn
            taken[:, n] = pos[:, i]
            n += 1
        return len(mine)
