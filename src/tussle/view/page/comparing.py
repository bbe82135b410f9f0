"""Two recorded runs seen together, from the first moment at which they differ."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from tussle.errors import ViewError
from tussle.view.entity import EntityState
from tussle.view.frame import Frame, Happening
from tussle.view.looks import Colour, Looks
from tussle.view.page.colours import BACKGROUND, mixed
from tussle.view.page.replaying import PlayHead, Replay, recorded_state
from tussle.view.scenery import Scenery

if TYPE_CHECKING:
    from tussle.view.recording import Recording

PALE = 0.55
"""Share of the background in the second run's colours."""
GAP = 0.15
"""Between two runs side by side, of their width."""
MOST_NAMED = 4
"""Entities that are named where two runs differ."""


@dataclass(frozen=True)
class Difference:
    """Where two runs part.

    Attributes:
        t: Time of the first moment at which they differ [s].
        step: Its step.
        text: What differs, in a line.
    """

    t: float
    step: int
    text: str


def first_difference(a: Recording, b: Recording) -> Difference | None:
    """The first moment that both runs have and that is not the same in both; None where all of these are the same.

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
    """In what two moments differ, in words; "" where they are the same."""
    if not np.array_equal(a.id, b.id):
        only_a, only_b = np.setdiff1d(a.id, b.id), np.setdiff1d(b.id, a.id)
        parts = [f"{_named(ids)} only in {name}" for ids, name in ((only_a, "A"), (only_b, "B")) if len(ids)]
        return "; ".join(parts)
    found: list[tuple[str, np.ndarray, str]] = []
    for name, unit in (("pos", "m"), ("vel", "m/s"), ("quat", ""), ("health", "")):
        one, other = getattr(a, name), getattr(b, name)
        same = (one == other) | (np.isnan(one) & np.isnan(other))
        rows = np.flatnonzero(~(same if same.ndim == 1 else same.all(axis=1)))
        if len(rows):
            found.append((name, rows, unit))
    for name in ("team", "block"):
        rows = np.flatnonzero(getattr(a, name) != getattr(b, name))
        if len(rows):
            found.append((name, rows, ""))
    if not found:
        return ""
    name, rows, unit = found[0]
    gaps = np.abs(np.asarray(getattr(a, name)[rows], float) - getattr(b, name)[rows])
    gap = float(np.linalg.norm(gaps, axis=-1).max()) if gaps.ndim > 1 else float(gaps.max())
    also = f" (and {', '.join(n for n, _, _ in found[1:])})" if len(found) > 1 else ""
    return f"{name} of {_named(a.id[rows])} of {len(a)}, by up to {gap:.3g} {unit}".rstrip() + also


def _named(ids: np.ndarray) -> str:
    """A few ids in words."""
    some = ", ".join(str(i) for i in ids[:MOST_NAMED])
    more = f" and {len(ids) - MOST_NAMED:,} more" if len(ids) > MOST_NAMED else ""
    return f"{'entity' if len(ids) == 1 else 'entities'} {some}{more}"


class Comparison(Replay):
    """Two recorded runs as one `Source`: the second has paler colours, stands beside the first or over it, and keeps its own time.

    Ids of the second run are counted on from the first one's.

    Args:
        a: The first run.
        b: The second.
        is_over_each_other: Both in the same place.
        warp: Simulated seconds per second; None is as fast as can be shown.
        is_paused: Whether it stands still at first.

    Attributes:
        shift: How far the second run is moved so as to stand beside the first [m], (3,).
        difference: Where they part, which is where it begins; None where they do not.

    Raises:
        ViewError: One of them has no moments.
    """

    def __init__(
        self,
        a: Recording,
        b: Recording,
        *,
        is_over_each_other: bool = False,
        warp: float | None = 1.0,
        is_paused: bool = False,
    ) -> None:
        for run in (a, b):
            if not run.n_frames:
                raise ViewError(f"{run.path}: nothing was recorded")
        super().__init__(a, warp=warp, is_paused=is_paused)
        self.a, self.b = a, b
        self.head = PlayHead(np.union1d(a.t, b.t), warp, is_paused)
        self.shift = np.zeros(3) if is_over_each_other else _place_beside(a, b)
        self._first_id = 10 ** len(str(_largest_id(a)))
        self._blocks = [*(f"A {name}" for name in a.blocks), *(f"B {name}" for name in b.blocks)]
        self._looks = _Both(a.looks, b.looks, len(a.blocks))
        self.difference = first_difference(a, b)
        if self.difference is not None:
            self.head.seek(self.difference.t)
        self._pair: tuple[int, int] | None = None
        self._merged: Frame | None = None

    @property
    def name(self) -> str:
        return f"{self.a.path.name} and {self.b.path.name}"

    @property
    def blocks(self) -> list[str]:
        return self._blocks

    @property
    def teams(self) -> dict[int, str]:
        return self.b.teams | self.a.teams

    @property
    def looks(self) -> Any:
        return self._looks

    @property
    def scenery(self) -> Scenery:
        """That of the first run, and room for both."""
        one, other = self.a.scenery, self.b.scenery
        low = np.minimum(one.low, other.low + np.minimum(self.shift, 0.0))
        high = np.maximum(one.high, other.high + self.shift)
        regions = list(one.boundaries)
        return Scenery(
            one.origin, one.origin_length, one.ground, low, high, one.grid_step, list(one.bases), regions,
            one.terrain, one.background, one.notes,
        )  # fmt: skip

    @property
    def notes(self) -> list[str]:
        said = f"A is {self.a.path.name}; B, paler, is {self.b.path.name}"
        if self.difference is None:
            both = min(self.a.t[-1], self.b.t[-1])
            return [
                said,
                f"they do not differ up to t = {both:g} s, where the shorter one ends",
                *self._own_notes(),
            ]
        d = self.difference
        return [said, f"they differ first at t = {d.t:g} s (step {d.step:,}): {d.text}", *self._own_notes()]

    def _own_notes(self) -> list[str]:
        return [f"{name}: {note}" for name, run in (("A", self.a), ("B", self.b)) for note in run.notes]

    # -- what is seen -------------------------------------------------------------------------------------------------------------

    def frame(self) -> Frame:
        """Both runs at the present; one that has ended, as it was at its end."""
        t = self.t
        pair = (self.a.index_at(t), self.b.index_at(t))
        if self._merged is None or pair != self._pair:
            self._pair, self._merged = pair, self._merge(self.a.frame(pair[0]), self.b.frame(pair[1]))
        return self._merged

    def frame_at(self, t: float) -> Frame:
        """Both runs at a time [s]."""
        return self._merge(self.a.at(t), self.b.at(t))

    def _merge(self, a: Frame, b: Frame) -> Frame:
        return Frame(
            max(a.t, b.t), max(a.step, b.step), np.concatenate([a.id, b.id + np.int32(self._first_id)]),
            np.concatenate([a.team, b.team]), np.concatenate([a.block, b.block + np.int32(len(self.a.blocks))]),
            np.concatenate([a.pos, b.pos + self.shift]), np.concatenate([a.quat, b.quat]),
            np.concatenate([a.vel, b.vel]), np.concatenate([a.health, b.health]),
        )  # fmt: skip

    def entity(self, who: int) -> EntityState | None:
        """What was recorded of an entity of either run."""
        return recorded_state(self.frame(), who, self.blocks)

    def name_of(self, frame: Frame, row: int) -> str:
        """What to call an entity: its run, its block and its id there."""
        who = int(frame.id[row])
        return (
            f"{self._blocks[int(frame.block[row])]} {who - self._first_id if who > self._first_id else who}"
        )

    @property
    def happenings(self) -> list[Happening]:
        """Events of both, and where they part."""
        shift = self._first_id
        found = [Happening(h.t, h.kind, h.id, h.other, f"A {h.text}") for h in self.a.happenings]
        found += [
            Happening(h.t, h.kind, h.id and h.id + shift, h.other and h.other + shift, f"B {h.text}")
            for h in self.b.happenings
        ]
        if self.difference is not None:
            found.append(Happening(self.difference.t, "difference", 0, 0, "A and B part"))
        return sorted(found, key=lambda h: h.t)


class _Both:
    """The looks of two runs: the second's blocks come after the first's, in paler colours."""

    def __init__(self, a: Looks, b: Looks, n_first: int) -> None:
        self._a, self._b, self._n = a, b, n_first
        self.notes = [*a.notes, *(note for note in b.notes if note not in a.notes)]

    def colour(self, team: int) -> Colour:
        return self._a.colour(team)

    def block_colour(self, block: int) -> Colour:
        if block < self._n:
            return self._a.block_colour(block)
        return mixed(self._b.block_colour(block - self._n), BACKGROUND, PALE)

    def model(self, block: int) -> str:
        return self._a.model(block) if block < self._n else self._b.model(block - self._n)

    def scale(self, block: int) -> float:
        return self._a.scale(block) if block < self._n else self._b.scale(block - self._n)


def _place_beside(a: Recording, b: Recording) -> np.ndarray:
    """How far the second run is moved so that it stands east of the first [m], (3,)."""
    width = max(float(a.scenery.high[0] - a.scenery.low[0]), float(b.scenery.high[0] - b.scenery.low[0]))
    return np.array([float(a.scenery.high[0] - b.scenery.low[0]) + GAP * width, 0.0, 0.0])


def _largest_id(run: Recording) -> int:
    """Of all who were ever there: those at the beginning, and those whose birth is an event."""
    return max(int(run.frame(0).id.max(initial=0)), max((h.id for h in run.happenings), default=0))
