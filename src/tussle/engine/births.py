"""Who is born when and where."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from tussle import rng
from tussle.engine.params import Overrides
from tussle.errors import MissionError
from tussle.mission import Block
from tussle.numeric import cos, sin
from tussle.numeric.quaternion import quat_from_euler
from tussle.rng import stream_key

MOST_TRIES = 10_000
"""Attempts to find a free place for one entity before the mission is called too crowded."""


@dataclass
class Room:
    """Who stands where, for those that are born at one moment.

    Attributes:
        rejects: (world, pos, taken) -> whether a place is not free.
        standing: World -> positions of those that are there [m], (3, j).
        fail: Called with a world that has no place for one of them.
        tries: World -> places drawn anew so far.
        full: Worlds that have no place for one of them.
    """

    rejects: Callable[[int, np.ndarray, np.ndarray], bool]
    standing: Callable[[int], np.ndarray]
    fail: Callable[[int, MissionError], None]
    tries: dict[int, int] = field(default_factory=lambda: defaultdict(int))
    full: set[int] = field(default_factory=set)


@dataclass
class Newborn:
    """New entities as columns, ordered by (world, id).

    Attributes:
        world: (m,) likewise block (its number), place (in its block), id, team.
        pos: [m], (3, m); vel [m/s], (3, m); quat (4, m).
        values: health, radius, mass, each (m,).
    """

    world: np.ndarray
    block: np.ndarray
    place: np.ndarray
    id: np.ndarray
    team: np.ndarray
    pos: np.ndarray
    vel: np.ndarray
    quat: np.ndarray
    values: dict[str, np.ndarray]

    def __len__(self) -> int:
        return len(self.world)

    @classmethod
    def join(cls, parts: list[Newborn]) -> Newborn:
        """All in one, ordered by (world, id)."""
        world = np.concatenate([p.world for p in parts])
        ids = np.concatenate([p.id for p in parts])
        order = np.lexsort((ids, world))

        def take(name: str) -> np.ndarray:
            return np.asarray(np.concatenate([getattr(p, name) for p in parts], axis=-1)[..., order])

        values = {k: np.concatenate([p.values[k] for p in parts])[order] for k in parts[0].values}
        return cls(
            world[order],
            take("block"),
            take("place"),
            ids[order],
            take("team"),
            take("pos"),
            take("vel"),
            take("quat"),
            values,
        )


class Births:
    """Draws places and headings, counts ids, and keeps the times of the births to come.

    Attributes:
        next_id: Next id of each world, (n_worlds,).
        n_born: Entities born so far, (n_blocks, n_worlds).
        n_left: Births to come of blocks with a rate, (n_blocks, n_worlds).
        next_time: Time of the next birth of each slot [s], per block (n_worlds, slots).
    """

    def __init__(self, overrides: Overrides, seeds: np.ndarray, start: float) -> None:
        self.overrides = overrides
        self.seeds = seeds
        self.start = start
        n_blocks, n_worlds = len(overrides.mission.blocks), overrides.n_worlds
        self.keys = [stream_key("block", b.name) for b in overrides.mission.blocks]
        self.next_id = np.ones(n_worlds, np.int64)
        self.n_born = np.zeros((n_blocks, n_worlds), np.int64)
        self.n_left = np.zeros((n_blocks, n_worlds), np.int64)
        self.next_time = [
            np.full((n_worlds, b.slots if b.rate else 0), np.inf) for b in overrides.mission.blocks
        ]
        self.has_rates = any(b.rate for b in overrides.mission.blocks)

    def begin(self, worlds: np.ndarray) -> dict[int, np.ndarray]:
        """Set worlds to their beginning; block number -> world of each entity that is there from the start."""
        self.next_id[worlds] = 1
        self.n_born[:, worlds] = 0
        due: dict[int, np.ndarray] = {}
        for i, block in enumerate(self.overrides.mission.blocks):
            if block.rate:
                self.n_left[i, worlds] = block.count
                self.next_time[i][worlds] = max(block.first_birth, self.start)
            else:
                due[i] = np.repeat(worlds, block.count)
        return due

    def due(self, t: np.ndarray, running: np.ndarray) -> dict[int, np.ndarray]:
        """Block number -> worlds of the births that are due at the worlds' times t [s], (n_worlds,)."""
        found: dict[int, np.ndarray] = {}
        for i, block in enumerate(self.overrides.mission.blocks):
            if not block.rate or not self.n_left[i].any():
                continue
            parts = []
            for slot in range(block.slots):
                again = 0  # a rate above that of the steps: several births of a slot in one step
                while True:
                    is_due = running & (self.next_time[i][:, slot] <= t + 1e-9) & (self.n_left[i] > 0)
                    worlds = np.flatnonzero(is_due)
                    if not len(worlds):
                        break
                    parts.append(worlds)
                    self.n_left[i, worlds] -= 1
                    wait = 1.0 / block.rate
                    number = self.n_born[i, worlds] + again
                    again += 1
                    jitter = self._normal(i, "birth", worlds, np.full(len(worlds), slot), number, 0, 1)[0]
                    # From the time it was due at, not that of the step, else a rate that does not divide the steps' would lag.
                    due_at = self.next_time[i][worlds, slot]
                    later = due_at + wait + block.interval_sd * jitter
                    self.next_time[i][worlds, slot] = np.where(later > due_at, later, due_at + wait)
            if parts:
                found[i] = np.sort(np.concatenate(parts), kind="stable")
        return found

    def space(self, n_alive: np.ndarray) -> np.ndarray:
        """Entities that may be born beside those of the blocks, (n_worlds,).

        Args:
            n_alive: Entities of each world, (n_worlds,).
        """
        mission = self.overrides.mission
        n_own = sum(b.count for b in mission.blocks)
        n_to_come = self.n_left.sum(axis=0)
        space = max(mission.limits.rows, n_own) - n_alive - n_to_come
        if mission.update == "sequential":  # whose groups and calls outlive the entities
            space = np.minimum(space, max(mission.limits.sequential, n_own) - self.next_id + 1 - n_to_come)
        return np.asarray(space)

    def is_over(self, world: int) -> bool:
        """No birth is to come in this world."""
        return not (self.n_left[:, world] > 0).any()

    def _normal(
        self,
        block: int,
        label: str,
        worlds: np.ndarray,
        index: np.ndarray,
        step: np.ndarray,
        substep: int,
        k: int,
    ) -> np.ndarray:
        return rng.normal(
            self.seeds[worlds] ^ np.uint64(self.keys[block]),
            stream_key("birth", label),
            index,
            step,
            substep,
            k,
        )

    def _scatter(
        self, block: int, spec: Block, worlds: np.ndarray, places: np.ndarray, attempt: int
    ) -> np.ndarray:
        """Offsets from the block's position [m], (3, m)."""
        seeds = self.seeds[worlds] ^ np.uint64(self.keys[block])
        stream, step = stream_key("birth", "position"), np.zeros(len(worlds), np.int64)
        if spec.placement == "uniform":
            draws = 2.0 * rng.uniform(seeds, stream, places, step, attempt, 3) - 1.0
            return np.asarray(draws * np.array(spec.half_width)[:, None])
        draws = rng.normal(seeds, stream, places, step, attempt, 3)
        return np.asarray(draws * np.sqrt(np.array(spec.variance))[:, None])

    def create(
        self,
        block: int,
        worlds: np.ndarray,
        where: dict[str, np.ndarray] | None = None,
        room: Room | None = None,
    ) -> Newborn:
        """Entities of one block, one per item of `worlds` (sorted).

        Args:
            block: Number of the block.
            worlds: World of each, (m,).
            where: pos, vel, quat, team that were asked for.
            room: Where they may stand; None is everywhere.
        """
        m, where = len(worlds), where or {}
        spec = self.overrides.mission.blocks[block]
        run = _run_numbers(worlds)
        places = self.n_born[block, worlds] + run
        ids = self.next_id[worlds] + run
        np.add.at(self.n_born[block], worlds, 1)
        np.add.at(self.next_id, worlds, 1)
        centre = np.array(spec.position)[:, None]
        pos = centre + np.where(
            (places > 0) | spec.scatter_first, self._scatter(block, spec, worlds, places, 0), 0.0
        )
        if "pos" in where:
            pos = np.array(where["pos"], float).reshape(3, -1) + np.zeros((3, m))
        elif room is not None:
            self._separate(block, worlds, places, pos, room)

        def value(name: str) -> np.ndarray:
            return self.overrides.block_values(spec, name, worlds)

        jitter = self._normal(block, "heading", worlds, places, np.zeros(m, np.int64), 0, 1)[0]
        yaw = value("heading") + np.sqrt(spec.heading_variance) * jitter
        climb = value("climb")
        quat = quat_from_euler(value("roll"), -climb, yaw)
        speed = value("speed")
        vel = np.array([speed * (cos(climb) * cos(yaw)), speed * (cos(climb) * sin(yaw)), speed * sin(climb)])
        if spec.velocity is not None:
            vel = np.repeat(np.array(spec.velocity)[:, None], m, axis=1)
        vel = np.array(where.get("vel", vel), float).reshape(3, -1) + np.zeros((3, m))
        quat = np.array(where.get("quat", quat), float).reshape(4, -1) + np.zeros((4, m))
        team = np.zeros(m, np.int64) + np.asarray(where.get("team", spec.team)).astype(np.int64)
        values = {name: value(name) for name in ("health", "radius", "mass")}
        return Newborn(worlds, np.full(m, block), places, ids, team, pos, vel, quat, values)

    def _separate(
        self, block: int, worlds: np.ndarray, places: np.ndarray, pos: np.ndarray, room: Room
    ) -> None:
        """Draw again where a referee finds a place not free; one entity after the other, as each takes up room."""
        for world in map(int, np.unique(worlds)):
            if world not in room.full:
                try:
                    self._separate_world(block, world, np.flatnonzero(worlds == world), places, pos, room)
                except MissionError as error:
                    room.full.add(world)
                    room.fail(world, error)

    def _separate_world(
        self, block: int, world: int, mine: np.ndarray, places: np.ndarray, pos: np.ndarray, room: Room
    ) -> None:
        spec, most = self.overrides.mission.blocks[block], self.overrides.mission.limits.tries
        before = room.standing(world)
        n = before.shape[1]
        taken = np.empty((3, n + len(mine)))
        taken[:, :n] = before
        for i in mine:
            attempt = 0
            while room.rejects(world, pos[:, i], taken[:, :n]):
                attempt += 1
                room.tries[world] += 1
                if attempt > MOST_TRIES or room.tries[world] > most:
                    others = f", and {most:,} in all" if room.tries[world] > most else ""
                    raise MissionError(
                        f"block {spec.name!r}: no free place for entity {int(places[i]) + 1} of {spec.count} "
                        f"after {attempt - 1} tries{others}; give the block more room (placement {spec.placement!r}) or fewer entities"
                    )
                one = slice(i, i + 1)
                pos[:, one] = np.array(spec.position)[:, None] + self._scatter(
                    block, spec, np.array([world]), places[one], attempt
                )
            taken[:, n] = pos[:, i]
            n += 1


def _run_numbers(worlds: np.ndarray) -> np.ndarray:
    """0, 1, 2 ... within each run of equal (sorted) worlds."""
    if not len(worlds):
        return np.zeros(0, np.int64)
    starts = np.flatnonzero(np.concatenate([[True], worlds[1:] != worlds[:-1]]))
    return np.asarray(np.arange(len(worlds)) - np.repeat(starts, np.diff([*starts, len(worlds)])))
