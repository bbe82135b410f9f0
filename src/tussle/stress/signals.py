"""Signals: numbers of each world at each step, of which specifications speak."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple, Protocol

import numpy as np

from tussle.api.bodies import Bodies
from tussle.declare import units
from tussle.declare.units import LENGTH, NONE, SPEED, TIME, Dimension
from tussle.documents import is_count
from tussle.engine.simulation import Simulation
from tussle.errors import ParameterError, TussleError, listed, nearest_name
from tussle.mission import Mission
from tussle.stress import kernels

EDGE = 0.001
"""Error of a clearance [m]."""
MAX_PLACES = 100_000
"""Places whose coverage is measured."""
AREA = re.compile(r"area (\S+) (\S+) (\S+) (\S+) by (.+)")
MAX_CLEARANCE = 100.0
"""Clearances are measured up to here [m]; beyond they are this far."""


class ChosenEntities(NamedTuple):
    """Entities that a signal is about.

    Attributes:
        kind: "all", "team", "block" or "entity".
        number: Number of the team or block, or id of the entity.
    """

    kind: str
    number: int = 0

    @classmethod
    def parse(cls, text: str, mission: Mission) -> ChosenEntities:
        """Read "all", "team 1", "entity 7", or the name of a block.

        Raises:
            ParameterError: The mission has no such entities.
        """
        word, _, rest = text.partition(" ")
        blocks, teams = [b.name for b in mission.blocks], [int(t) for t in mission.teams]
        if text in blocks:
            return cls("block", blocks.index(text))
        if text == "all":
            return cls("all")
        if word in ("team", "entity") and is_count(rest.strip()):
            number = int(rest)
            if word == "team" and number not in teams:
                raise ParameterError(f"there is no team {number}; {listed(map(str, teams))}")
            return cls(word, number)
        names = [*blocks, *(f"team {team}" for team in teams), "all"]
        raise ParameterError(f"there are no entities {text!r}{nearest_name(text, names)}; {listed(names)}")


class ChosenRows:
    """The rows of each selection, by world; valid until entities are born or removed.

    Args:
        bodies: The body table.
        layout: Its rows by world and id, and the place where those of each world start, (n_worlds + 1,); None asks the table.
    """

    def __init__(self, bodies: Bodies, layout: tuple[np.ndarray, np.ndarray] | None = None) -> None:
        self.ints = bodies.ints
        self._bodies, self._layout = bodies, layout
        self._chosen: dict[ChosenEntities, tuple[np.ndarray, np.ndarray]] = {}
        self._has_many: dict[tuple[ChosenEntities, ChosenEntities], bool] = {}

    def of(self, chosen: ChosenEntities) -> tuple[np.ndarray, np.ndarray]:
        """ChosenRows, and the place where those of each world start, (n_worlds + 1,)."""
        if chosen not in self._chosen:
            bodies = self._bodies
            members, start = self._layout or bodies.layout()[:2]
            column = {"team": bodies.team, "block": bodies.block, "entity": bodies.id}.get(chosen.kind)
            if column is not None:
                is_in = column[members] == chosen.number
                start = np.concatenate([[0], np.cumsum(is_in)])[start]
                members = members[is_in]
            self._chosen[chosen] = np.ascontiguousarray(members), np.ascontiguousarray(start)
        return self._chosen[chosen]

    def has_many_pairs(self, a: ChosenEntities, b: ChosenEntities) -> bool:
        """Some world has so many pairs that not all of them are looked at."""
        if (a, b) not in self._has_many:
            n_pairs = np.diff(self.of(a)[1]) * np.diff(self.of(b)[1])
            self._has_many[a, b] = bool(np.max(n_pairs, initial=0) >= kernels.SWEEP_FROM)
        return self._has_many[a, b]


class SignalSource(Protocol):
    """What signals are computed of, beside a body table: a simulation, or frames of a recorded game."""

    @property
    def t(self) -> np.ndarray: ...
    def read(self, path: str) -> tuple[np.ndarray, np.ndarray]: ...


@dataclass
class Games:
    """The games that the worlds of a body table are moments of, and what is kept of their earlier moments.

    What is kept says at which step it was so: a game that is rewound or begins again forgets what came later.

    Attributes:
        n: How many games: as many as worlds, or one of which the worlds are moments in order.
        step: Step of each world, (n_worlds,).
        kept: Text of a signal -> its numbers of each game, (n, k).
    """

    n: int
    step: np.ndarray
    kept: dict[str, np.ndarray] = field(default_factory=dict)

    def numbers(self, signal: str, k: int) -> np.ndarray:
        """What is kept for a signal, (n, k or more); at first `NEVER`."""
        known = self.kept.get(signal, np.empty((self.n, 0), np.int64))
        if (has := known.shape[1]) < k:
            known = np.pad(known, ((0, 0), (0, max(k - has, has))), constant_values=kernels.NEVER)
            self.kept[signal] = known
        return known


@dataclass
class StepView:
    """The state that signals are computed from.

    Attributes:
        sim: The simulation, or what stands in for it.
        bodies: Its body table, or that of a world that has ended.
        rows: ChosenRows of selections.
        games: What is known of the moments before; None if nothing is.
    """

    sim: SignalSource
    bodies: Bodies
    rows: ChosenRows
    games: Games | None = None

    def extreme(self, values: np.ndarray, chosen: ChosenEntities, sign: float) -> np.ndarray:
        """Least (sign 1) or greatest (sign -1) value of the entities of each world, (n_worlds,); values are per row, (n,)."""
        rows, start = self.rows.of(chosen)
        out = np.empty(self.bodies.n_worlds)
        kernels.extreme(values[rows], start, sign, out)
        return out

    def counted(self, values: np.ndarray, chosen: ChosenEntities) -> np.ndarray:
        """Number of entities of each world for which values, (n,), are true."""
        rows, start = self.rows.of(chosen)
        before = np.concatenate([[0], np.cumsum(values[rows])])
        found: np.ndarray = np.diff(before[start]).astype(np.float64)
        return found

    def distances(self, vectors: np.ndarray, point: tuple[float, float, float]) -> np.ndarray:
        """Distances of vectors (3, n) from a point, (n,)."""
        out = np.empty(self.bodies.n)
        kernels.distance_to(vectors, *point, out)
        return out

    def least_distance(self, a: ChosenEntities, b: ChosenEntities) -> np.ndarray:
        """Least distance of an entity a from another b [m], (n_worlds,); inf without a pair."""
        out, pos = np.empty(self.bodies.n_worlds), self.bodies.pos
        (rows_a, start_a), (rows_b, start_b) = self.rows.of(a), self.rows.of(b)
        if self.rows.has_many_pairs(a, b):
            both = np.union1d(rows_a, rows_b)
            world = self.bodies.world[both]
            order = np.lexsort((pos[0, both], world))
            start = np.searchsorted(world[order], np.arange(len(out) + 1))
            both = both[order]
            kernels.least_by_sweep(
                np.take(pos, both, axis=1), np.isin(both, rows_a), np.isin(both, rows_b), start, out
            )
        elif a == b:
            kernels.least_within(np.take(pos, rows_a, axis=1), start_a, out)
        else:
            kernels.least_between(
                np.take(pos, rows_a, axis=1),
                rows_a,
                start_a,
                np.take(pos, rows_b, axis=1),
                rows_b,
                start_b,
                out,
            )
        return out

    def least_approach(self, a: ChosenEntities, b: ChosenEntities, per_second: float) -> np.ndarray:
        """Least approach of an entity a to another b [m], (n_worlds,), see `kernels.least_approach`; inf without a pair."""
        out, pos, vel = np.empty(self.bodies.n_worlds), self.bodies.pos, self.bodies.vel
        chosen = [
            (np.take(pos, rows, axis=1), np.take(vel, rows, axis=1), rows, start)
            for rows, start in (self.rows.of(a), self.rows.of(b))
        ]
        kernels.least_approach(*chosen, per_second, out)
        return out

    def covered(self, chosen: ChosenEntities, places: np.ndarray, reach: float, signal: str) -> np.ndarray:
        """Share of places, (k, m), of which an entity has been nearer than `reach` in its k first components, (n_worlds,).

        Args:
            chosen: The entities.
            places: The places [m].
            reach: The distance [m].
            signal: Under which it is kept which ones were reached before; "" asks for this moment alone.

        Raises:
            ParameterError: Moments before are not known.
        """
        if signal and self.games is None:
            raise ParameterError(f"{signal} is not known of a single moment")
        n, (rows, start), out = self.bodies.n_worlds, self.rows.of(chosen), np.empty(self.bodies.n_worlds)
        games = self.games if signal and self.games else Games(n, np.zeros(n, np.int64))
        since = games.numbers(signal, places.shape[1])
        pos = np.take(self.bodies.pos, rows, axis=1)
        kernels.covered(pos, start, places, reach, games.step, since, out)
        return out

    def messages(self, network: str) -> np.ndarray:
        """Copies of messages on a network so far: delivered, then lost for each reason, (1 + n_losses, n_worlds).

        Raises:
            ParameterError: This is no simulation.
        """
        if not isinstance(self.sim, Simulation):
            raise ParameterError(f"messages of {network} are known in a simulation only")
        counts: np.ndarray = self.sim.state.networks[network].plugin.link_counts
        return counts


Evaluate = Callable[[StepView], np.ndarray]


@dataclass(frozen=True)
class Signal:
    """A number of each world at each step.

    Attributes:
        text: As it is written, in one way.
        unit: Its dimension; None where it is not known.
        evaluate: Returns the values, (n_worlds,).
        unrecorded: Why no recording has it; "" where one can have it.
        column: Path of the column that it reads; "" for none.
    """

    text: str
    unit: Dimension | None
    evaluate: Evaluate = field(compare=False, repr=False)
    unrecorded: str = ""
    column: str = ""

    def __str__(self) -> str:
        return self.text


def _point(text: str) -> tuple[float, float, float] | None:
    """The place of "point 10 20 0"; None for something else."""
    word, *numbers = text.split()
    if word != "point":
        return None
    try:
        x, y, z = map(float, numbers)
    except ValueError:
        raise ParameterError(f"{text!r} is no point; it takes three numbers, as point 10 20 0") from None
    return x, y, z


def _places(text: str) -> np.ndarray:
    """Places [m]: (3, n) of "points 10 20 0 30 40 0"; (2, n) of "area 0 0 90 60 by 10 m", the centres of its squares.

    Raises:
        ParameterError: The text is neither, or they are too many.
    """
    area = AREA.fullmatch(text)
    try:
        numbers = list(map(float, area.groups()[:4] if area else text.removeprefix("points ").split()))
    except ValueError:
        numbers = []
    if area and numbers and numbers[0] < numbers[2] and numbers[1] < numbers[3]:
        edge = units.parse(area[5], "m")
        sizes = [(numbers[k + 2] - numbers[k]) / edge if edge > 0.0 else math.inf for k in (0, 1)]
        if sizes[0] * sizes[1] <= MAX_PLACES:
            x, y = (
                numbers[k] + edge * (np.arange(max(1, round(size))) + 0.5) for k, size in enumerate(sizes)
            )
            return np.stack([np.repeat(x, len(y)), np.tile(y, len(x))])
        raise ParameterError(f"{text!r} has too many squares; at most {MAX_PLACES:,} are allowed")
    if (
        area
        or not text.startswith("points ")
        or not numbers
        or len(numbers) % 3
        or not np.isfinite(numbers).all()
    ):
        raise ParameterError(
            f"{text!r} is no area and no points; places are area 0 0 90 60 by 10 m (two corners, edge of squares) or points 10 20 0 30 40 0"
        )
    return np.ascontiguousarray(np.reshape(numbers, (-1, 3)).T)


OF_MESSAGES = "messages_sent", "messages_lost", "loss_rate"
"""Signals that count messages."""


class Factory:
    """Makes the signals of one mission.

    Args:
        mission: The mission.
        functions: Further signals: name -> function of the simulation that returns one number per world.
    """

    def __init__(self, mission: Mission, functions: Mapping[str, Callable[[Simulation], Any]]) -> None:
        self.mission, self.functions = mission, dict(functions)

    @cached_property
    def kinds(self) -> dict[str, tuple[int, Callable[..., tuple[Dimension | None, Evaluate]]]]:
        """Name -> number of arguments, and the method that makes it."""
        return {name.removeprefix("of_"): (
            getattr(type(self), name).__code__.co_argcount - 1, getattr(self, name)
        ) for name in vars(type(self)) if name.startswith("of_")}  # fmt: skip

    def make(self, name: str, arguments: list[str]) -> Signal:
        """The signal of a call.

        Raises:
            ParameterError: There is no such signal, or an argument is not allowed.
        """
        if name in self.functions and not arguments:
            evaluate = _checked(name, self.functions[name])
            return Signal(
                f"{name}()", None, evaluate, "is a function of the simulation, and a recording is none"
            )
        if name not in self.kinds:
            known = [*self.kinds, *self.functions]
            raise ParameterError(f"there is no signal {name!r}{nearest_name(name, known)}; {listed(known)}")
        n, make = self.kinds[name]
        if len(arguments) != n:
            raise ParameterError(f"{name}() takes {n} argument{'s' * (n != 1)}, not {len(arguments)}")
        unit, evaluate = make(*arguments)
        column = arguments[0] if name in ("min", "max") else ""
        unrecorded = "counts messages, which are not recorded step by step" if name in OF_MESSAGES else ""
        return Signal(f"{name}({', '.join(arguments)})", unit, evaluate, unrecorded, column)

    def selection(self, text: str) -> ChosenEntities:
        """Entities by their text."""
        return ChosenEntities.parse(text, self.mission)

    def of_time(self) -> tuple[Dimension | None, Evaluate]:
        """Time since the start of the clock [s]."""
        return TIME, lambda f: f.sim.t

    def of_distance(self, these: str, others: str) -> tuple[Dimension | None, Evaluate]:
        """Least distance between an entity and another one, or from a point [m]; inf without a pair."""
        a = self.selection(these)
        if (point := _point(others)) is not None:
            return LENGTH, lambda f: f.extreme(f.distances(f.bodies.pos, point), a, 1.0)
        b = self.selection(others)

        return LENGTH, lambda f: f.least_distance(a, b)

    def of_approach(self, these: str, others: str, speed: str) -> tuple[Dimension | None, Evaluate]:
        """Least distance at which an entity passes another one if both fly straight on; each second until then counts as so far [m]."""
        a, b = self.selection(these), self.selection(others)
        per_second = units.parse(speed, "m/s")
        return LENGTH, lambda f: f.least_approach(a, b, per_second)

    def of_max_distance(self, these: str, place: str) -> tuple[Dimension | None, Evaluate]:
        """Greatest distance of an entity from a point [m]; -inf without one."""
        a, point = self.selection(these), _point(place)
        if point is None:
            raise ParameterError(f"max_distance() takes a point, as point 10 20 0, not {place!r}")
        return LENGTH, lambda f: f.extreme(f.distances(f.bodies.pos, point), a, -1.0)

    def of_min_speed(self, these: str) -> tuple[Dimension | None, Evaluate]:
        """Speed of the slowest [m/s]; inf without entities."""
        a = self.selection(these)
        return SPEED, lambda f: f.extreme(f.distances(f.bodies.vel, (0.0, 0.0, 0.0)), a, 1.0)

    def of_max_speed(self, these: str) -> tuple[Dimension | None, Evaluate]:
        """Speed of the fastest [m/s]; -inf without entities."""
        a = self.selection(these)
        return SPEED, lambda f: f.extreme(f.distances(f.bodies.vel, (0.0, 0.0, 0.0)), a, -1.0)

    def of_min_height(self, these: str) -> tuple[Dimension | None, Evaluate]:
        """Least height above the highest surface below: roofs, terrain, ground [m]; inf without entities."""
        a, scene = self.selection(these), self.mission.scene
        return LENGTH, lambda f: f.extreme(f.bodies.pos[2] - scene.height(*f.bodies.pos[:2]), a, 1.0)

    def of_clearance(self, these: str) -> tuple[Dimension | None, Evaluate]:
        """Least distance of a centre from walls, meshes, terrain and ground [m], to a millimetre and up to 100 m."""
        a, scene = self.selection(these), self.mission.scene
        if not scene.solids:
            raise ParameterError(
                "clearance() needs something solid, and the mission has no walls, meshes, terrain or ground"
            )

        def evaluate(f: StepView) -> np.ndarray:
            low, high = np.zeros(f.bodies.n), np.full(f.bodies.n, MAX_CLEARANCE)
            is_far = scene.free(f.bodies.pos, MAX_CLEARANCE)
            while np.max(high - low, initial=0.0) > EDGE:
                middle = 0.5 * (low + high)
                is_free = scene.free(f.bodies.pos, middle)
                low, high = np.where(is_free, middle, low), np.where(is_free, high, middle)
            return f.extreme(np.where(is_far, MAX_CLEARANCE, low), a, 1.0)

        return LENGTH, evaluate

    def of_count(self, these: str) -> tuple[Dimension | None, Evaluate]:
        """Number of living entities."""
        a = self.selection(these)
        return NONE, lambda f: f.counted(np.ones(f.bodies.n, np.int64), a)

    def of_inside(self, these: str, boundary: str) -> tuple[Dimension | None, Evaluate]:
        """Number of entities inside of a boundary, by its id."""
        a = self.selection(these)
        regions = [r for plugin in self.mission.world_plugins for r in plugin.regions()]
        found = [r for r in regions if str(r.boundary) == boundary]
        if len(found) != 1:
            known = [str(r.boundary) for r in regions]
            raise ParameterError(
                f"{len(found) or 'no'} boundaries of the mission have the id {boundary}; {listed(known)}"
            )
        return NONE, lambda f: f.counted(found[0].shape.contains(f.bodies.pos), a)

    def of_components(self, these: str, reach: str) -> tuple[Dimension | None, Evaluate]:
        """Connected parts of the network of entities that are in range of each other, as components(team 1, 100 m)."""
        a, limit = self.selection(these), units.parse(reach, "m")
        return NONE, lambda f: _tree(f, a, limit)[1]

    def of_longest_link(self, these: str) -> tuple[Dimension | None, Evaluate]:
        """The range that entities need to be one connected network: the longest link of their minimum spanning tree [m]."""
        a = self.selection(these)
        return LENGTH, lambda f: _tree(f, a, 0.0)[0]

    def of_coverage(self, these: str, places: str, reach: str) -> tuple[Dimension | None, Evaluate]:
        """Share of places of which an entity has been nearer than a distance, as coverage(all, area 0 0 90 60 by 10 m, 25 m)."""
        a, where, limit = self.selection(these), _places(places), units.parse(reach, "m")
        text = f"coverage({these}, {places}, {reach})"
        return NONE, lambda f: f.covered(a, where, limit, text)

    def of_coverage_now(self, these: str, places: str, reach: str) -> tuple[Dimension | None, Evaluate]:
        """Share of places of which an entity is nearer than a distance now."""
        a, where, limit = self.selection(these), _places(places), units.parse(reach, "m")
        return NONE, lambda f: f.covered(a, where, limit, "")

    def of_messages_sent(self, network: str) -> tuple[Dimension | None, Evaluate]:
        """Messages so far to entities within reach that listen, each copy counted."""
        name = self._network(network)
        return NONE, lambda f: f.messages(name).sum(axis=0).astype(np.float64)

    def of_messages_lost(self, network: str) -> tuple[Dimension | None, Evaluate]:
        """Those of them that were lost."""
        name = self._network(network)
        return NONE, lambda f: f.messages(name)[1:].sum(axis=0).astype(np.float64)

    def of_loss_rate(self, network: str, time: str) -> tuple[Dimension | None, Evaluate]:
        """Messages that were lost within the time before, per time [1/s], as loss_rate(RadioNetwork, 10 s)."""
        name, text, dt = self._network(network), f"loss_rate({network}, {time})", self.mission.dt
        n = round(units.parse(time, "s") / dt)
        if n < 1:
            raise ParameterError(f"loss_rate() takes a time of a step or more, {dt:g} s, not {time!r}")

        def evaluate(f: StepView) -> np.ndarray:
            lost = f.messages(name)[1:].sum(axis=0)
            assert f.games is not None  # as there is a simulation
            step, world = f.games.step, np.arange(f.games.n)
            before = f.games.numbers(text, int(step.max()) + 1)
            before[world, step] = lost
            return np.asarray((lost - before[world, np.maximum(step - n, 0)]) / (n * dt))

        return units.unit_of("1/s").dimension, evaluate

    def _network(self, name: str) -> str:
        known = [each.instance_name for each in self.mission.networks if type(each).losses]
        if name not in known:
            raise ParameterError(
                f"there is no network {name!r} that counts lost messages{nearest_name(name, known)}; {listed(known)}"
            )
        return name

    def of_min(self, path: str) -> tuple[Dimension | None, Evaluate]:
        """Least value of a column, by its path: min(prey.Battery.charge); inf without entities."""
        return _unit_of(path, self.mission), lambda f: _column(f, path, np.min, np.inf)

    def of_max(self, path: str) -> tuple[Dimension | None, Evaluate]:
        """Greatest value of a column; -inf without entities."""
        return _unit_of(path, self.mission), lambda f: _column(f, path, np.max, -np.inf)


def _checked(name: str, function: Callable[[Simulation], Any]) -> Evaluate:
    def evaluate(f: StepView) -> np.ndarray:
        assert isinstance(f.sim, Simulation)  # others have no functions
        values = np.asarray(function(f.sim), dtype=np.float64)
        if values.shape != (f.sim.n_worlds,):
            raise ParameterError(
                f"{name}() has returned shape {values.shape}; it takes one number per world, ({f.sim.n_worlds},)"
            )
        return values

    return evaluate


def _tree(f: StepView, chosen: ChosenEntities, reach: float) -> tuple[np.ndarray, np.ndarray]:
    longest, parts = np.empty(f.bodies.n_worlds), np.empty(f.bodies.n_worlds)
    rows, start = f.rows.of(chosen)
    kernels.spanning_tree(np.take(f.bodies.pos, rows, axis=1), start, reach, longest, parts)
    return longest, parts


def _column(f: StepView, path: str, of: Callable[..., Any], empty: float) -> np.ndarray:
    values, is_there = f.sim.read(path)
    if values.dtype == object:
        raise ParameterError(f"{path!r} is a list per entity, which has no least and no greatest value")
    if is_there.ndim < values.ndim:
        is_there = is_there.reshape(is_there.shape + (1,) * (values.ndim - is_there.ndim))
    is_there = np.broadcast_to(is_there, values.shape)
    axes = tuple(range(1, values.ndim))
    numbers = np.where(is_there, values, empty).astype(np.float64)
    return np.asarray(of(numbers, axis=axes, initial=empty) if axes else numbers)


def _unit_of(path: str, mission: Mission) -> Dimension | None:
    """Check that a mission has a column; its dimension is not known here."""
    sim = Simulation(mission, 1, on_error="record")
    try:
        sim.read(path)
    except TussleError as error:
        raise ParameterError(str(error)) from None
    finally:
        sim.close()
    return None
