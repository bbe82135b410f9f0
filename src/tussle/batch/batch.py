"""A batch: one mission played many times, with other seeds and values."""

from __future__ import annotations

import hashlib
import json
import math
import re
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tussle.arguments import checked, explained
from tussle.batch.code import plugin_code
from tussle.batch.design_points import (
    DesignPoint,
    build_points,
    check_source,
    check_variables,
    group_points,
    read_points,
    with_whole_numbers,
)
from tussle.batch.executors import OVERDUE, Executor, InProcess, Processes
from tussle.batch.plan import BatchPlan
from tussle.batch.points import settings_of, variables_of
from tussle.batch.sampling import method_for
from tussle.batch.sampling import sample as sample_points
from tussle.batch.store import PLUGINS
from tussle.batch.tasks import BatchRun, Finished
from tussle.batch.variables import Variable
from tussle.batch.varied import as_variables, variable_entry
from tussle.declare.displays import counted, line, listing, page, table
from tussle.documents import POSITIVE, Maybe, check_argument, several
from tussle.engine.simulation import Simulation
from tussle.errors import BatchError, ParameterError, PluginError
from tussle.folders import real_path
from tussle.mission import Loaded, Mission, PluginFile, read_mission
from tussle.mission.effects import exactly
from tussle.notebook_bar import Show, notebook_bar
from tussle.palette import team_colours
from tussle.record.run_file import versions

if TYPE_CHECKING:
    from tussle.batch.results import Results
    from tussle.batch.sequential import Rule
    from tussle.batch.stopping import Until
    from tussle.batch.target import Target
    from tussle.batch.tasks import Progress

MAX_CHECKED = 16
"""Groups of which one game is started before the batch, so that errors of the mission show at once."""

WORTH_A_PROCESS = 4.0
"""CPU time of games, played alone, that is worth a process [s]: it starts in one second, and stacked games take a third or less."""

STARTS_WITHIN = 120.0
"""Time that the first steps of a game may take in addition to `run_timeout` [s]: kernels may have to be compiled."""

MAX_SEEDS, MAX_RUNS_UNTIL = 100_000, 1_000_000
"""Seeds and runs of a batch with `until` and without `runs`."""


@explained
class Batch:
    """One mission, played with many seeds and values.

    Args:
        mission: A mission file, the name of one that ships, a `Mission`, or a function of the varied values that makes one.
        runs: Games of each point, that is of each set of varied values; None for as many as `until` needs, see `play`.
        vary: What varies: texts as on the command line ("prey_speed=20:30"), variables, or a dict by name of (low, high), lists and
            texts ("20:30:log").
        sample: How points are chosen: lhs, sobol, saltelli, grid, list, product; "" chooses by what varies.
        samples: Number of points; None for the method's default.
        points: The points themselves, instead of `vary`.
        sample_seed: Seed of the sampling.
        first_seed: Seeds of the games count up from here.
        independent: Each game has a seed of its own; otherwise all points have the same seeds (common random numbers).
        settings: Values that are set in all points, as for `read_mission` or by path.
        plugin_files: Python files whose plugins the mission file may name.
        ends_by_time: The game ends at its end time whatever the mission says.
        run_timeout: Wall time that a game may take [s]; one that takes longer is stopped and recorded as failed. Worlds of a stack share
            its time. All games are then played in other processes of this machine.
        options: Further options of `read_mission`.

    Attributes:
        reading: All options of `read_mission`.

    Raises:
        ParameterError: A variable or a number is not allowed.
        MissionError: There is no such mission, or it cannot be played at one of the points.
    """

    @checked("independent", "ends_by_time")
    def __init__(
        self,
        mission: str | Path | Mission | Callable[..., Mission],
        *,
        runs: int | None = 100,
        vary: Mapping[str, Any] | Iterable[str | Variable] = (),
        sample: str = "",
        samples: int | None = None,
        points: Sequence[Mapping[str, Any]] | None = None,
        sample_seed: int = 0,
        first_seed: int = 1,
        independent: bool = False,
        settings: Mapping[str, Any] | None = None,
        plugin_files: Sequence[str | Path] = (),
        ends_by_time: bool = False,
        run_timeout: float | None = None,
        **options: Any,
    ) -> None:
        check_source(mission, "Batch")
        check_argument("run_timeout", run_timeout, Maybe(POSITIVE))
        self.source = mission
        self.settings = dict(settings or {})
        plugin_files = several(plugin_files)
        self.plugin_files = tuple(PluginFile.of(p) for p in plugin_files)
        for file in self.plugin_files:
            file.load()
        self.variables = as_variables(vary)
        self.reading = {**options, "plugin_files": plugin_files}
        if isinstance(mission, (str, Path)):
            self.variables = with_whole_numbers(mission, self.settings, self.variables, **self.reading)
        self.sample, self.sample_seed = sample, sample_seed
        if points is not None and self.variables:
            raise ParameterError(
                "points are given, so there is nothing to vary beside them; give one of the two"
            )
        chosen = (
            [dict(p) for p in points]
            if points is not None
            else sample_points(self.variables, sample, samples, sample_seed)
        )
        is_sampled = points is None and bool(self.variables)
        self.sample = method_for(self.variables, sample) if is_sampled else sample
        if points is not None:
            self.variables = variables_of(chosen)
        if runs is None:
            runs = max(1, min(MAX_SEEDS, MAX_RUNS_UNTIL // len(chosen)))
        self.plan = BatchPlan(chosen, runs, first_seed, independent)
        self._ends_by_time = ends_by_time
        self._game_s: float | None = (
            None  # CPU time of a game, estimated from its second step; None before `check`
        )
        self._rules: set[str] = set()  # that `check` has checked
        self.loaded = self._read()
        self.missions = list(self._missions(self.plan.points))
        if isinstance(self.source, (str, Path)) and self.variables:
            points = list(map(self._settings, self.plan.points))
            check_variables(self.source, self.settings, points, **self.reading)
        self.design_points, package = group_points(self.missions, self.plugin_files)
        self.package = replace(package, run_timeout=run_timeout)

    def _read(self) -> Loaded | None:
        """The mission file as it stands without any varied value; None for a mission made in Python."""
        if not isinstance(self.source, (str, Path)):
            return None
        return read_mission(self.source, self.settings, **self.reading)

    def _missions(self, points: Sequence[Mapping[str, Any]]) -> Iterator[Mission]:
        """The mission of each point; `_files` gets the files that they are read from."""
        self._files: dict[Path, bytes] = {}
        settings = map(self._settings, points)
        if not isinstance(self.source, (str, Path)):
            yield from map(self._ended, build_points(self.source, self.settings, settings))
            return
        for loaded in read_points(self.source, self.settings, settings, **self.reading):
            self._files |= {file: file.read_bytes() for file in loaded.files if file not in self._files}
            yield self._ended(loaded.mission)

    def missions_at(self, points: Sequence[Mapping[str, Any]]) -> list[Mission]:
        """The mission with further values, as settings, whose effect is not checked.

        Raises:
            TussleError: The mission cannot be played with them.
        """
        if not isinstance(self.source, (str, Path)):
            return list(map(self._ended, build_points(self.source, self.settings, points)))
        found = read_points(self.source, self.settings, points, **self.reading)
        return [self._ended(loaded.mission) for loaded in found]

    def _settings(self, point: Mapping[str, Any]) -> dict[str, Any]:
        return settings_of(point, self.variables, is_argument=callable(self.source))

    def _ended(self, mission: Mission) -> Mission:
        compat = self.reading.get("compat")  # a mission made in Python does not have it yet
        mission = mission if compat in (None, mission.compat) else mission.replace(compat=compat)
        return mission.ending_by_time() if self._ends_by_time else mission

    def __repr__(self) -> str:
        return line("Batch", repr(self._name), *self._facts())

    @property
    def _name(self) -> str:
        return self.mission.name or (str(self.source) if isinstance(self.source, (str, Path)) else "")

    def _facts(self) -> tuple[str, ...]:
        n_points, first = len(self.plan.points), self.plan.seed(0)
        varied = (
            f"{counted(n_points, 'point')} of {listing([v.name for v in self.variables])}"
            if self.variables
            else ""
        )
        return counted(self.plan.n_runs, "run"), varied, f"seeds from {first}"

    def _repr_html_(self) -> str:
        names = [v.name for v in self.variables]
        rows = ((number, *(point[name] for name in names)) for number, point in enumerate(self.plan.points))
        points = table(("point", *names), rows) if names else ""
        return page(f"Batch {self._name}", self._facts(), points, self.mission._repr_html_())

    # -- runs -----------------------------------------------------------------------------------------------------------------

    @property
    def mission(self) -> Mission:
        """The mission at the first point."""
        return self.missions[0]

    def run(self, number: int) -> BatchRun:
        """A run, as executors take it."""
        point: DesignPoint = self.design_points[self.plan.point(number)]
        return BatchRun(number, point.group, self.plan.seed(number), point.params)

    def simulation(self, number: int) -> Simulation:
        """The game of one run, alone, before its first step.

        Raises:
            BatchError: There is no such run.
        """
        if not 0 <= number < self.plan.n_runs:
            raise BatchError(f"there is no run {number}; the batch has runs 0 to {self.plan.n_runs - 1}")
        return Simulation(self.missions[self.plan.point(number)], self.plan.seed(number), on_error="record")

    def check(self, until: Rule | None = None) -> None:
        """Start a game of each group, up to some number, and make its first steps, so that errors of the mission show at once.

        Errors of plugins are left to the runs, since they may depend on the seed.

        Args:
            until: When to stop; games must have the quantity that it names.

        Raises:
            TussleError: A mission cannot be played.
            ParameterError: No game has that quantity.
        """
        first = {t.group: point for point, t in reversed(list(enumerate(self.design_points)))}
        points = sorted(first.values())[:MAX_CHECKED]
        if self._game_s is None:
            longest = 0.0
            for point in self._starting(points):
                with suppress(PluginError, SystemExit), self.simulation(point) as simulation:
                    simulation.step()  # loads or compiles what it needs
                    began = time.perf_counter()
                    simulation.step()
                    longest = max(longest, (time.perf_counter() - began) * self.missions[point].steps)
            self._game_s = longest
        if until is not None and str(until) not in self._rules:
            missions = [self.missions[point] for point in points]
            check_quantity(
                missions,
                self.plan.first_seed,
                self.patience,
                lambda results: until.check({name: results.quantity(name) for name in results.quantities}),
            )
            self._rules.add(str(until))

    @property
    def patience(self) -> float | None:
        """Wall time that a game may take in `check` [s]; None for no limit."""
        limit = self.package.run_timeout
        return None if limit is None else STARTS_WITHIN + limit

    def _starting(self, points: Sequence[int]) -> list[int]:
        """The points whose game makes its first steps within `patience`: the others are not started in this process."""
        if self.patience is None:
            return list(points)
        short = [(m := self.missions[point]).replace(end=m.start + 2.0 * m.dt) for point in points]
        played, package = group_points([m.ending_by_time() for m in short], self.plugin_files)
        seed = self.plan.first_seed
        runs = [BatchRun(point, t.group, seed, t.params) for point, t in zip(points, played, strict=True)]
        messages = Processes(1, 1).play(replace(package, run_timeout=self.patience), runs)
        late = {m.number for m in messages if isinstance(m, Finished) and m.error.startswith(OVERDUE)}
        return [point for point in points if point not in late]

    @cached_property
    def code(self) -> dict[str, str]:
        """Hashes of the code of plugin classes that neither tussle nor a plugin file has."""
        return plugin_code(self.missions)

    @cached_property
    def fingerprint(self) -> str:
        """Hash of all that the runs depend on, without their number."""
        if self.loaded is None:
            sources = [exactly(mission) for mission in self.missions]
        else:
            of_all = set(self.loaded.files)  # they are in its text
            sources = [
                self.loaded.text,
                *(data.hex() for file, data in self._files.items() if file not in of_all),
            ]
        parts = [
            *sources,
            *(text for file in self.plugin_files for text in file.texts.values()),
            json.dumps([self._settings(p) for p in self.plan.points], default=str),
            repr((self.plan.first_seed, self.plan.independent, self._ends_by_time, versions()["tussle"])),
            *(f"{name} {text}" for name, text in self.code.items()),
        ]
        return hashlib.blake2b("\0".join(parts).encode(), digest_size=16).hexdigest()

    def mission_files(self) -> dict[str, bytes]:
        """The files of the mission, with which each run can be played again: path in one folder -> content.

        Files on a search path are left out: they are found there again.
        """
        if self.loaded is None:
            return {}
        home = real_path(self.loaded.path.parent)
        inside = {real_path(file): data for file, data in self._files.items()}
        found = {
            str(file.relative_to(home)): data for file, data in inside.items() if file.is_relative_to(home)
        }
        return found | {
            f"{PLUGINS}/{i}/{name}": text.encode()  # a folder each, as two files may have one name
            for i, file in enumerate(self.plugin_files)
            for name, text in file.texts.items()
        }

    @property
    def name(self) -> str:
        """Short name of the mission."""
        if self.loaded is not None:
            return self.loaded.path.stem
        return self.mission.name or "mission"

    @property
    def team_names(self) -> dict[int, str]:
        """Team -> names of its blocks."""
        teams: dict[int, list[str]] = {}
        for block in self.mission.blocks:
            teams.setdefault(block.team, []).append(block.name)
        return {team: ", ".join(names) for team, names in sorted(teams.items())}

    @property
    def team_colours(self) -> dict[int, str]:
        """Team -> its colour, "#rrggbb"."""
        viewer = {} if self.loaded is None else self.loaded.viewer.get("entities", {})
        return team_colours((b.team, viewer.get(b.name, {}).get("color")) for b in self.mission.blocks)

    def info(self) -> dict[str, Any]:
        """The entries of `batch.json` that describe the plan."""
        mission = self.mission
        return {
            "format": 1,
            "tussle": versions()["tussle"],
            "name": mission.name or self.name,
            "fingerprint": self.fingerprint,
            "code": self.code,
            "mission": {"made_in": "python"}
            if self.loaded is None
            else {
                "made_in": "file",
                "file": self.loaded.path.name,
                "settings": self.loaded.settings,
                "ends_by_time": self._ends_by_time,
                "plugin_files": [f"{i}/{file.name}" for i, file in enumerate(self.plugin_files)],
                "options": {k: v for k, v in self.reading.items() if k != "plugin_files"},
                "notes": list(self.loaded.game_notes),
            },
            "variables": [variable_entry(v) for v in self.variables],
            "sample": self.sample,
            "sample_seed": self.sample_seed,
            "n_points": self.plan.n_points,
            "n_seeds": self.plan.n_seeds,
            "first_seed": self.plan.first_seed,
            "independent": self.plan.independent,
            "n_runs": self.plan.n_runs,
            "n_groups": len(self.package.missions),
            "teams": self.team_names,
            "colours": self.team_colours,
            "dt": mission.dt,
            "start": mission.start,
            "end": mission.end,
        }

    # -- playing ------------------------------------------------------------------------------------------------------------

    def default_directory(self) -> Path:
        """The directory where none is given: the same for the same batch, so that the same command goes on with it."""
        plain = re.sub(r"[^A-Za-z0-9_.-]+", "_", self.name).strip("._") or "mission"
        return Path("batches") / f"{plain[:80]}-{self.fingerprint[:8]}"

    def is_played_in(self, directory: str | Path, until: Rule | None = None) -> bool:
        """Return True if a directory has all runs of the batch.

        Raises:
            BatchError: The directory holds another batch, or cannot be read.
        """
        from tussle.batch.runner import is_played

        return is_played(self, Path(directory), until)

    def executor(
        self, processes: int | None = None, stack: int | None = None, n_runs: int | None = None
    ) -> Executor:
        """The fastest executor of this machine: this process for short batches, else one process per core.

        Args:
            processes: Number of processes; None chooses.
            stack: Worlds side by side in each; None chooses by the mission.
            n_runs: Number of runs to play; None for all.

        Raises:
            TussleError: The mission cannot be played.
        """
        pool = Processes(processes, stack)
        if processes is None:
            self.check()
            n_runs = self.plan.n_runs if n_runs is None else n_runs
            n_worth = math.ceil(n_runs * (self._game_s or 0.0) / WORTH_A_PROCESS)
            pool.n = max(1, min(pool.n, n_runs, n_worth))
        return InProcess(stack) if pool.n == 1 else pool

    def play(
        self,
        directory: str | Path | None = None,
        executor: Executor | None = None,
        *,
        until: str | Until | None = None,
        target: str | Target | None = None,
        over: str | None = None,
        command: Sequence[str] | None = None,
        on_progress: Callable[[Progress], None] | None = None,
    ) -> Results:
        """Play all runs that are not finished yet.

        Args:
            directory: Batch directory, which gets results as runs finish; None keeps all in memory.
            executor: Who plays; None chooses, see `executor`.
            until: Stop when the interval of a result is narrow enough, such as "score[2]:0.5"; see `Until` and `Width`.
            target: Play what it takes to find the smallest value that reaches a target, such as "Guard.share >= 0.95"; see `Question`.
            over: Name of the variable whose smallest value the target needs; None for the first range, or the first choice of numbers.
            command: The command that `batch.json` names.
            on_progress: Called after each finished run, and several times a second; None shows a bar in notebooks.

        Returns:
            The results.

        Raises:
            TussleError: The mission cannot be played.
            BatchError: The directory holds another batch, or another process plays it.
            RecordError: The directory cannot be written.
            ParameterError: `until` or `target` is written otherwise, or games have no such quantity.
        """
        from tussle.batch.runner import play_in_directory, play_in_memory
        from tussle.batch.sequential import rule_of

        rule = rule_of(until, target, over)
        with notebook_bar(self.name) as show:
            if show is not None and on_progress is None:
                on_progress = partial(_show_runs, show, rule is None)
            if directory is None:
                return play_in_memory(self, executor, rule, on_progress)
            return play_in_directory(
                self, Path(directory), executor, rule, list(command or sys.argv), on_progress
            )


def _show_runs(show: Show, is_whole: bool, progress: Progress) -> None:
    """Show progress in a notebook; where a rule ends the batch early, it is not known how many runs there will be."""
    failed = f", {progress.n_failed} failed" if progress.n_failed else ""
    show(progress.n_done + progress.under_way, progress.n_runs if is_whole else math.inf, f"runs{failed}")


def check_quantity(
    missions: Sequence[Mission], seed: int, patience: float | None, find: Callable[[Results], object]
) -> None:
    """Look for a quantity in a game of each mission, until one has it: after its first step, else at its end.

    Args:
        missions: The missions.
        seed: Of the games.
        patience: Wall time that a game may take [s]; None for no limit.
        find: Looks for the quantity in the results of a game.

    Raises:
        ParameterError: As `find` raises it for the last game.
    """
    short = [m.replace(end=m.start + m.dt).ending_by_time() for m in missions]
    for i, mission in enumerate((*short, *missions), 1):
        results = Batch(mission, runs=1, first_seed=seed, run_timeout=patience).play(executor=InProcess(1))
        if results.n_failed:
            return  # it shows nothing
        try:
            find(results)
            return
        except ParameterError:
            if i == 2 * len(missions):
                raise
