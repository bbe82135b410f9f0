"""What a game's quantities were in each of its steps, whether somebody watched or not."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from tussle.engine.simulation import Simulation
from tussle.engine.step_end import world_result
from tussle.errors import PluginError
from tussle.view.entity import EntityState, Reading, entity_state
from tussle.view.frame import FrameReader
from tussle.view.pacing import Allowance
from tussle.view.series import CurveName, StepSeries

READING_SHARE = 0.25
"""Share of the CPU time for reading results and columns of entities."""
SHORT = {"pos": ("x", "y", "z"), "vel": ("vx", "vy", "vz")}
"""Names of the components of a body, as in a recording."""


class GameCurves:
    """Keeps quantities of one world: entities left and born by team, scores, results, and the columns of entities that are watched.

    Entities are counted after each step, as for the `alive.parquet` of a batch. Results and columns are also read after each step,
    unless this takes more than a share of the time; then steps are left out, and a note says so.

    Args:
        simulation: The simulation.
        world: Number of the world.
        note: Takes notes for the user.

    Attributes:
        series: CurveName -> its changes. A series is replaced where its past has changed.
    """

    def __init__(self, simulation: Simulation, world: int, note: Callable[[str], None]) -> None:
        self._simulation, self._world, self._note = simulation, world, note
        self._reader = FrameReader(simulation, world)
        self._allowance = Allowance(READING_SHARE)
        self._watched: dict[int, set[str]] = {}
        self.clear()

    def clear(self) -> None:
        """Forget everything."""
        self.series: dict[Any, StepSeries] = {}  # also found by the tuple that equals a name
        self._last = -1
        self._who: tuple[np.ndarray, ...] | None = None
        self._is_after_gap = False

    def forget_after(self, step: int) -> None:
        """Forget all steps after one."""
        self.series = {name: each.until(step) for name, each in self.series.items() if each.first <= step}
        self._last, self._who = min(self._last, step), None

    def rest(self, seconds: float) -> None:
        """Grant time: the game has waited this long [s]."""
        self._allowance.rest(seconds)

    def watch(self, wanted: Iterable[CurveName], step: int) -> None:
        """Read these columns of entities from the present state, at this step, on, and no others."""
        watched: dict[int, set[str]] = {}
        for quantity in wanted:
            watched.setdefault(quantity.id, set()).add(quantity.name)
        self._watched = watched
        for quantity in list(self.series):
            if quantity.id and quantity.name not in watched.get(quantity.id, ()):
                del self.series[quantity]
        self._read_entities(step)

    def offer(self, step: int, *, is_after_gap: bool = False) -> None:
        """Read the present state.

        Args:
            step: Its step. What was read of it before is not read again.
            is_after_gap: The game has jumped to it.
        """
        self._is_after_gap = is_after_gap
        is_new = step > self._last
        if is_new:
            self._last = step
            self._count(step)
        if (is_new or self._watched) and self._allowance.allows():
            began = time.thread_time()
            if is_new:
                self._read_results(step)
            self._read_entities(step)
            self._allowance.pay(time.thread_time() - began)
        elif is_new:
            self._note("reading results takes long: their curves do not have every step")

    def _set(self, quantity: CurveName, step: int, value: float) -> None:
        series = self.series.get(quantity)
        if series is None or step < series.first:
            series = StepSeries()
        elif step <= series.last:
            return
        elif series.values[-1] == value and not self._is_after_gap:  # mostly, and then at little cost
            series.last = step
            return
        self.series[quantity] = series = series.add(step, value, is_after_gap=self._is_after_gap)
        if series.is_thinned:
            self._note(f"{quantity.name} changes often: its curve does not have every change of the past")

    def _count(self, step: int) -> None:
        """Count the entities left and born, of each team."""
        _, who = self._reader.read()
        if who is self._who:
            return
        self._who, state = who, self._simulation.state
        teams = state.context.teams
        counts = np.bincount(np.searchsorted(teams, who[1]), minlength=len(teams))
        born = dict.fromkeys(teams.tolist(), 0)
        for block, n in zip(state.mission.blocks, state.births.n_born[:, self._world], strict=True):
            born[block.team] += int(n)
        for team, count in zip(teams.tolist(), counts.tolist(), strict=True):
            self._set(CurveName("left", team), step, count)
            self._set(CurveName("born", team), step, born[team])

    def _read_results(self, step: int) -> None:
        """Read scores and results."""
        state = self._simulation.state
        try:
            result = state.results[self._world] if not state.running[self._world] else None
            result = result or world_result(state, self._world, "", is_hashed=False)
        except PluginError as error:
            self._note(str(error))
            return
        for team, score in result.scores.items():
            self._set(CurveName("score", team), step, score)
        for plugin, named in result.metrics.items():
            for name, value in named.items():
                by_team: dict[int | None, Any] = value if isinstance(value, dict) else {None: value}
                for key, number in by_team.items():
                    if isinstance(number, (bool, int, float)):
                        self._set(CurveName(f"{plugin}.{name}", key), step, float(number))

    def _read_entities(self, step: int) -> None:
        """Read columns of the entities that are watched; they are NaN while an entity does not exist."""
        for who, names in self._watched.items():
            state = entity_state(self._simulation, self._world, who, has_messages=False)
            numbers = {} if state is None else numbers_of(state)
            for name in names:
                self._set(CurveName(name, None, who), step, numbers.get(name, (np.nan, ""))[0])


def numbers_of(state: EntityState) -> dict[str, tuple[float, str]]:
    """Return all numbers of an entity by name, each with its SI unit: of its body as a recording names them, and "Plugin.column.field"."""
    found: dict[str, tuple[float, str]] = {}
    for column, reading in state.body.items():
        if column == "vel":
            found["speed"] = float(np.linalg.norm(reading.value)), reading.unit
        names = SHORT.get(column) or [f"{column}_{axis}" for axis in "wxyz"[4 - np.size(reading.value) :]]
        found |= _numbers(names if np.ndim(reading.value) else [column], reading)
    for plugin, columns in state.plugins.items():
        for column, reading in columns.items():
            fields = [f"{plugin}.{column}.{field}" for field in reading.fields]
            found |= _numbers(fields if np.ndim(reading.value) else [f"{plugin}.{column}"], reading)
    return found


def _numbers(names: Iterable[str], reading: Reading) -> dict[str, tuple[float, str]]:
    """The components of a reading; nothing of lists, texts and structural values."""
    values: Any = np.atleast_1d(reading.value)
    if values.ndim != 1 or values.dtype.kind not in "bif" or len(values) != len(list(names)):
        return {}
    units = reading.unit.split()
    units = units if len(units) == len(values) else [reading.unit] * len(values)
    return {name: (float(value), unit) for name, value, unit in zip(names, values, units, strict=True)}
