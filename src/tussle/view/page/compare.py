"""Compares two recorded runs and shows them together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from tussle.errors import ViewError
from tussle.mission import Mission
from tussle.record.plugin_columns import PluginColumn
from tussle.view.drawn import Shape
from tussle.view.frame import Event, Frame
from tussle.view.page.formatting import differing_settings
from tussle.view.scenery import Scenery
from tussle.view.sight import Sight
from tussle.view.style import Colour, Style
from tussle.world.geodesy import Origin

if TYPE_CHECKING:
    from tussle.view.recording import Recording

PALE = 0.55
"""Share of `PAPER` in the second run's colours."""
PAPER: Colour = (200, 205, 212)
GAP = 0.15
"""Between two runs side by side, of their width."""
MAX_NAMED = 4
"""Entities that are named where two runs differ."""


@dataclass(frozen=True)
class Difference:
    """The first difference between two runs.

    Attributes:
        t: Time of the first moment at which they differ [s].
        step: Its step.
        text: What differs, in a line.
    """

    t: float
    step: int
    text: str


def first_difference(a: Recording, b: Recording) -> Difference | None:
    """Return the first common time at which two runs differ; None if they do not differ.

    A run that is shorter than the other differs from it only in its end, which is no moment of both.
    """
    common, in_a, in_b = np.intersect1d(a.steps, b.steps, assume_unique=True, return_indices=True)
    for step, i, j in zip(common, in_a, in_b, strict=True):
        one, other = a.frame(int(i)), b.frame(int(j))
        text = what_differs(one, other)
        if text:
            return Difference(one.t, int(step), text)
    return None


def what_differs(a: Frame, b: Frame) -> str:
    """Describe the difference between two frames; "" if they are equal."""
    if not np.array_equal(a.id, b.id):
        only_a, only_b = np.setdiff1d(a.id, b.id), np.setdiff1d(b.id, a.id)
        parts = [f"{_named(ids)} only in {name}" for ids, name in ((only_a, "A"), (only_b, "B")) if len(ids)]
        return "; ".join(parts)
    found: list[tuple[str, np.ndarray, str]] = []
    units = {"pos": "m", "vel": "m/s", "quat": "", "health": "", "team": "", "block": ""}
    for name, unit in units.items():
        one, other = (np.asarray(getattr(frame, name), float) for frame in (a, b))
        same = (one == other) | (np.isnan(one) & np.isnan(other))
        rows = np.flatnonzero(~(same if same.ndim == 1 else same.all(axis=1)))
        if len(rows):
            found.append((name, rows, unit))
    if not found:
        return ""
    name, rows, unit = found[0]
    gaps = np.abs(np.asarray(getattr(a, name)[rows], float) - getattr(b, name)[rows])
    gap = float(np.linalg.norm(gaps, axis=-1).max()) if gaps.ndim > 1 else float(gaps.max())
    also = f" (and {', '.join(n for n, _, _ in found[1:])})" if len(found) > 1 else ""
    return f"{name} of {_named(a.id[rows])} of {len(a)}, by up to {gap:.3g} {unit}".rstrip() + also


def _named(ids: np.ndarray) -> str:
    """List a few ids as text."""
    some = ", ".join(str(i) for i in ids[:MAX_NAMED])
    more = f" and {len(ids) - MAX_NAMED:,} more" if len(ids) > MAX_NAMED else ""
    return f"{'entity' if len(ids) == 1 else 'entities'} {some}{more}"


class Comparison:
    """Two recorded runs as one recording: the second has paler colours, and stands beside the first or over it.

    Ids of the second run are counted on from the first one's (`id_shift`); a run that has ended stays as it was at its end.

    Args:
        a: The first run.
        b: The second.
        is_over_each_other: Both in the same place.

    Attributes:
        t: Times of the frames of both [s], (T,), ascending.
        shift: How far the second run is moved so as to stand beside the first [m], (3,).
        difference: Where they part; None where they do not.
        id_shift: What is added to the ids of the second run.
        team_shift: What is added to the numbers of its teams.

    Raises:
        ViewError: One of them has no moments.
    """

    def __init__(self, a: Recording, b: Recording, *, is_over_each_other: bool = False) -> None:
        for run in (a, b):
            if not run.n_frames:
                raise ViewError(f"{run.path}: nothing was recorded")
        self.a, self.b = a, b
        self.path = a.path
        self.t: np.ndarray = np.union1d(a.t, b.t)
        self.shift = np.zeros(3) if is_over_each_other else _place_beside(a, b)
        self.id_shift = 10 ** len(str(_largest_id(a)))
        self.blocks = [*(f"A {name}" for name in a.blocks), *(f"B {name}" for name in b.blocks)]
        # Teams of the two runs are teams of their own.
        self.team_shift = 10 ** len(str(2 * max(map(abs, [*a.teams, *b.teams]), default=0)))
        self.block_teams = [*a.block_teams, *(team + self.team_shift for team in b.block_teams)]
        self.teams = {team: f"A {name}" for team, name in a.teams.items()}
        self.teams |= {team + self.team_shift: f"B {name}" for team, name in b.teams.items()}
        self.style: Any = _Both(a.style, b.style, len(a.blocks), self.team_shift, list(a.teams))
        self.difference = first_difference(a, b)

    @property
    def name(self) -> str:
        return f"{self.a.path.name} and {self.b.path.name}"

    @property
    def mission(self) -> Mission | None:
        return self.a.mission

    @property
    def viewer(self) -> dict[str, Any]:
        return self.a.viewer

    @property
    def is_complete(self) -> bool:
        return self.a.is_complete and self.b.is_complete

    @cached_property
    def scenery(self) -> Scenery:
        """Return the scenery of the first run, with that of the second if they are shown side by side."""
        one, other = self.a.scenery, self.b.scenery
        low, high = np.minimum(one.low, other.low + self.shift), np.maximum(one.high, other.high + self.shift)
        if one.origin != other.origin or self.shift.any():
            one = replace(one, origin=Origin())  # a place on the page is not one on Earth
        if not self.shift.any():
            return replace(one, low=low, high=high)
        bases = [
            replace(base, team=base.team + self.team_shift, position=tuple(np.add(base.position, self.shift)))
            for base in other.bases
        ]
        regions = [
            replace(
                r,
                team=r.team and r.team + self.team_shift,
                mesh=r.mesh.placed(at=self.shift.tolist()),
                outline=r.outline + self.shift.astype(np.float32),
                parts=tuple(replace(part, vertices=part.vertices + self.shift) for part in r.parts),
            )
            for r in other.boundaries
        ]
        return replace(
            one, low=low, high=high, bases=[*one.bases, *bases], boundaries=[*one.boundaries, *regions]
        )

    @property
    def extent(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper corner of a box around all positions [m], each (3,)."""
        (low, high), (low_b, high_b) = self.a.extent, self.b.extent
        return np.minimum(low, low_b + self.shift), np.maximum(high, high_b + self.shift)

    @property
    def lead(self) -> str:
        """The first difference, in one line."""
        if self.difference is None:
            both = min(self.a.t[-1], self.b.t[-1])
            return f"they do not differ up to t = {both:g} s, where the shorter one ends"
        d = self.difference
        return f"they differ first at t = {d.t:g} s (step {d.step:,}): {d.text}"

    @property
    def signs(self) -> list[tuple[str, list[float]]]:
        """Names of the runs, and where they stand in the scene [m], (3,): at the northern edge of each, or one for both."""
        names = [f"A: {self.a.path.name}", f"B: {self.b.path.name}"]
        edges = [
            [0.5 * float(low[0] + high[0]), float(high[1]), float(low[2])]
            for low, high in ((run.scenery.low, run.scenery.high) for run in (self.a, self.b))
        ]
        if not self.shift.any():
            return [(f"{names[0]} · {names[1]}, paler", edges[0])]
        return [(names[0], edges[0]), (names[1], np.add(edges[1], self.shift).tolist())]

    @cached_property
    def differing(self) -> list[tuple[str, str, str]]:
        """Settings that differ: path, value in the first run, value in the second."""
        return differing_settings(self.a, self.b)

    @property
    def notes(self) -> list[str]:
        said = f"A is {self.a.path.name}; B, paler, is {self.b.path.name}"
        own = [f"{name}: {note}" for name, run in (("A", self.a), ("B", self.b)) for note in run.notes]
        return [said, self.lead, *own]

    @cached_property
    def _pairs(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the frame number of each run at each time, (T,) each."""
        a, b = ([run.index_at(float(t)) for t in self.t] for run in (self.a, self.b))
        return np.array(a), np.array(b)

    @property
    def counts(self) -> np.ndarray:
        """Entities of each frame, (T,)."""
        a, b = self._pairs
        counts: np.ndarray = self.a.counts[a] + self.b.counts[b]
        return counts

    def frame(self, i: int) -> Frame:
        """Return the frame of both runs at a time index."""
        a, b = (run.frame(int(pair[i])) for run, pair in zip((self.a, self.b), self._pairs, strict=True))
        return Frame(
            float(self.t[i]), max(a.step, b.step), np.concatenate([a.id, b.id + np.int32(self.id_shift)]),
            np.concatenate([a.team, b.team + np.int32(self.team_shift)]), np.concatenate([a.block, b.block + np.int32(len(self.a.blocks))]),
            np.concatenate([a.pos, b.pos + self.shift]), np.concatenate([a.quat, b.quat]),
            np.concatenate([a.vel, b.vel]), np.concatenate([a.health, b.health]),
        )  # fmt: skip

    @property
    def columns(self) -> dict[str, PluginColumn]:
        """Columns of plugins that were recorded of both runs, and those of one run whose names the other does not have."""
        common = self.a.columns | self.b.columns
        return {k: c for k, c in common.items() if self.a.columns.get(k, c) == self.b.columns.get(k, c)}

    def values(self, i: int, name: str) -> np.ma.MaskedArray[Any, Any]:
        """Return the values of a column of plugins at a time index, (n, k), in the order of the frame's ids; masked where there is none."""
        found: list[np.ma.MaskedArray[Any, Any]] = []
        for run, pair in zip((self.a, self.b), self._pairs, strict=True):
            if name in run.columns:
                found.append(run.values(int(pair[i]), name))
            else:
                nothing = np.zeros((int(run.counts[pair[i]]), len(self.columns[name].parts)))
                found.append(np.ma.array(nothing, mask=True))
        both: np.ma.MaskedArray[Any, Any] = np.ma.vstack(found)
        return both

    @property
    def has_shapes(self) -> bool:
        """True if shapes that plugins drew were recorded of one of the runs."""
        return self.a.has_shapes or self.b.has_shapes

    def shapes(self, i: int) -> tuple[Shape, ...]:
        """Return the shapes of both runs at a time index."""
        a, b = (run.shapes(int(pair[i])) for run, pair in zip((self.a, self.b), self._pairs, strict=True))
        return (*a, *(self._moved(shape) for shape in b))

    def _moved(self, shape: Shape) -> Shape:
        """A shape of the second run where that is seen."""
        try:
            pos = np.asarray(shape.attributes.get("pos", (0.0, 0.0, 0.0)), float).T + self.shift
        except (TypeError, ValueError, OverflowError):  # it cannot be drawn, as the page will say
            return shape
        return replace(shape, attributes=shape.attributes | {"pos": pos.T})

    @cached_property
    def events(self) -> list[Event]:
        """Events of both, and where they part. Texts are of the run itself: a birth's is the name of its block."""
        shift = self.id_shift
        found = [replace(e, text=_of_run("A", e)) for e in self.a.events]
        found += [
            replace(e, id=e.id and e.id + shift, other=e.other and e.other + shift, text=_of_run("B", e))
            for e in self.b.events
        ]
        if self.difference is not None:
            found.append(Event(self.difference.t, "difference", 0, 0, "A and B part"))
        return sorted(found, key=lambda event: event.t)


def _of_run(name: str, event: Event) -> str:
    """Text of an event of one of two runs: with its name where it has nothing else of the run."""
    if event.kind in ("alarm", "failure"):
        return f"{name}: {event.text}"
    return f"{name} {event.text}" if event.kind == "birth" else event.text


class _Both:
    """Style of two runs: the blocks of the second run follow those of the first, in paler colours."""

    def __init__(self, a: Style, b: Style, n_first: int, team_shift: int, teams: list[int]) -> None:
        self._a, self._b, self._n = a, b, n_first
        self._team_shift, self._teams = team_shift, teams
        self.notes = [*a.notes, *(note for note in b.notes if note not in a.notes)]

    def colour(self, team: int) -> Colour:
        return (
            self._a.colour(team) if team in self._teams else _paler(self._b.colour(team - self._team_shift))
        )

    def block_colour(self, block: int) -> Colour:
        if block < self._n:
            return self._a.block_colour(block)
        return _paler(self._b.block_colour(block - self._n))

    def model(self, block: int) -> str:
        return self._a.model(block) if block < self._n else self._b.model(block - self._n)

    def views(self, block: int) -> Sequence[Sight]:
        return self._a.views(block) if block < self._n else self._b.views(block - self._n)

    def lengths(self, block: int) -> tuple[float, float, float]:
        return self._a.lengths(block) if block < self._n else self._b.lengths(block - self._n)

    def scale(self, block: int) -> float:
        return max(self.lengths(block))


def _paler(colour: Colour) -> Colour:
    red, green, blue = (round((1.0 - PALE) * c + PALE * p) for c, p in zip(colour, PAPER, strict=True))
    return red, green, blue


def _place_beside(a: Recording, b: Recording) -> np.ndarray:
    """Return the offset that moves the second run east of the first [m], (3,)."""
    width = max(float(a.scenery.high[0] - a.scenery.low[0]), float(b.scenery.high[0] - b.scenery.low[0]))
    return np.array([float(a.scenery.high[0] - b.scenery.low[0]) + GAP * width, 0.0, 0.0])


def _largest_id(run: Recording) -> int:
    """Largest id of all entities of a run: of the first frame, and of births among the events."""
    return max(int(run.frame(0).id.max(initial=0)), max((h.id for h in run.events), default=0))
