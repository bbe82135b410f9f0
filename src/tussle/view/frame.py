"""What is seen of one world at one moment."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tussle.api.bodies import FLOATS, OFFSETS
from tussle.engine.simulation import Simulation


@dataclass(frozen=True, eq=False)
class Frame:
    """All entities of one world at one moment; nothing of it is ever written to again.

    Attributes:
        t: Time [s].
        step: Number of the step that begins with this state.
        id: Who, ascending, (n,), int32.
        team: Team of each, (n,), int32.
        block: Number of its block's name, (n,), int32.
        pos: Position [m], (n, 3), world frame, East North Up.
        quat: Attitude (w, x, y, z), (n, 4), body (forward, left, up) to world.
        vel: Ground velocity [m/s], (n, 3), world frame.
        health: What is left before it is removed at 0, (n,).
    """

    t: float
    step: int
    id: np.ndarray
    team: np.ndarray
    block: np.ndarray
    pos: np.ndarray
    quat: np.ndarray
    vel: np.ndarray
    health: np.ndarray

    def __len__(self) -> int:
        return len(self.id)

    def row_of(self, who: int) -> int:
        """Row of the entity with this id; -1 where it is not there."""
        row = int(np.searchsorted(self.id, who))
        return row if row < len(self.id) and self.id[row] == who else -1


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened in a game.

    Attributes:
        t: Time of the beginning of the step in which it happened; of a birth or an end, its time [s].
        kind: "birth", "death", "capture", "collision" or "end".
        id: Who was born, died, captured, or has the smaller id of two that met; 0 for an end.
        other: Who was captured, who captured or met the dead, the larger id of two that met; 0 for nobody.
        text: Block of the born, "ground" where one met that, why one died, why the world ended.
    """

    t: float
    kind: str
    id: int
    other: int
    text: str


def empty_frame(t: float, step: int) -> Frame:
    """A moment in which nobody is there."""
    none = np.zeros(0, np.int32)
    return Frame(t, step, none, none, none, np.zeros((0, 3)), np.zeros((0, 4)), np.zeros((0, 3)), np.zeros(0))


class Lens:
    """Makes frames of one world of a simulation. Who is there is looked up only when somebody has come or gone.

    Args:
        simulation: The simulation; it is looked at between its steps only.
        world: Number of the world.
    """

    def __init__(self, simulation: Simulation, world: int = 0) -> None:
        self._simulation, self._world = simulation, world
        self._seen: np.ndarray | None = None
        self.order: np.ndarray | None = None
        self._who: tuple[np.ndarray, ...] = ()

    def look(self) -> tuple[np.ndarray, tuple[np.ndarray, ...]]:
        """Real columns of the table in which the world lies, (22, n), and id, team and block of its entities, each (m,), int32.

        `order` then has their rows in that table; None when these are all rows as they lie.
        """
        parked = self._simulation.state.parked.get(self._world)
        bodies = self._simulation.state.population.bodies if parked is None else parked.bodies
        if bodies.ints is not self._seen:
            self._seen = bodies.ints
            rows = np.flatnonzero(bodies.world == self._world)
            rows = rows[np.argsort(bodies.id[rows], kind="stable")]
            is_all = len(rows) == bodies.n and bool((rows[1:] > rows[:-1]).all())
            self.order = None if is_all else rows
            self._who = tuple(
                _closed(a[rows].astype(np.int32)) for a in (bodies.id, bodies.team, bodies.block)
            )
        return bodies.floats, self._who

    def frame(self) -> Frame:
        """A copy of what is there now; of a world that has ended, its last state."""
        floats, who = self.look()
        clock = self._simulation.state.context.clock
        step = int(clock.step[self._world])
        columns = []
        for name in ("pos", "quat", "vel", "health"):
            first, k = OFFSETS[name], FLOATS[name]
            part = floats[first : first + k] if self.order is None else floats[first : first + k, self.order]
            columns.append(_closed(np.array(part.T if k > 1 else part[0], order="C")))
        return Frame(float(clock.start + step * clock.dt), step, *who, *columns)


def _closed(array: np.ndarray) -> np.ndarray:
    """The array, from now on read-only."""
    array.flags.writeable = False
    return array


def frame_of(simulation: Simulation, world: int = 0) -> Frame:
    """A copy of what is in one world now; of a world that has ended, its last state."""
    return Lens(simulation, world).frame()
