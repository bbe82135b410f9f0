"""Every way to read a directory, tried on damaged ones: a process that works through many and prints what came of each."""

from __future__ import annotations

import contextlib
import faulthandler
import json
import os
import random
import resource
import shutil
import signal
import sys
import time
import traceback
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from unittest import mock

from cli_process import call
from damages import damage, make_bombs

from tussle import Simulation
from tussle.batch import Batch, InProcess, load_batch
from tussle.batch.reload import planned_run
from tussle.batch.search.study_store import load_study
from tussle.cli import terminal
from tussle.errors import MissingExtraError, TussleError
from tussle.mission import read_mission
from tussle.record import Recorder, load_run, read_table
from tussle.view.export.html import write_html
from tussle.view.export.mcap_file import write_mcap
from tussle.view.export.tables import write_tables
from tussle.view.page.recorded import RecordedData
from tussle.view.recording import Recording

SECONDS = 10
BYTES = 1 << 30
MAX_FAULTS = 20
GAME = ("predator_prey", "--set", "prey=6", "--processes", "1")
VARIED = (
    "--vary",
    "prey.Boids.max_speed=10:20:2",
    "--vary",
    "switchers.Predator.allow_prey_switching=true,false",
)
BATCH = ("batch", *GAME, "--end", "2", *VARIED, "-n", "2")
SEARCH = ("optimize", *GAME, "--end", "2", "--objective", "score[2]", *VARIED, "--trials", "4", "--per-round", "2", "-n", "2",
          "--sampler", "random")  # fmt: skip
RUN = ("run", "predator_prey", "--set", "prey=6")
STRESS = ("stress", "predator_prey", "--set", "prey=6", "--end", "2", "--processes", "1", "--spec")
STUDY = (*STRESS, "always (distance(team 1, team 2) > 40 m)", "-n", "6")
HUNT = (*STUDY, "--vary", "prey.Boids.max_speed=10:20", "--sampler", "random")
SPLIT = (
    *STRESS,
    "always (distance(team 1, team 2) > 5 m)",
    "--probability",
    "--particles",
    "4",
    "--repetitions",
    "2",
)
LEAGUE = ("league", "tussle/Battle-v0", "--players", "rules,b=rules", "--games", "2", "--processes", "1")


class TooLong(BaseException):
    """A door has not come back."""


class Fault(Exception):
    """A command has ended in something that is no error of ours."""


def cli(*words: str | Path) -> None:
    """A command, as if typed; its error as it was raised.

    Raises:
        TussleError: That of the command.
    """
    told: list[BaseException] = []
    with mock.patch.object(terminal, "_report", told.append):
        result = call(*words)
    if told:
        raise told[0]
    if result.returncode == terminal.NOT_WRITTEN:  # told by the command itself
        raise TussleError(result.stderr)
    if result.returncode in (terminal.OWN_FAULT, terminal.USAGE):
        raise Fault(f"exit code {result.returncode}: {result.stdout} {result.stderr}")


# -- doors: each opens a directory and looks at all that is behind ----------------------------------------------------------------


def run(path: Path, _: Path) -> None:
    loaded = load_run(path)
    for look in ("trajectory", "events", "summary", "mission"):
        with contextlib.suppress(TussleError):
            getattr(loaded, look)
    assert repr(loaded)


def recording(path: Path, _: Path) -> None:
    recorded = Recording(path, is_mapped=True)
    if not recorded.n_frames:
        return
    served = RecordedData(recorded, is_file=False)
    assert served.document()["nFrames"] == recorded.n_frames
    for name in served.names:
        served.blob(name)
    for look in ("style", "scenery", "events", "notes", "teams", "name"):
        getattr(recorded, look)


def start(path: Path, _: Path) -> None:
    read_table(path)


def csv(path: Path, out: Path) -> None:
    write_tables(path, out / "states.csv", "csv")


def parquet(path: Path, out: Path) -> None:
    write_tables(path, out / "states.parquet", "parquet", world=0)


def html(path: Path, out: Path) -> None:
    write_html(Recording(path), out / "page.html")


def mcap(path: Path, out: Path) -> None:
    write_mcap(Recording(path), out / "run.mcap")


def bag(path: Path, out: Path) -> None:
    cli("export", path, "--rosbag2", out / "bag")


def earth(path: Path, out: Path) -> None:
    cli("export", path, "--geojson", out / "a.geojson", "--kml", out / "a.kml", "--czml", out / "a.czml")


def judged(path: Path, out: Path) -> None:
    cli("export", path, "--html", out / "a.html", "--spec", "always (distance(team 1, team 2) > 1 m)")


def plots(path: Path, out: Path) -> None:
    cli("plot", path, "--out", out / "plots")


def replayed(path: Path, _: Path) -> None:
    with mock.patch("tussle.cli.view.watch", return_value=0):
        cli("replay", path, "--no-browser", "--paused")


def viewed(path: Path, _: Path) -> None:
    with mock.patch("tussle.cli.view.watch", return_value=0):
        cli("view", path / "mission.xml", "--no-browser", "--paused")


def started(path: Path, _: Path) -> None:
    cli(*RUN, "--end", "0.3", "--start-from", path, "--no-log")


def batch(path: Path, _: Path) -> None:
    results = load_batch(path)
    with contextlib.suppress(MissingExtraError):
        results.frame("pandas")
    (
        results.failed(),
        results.slowest(3),
        results.shares_by_point(),
        results.n_runs_by_point(),
        repr(results),
        results.title("t"),
    )
    for name in results.quantities[:3]:
        results.means_by_point(name), results.by_seed(name), results.rank_correlations(name)
    for team in results.teams:
        results.survival(team)
    for point in range(min(5, len(results.points))):
        results.label(point), results.shares(point), results.means(point=point)


def again(path: Path, _: Path) -> None:
    planned_run(path, 3)


def played_again(path: Path, out: Path) -> None:
    cli("run", "--from", f"{path}:3", "--out", out / "run")


def analyzed(path: Path, _: Path) -> None:
    cli("analyze", path)
    cli("analyze", path, "--json")
    cli("analyze", path, "--by-point", "--compare", "0", "1", "--quantity", "t")


def reported(path: Path, out: Path) -> None:
    cli("report", path, "--out", out / "report")


def resumed(path: Path, _: Path) -> None:
    cli(*BATCH, "--out", path)


def logged(path: Path, _: Path) -> None:
    cli(*BATCH, "--out", path, "--record-runs", "0,3")


def search(path: Path, _: Path) -> None:
    study = load_study(path)
    for look in ("ranking", "improvements", "table", "n_points", "objective", "best", "lead", "is_clear"):
        getattr(study, look)
    study.importances()
    for trial in study.trials:
        study.label(trial.values)


def searched(path: Path, _: Path) -> None:
    cli(*SEARCH, "--out", path)


def studied(path: Path, _: Path) -> None:
    cli(*STUDY, "--out", path)


def explained(path: Path, _: Path) -> None:
    cli(*STUDY, "--why", "--out", path)


def hunted(path: Path, _: Path) -> None:
    cli(*HUNT, "--out", path)


def split(path: Path, _: Path) -> None:
    cli(*SPLIT, "--out", path)


def rated(path: Path, _: Path) -> None:
    cli(*LEAGUE, "--out", path)


def wrong(path: Path, _: Path) -> None:
    """The commands of another kind of directory."""
    for command in (
        ("analyze", path),
        ("report", path),
        ("plot", path),
        ("run", "--from", f"{path}:0"),
        (*RUN, "--start-from", path),
    ):
        with contextlib.suppress(TussleError):
            cli(*command)


Door = Callable[[Path, Path], None]
DOORS: dict[str, tuple[tuple[Door, float], ...]] = {
    "run": ((run, 1), (recording, 1), (start, 0.5), (csv, 0.25), (parquet, 0.1), (html, 0.08), (mcap, 0.08),
    (replayed, 0.03), (viewed, 0.01),
            (started, 0.05), (plots, 0.005), (bag, 0.03), (earth, 0.03), (judged, 0.03)),
    "batch": ((batch, 1), (again, 0.25), (resumed, 0.04), (analyzed, 0.05), (reported, 0.03), (played_again, 0.03), (logged, 0.03)),
    "cut": ((batch, 1), (again, 0.25), (resumed, 0.04), (analyzed, 0.02)),
    "search": ((search, 1), (searched, 0.06)),
    "study": ((studied, 1), (explained, 0.05)),
    "hunt": ((hunted, 1),),
    "split": ((split, 1),),
    "league": ((rated, 1),),
}  # fmt: skip
"""Ways to read each kind of directory, and how often each is tried."""
OFTEN = ("run", "batch", "cut", "search")
"""Kinds that are tried five times as often as the others, which play games."""


# -- what is damaged ----------------------------------------------------------------------------------------------------------------


def make(root: Path) -> None:
    """A directory of each kind: a run of two worlds, a batch, one that was stopped, a search, studies of stress, and a league."""
    loaded = read_mission("predator_prey", {"prey": "6", "run.end": "3"})
    with Simulation(loaded.mission, seeds=[1, 2]) as simulation:
        with Recorder(simulation, root / "run", mission_text=loaded.text) as recorder:
            simulation.run()
        assert recorder.directory.is_dir()
    cli(*BATCH, "--out", root / "batch")
    with contextlib.suppress(Stopped):
        Batch("predator_prey", vary=VARIED[1::2], runs=2, settings={"prey": 6, "run.end": "2.0"}, ends_by_time=True, strict=False,
              allow_large=False).play(root / "cut", InProcess(2), on_progress=_stop)  # fmt: skip
    assert list((root / "cut" / "parts").iterdir())
    for words, name in (
        (SEARCH, "search"),
        (STUDY, "study"),
        (HUNT, "hunt"),
        (SPLIT, "split"),
        (LEAGUE, "league"),
    ):
        cli(*words, "--out", root / name)
    make_bombs(root, root / "bombs")


class Stopped(Exception):
    """Enough has been played."""


def _stop(progress: Any) -> None:
    if progress.n_done >= 4:
        raise Stopped


# -- watch ------------------------------------------------------------------------------------------------------------------------


@contextlib.contextmanager
def watched() -> Iterator[None]:
    """Not longer than allowed: of CPU time, and of wall time some times as much, since others work here too."""

    def ring(*_: Any) -> None:
        raise TooLong

    signal.signal(signal.SIGPROF, ring)
    signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_PROF, SECONDS)
    signal.setitimer(signal.ITIMER_REAL, 12 * SECONDS)
    faulthandler.dump_traceback_later(24 * SECONDS, exit=True)  # what no signal wakes
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.setitimer(signal.ITIMER_REAL, 0)
        faulthandler.cancel_dump_traceback_later()


def opened(door: Door, path: Path, out: Path) -> str:
    """What came of it: "" for nothing to say, the message of our error, or beginning with FAULT what is wrong."""
    try:
        with watched():
            door(path, out)
    except TussleError as error:
        said = str(error)
        return said if str(path)[:50] in said else f"FAULT the message does not say where: {said}"
    except TooLong:
        return f"FAULT longer than {SECONDS} s\n{traceback.format_exc(limit=-4)}"
    except BaseException:  # noqa: BLE001  whatever it is, it is told
        return f"FAULT\n{traceback.format_exc(limit=-6)}"
    return ""


def bound_memory() -> None:
    """So much more than now, and no more."""
    now = int(Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    resource.setrlimit(resource.RLIMIT_AS, (now + BYTES, now + BYTES))


def main(sources: Path, work: Path, first: int, last: int) -> None:
    """Work through the numbers from `first` to `last`."""
    warnings.simplefilter("ignore")
    if not sources.exists():
        make(sources)
    kinds = sorted(DOORS)
    turns = [*OFTEN * 4, *kinds]
    for kind in kinds:  # what a door loads and compiles is not its directory's fault
        for door, _ in DOORS[kind]:
            copied, out = work / "warm", work / "out"
            shutil.copytree(sources / kind, copied)
            out.mkdir()
            said = opened(door, copied, out)
            assert not said, f"{kind} {door.__name__}: {said}"
            shutil.rmtree(copied)
            shutil.rmtree(out)
    bound_memory()
    n_faults = 0
    for number in range(first, last):
        if n_faults > MAX_FAULTS:
            break
        kind = turns[number % len(turns)]
        rng = random.Random(number)
        path, out = work / f"{kind}{number}", work / "out"
        said = damage(rng, sources / kind, path)
        for door, how_often in DOORS[kind]:
            if rng.random() >= how_often:
                continue
            out.mkdir()
            began = time.process_time()
            answer = opened(door, path, out)
            n_faults += answer.startswith("FAULT")
            spent = round(time.process_time() - began, 3)
            print(json.dumps([number, kind, said, door.__name__, spent, answer]), flush=True)
            shutil.rmtree(out)
        shutil.rmtree(path)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3]), int(sys.argv[4]))
