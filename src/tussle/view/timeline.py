"""Snapshots of a game, and a compact history of its frames."""

from __future__ import annotations

import math
import time
from bisect import bisect_right
from typing import Any

import numpy as np

from tussle.api.bodies import FLOATS, OFFSETS
from tussle.declare.comms.topic import Delivery
from tussle.declare.lists import RaggedColumn
from tussle.declare.messages import Messages
from tussle.engine.simulation import Simulation
from tussle.engine.snapshot import Snapshot
from tussle.engine.state import Parked
from tussle.engine.table import Stored
from tussle.errors import SnapshotError
from tussle.view.frame import Frame, FrameReader
from tussle.view.pacing import Allowance

SNAPSHOT_SHARE = 0.01
"""Share of the CPU time for snapshots."""
HISTORY_SHARE = 0.01
"""Share of the CPU time for the history of frames."""


class Timeline:
    """Snapshots of a simulation while it plays, so that any earlier step can be reached by replaying from the one before it.

    A snapshot is taken when `every` seconds have been simulated and its CPU time is within the share. Beyond the memory limit
    snapshots are dropped so that gaps grow in proportion to the distance from the present; the first and the last stay.

    Args:
        simulation: The simulation.
        world: The world whose steps are counted.
        every: Least simulated time between two [s].
        limit: Memory that they may take [B].

    Attributes:
        refusal: Why no snapshot can be taken; "" if they can.
        size: Memory that they take [B].
    """

    def __init__(self, simulation: Simulation, world: int, every: float, limit: float) -> None:
        self._simulation, self._world = simulation, world
        self._every, self._limit = every, limit
        self._allowance = Allowance(SNAPSHOT_SHARE)
        self._steps: list[int] = []
        self._saved: list[tuple[Snapshot, int]] = []
        self.size = 0
        self.refusal = ""
        if simulation.grade == "external":
            self.refusal = "its plugins have state outside the simulation (their grade is external)"

    @property
    def steps(self) -> list[int]:
        """Steps with a snapshot, ascending."""
        return list(self._steps)

    def offer(self, step: int) -> None:
        """Take a snapshot of the present, at this step, if one is due and within the share."""
        place = bisect_right(self._steps, step)
        gap = (step - self._steps[place - 1]) * self._simulation.mission.dt if place else math.inf
        if gap < self._every * (1.0 - 1e-9):
            return
        if self._allowance.allows():
            self.keep(step)

    def keep(self, step: int) -> None:
        """Take a snapshot of the present, at this step."""
        place = bisect_right(self._steps, step)
        if self.refusal or (place and self._steps[place - 1] == step):
            return
        began = time.thread_time()
        try:
            snapshot = self._simulation.snapshot()
        except SnapshotError as error:
            self.refusal = str(error)
            self.clear()
            return
        size = memory_of(snapshot)
        self._steps.insert(place, step)
        self._saved.insert(place, (snapshot, size))
        self.size += size
        self._thin(step)
        self._allowance.pay(time.thread_time() - began)

    def _thin(self, step: int) -> None:
        while self.size > self._limit and len(self._steps) > 2:
            steps = np.array(self._steps)
            loss = (steps[2:] - steps[:-2]) / (np.abs(steps[1:-1] - step) + 1)
            self._drop(1 + int(loss.argmin()))

    def _drop(self, number: int) -> None:
        self.size -= self._saved[number][1]
        del self._steps[number], self._saved[number]

    def rest(self, seconds: float) -> None:
        """Grant time: the game has waited this long [s]."""
        self._allowance.rest(seconds)

    def nearest(self, step: int) -> tuple[int, Snapshot] | None:
        """The last snapshot not after a step, and its step."""
        place = bisect_right(self._steps, step)
        return (self._steps[place - 1], self._saved[place - 1][0]) if place else None

    def forget_after(self, step: int) -> None:
        """Drop everything after a step."""
        while self._steps and self._steps[-1] > step:
            self._drop(-1)

    def clear(self) -> None:
        """Drop all."""
        self._steps, self._saved, self.size = [], [], 0


class History:
    """Past frames of a game in single precision.

    Beyond the memory limit every other frame is dropped, and half as many are kept from then on.

    Args:
        simulation: The simulation.
        world: Number of the world.
        limit: Memory that they may take [B].
    """

    def __init__(self, simulation: Simulation, world: int, limit: float) -> None:
        self._clock = simulation.state.context.clock
        self._reader = FrameReader(simulation, world)
        self._limit = limit
        self._allowance = Allowance(HISTORY_SHARE)
        self._stride = 1
        self.size = 0
        # Appended to and replaced, never changed, so that readers in other threads need no lock.
        self._entries: list[tuple[int, tuple[np.ndarray, ...], np.ndarray]] = []

    def offer(self, step: int) -> None:
        """Keep the present frame, at this step, if it is new and within the share."""
        if (self._entries and step < self._entries[-1][0] + self._stride) or not self._allowance.allows():
            return
        began = time.thread_time()
        floats, who = self._reader.read()
        order = slice(None) if self._reader.order is None else self._reader.order
        state = np.empty((_N_KEPT, len(who[0])), np.float32)
        with np.errstate(over="ignore"):  # values beyond 3e38 become inf
            state[:_N_STATE] = floats[:_N_STATE, order]
            state[_N_STATE] = floats[OFFSETS["health"], order]
        self._entries.append((step, who, state))
        self.size += state.nbytes + 200
        while self.size > self._limit and len(self._entries) > 2:
            self._stride *= 2
            self._keep_only(self._entries[::2])
        self._allowance.pay(time.thread_time() - began)

    def _keep_only(self, entries: list[tuple[int, tuple[np.ndarray, ...], np.ndarray]]) -> None:
        self._entries = entries
        self.size = sum(state.nbytes + 200 for _, _, state in entries)

    def rest(self, seconds: float) -> None:
        """Grant time: the game has waited this long [s]."""
        self._allowance.rest(seconds)

    def at(self, step: int) -> Frame | None:
        """The last frame not after a step; None before the first."""
        entries = self._entries
        place = bisect_right(entries, step, key=lambda entry: entry[0])
        if not place:
            return None
        kept, (ids, team, block), state = entries[place - 1]

        def column(name: str) -> np.ndarray:
            return np.ascontiguousarray(state[OFFSETS[name] : OFFSETS[name] + FLOATS[name]].T, np.float64)

        t, health = float(self._clock.start + kept * self._clock.dt), state[_N_STATE].astype(np.float64)
        return Frame(t, kept, ids, team, block, column("pos"), column("quat"), column("vel"), health)

    @property
    def steps(self) -> list[int]:
        """Steps with a frame, ascending."""
        return [entry[0] for entry in self._entries]

    def forget_after(self, step: int) -> None:
        """Drop everything after a step."""
        self._keep_only([entry for entry in self._entries if entry[0] <= step])

    def clear(self) -> None:
        """Drop all."""
        self._stride = 1
        self._keep_only([])


_N_STATE = FLOATS["pos"] + FLOATS["vel"] + FLOATS["quat"]
_N_KEPT = _N_STATE + FLOATS["health"]
assert (OFFSETS["vel"], OFFSETS["quat"]) == (3, 6), "pos, vel and quat are copied as one piece"


def memory_of(item: Any) -> int:
    """Memory of all arrays and bytes in nested containers [B]; shared arrays count in each snapshot."""
    if isinstance(item, np.ndarray):
        return int(item.nbytes)
    if isinstance(item, bytes):
        return len(item)
    if isinstance(item, dict):
        return sum(memory_of(value) for value in item.values())
    if isinstance(item, (list, tuple)):
        return sum(memory_of(value) for value in item)
    if isinstance(item, Delivery):
        return memory_of([item.batch, item.due, item.to])
    if isinstance(item, Parked):
        return memory_of([item.bodies.floats, item.bodies.ints, item.tables])
    if isinstance(item, Stored):
        return memory_of([item.arrays, item.lists])
    if isinstance(item, (Snapshot, Messages, RaggedColumn)):
        return sum(memory_of(value) for name, value in vars(item).items() if name != "mission")
    return 0
