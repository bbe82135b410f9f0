"""Data shared by all views of one simulation."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np

from tussle.api.draw import Draw
from tussle.api.mass import MassProperties
from tussle.errors import PluginError, TussleError, listed, nearest_name
from tussle.numeric.rng import stream_key
from tussle.world.scene import Scene, TeamRegion, find_region


class Clock:
    """Time of each world, computed from its step number: rounding errors do not accumulate.

    Attributes:
        start: Time at the beginning of step 0 [s].
        dt: Length of a step [s].
        step: Current step number of each world, (n_worlds,), int64.
        common: Step number of all running worlds; -1 if they differ.
    """

    def __init__(self, n_worlds: int, start: float, dt: float) -> None:
        self.start = start
        self.dt = dt
        self.step = np.zeros(n_worlds, np.int64)
        self.common = 0

    def at(self, phase: float) -> np.ndarray:
        """Time of each world at a fraction `phase` of its step [s], (n_worlds,); phase 1 is exactly the start of the next step."""
        return self.start + (self.step + phase) * self.dt

    @property
    def t(self) -> np.ndarray:
        """Time of each world [s], (n_worlds,)."""
        return self.start + self.step * self.dt


PARTS_PER_THREAD = 4
"""Parts that `Context.split` makes for each thread: a slow thread then delays the others less."""


@dataclass(frozen=True)
class Redraw:
    """Some draws of a world that have a key of their own.

    Attributes:
        world: The world.
        key: Their key.
        block: Number of the block for whose entities they are; -1 for those of a world plugin for its world.
        index: Index of the entity in the block; -1 for all.
        plugin: Instance name of the plugin that draws; "" for all.
        label: Label of the draws; "" for all.
    """

    world: int
    key: np.uint64
    block: int
    index: int
    plugin: str
    label: str


@dataclass
class Context:
    """Data shared by all views of a simulation.

    Attributes:
        clock: Time of each world.
        seeds: Seed of each world, (n_worlds,), uint64.
        keys: Random key of each world: its seed, or the one with which draws go on, (n_worlds,), uint64.
        block_names: Names of the entity blocks; the body column `block` is an index into them.
        scene: Origin, ground, boundaries and bases.
        teams: Team numbers of the mission, ascending.
        running: Whether each world is still running, (n_worlds,).
        services: Service name -> function, for the services of world plugins.
        regions: Regions that world plugins define.
        topic: Function that returns the topic of a network, name and message type.
        threads: Number of threads that `split` may use.
        draw: Receives the shapes that plugins draw.
        fail: Ends one world with an error; the others continue.
        simulation: Returns the simulation, for code above the engine that a plugin calls.
        shared: Objects that handles of several entities use; their method `end` is called when the simulation is closed.
        boxes: Lengths of the boxes of each block for rays [m], (n_blocks, 3); 0 for spheres.
        move: Places entities: move(rows, pos=, vel=, quat=, omega=) as `WorldView.move`; their motion models go on from there at once.
        mass_properties: Returns mass, inertia and weight of all rows of the body table.
        steady: Number of steps for which rows have to stay the same until the arguments of kernels are packed.
        steady_steps: This number where rows stay the same for long, and where they do not: to pack takes as long as ten steps save.
        later: What `GroupView.finish` is called with, where the calls of kernels are recorded.
        is_interrupted: Whether the user asked to stop; a plugin that waits for others then waits no longer.
        redraws: Draws with keys of their own; if several apply to one draw, the last one is used.
        streams: Plugin and label of each random stream that has been drawn from.
        has_chance: Whether a plugin, or the order of moves, has drawn or read the seeds.
    """

    clock: Clock
    seeds: np.ndarray
    block_names: list[str]
    scene: Scene
    teams: np.ndarray
    running: np.ndarray
    services: dict[str, Callable[..., Any]] = field(default_factory=dict)
    regions: list[TeamRegion] = field(default_factory=list)
    topic: Callable[..., Any] = field(init=False)
    threads: int = 1
    draw: Draw = field(default_factory=Draw)
    keys: np.ndarray = field(init=False)
    fail: Callable[[int, PluginError], None] = field(init=False)
    simulation: Callable[[], Any] = field(init=False)
    boxes: np.ndarray = field(init=False)
    move: Callable[..., None] = field(init=False)
    mass_properties: Callable[[], MassProperties] = field(init=False)
    shared: dict[Hashable, Any] = field(default_factory=dict)
    is_interrupted: Callable[[], bool] = lambda: False
    steady: int = 12
    steady_steps: tuple[int, int] = (1, 12)
    later: list[Any] | None = None
    redraws: list[Redraw] = field(default_factory=list)
    streams: set[tuple[str, str]] = field(default_factory=set)
    has_chance: bool = False
    _pool: ThreadPoolExecutor | None = None

    def __post_init__(self) -> None:
        self.keys = self.seeds.copy()
        self.block_keys = np.array([stream_key("block", name) for name in self.block_names], np.uint64)
        self.boxes = np.zeros((len(self.block_names), 3))

    def row_seeds(self, world: np.ndarray, block: np.ndarray) -> np.ndarray:
        """Random key of each row, (n,), uint64: that of its world combined with the name of its block."""
        return np.asarray(self.keys[world] ^ self.block_keys[block])

    def redrawn(
        self,
        seeds: np.ndarray,
        draw: tuple[str, str],
        world: np.ndarray,
        block: np.ndarray,
        index: np.ndarray,
        of_world: bool = False,
    ) -> np.ndarray:
        """Keys of draws, (n,), uint64, with those that `redraws` gives to some of them.

        Args:
            seeds: Keys without them, (n,).
            draw: Plugin and label.
            world: World of each, (n,).
            block: Block of its entity, (n,); -1 for none.
            index: Index of the entity in its block, (n,).
            of_world: The plugin is one of the world.
        """
        plugin, label = draw
        out = seeds.copy()
        for each in self.redraws:
            if each.plugin in ("", plugin) and each.label in ("", label):
                is_it = (world == each.world) & (of_world if each.block < 0 else block == each.block)
                if each.index >= 0:
                    is_it &= index == each.index
                out[is_it] = each.key ^ self.block_keys[each.block] if each.block >= 0 else each.key
        return out

    def split(self, n: int, run: Callable[[int, int], Any], least: int = 64) -> None:
        """Call run(first, last) on consecutive parts of [0, n): in parallel if `threads` > 1 and n >= 2 * least, else in one call."""
        if self.threads == 1 or n < 2 * least:
            run(0, n)
            return
        if self._pool is None:
            self._pool = ThreadPoolExecutor(self.threads - 1)
        n_parts = min(PARTS_PER_THREAD * self.threads, n // least)
        edges = [n * i // n_parts for i in range(n_parts + 1)]
        parts = iter([part for part in pairwise(edges) if part[1] > part[0]])

        def work() -> None:
            for part in parts:  # all threads take from the same iterator
                run(*part)

        others = [self._pool.submit(work) for _ in range(self.threads - 1)]
        try:
            work()
        finally:
            wait(others)
        for other in others:
            other.result()

    def close(self) -> None:
        if self._pool is not None:
            self._pool.shutdown()
            self._pool = None
        while self.shared:
            self.shared.popitem()[1].end()

    def share(self, key: Hashable, make: Callable[[], Any]) -> Any:
        """The shared object with this key, which make() makes where there is none yet."""
        if key not in self.shared:
            self.shared[key] = make()
        return self.shared[key]

    def region(self, boundary: float) -> TeamRegion:
        """The region with this id.

        Raises:
            MissionError: No region, or more than one, has the id.
        """
        return find_region(self.regions, boundary)

    def find_service(self, name: str, own: dict[str, Callable[..., Any]]) -> Callable[..., Any]:
        """The service `name` of the entity's plugins, else of the world plugins.

        Raises:
            TussleError: No plugin offers it.
        """
        found = own.get(name) or self.services.get(name)
        if found is None:
            raise TussleError(missing_service(name, {*own, *self.services}))
        return found


def missing_service(name: str, offered: Iterable[str]) -> str:
    """Message that no plugin offers a service."""
    allowed = sorted(offered)
    return f"no plugin offers a service {name!r}{nearest_name(name, allowed)}; {listed(allowed)}"


@lru_cache(maxsize=4096)
def stream(plugin: str, label: str) -> int:
    """Random stream number of a plugin instance and a label."""
    return stream_key("plugin", plugin, label)
