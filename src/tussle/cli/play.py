"""`tussle run`: one game, played, shown and recorded."""

from __future__ import annotations

import datetime as dt
import itertools
import re
import time
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from tussle.cli.interrupt import Interrupt
from tussle.cli.progress import Meter, compiling
from tussle.cli.settings import ending_by_time, read_time
from tussle.cli.summary import Speed, show_summary
from tussle.cli.terminal import say, say_note
from tussle.engine.simulation import Simulation
from tussle.errors import MissionError, ParameterError, RecordError, WiringError
from tussle.mission import Loaded, Mission, read_mission

if TYPE_CHECKING:
    from tussle.record import Recorder

NAP = 0.05  # [s] longest sleep of a paced run, so that Ctrl-C is heard

FOR_VIEWER = ": kept for the viewer: "


@dataclass(frozen=True)
class Source:
    """Where a mission comes from, and what is set in it; the options that run, check and describe share.

    Attributes:
        mission: A file, or the name of a mission that ships.
        settings: Values of the file's ${name=default}, and of anything by path.
        seed: Instead of the mission's.
        end: Time that ends the game, whatever else does.
        strict: What is unknown is an error.
        plugin_files: Python files with plugins.
        allow_large: Without limits on how much the mission may ask for.
    """

    mission: str
    settings: dict[str, str]
    seed: int | None = None
    end: str | None = None
    strict: bool = False
    plugin_files: Sequence[Path] = ()
    allow_large: bool = False

    def read(self, tells_all: bool = True) -> tuple[Loaded, Mission, int]:
        """The file as read, the mission, and the seed. Without `tells_all`, nothing is said of settings kept for the viewer."""
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
        """All that is set."""
        return self.settings | ({} if self.end is None else {"run.end": read_time("--end", self.end)})

    def ended(self, state_hash: str) -> None:
        """The game has come to its end, whatever it is."""


def simulate(loaded: Loaded, mission: Mission, seed: int, **more: Any) -> Simulation:
    """The game of a mission that was read, before its first step.

    Raises:
        TussleError: It cannot be played; the message begins with file and line where it names a block.
    """
    try:
        return Simulation(mission, seed, on_error="record", **more)
    except (MissionError, ParameterError, WiringError) as error:
        block = re.match(r"block '([^']*)'", str(error))
        place = loaded.places.get(block[1]) if block else None
        raise type(error)(f"{place or loaded.path}: {error}") from error


@dataclass(frozen=True)
class Record:
    """Where a run is written, and how often."""

    directory: Path | None = None
    is_on: bool = True
    period: float | None = None


class Game(Protocol):
    """What is to be played: a mission with settings, or a run of a batch."""

    def read(self, tells_all: bool = True) -> tuple[Loaded, Mission, int]:
        """The file as read, the mission, and the seed."""

    def ended(self, state_hash: str) -> None:
        """The game has come to its end."""


def play(source: Game, record: Record, pace: float | None, start_from: Path | None) -> int:
    """Play a mission and show what came of it.

    Returns:
        The exit code.

    Raises:
        PluginError: A plugin failed; all until then is recorded and shown.
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
            simulation.step()  # loads or compiles what the game needs, and so counts as preparation
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
        say(
            "interrupted",
            "the step was ended, and all files were written" if recorder else "the step was ended",
            "bold yellow",
        )
    return interrupt.code


def _run(simulation: Simulation, name: str, speed: Speed, pace: float | None, interrupt: Interrupt) -> None:
    """Play on to the end, or until an interrupt."""
    start = float(simulation.t[0])
    speed.begin(start)
    end = simulation.mission.end if "time" in simulation.mission.end_conditions else None

    with Meter(name, start, end) as meter:

        def is_enough(s: Simulation) -> bool:
            t = float(s.t[0])
            meter.show(t)
            if pace is not None:
                _wait(speed.wall_began + (t - start) / pace, meter, t, interrupt)
            return bool(interrupt.code)

        simulation.run_until(is_enough)
    speed.end(float(simulation.t[0]))


def _wait(until: float, meter: Meter, t: float, interrupt: Interrupt) -> None:
    """Sleep until a moment of the wall clock, so that the game keeps its pace; a game that is late is not hurried."""
    while (left := until - time.perf_counter()) > 0.0 and not interrupt.code:
        time.sleep(min(left, NAP))
        meter.show(t)


def _recorder(simulation: Simulation, record: Record, loaded: Loaded, seed: int) -> Recorder:
    from tussle.record import Recorder

    directory = record.directory or _new_directory(loaded.path.stem, seed)
    return Recorder(
        simulation, directory, period=record.period, mission_text=loaded.text, parameters=loaded.settings
    )


def _new_directory(name: str, seed: int) -> Path:
    """A new runs/NAME-SEED-TIMESTAMP, with a number behind it where that is taken; made here, since others may begin in this second.

    Raises:
        RecordError: It cannot be made.
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
