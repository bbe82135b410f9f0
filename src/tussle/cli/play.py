"""`tussle run` and `tussle check`: build, play, show and record one game."""

from __future__ import annotations

import datetime as dt
import itertools
import math
import re
import shlex
import sys
import time
from collections import Counter
from contextlib import ExitStack, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from tussle import documents
from tussle.cli.interrupt import Interrupt
from tussle.cli.options import MissionOptions
from tussle.cli.play_options import ConvertOptions, RunOptions, ViewOptions
from tussle.cli.progress import ProgressMeter, compiling
from tussle.cli.summary import Speed, show_summary
from tussle.cli.tables import text_table
from tussle.cli.terminal import OK, WRONG_INPUT, out, say, say_error, say_note
from tussle.declare.displays import counted
from tussle.engine.simulation import Simulation
from tussle.errors import BatchError, MissionError, ParameterError, RecordError, TussleError, WiringError
from tussle.folders import whole_file
from tussle.mission import Loaded, Mission, to_python, to_xml
from tussle.pacing import Pace
from tussle.plugins import stock
from tussle.record.plugin_columns import select
from tussle.record.schema import MISSION_FILE, RUN_FILE, TRAJECTORY_FILE

if TYPE_CHECKING:
    from tussle.batch.reload import PlannedRun
    from tussle.batch.trust import DirectoryCode
    from tussle.record import Recorder

SEARCHED = 10_000
"""Number of bytes at the beginning of a file in which the root tag is searched."""
STATES = {"plays": "can be played", "waits": "wait for a program or a device", "refused": "are refused"}


def simulate(loaded: Loaded, mission: Mission, seed: int | range, **more: Any) -> Simulation:
    """Build the simulation of a mission.

    Raises:
        TussleError: The mission cannot be played. If the message names a block, it starts with file and line.
    """
    try:
        return Simulation(mission, seed, on_error="record", **more)
    except (MissionError, ParameterError, WiringError) as error:
        block = re.match(r"block '([^']*)'", str(error))
        place = loaded.places.get(block[1]) if block else None
        raise type(error)(f"{place or loaded.path}: {error}") from error


def record(
    simulation: Simulation,
    directory: Path,
    loaded: Loaded,
    period: float | None = None,
    shapes: bool = False,
    columns: str | None = None,
    results: bool = False,
) -> Recorder:
    """Return a recorder of a simulation.

    Raises:
        RecordError: The directory cannot be written.
        ParameterError: A column does not exist.
    """
    from tussle.record import Recorder

    if loaded.plugin_files:
        from tussle.batch.trust import remember

        remember(loaded.plugin_files)
    return Recorder(
        simulation, directory, period=period, mission_text=loaded.text, parameters=loaded.settings, shapes=shapes,
        columns=columns or (), results=results, scene_files=loaded.scene_files, mission_notes=loaded.game_notes,
        plugin_files=loaded.plugin_files,
    )  # fmt: skip


def check(options: MissionOptions) -> int:
    """Build the game of a mission and show its size, or of all missions of a folder. Compare a run or batch with its checksums.

    Returns:
        The exit code.
    """
    path = Path(options.mission)
    if any((path / name).exists() for name in ("batch.json", RUN_FILE, TRAJECTORY_FILE)):
        return _check_directory(path)
    if path.is_dir():
        return check_folder(options)
    loaded, mission, seed = options.read(shows_viewer_notes=True)
    with compiling(), simulate(loaded, mission, seed) as simulation:
        n = counted(sum(block.count for block in mission.blocks), "entity", "entities")
        notes = f", {counted(len(loaded.notes), 'note')}" if loaded.notes else ""
        out().print(f"{options.mission} can be played: {n}, grade {simulation.grade}{notes}", soft_wrap=True)
        for needed in awaited(mission):
            out().print(f"it waits for {needed}", soft_wrap=True)
    return OK


def check_folder(options: MissionOptions) -> int:
    """Build the games of all missions of a folder and show which can be played, which wait for what, and which are refused and why.

    Returns:
        The exit code: an error if some are refused.

    Raises:
        MissionError: The folder has no missions.
    """
    files = [path for path in sorted(Path(options.mission).rglob("*.xml")) if is_mission(path)]
    if not files:
        raise MissionError(f"{options.mission} has no mission file, an .xml whose root tag is <runscript>")
    counts, shown = Counter[str](), text_table("mission", "", "waits for, or why it is refused")
    for path in files:
        folders = [*options.data_path, Path(options.mission)]  # missions of a folder may include each other
        state, why = state_of(replace(options, mission=str(path), data_path=folders))
        counts[state] += 1
        shown.add_row(str(path.relative_to(options.mission)), state, why)
    out().print(shown)
    out().print(", ".join(f"{counts[state]} {words}" for state, words in STATES.items()), f"of {len(files)}")
    return WRONG_INPUT if counts["refused"] else OK


def state_of(options: MissionOptions) -> tuple[str, str]:
    """Return a key of STATES for a mission, and what it waits for or why it is refused."""
    try:
        loaded, mission, seed = options.read(shows_notes=False)
        with simulate(loaded, mission, seed):
            needed = "; ".join(awaited(mission))
    except TussleError as error:
        return "refused", str(error).removeprefix(f"{options.mission}:")
    return ("waits", needed) if needed else ("plays", "")


def is_mission(path: Path) -> bool:
    """Return whether a file seems to be a mission, by its beginning."""
    try:
        return b"<runscript" in documents.read_bytes(path, MissionError)[:SEARCHED]
    except MissionError:  # no regular file, or one that is too large
        return False


def awaited(mission: Mission) -> list[str]:
    """The programs and devices outside of tussle that a mission needs."""
    plugins = (each for plugin in mission.plugins for each in plugin.walk())
    return list(dict.fromkeys(filter(None, (plugin.awaited for plugin in plugins))))


def _check_directory(path: Path) -> int:
    from tussle.batch.damage import damage_in_batch
    from tussle.record.damage import damage_in_run

    damage, unchecked = (damage_in_batch if (path / "batch.json").exists() else damage_in_run)(path)
    for line in unchecked:
        say_note(f"{line}; an older version wrote it")
    for line in damage:
        say_error(f"{path}: {line}")
    if damage:
        return WRONG_INPUT
    is_cut = not any((path / name).exists() for name in ("batch.json", RUN_FILE))
    more = f" as far as it goes: it has no {RUN_FILE}, since the run was killed or goes on" if is_cut else ""
    out().print(f"{path} is intact{more}", soft_wrap=True)
    return OK


def convert(options: ConvertOptions) -> None:
    """Write a mission as a mission file or as Python code.

    Raises:
        MissionError: The mission cannot be written in this form, or the file exists already or cannot be written.
    """
    loaded, mission, seed = options.read()
    if loaded.viewer:
        say_note(f"{options.to} has no settings of the viewer, such as colours")
    is_code = options.to.suffix == ".py"
    text = (to_python if is_code else to_xml)(mission, seed)
    if options.to.exists():
        raise MissionError(f"{options.to}: exists already; choose another name, or remove it")
    try:
        with whole_file(options.to) as part:
            part.write_text(text, encoding="utf-8")
    except OSError as error:
        raise MissionError(f"{options.to}: cannot be written: {error.strerror or error}") from error
    command = "python" if is_code else "tussle run"
    out().print(f"{options.to} plays the same game: {command} {shlex.quote(str(options.to))}", soft_wrap=True)


def run(options: RunOptions) -> int:
    """Play a game and show its result.

    Returns:
        The exit code.

    Raises:
        PluginError: A plugin failed. The game up to the failure is recorded and shown.
        KeyboardInterrupt: The user left the debugger. The game up to there is recorded.
    """
    began = time.perf_counter()
    planned = None if options.from_batch is None else planned_by(options)
    if planned is None:
        loaded, mission, seed = options.read()
    else:
        loaded, mission, seed = planned.loaded, planned.mission, planned.seed
    more: dict[str, Any] = {}
    if options.start_from is not None:
        from tussle.record import read_table

        more["start_from"] = read_table(options.start_from)
    name, recorder = options.mission if options.mission in stock.examples() else loaded.path.stem, None
    with ExitStack() as stack:
        with compiling():
            simulation = stack.enter_context(simulate(loaded, mission, seed, **more))
            if planned is not None:
                simulation.play_inputs(planned.inputs)
            interrupt = stack.enter_context(Interrupt())
            simulation.state.context.is_interrupted = lambda: bool(interrupt.code)
            if not options.no_log:
                select(
                    mission, options.record_columns or ""
                )  # a wrong name is found before a directory is made
                directory = options.directory or _new_directory(name, seed)
                recorder = record(
                    simulation,
                    directory,
                    loaded,
                    options.log_period,
                    options.shapes,
                    options.record_columns,
                    options.results,
                )
            if recorder is not None:
                stack.push(partial(_close_interrupted, recorder))
            simulation.step()  # loads or compiles kernels, so it counts as preparation
        speed = Speed(began)
        _play(simulation, name, speed, options.pace, interrupt)
        error = simulation.result()[0].error
        if recorder is not None:
            recorder.close(str(error) if error else "interrupted" if interrupt.code else "")
        show_summary(simulation, name, speed, recorder.directory if recorder else None)
        if planned is not None and simulation.is_over and options.start_from is None:
            check_hash(planned, simulation.state_hash(), str(options.from_batch))
            why = f": {planned.interrupted}" if planned.interrupted else ""
            known = (
                f"the end is that of the {planned.origin}: the same state hash"
                if planned.state_hash
                else f"the {planned.origin} has not played it to its end{why}"
            )
            say_note(f"run {options.from_batch}: {known}")
    if error is not None:
        raise error
    if interrupt.code:
        files = ", and all files were written" if recorder else ""
        say("interrupted", f"the current step was finished{files}", "bold yellow")
    return interrupt.code


def _close_interrupted(recorder: Recorder, kind: type[BaseException] | None, *_: object) -> None:
    """Complete the run directory if the user left the debugger."""
    if kind is not None and issubclass(kind, KeyboardInterrupt):
        recorder.close("interrupted")
        say_note(f"the game up to there is in {recorder.directory}")


def _play(simulation: Simulation, name: str, speed: Speed, pace: float | None, interrupt: Interrupt) -> None:
    """Play to the end, or until an interrupt."""
    start = float(simulation.t[0])
    speed.begin(start)
    end = simulation.mission.end if "time" in simulation.mission.end_conditions else None

    clock = Pace(math.inf if pace is None else pace)
    clock.due_in(start, 0.0)
    with ProgressMeter(name, "s", start, "× real time") as meter:

        def is_enough(s: Simulation) -> bool:
            t = float(s.t[0])
            meter.show(t, end)
            clock.hold(t, s.mission.dt, lambda: interrupt.code, lambda: meter.show(t, end))
            return bool(interrupt.code)

        simulation.run_until(is_enough)
    speed.end(float(simulation.t[0]))


def _new_directory(name: str, seed: int) -> Path:
    """Create a new directory runs/NAME-SEED-TIMESTAMP, with a number appended if it exists.

    It is created here because another run may start in the same second.

    Raises:
        RecordError: The directory cannot be created.
    """
    stamp = dt.datetime.now().strftime("%Y%m%d-%H%M%S")  # noqa: DTZ005 - the user's own clock
    plain = re.sub(r"[^A-Za-z0-9_.-]+", "_", name).strip("._") or "mission"
    base = Path("runs") / f"{plain[:80]}-{seed}-{stamp}"
    for number in itertools.count(1):
        path = base if number == 1 else base.with_name(f"{base.name}-{number}")
        try:
            path.mkdir(parents=True)
        except FileExistsError:
            continue
        except OSError as error:
            raise RecordError(f"{path}: no run can be recorded there: {error.strerror or error}") from error
        return path
    raise AssertionError


# -- runs of a batch --------------------------------------------------------------------------------------------------------


def planned_by(options: RunOptions | ViewOptions) -> PlannedRun:
    """Return the run of a batch that `--from DIR:417` names, or the run of a run directory.

    Raises:
        ParameterError: The text has another form.
        BatchError: The batch cannot be read, or its plugin code may not run.
    """
    from tussle.batch.reload import planned_run, recorded_run

    def may_run(code: DirectoryCode) -> bool:
        return _may_run(code, options.trust)

    text = options.from_batch or ""
    directory, colon, number = text.rpartition(":")
    for run, world in ((text, "0"), (directory, number)):
        if run and documents.is_count(world) and (Path(run) / MISSION_FILE).exists():
            return recorded_run(
                Path(run),
                int(world),
                may_run=may_run,
                allow_large=options.allow_large,
                search=options.data_path,
            )
        if run and documents.is_count(world) and (Path(run) / RUN_FILE).exists():
            raise ParameterError(
                f"--from {run!r}: the run has no {MISSION_FILE}: its mission was made in Python, where Simulation(mission, seed) plays it "
                "again, with play_inputs(load_inputs(directory)) for what came from outside"
            )
    if not colon or not documents.is_count(number):
        raise ParameterError(
            f"--from {options.from_batch!r} is not allowed; it takes a batch directory and the number of a run, "
            "DIR:417, or a run directory"
        )
    return planned_run(
        Path(directory),
        int(number),
        may_run=may_run,
        allow_large=options.allow_large,
        search=options.data_path,
    )


def _may_run(code: DirectoryCode, is_trusted: bool) -> bool:
    """Return True if plugin code of a batch directory may run: the user's own, and other code if the user says so."""
    if code.is_own:
        return True
    is_asked = not is_trusted and sys.stdin.isatty() and sys.stderr.isatty()
    if is_trusted or is_asked:
        say_note(f"plugin code of {code.path}, which is not known to be yours, has all your rights: {code}")
    if is_asked:
        with suppress(typer.Abort):  # no answer
            return typer.confirm("Run it?", err=True)
    return is_trusted


def check_hash(planned: PlannedRun, state_hash: str, name: str) -> None:
    """Compare the end of a run with its end in the batch or recording.

    Raises:
        BatchError: The state hashes differ.
    """
    if planned.state_hash and state_hash != planned.state_hash:
        raise BatchError(
            f"run {name} ended otherwise than in its {planned.origin}: state hash {state_hash}, in the {planned.origin} "
            f"{planned.state_hash}; "
            "the version of tussle or of a plugin differs, or a plugin is not deterministic"
        )
