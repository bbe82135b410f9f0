"""The robustness of a recorded game, from the states that were recorded."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from tussle.api.bodies import DERIVED, Bodies, derived_from
from tussle.errors import ParameterError
from tussle.mission import Mission
from tussle.record.plugin_columns import PluginColumn, select
from tussle.stress.signals import ChosenRows, Games, StepView
from tussle.stress.specification import Specification

MAX_ROWS = 200_000
"""States of which signals are computed at once."""
MAX_STEPS = 5_000_000
"""Steps of a game of which robustness is computed."""
BODY_COLUMNS = ("pos", "vel", "quat", "health")
"""Columns of the body table that are recorded."""
AGAIN = "`tussle view --from RUN --spec ...` plays the game again and shows it"


class RecordedStates(Protocol):
    """A recorded game, such as `tussle.view.Recording`."""

    path: Path
    steps: np.ndarray
    t: np.ndarray
    blocks: list[str]
    notes: list[str]

    @property
    def mission(self) -> Mission | None: ...
    @property
    def is_complete(self) -> bool: ...
    @property
    def counts(self) -> np.ndarray: ...
    @property
    def columns(self) -> Mapping[str, PluginColumn]: ...
    def frame(self, i: int) -> Any: ...
    def values(self, i: int, name: str) -> np.ma.MaskedArray[Any, Any]: ...


class RecordedMonitor:
    """What a recorded game shows of a specification: a monitor for `tussle.view.Recording.watch`.

    Steps that were not recorded count with the state before them.

    Args:
        text: The specification, as of `Specification.parse`.
        run: The game.

    Attributes:
        text: The specification.
        unit: SI unit of the robustness.

    Raises:
        ParameterError: The specification is none of this game, or speaks of what was not recorded.
    """

    def __init__(self, text: str, run: RecordedStates) -> None:
        if run.mission is None:
            raise ParameterError(f"{run.path}: a specification needs the mission of the run: {run.notes[-1]}")
        if [block.name for block in run.mission.blocks] != run.blocks:
            raise ParameterError(
                f"{run.path}: the blocks of its mission file are not those of its states ({', '.join(run.blocks)})"
            )
        if not len(run.steps):
            raise ParameterError(f"{run.path}: nothing was recorded, so nothing is known of {text!r}")
        if run.steps[-1] > MAX_STEPS:
            raise ParameterError(
                f"{run.path}: has {run.steps[-1]:,} steps; a specification is shown of at most {MAX_STEPS:,}"
            )
        self._run, self._specification = run, Specification.parse(text, run.mission)
        if reason := unrecorded(self._specification, run.mission):
            raise ParameterError(f"{run.path}: {reason}; {AGAIN}")
        self.text, self.unit = text, self._specification.unit
        self._signals = self._computed()

    def progress(self, world: int) -> tuple[np.ndarray, np.ndarray, float]:
        """What the game has shown, see `Monitor.progress`.

        Raises:
            ParameterError: A signal is not a number.
        """
        return self._specification.progress(self._signals, {}, self._run.is_complete)

    def _computed(self) -> dict[str, np.ndarray]:
        """Values of each signal at each step, (n_steps,)."""
        run, signals = self._run, self._specification.signals
        found: dict[str, list[np.ndarray]] = {name: [] for name in signals}
        kept: dict[str, np.ndarray] = {}
        for numbers in np.split(np.arange(len(run.steps)), _edges(run.counts)):
            frames = RecordedFrames(run, numbers.tolist())
            games = Games(1, np.asarray(run.steps[numbers], np.int64), kept)
            view = StepView(frames, frames.bodies, ChosenRows(frames.bodies, frames.layout), games)
            for name, signal in signals.items():
                found[name].append(signal.evaluate(view))
        frame_of = np.searchsorted(run.steps, np.arange(run.steps[-1] + 1), side="right") - 1
        return {name: np.concatenate(parts)[np.maximum(frame_of, 0)] for name, parts in found.items()}


def unrecorded(specification: Specification, mission: Mission) -> str:
    """Why no recording of a mission has what a specification speaks of; "" where one can have it."""
    known = columns_read(specification, mission)
    for quantity in specification.quantities:
        return f"{quantity.quantity} is known at the end of a game, and a recording is shown moment by moment"
    for signal in specification.signals.values():
        if signal.unrecorded:
            return f"{signal} {signal.unrecorded}"
        if signal.column not in ("", *known) and not _is_of_body(signal.column):
            return f"{signal.column} is no State or Output of an entity's plugin, and others are not recorded"
    return ""


def columns_read(specification: Specification, mission: Mission) -> list[str]:
    """Paths of the columns of entities' plugins that a specification reads and a recorder can keep."""
    found = []
    of_world = {plugin.instance_name for plugin in mission.world_plugins}
    for column in dict.fromkeys(signal.column for signal in specification.signals.values()):
        if column and column.partition(".")[0] not in of_world:
            with suppress(ParameterError):  # of the body table, or a parameter
                found += [column] if select(mission, column) else []
    return found


def _is_of_body(path: str) -> bool:
    return path.rpartition(".")[2] in (*BODY_COLUMNS, *DERIVED)


def _edges(counts: np.ndarray) -> np.ndarray:
    """The first frame of each but the first group of about `MAX_ROWS` states, counting a frame as one more."""
    group = np.cumsum(counts + 1) // MAX_ROWS
    return np.flatnonzero(np.diff(group)) + 1


class RecordedFrames:
    """Frames of a recorded game as the worlds of one body table, so that a signal is computed of all of them at once.

    Args:
        run: The game.
        numbers: Numbers of the frames.

    Attributes:
        t: Their times [s], (n_frames,).
        bodies: Their entities.
        layout: Of the rows, see `ChosenRows`: that of the table has room for all ids, of which a recording may have any.
    """

    def __init__(self, run: RecordedStates, numbers: Sequence[int]) -> None:
        self._run, self._numbers = run, numbers
        self.t = run.t[numbers]
        frames = [run.frame(i) for i in numbers]
        self._counts = [len(frame.id) for frame in frames]
        self.bodies = Bodies.empty(sum(self._counts), len(frames))
        self.layout = np.arange(self.bodies.n), np.cumsum([0, *self._counts])
        self.bodies.world[:] = np.repeat(np.arange(len(frames)), self._counts)
        for name in ("id", "team", "block", *BODY_COLUMNS):
            column = getattr(self.bodies, name)
            column[:] = np.concatenate([getattr(frame, name) for frame in frames]).T

    def read(self, path: str) -> tuple[np.ndarray, np.ndarray]:
        """Values of a column, (n_frames, n, ...), and where there are some, (n_frames, n); see `Simulation.read`.

        Raises:
            ParameterError: It was not recorded.
        """
        blocks = self._run.blocks
        number = next((i for i, name in enumerate(blocks) if path.startswith(f"{name}.")), -1)
        column = path[len(blocks[number]) + 1 :] if number >= 0 else ""
        values = self._values(blocks[number], column) if number >= 0 else None
        if values is None:
            raise ParameterError(
                f"{self._run.path}: {path!r} was not recorded, as `tussle run --record DIR --record-columns {path}` does; {AGAIN}"
            )
        mine = np.flatnonzero(self.bodies.block == number)
        frame = self.bodies.world[mine]
        place = np.arange(len(mine)) - np.searchsorted(frame, frame)
        is_there = np.zeros((len(self._counts), int(place.max(initial=-1)) + 1), bool)
        is_there[frame, place] = ~np.ma.getmaskarray(values)[mine].any(axis=1)
        found = np.zeros((*is_there.shape, values.shape[1]))
        found[frame, place] = values.filled(0)[mine]
        return found, is_there

    def _values(self, block: str, column: str) -> np.ma.MaskedArray[Any, Any] | None:
        """A column of a block's entities, (rows, k), masked where there is none; None if it was not recorded."""
        if column in BODY_COLUMNS or column in DERIVED:
            values = (
                derived_from(column, self.bodies.quat) if column in DERIVED else getattr(self.bodies, column)
            )
            return np.ma.array(np.atleast_2d(values).T)
        names = (n for n in self._run.columns if n == column or _is_of(n, block, column))
        if (name := next(names, None)) is None:
            return None
        found: np.ma.MaskedArray[Any, Any] = np.ma.vstack([self._run.values(i, name) for i in self._numbers])
        return found


def _is_of(name: str, block: str, column: str) -> bool:
    """Whether a recorded column, whose name begins with its blocks, is that of a block."""
    blocks = name.removesuffix(f".{column}")
    return blocks != name and block in blocks.split("+")
