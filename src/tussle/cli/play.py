"""`tussle run`: play, show and record one game."""

from __future__ import annotations

import datetime as dt
import itertools
import re
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from tussle.cli.interrupt import Interrupt
from tussle.cli.progress import ProgressMeter, compiling
from tussle.cli.settings import ending_by_time, read_time
from tussle.cli.summary import Speed, show_summary
from tussle.cli.terminal import say, say_note
from tussle.engine.simulation import Simulation
from tussle.errors import MissionError, ParameterError, RecordError, WiringError
from tussle.mission import Loaded, Mission, read_mission

if TYPE_CHECKING:
    from tussle.record import Recorder

NAP = 0.05  # [s] longest sleep of a paced run, so that Ctrl-C is handled in time

FOR_VIEWER = ": kept for the viewer: "


@dataclass(frozen=True)
class Source:
    """A mission and its settings; the options shared by run, check and describe.

    Attributes:
        mission: A file, or the name of a built-in mission.
        settings: Values of variables ${name=default}, and of any path.
        seed: Replaces the seed of the mission.
        end: End time, in addition to the other end conditions.
        strict: Treat unknown tags and attributes as errors.
        plugin_files: Python files with plugins.
        allow_large: Lift the limits on the size of the mission.
    """

    mission: str
    settings: dict[str, str]
    seed: int | None = None
    end: str | None = None
    strict: bool = False
    plugin_files: Sequence[Path] = ()
    allow_large: bool = False

    def read(self, tells_all: bool = True) -> tuple[Loaded, Mission, int]:
        """Return the file as read, the mission, and the seed. Without `tells_all`, notes on viewer settings are omitted."""
        loaded = read_mission(
            self.mission,
            self.given,
            strict=self.strict,
            plugin_files=tuple(self.plugin_files),
            allow_large=self.allow_large,
        )
        for note in loaded.notes:
            if tells_all or FOR_VIEWER not in note:
                say_note(note)
        seed = self.seed if self.seed is not None else loaded.seed if loaded.seed is not None else 1
        return loaded, loaded.mission if self.end is None else ending_by_time(loaded.mission), seed

    @property
    def given(self) -> dict[str, Any]:
        """All settings, including the end time."""
        return self.settings | ({} if self.end is None else {"run.end": read_time("--end", self.end)})

    def ended(self, state_hash: str) -> None:
        """Do nothing: any end is accepted."""


def simulate(loaded: Loaded, mission: Mission, seed: int, **more: Any) -> Simulation:
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


@dataclass(frozen=True)
class Record:
    """Recording options: run directory, whether to record, and period [s]."""

    directory: Path | None = None
    is_on: bool = True
    period: float | None = None


class Game(Protocol):
    """A game to play: a mission with settings, or a run of a batch."""

    def read(self, tells_all: bool = True) -> tuple[Loaded, Mission, int]:
        """Return the file as read, the mission, and the seed."""

    def ended(self, state_hash: str) -> None:
        """Called when the game has ended."""


def play(source: Game, record: Record, pace: float | None, start_from: Path | None) -> int:
    """Play a game and show its result.

    Returns:
        The exit code.

    Raises:
        PluginError: A plugin failed. The game up to the failure is recorded and shown.
    """
    began = time.perf_counter()
    loaded, mission, seed = source.read(tells_all=False)
    more: dict[str, Any] = {}
    if start_from is not None:
        from tussle.record import read_table

        more["start_from"] = read_table(start_from)
    with ExitStack() as stack:
        with compiling():
            simulation = stack.enter_context(simulate(loaded, mission, seed, **more))
            interrupt = stack.enter_context(Interrupt())
            recorder = _recorder(simulation, record, loaded, seed) if record.is_on else None
            simulation.step()  # loads or compiles kernels, so it counts as preparation
        speed = Speed(began)
        _run(simulation, loaded.path.stem, speed, pace, interrupt)
        error = simulation.result()[0].error
        if recorder is not None:
            recorder.close(str(error) if error else "interrupted" if interrupt.code else "")
        show_summary(simulation, loaded.path.stem, speed, recorder.directory if recorder else None)
        if simulation.is_over and start_from is None:
            source.ended(simulation.state_hash())
    if error is not None:
        raise error
    if interrupt.code:
        files = ", and all files were written" if recorder else ""
        say("interrupted", f"the current step was finished{files}", "bold yellow")
    return interrupt.code


def _run(simulation: Simulation, name: str, speed: Speed, pace: float | None, interrupt: Interrupt) -> None:
    """Play to the end, or until an interrupt."""
    start = float(simulation.t[0])
    speed.begin(start)
    end = simulation.mission.end if "time" in simulation.mission.end_conditions else None

    with ProgressMeter(name, "s", start, "× real time") as meter:

        def is_enough(s: Simulation) -> bool:
            t = float(s.t[0])
            meter.show(t, end)
            if pace is not None:
                _wait(speed.wall_began + (t - start) / pace, lambda: meter.show(t, end), interrupt)
            return bool(interrupt.code)

        simulation.run_until(is_enough)
    speed.end(float(simulation.t[0]))


def _wait(until: float, show: Callable[[], None], interrupt: Interrupt) -> None:
    """Sleep until a time of `time.perf_counter` to keep the pace, and show the progress meanwhile."""
    while (left := until - time.perf_counter()) > 0.0 and not interrupt.code:
        time.sleep(min(left, NAP))
        show()


def _recorder(simulation: Simulation, record: Record, loaded: Loaded, seed: int) -> Recorder:
    from tussle.record import Recorder

    directory = record.directory or _new_directory(loaded.path.stem, seed)
    return Recorder(
        simulation, directory, period=record.period, mission_text=loaded.text, parameters=loaded.settings
    )


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
