"""The state of one world at one time, and its events."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tussle.api.bodies import FLOATS, OFFSETS
from tussle.arguments import explained
from tussle.engine.simulation import Simulation


@explained
@dataclass(frozen=True, eq=False)
class Frame:
    """All entities of one world at one time; the arrays are not changed.

    Attributes:
        t: Time [s].
        step: Number of the step that begins with this state.
        id: Ids, ascending, (n,), int32.
        team: Team of each, (n,), int32.
        block: Number of its block's name, (n,), int32.
        pos: Position [m], (n, 3), world frame, East North Up.
        quat: Attitude (w, x, y, z), (n, 4), body (forward, left, up) to world.
        vel: Ground velocity [m/s], (n, 3), world frame.
        health: Health; an entity is removed at 0, (n,).
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
        """Row of the entity with this id; -1 if it does not exist."""
        row = int(np.searchsorted(self.id, who))
        return row if row < len(self.id) and self.id[row] == who else -1


@dataclass(frozen=True, slots=True)
class Event:
    """An event of a game.

    Attributes:
        t: Time at the beginning of its step; of a birth or an end, its own time [s].
        kind: "birth", "death", "capture", "collision", "flag" or "end"; of a specification "alarm" or "failure".
        id: Entity that was born, died, captured or has a flag; the smaller id in a collision; 0 for an end.
        other: Entity that was captured, that captured or hit the dead one, or the larger id in a collision; 0 for none.
        text: The specification; block of a birth, "ground" for a collision with it, cause of a death or an end, what happened to a flag.
    """

    t: float
    kind: str
    id: int
    other: int
    text: str


def empty_frame(t: float, step: int) -> Frame:
    """A frame without entities."""
    none = np.zeros(0, np.int32)
    return Frame(t, step, none, none, none, np.zeros((0, 3)), np.zeros((0, 4)), np.zeros((0, 3)), np.zeros(0))


class FrameReader:
    """Makes frames of one world of a simulation. Rows are looked up again only after births and removals.

    Args:
        simulation: The simulation; used between steps only.
        world: Number of the world.
    """

    def __init__(self, simulation: Simulation, world: int = 0) -> None:
        self._simulation, self._world = simulation, world
        self._seen: np.ndarray | None = None
        self.order: np.ndarray | None = None
        self._who: tuple[np.ndarray, ...] = ()

    def read(self) -> tuple[np.ndarray, tuple[np.ndarray, ...]]:
        """Real columns of the table that holds the world, (22, n), and id, team and block of its entities, each (m,), int32.

        `order` then has their rows in that table; None if these are all rows in order.
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
        """A copy of the present state; of a world that has ended, its last state."""
        floats, who = self.read()
        clock = self._simulation.state.context.clock
        step = int(clock.step[self._world])
        columns = []
        for name in ("pos", "quat", "vel", "health"):
            first, k = OFFSETS[name], FLOATS[name]
            part = floats[first : first + k] if self.order is None else floats[first : first + k, self.order]
            columns.append(_closed(np.array(part.T if k > 1 else part[0], order="C")))
        return Frame(float(clock.start + step * clock.dt), step, *who, *columns)


def _closed(array: np.ndarray) -> np.ndarray:
    """The array, made read-only."""
    array.flags.writeable = False
    return array


@explained
def frame_of(simulation: Simulation, world: int = 0) -> Frame:
    """A copy of the present state of a world; of one that has ended, its last state."""
    return FrameReader(simulation, world).frame()
