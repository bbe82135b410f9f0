"""Who plays: this process or several, with the same results, whatever happens to the processes."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import ModuleType

import gambles
import pytest
from gambles import game, is_bad, rows

from tussle.api import Metric
from tussle.batch import Batch, InProcess, Processes
from tussle.batch.executors import RunQueue, even_size
from tussle.batch.tasks import BatchRun, Heartbeat
from tussle.errors import BatchError, ParameterError

POINTS = [{"reds.count": n, "Roulette.odds": odds} for n in (4, 2) for odds in (0.1, 0.4)]


# -- runs that wait -----------------------------------------------------------------------------------------------------------


def test_runs_wait_by_group_and_are_taken_in_order():
    queue = RunQueue([BatchRun(i, i % 2 if i < 4 else 0, i) for i in range(6)])
    assert (len(queue), queue.largest()) == (6, 0)
    assert [r.number for r in queue.take(0, 3)] == [0, 2, 4]
    assert [r.number for r in queue.take(1, 9)] == [1, 3]
    assert queue.take(1, 1) == queue.take(7, 1) == []
    assert (len(queue), queue.largest()) == (1, 0)
    queue.take(0, 1)
    assert (len(queue), queue.largest()) == (0, None)


@pytest.mark.parametrize("size", [1, 7, 64])
@pytest.mark.parametrize("n_workers", [1, 2, 5])
def test_stacks_are_even_and_no_larger_than_asked(size, n_workers):
    for n_runs in range(1, 200):
        even = even_size(size, n_runs, n_workers)
        assert 1 <= even <= size
        n_rounds = -(-n_runs // (even * n_workers))
        assert n_rounds == -(-n_runs // (size * n_workers))


@pytest.mark.parametrize("executor", [InProcess, Processes])
@pytest.mark.parametrize("wrong", [0, -1, 1.5, True, "2"])
def test_how_many_is_a_whole_number(executor, wrong):
    with pytest.raises(ParameterError, match="stack = "):
        executor(stack=wrong)
    with pytest.raises(ParameterError, match="processes = "):
        Processes(wrong)


# -- processes ----------------------------------------------------------------------------------------------------------------


def test_processes_find_what_this_process_finds():
    batch = Batch(game(how="step"), runs=9, points=POINTS)
    reference = rows(batch.play(executor=InProcess(1)))
    assert rows(batch.play(executor=InProcess(7))) == reference
    assert rows(batch.play(executor=InProcess())) == reference
    assert rows(batch.play(executor=Processes(2, 7))) == reference


@pytest.mark.slow
def test_a_run_that_kills_its_process_fails_and_the_others_are_there():
    points = [{"Trouble.how": how} for how in ("crash", "never")]
    batch = Batch(game(), runs=4, points=points)
    results = batch.play(executor=Processes(2))
    failed = {row["run"]: row["error"] for row in results.failed().to_pylist()}
    assert failed == {4: "the process that played it died: signal 11, Segmentation fault"}
    assert is_bad(batch.run(4).seed)
    clean = rows(Batch(game(), runs=4).play(executor=InProcess()))[0]
    for point in range(2):
        own = [r for r in rows(results)[0] if r["point"] == point and r["run"] not in failed]
        theirs = [r for r in clean if point == 1 or r["seed"] != 3]
        keys = set(clean[0]) - {"run", "point", "group"}
        assert [{k: r[k] for k in keys} for r in own] == [{k: r[k] for k in keys} for r in theirs]
    assert not multiprocessing.active_children()


def test_a_process_that_ends_before_it_plays_ends_the_batch(tmp_path, monkeypatch):
    (tmp_path / "sitecustomize.py").write_text(
        "import os, sys\nif '--multiprocessing-fork' in sys.argv: os._exit(3)\n"
    )
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")]))
    with pytest.raises(BatchError, match=r"ended as it started \(exit code 3\)"):
        Batch(game(), runs=2).play(executor=Processes(1))


def test_a_process_that_cannot_be_started_ends_the_batch(monkeypatch):
    def no_processes(*_):
        raise BlockingIOError(11, "Resource temporarily unavailable")

    monkeypatch.setattr(multiprocessing.get_context("spawn").Process, "start", no_processes)
    with pytest.raises(BatchError, match=r"cannot be started: .*Resource temporarily unavailable"):
        Batch(game(), runs=2).play(executor=Processes(1))


def test_a_mission_that_processes_cannot_load_ends_the_batch():
    module = ModuleType("a_module_that_is_only_here")
    module.Own = type("Own", (Metric,), {"__module__": module.__name__, "__doc__": "Own."})
    sys.modules[module.__name__] = module
    try:
        batch = Batch(game().replace(metrics=[module.Own()]), runs=8)
        assert not batch.play(executor=InProcess()).n_failed
        with pytest.raises(BatchError, match=r"cannot load the mission: ModuleNotFoundError: .*only_here"):
            batch.play(executor=Processes(1))
    finally:
        del sys.modules[module.__name__]
    assert not multiprocessing.active_children()


def test_closing_it_ends_the_processes_while_a_plugin_takes_its_time():
    batch = Batch(game(how="sleep"), runs=2, first_seed=3)
    messages = Processes(1).play(batch.package, [batch.run(0)])
    assert all(isinstance(next(messages), Heartbeat) for _ in range(2))
    assert len(multiprocessing.active_children()) == 1
    messages.close()
    assert not multiprocessing.active_children()


# -- scripts ------------------------------------------------------------------------------------------------------------------

SCRIPT = """\
import sys
sys.path.insert(0, {folder!r})
from gambles import game
from tussle.batch import Batch, Processes
print("here", flush=True)
{rest}
"""


def run_script(tmp_path, rest, **options):
    path = tmp_path / "script.py"
    path.write_text(SCRIPT.format(folder=str(Path(gambles.__file__).parent), rest=rest))
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    return subprocess.Popen(
        [sys.executable, str(path)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment, **options
    )  # fmt: skip


OWN = """\
import numpy as np
from tussle.api import Autonomy, Metric, State, neighbors
from tussle.numeric.kernel import device, kernel
from tussle.stock import Still
from tussle import Block

SHARE = 0.5

@device
def half(x):
    return SHARE * x

@kernel("F Fw")
def halves(given, found):
    for i in range(len(given)):
        found[i] = half(given[i])

class Own(Metric):
    found = State(per="world")

    def step(self, w):
        each = w.bodies.health.copy()
        halves(w.bodies.health, each)
        self.found[:] = np.bincount(w.world, each, w.n_worlds)

    def result(self, w):
        return {"halves": self.found}

class Crowd(Autonomy):
    @neighbors(1e9, teams="own", n="count")
    @staticmethod
    def seen(distance):
        return distance > 0.0

    def step(self, g):
        assert (self.seen(g).n == np.bincount(g.world)[g.world] - 1).all()

def mission():
    crowd = Block(name="greens", team=3, count=4, variance=(9, 9, 0), autonomy=Crowd(), motion=Still())
    made = game()
    return made.replace(metrics=[*made.metrics, Own()], blocks=[*made.blocks, crowd])

"""
PLAY = """
if True:  # no guard
    batches = [Batch(mission(), runs=4).play(executor=who) for who in (InProcess(), Processes(1), Processes(2, 1))]
    print([b.n_failed for b in batches], {tuple(b.runs["state_hash"].to_pylist()) for b in batches}.__len__())
    print(len({tuple(b.quantity("Own.halves")) for b in batches}))
"""


@pytest.mark.slow
def test_a_script_can_define_plugins_and_needs_no_main_guard(tmp_path):
    script = run_script(tmp_path, "from tussle.batch import InProcess\n" + OWN + PLAY)
    try:
        out, err = script.communicate(timeout=600)
    finally:
        script.kill()
    assert (script.returncode, out, err) == (0, "here\n[0, 0, 0] 1\n1\n", "")


WATCHED = """\
import multiprocessing
batch = Batch(game(how="sleep"), runs=4, first_seed=3)
for message in Processes(1).play(batch.package, [batch.run(0)]):
    print(multiprocessing.active_children()[0].pid, flush=True)
"""


def test_processes_end_with_their_parent_whatever_they_do(tmp_path):
    script = run_script(tmp_path, WATCHED)
    try:
        assert script.stdout.readline() == "here\n"
        child = int(script.stdout.readline())
        time.sleep(2.0)  # by now its plugin sleeps, for ten minutes
        script.send_signal(signal.SIGKILL)
        script.wait(300)
        limit = time.monotonic() + 300.0
        while is_running(child) and time.monotonic() < limit:
            time.sleep(0.05)
        assert not is_running(child)
    finally:
        script.kill()
        script.communicate()


def is_running(process):
    """Whether a process is there and no zombie, which waits only to be counted."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False
