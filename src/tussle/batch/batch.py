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
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tussle.batch.executors import OVERDUE, Executor, InProcess, Processes
from tussle.batch.plan import Plan
from tussle.batch.points import settings_of, variables_of
from tussle.batch.sampling import method_for
from tussle.batch.sampling import sample as sample_points
from tussle.batch.store import PLUGINS
from tussle.batch.tasks import Finished, Run
from tussle.batch.treatments import Treatment, build_points, exactly, group_points, read_points
from tussle.batch.variables import Variable
from tussle.batch.varied import about, as_variables
from tussle.engine.simulation import Simulation
from tussle.errors import BatchError, ParameterError, PluginError
from tussle.mission import Loaded, Mission, PluginFile, read_mission
from tussle.record.run_file import versions

if TYPE_CHECKING:
    from tussle.batch.progress import Progress
    from tussle.batch.results import Results
    from tussle.batch.until import Until

MOST_CHECKED = 16
"""Groups whose game is begun before the batch, to tell what is wrong with it at once."""

WORTH_A_PROCESS = 4.0
"""Seconds of games, as one alone takes them, that are worth a process: it starts in one, and games side by side take a third and less."""

STARTS_WITHIN = 120.0
"""Time that the first steps of a game may take beside that of a run [s]: kernels may have to be compiled."""

MOST_UNASKED = (100_000, 1_000_000)
"""Seeds and runs of a batch that stops by what it finds, where nobody says how many are too many."""


class Batch:
    """One mission, played with many seeds and values.

    Args:
        mission: A mission file, the name of one that ships, a `Mission`, or a function of the varied values that makes one.
        runs: Games of each point, that is of each set of varied values; None is as many as it takes to stop by what is found, see `play`.
        vary: What varies: texts as on the command line ("prey_speed=20:30"), variables, or a dict by name of (low, high), lists and
            texts ("20:30:log").
        sample: How points are chosen: lhs, sobol, saltelli, grid, list, product; "" chooses by what varies.
        samples: How many points; None is the method's default.
        points: The points themselves, instead of `vary`.
        sample_seed: Seed of the sampling.
        first_seed: Seeds of the games count up from here.
        independent: Each game has a seed of its own; otherwise all points meet the same seeds (common random numbers).
        settings: Values that are set in all points, as for `read_mission` or by path.
        plugin_files: Python files whose plugins the mission file may name.
        ends_by_time: The game ends at its end time whatever the mission says.
        run_timeout: Wall time that a game may take [s]; one that takes longer is given up, and recorded as failed. Worlds of a stack share
            its time. It holds on this machine only, and all games are played in processes of their own.
        options: Further options of `read_mission`.

    Raises:
        ParameterError: A variable or a number is not allowed.
        MissionError: The mission cannot be played at one of the points.
    """

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
        if run_timeout is not None and not 0.0 < run_timeout < math.inf:
            raise ParameterError(
                f"run_timeout = {run_timeout!r} is not allowed; it takes a number of seconds > 0"
            )
        self.source = mission
        self.settings = dict(settings or {})
        self.plugin_files = tuple(PluginFile.of(p) for p in plugin_files)
        for file in self.plugin_files:
            file.load()
        self.variables = as_variables(vary)
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
        self.plan = Plan(chosen, _most_seeds(len(chosen)) if runs is None else runs, first_seed, independent)
        self._options = {**options, "plugin_files": tuple(plugin_files)}
        self._ends_by_time = ends_by_time
        self._is_checked = False
        self._game_s = 0.0  # that a game takes, by its second step
        self._rules: set[str] = set()  # that have been checked
        self.loaded = self._read()
        self.missions = list(self._missions(self.plan.points))
        self.treatments, package = group_points(self.missions, self.plugin_files)
        self.package = replace(package, run_timeout=run_timeout)

    def _read(self) -> Loaded | None:
        """The mission file as it stands without any varied value; None for a mission made in Python."""
        if not isinstance(self.source, (str, Path)):
            return None
        return read_mission(self.source, self.settings, **self._options)

    def _missions(self, points: Sequence[Mapping[str, Any]]) -> Iterator[Mission]:
        """The mission of each point; the files that they are read from are noted."""
        self._files: dict[Path, bytes] = {}
        if isinstance(self.source, (str, Path)):
            for loaded in read_points(
                self.source, self.settings, map(self._settings, points), **self._options
            ):
                for file in loaded.files:
                    if file not in self._files:
                        self._files[file] = file.read_bytes()
                yield self._ended(loaded.mission)
        else:
            for mission in build_points(self.source, self.settings, map(self._settings, points)):
                yield self._ended(mission)

    def _settings(self, point: Mapping[str, Any]) -> dict[str, Any]:
        return settings_of(point, self.variables, is_argument=callable(self.source))

    def _ended(self, mission: Mission) -> Mission:
        return mission.ending_by_time() if self._ends_by_time else mission

    # -- what is played -----------------------------------------------------------------------------------------------------

    @property
    def mission(self) -> Mission:
        """The mission at the first point."""
        return self.missions[0]

    def run(self, number: int) -> Run:
        """A run as it is handed to those who play."""
        treatment: Treatment = self.treatments[self.plan.point(number)]
        return Run(number, treatment.group, self.plan.seed(number), treatment.params)

    def simulation(self, number: int) -> Simulation:
        """The game of one run, alone, before its first step.

        Raises:
            BatchError: There is no such run.
        """
        if not 0 <= number < self.plan.n_runs:
            raise BatchError(f"there is no run {number}; the batch has runs 0 to {self.plan.n_runs - 1}")
        return Simulation(self.missions[self.plan.point(number)], self.plan.seed(number), on_error="record")

    def check(self, until: Until | None = None) -> None:
        """Begin a game of each group, up to some number, and make its first step: what is wrong with it shows at once.

        What fails in a plugin is no matter of this: it may come from the seed, and is the result of its run.

        Args:
            until: When it is to be enough; games must have the result that this is about.

        Raises:
            TussleError: A mission cannot be played.
            ParameterError: No game has that result.
        """
        first = {t.group: point for point, t in reversed(list(enumerate(self.treatments)))}
        points = sorted(first.values())[:MOST_CHECKED]
        if not self._is_checked:
            for point in self._that_begin(points):
                with suppress(PluginError, SystemExit), self.simulation(point) as simulation:
                    simulation.step()  # loads or compiles what it needs
                    began = time.perf_counter()
                    simulation.step()
                    game_s = (time.perf_counter() - began) * self.missions[point].steps
                    self._game_s = max(self._game_s, game_s)
            self._is_checked = True
        if until is not None and str(until) not in self._rules:
            _check_rule(
                until, [self.missions[point] for point in points], self.plan.first_seed, self.patience
            )
            self._rules.add(str(until))

    @property
    def patience(self) -> float | None:
        """Wall time that a game may take before the batch [s]."""
        limit = self.package.run_timeout
        return None if limit is None else STARTS_WITHIN + limit

    def _that_begin(self, points: Sequence[int]) -> list[int]:
        """Those points whose game makes its first steps in time: where there is a limit, others are not begun in this process."""
        if self.patience is None:
            return list(points)
        short = [(m := self.missions[point]).replace(end=m.start + 2.0 * m.dt) for point in points]
        treatments, package = group_points([m.ending_by_time() for m in short], self.plugin_files)
        seed = self.plan.first_seed
        runs = [Run(point, t.group, seed, t.params) for point, t in zip(points, treatments, strict=True)]
        played = Processes(1, 1).play(replace(package, run_timeout=self.patience), runs)
        late = {f.number for f in played if isinstance(f, Finished) and f.error.startswith(OVERDUE)}
        return [point for point in points if point not in late]

    @cached_property
    def fingerprint(self) -> str:
        """Hash of all that the runs depend on, but for how many there are."""
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
        ]
        return hashlib.blake2b("\0".join(parts).encode(), digest_size=16).hexdigest()

    def mission_files(self) -> dict[str, bytes]:
        """The mission and all that it is made of, so that each run can be played again: path in one folder -> content.

        What lies elsewhere, on a search path, is not among them: it is found there again.
        """
        if self.loaded is None:
            return {}
        home = self.loaded.path.parent.resolve()
        inside = {file.resolve(): data for file, data in self._files.items()}
        found = {
            str(file.relative_to(home)): data for file, data in inside.items() if file.is_relative_to(home)
        }
        return found | {
            f"{PLUGINS}/{i}/{name}": text.encode()
            for i, file in enumerate(self.plugin_files)
            for name, text in file.texts.items()
        }

    def _plugin_names(self) -> list[str]:
        """Each plugin file with its neighbours in a folder of its own, since two may be called alike."""
        return [f"{i}/{file.name}" for i, file in enumerate(self.plugin_files)]

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

    def info(self) -> dict[str, Any]:
        """What `batch.json` says of the plan."""
        mission = self.mission
        return {
            "format": 1,
            "tussle": versions()["tussle"],
            "name": mission.name or self.name,
            "fingerprint": self.fingerprint,
            "mission": self._about_mission(),
            "variables": [about(v) for v in self.variables],
            "sample": self.sample,
            "sample_seed": self.sample_seed,
            "n_points": self.plan.n_points,
            "n_seeds": self.plan.n_seeds,
            "first_seed": self.plan.first_seed,
            "independent": self.plan.independent,
            "n_runs": self.plan.n_runs,
            "n_groups": len(self.package.missions),
            "teams": self.team_names,
            "dt": mission.dt,
            "start": mission.start,
            "end": mission.end,
        }

    def _about_mission(self) -> dict[str, Any]:
        if self.loaded is None:
            return {"made_in": "python"}
        return {
            "made_in": "file",
            "file": self.loaded.path.name,
            "settings": self.loaded.settings,
            "ends_by_time": self._ends_by_time,
            "plugin_files": self._plugin_names(),
            "options": {k: v for k, v in self._options.items() if k != "plugin_files"},
        }

    # -- playing ------------------------------------------------------------------------------------------------------------

    def default_directory(self) -> Path:
        """Where the batch goes unless told otherwise: the same for the same batch, so that the same command goes on with it."""
        plain = re.sub(r"[^A-Za-z0-9_.-]+", "_", self.name).strip("._") or "mission"
        return Path("batches") / f"{plain[:80]}-{self.fingerprint[:8]}"

    def is_played_in(self, directory: str | Path, until: Until | None = None) -> bool:
        """All of it is in a directory already.

        Raises:
            BatchError: The directory holds another batch, or one that cannot be read.
        """
        from tussle.batch.course import is_played

        return is_played(self, Path(directory), until)

    def executor(
        self, processes: int | None = None, stack: int | None = None, n_runs: int | None = None
    ) -> Executor:
        """Who plays best on this machine: this process where there is little to do, else one process per core.

        Args:
            processes: How many, whatever there is to do.
            stack: Worlds side by side in each.
            n_runs: How many there are to play; by default all.

        Raises:
            TussleError: The mission cannot be played.
        """
        pool = Processes(processes, stack)
        if processes is None:
            self.check()
            n_runs = self.plan.n_runs if n_runs is None else n_runs
            n_worth = math.ceil(n_runs * self._game_s / WORTH_A_PROCESS)
            pool.n = max(1, min(pool.n, n_runs, n_worth))
        return InProcess(stack, is_replaceable=processes is None) if pool.n == 1 else pool

    def play(
        self,
        directory: str | Path | None = None,
        executor: Executor | None = None,
        *,
        until: str | Until | None = None,
        command: Sequence[str] | None = None,
        on_progress: Callable[[Progress], None] | None = None,
    ) -> Results:
        """Play all runs that are not finished yet.

        Args:
            directory: Batch directory, where finished runs are kept at once; None keeps all in memory.
            executor: Who plays; by default all cores of this machine.
            until: Stop when the interval of a result is narrow enough, such as "score[2]:0.5"; see `Until`.
            command: What `batch.json` is to name as the command.
            on_progress: Called after each finished run, and now and then.

        Returns:
            The results.

        Raises:
            TussleError: The mission cannot be played.
            BatchError: The directory holds another batch, or somebody else plays it.
            RecordError: The directory cannot be written.
        """
        from tussle.batch.course import play_in_directory, play_in_memory

        rule = _as_until(until)
        if directory is None:
            return play_in_memory(self, executor, rule, on_progress)
        return play_in_directory(
            self, Path(directory), executor, rule, list(command or sys.argv), on_progress
        )


def _most_seeds(n_points: int) -> int:
    """Seeds of a batch that stops by what it finds."""
    seeds, runs = MOST_UNASKED
    return max(1, min(seeds, runs // n_points))


def _check_rule(until: Until, missions: Sequence[Mission], seed: int, patience: float | None) -> None:
    """See that a game of one of the missions has the result that a rule is about: after its first step, else at its end.

    Raises:
        ParameterError: None has.
    """
    short = [m.replace(end=m.start + m.dt).ending_by_time() for m in missions]
    error = None
    for mission in (*short, *missions):
        results = Batch(mission, runs=1, first_seed=seed, run_timeout=patience).play(executor=InProcess(1))
        if results.n_failed:
            return  # it tells nothing
        try:
            until.is_met([{name: results.quantity(name) for name in results.quantities}])
        except ParameterError as unknown:
            error = unknown
        else:
            return
    assert error is not None
    raise error


def _as_until(until: str | Until | None) -> Until | None:
    if isinstance(until, str):
        from tussle.batch.until import Until

        return Until.parse(until)
    return until
