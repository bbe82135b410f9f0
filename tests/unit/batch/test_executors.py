"""Who plays: this process or several, with the same results, whatever happens to them."""

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
from tussle.batch.executors import Waiting, even_size
from tussle.batch.tasks import Beat, Run
from tussle.errors import BatchError, ParameterError

POINTS = [{"reds.count": n, "Roulette.odds": odds} for n in (4, 2) for odds in (0.1, 0.4)]


# -- runs that wait -----------------------------------------------------------------------------------------------------------


def test_runs_wait_by_group_and_are_taken_in_order():
    waiting = Waiting([Run(i, i % 2 if i < 4 else 0, i) for i in range(6)])
    assert (len(waiting), waiting.largest()) == (6, 0)
    assert [r.number for r in waiting.take(0, 3)] == [0, 2, 4]
    assert [r.number for r in waiting.take(1, 9)] == [1, 3]
    assert waiting.take(1, 1) == waiting.take(7, 1) == []
    assert (len(waiting), waiting.largest()) == (1, 0)
    waiting.take(0, 1)
    assert (len(waiting), waiting.largest()) == (0, None)


@pytest.mark.parametrize("size", [1, 7, 64])
@pytest.mark.parametrize("n_processes", [1, 2, 5])
def test_stacks_are_even_and_no_larger_than_asked(size, n_processes):
    for n_runs in range(1, 200):
        even = even_size(size, n_runs, n_processes)
        assert 1 <= even <= size
        n_rounds = -(-n_runs // (even * n_processes))
        assert n_rounds == -(-n_runs // (size * n_processes))


@pytest.mark.parametrize("executor", [InProcess, Processes])
@pytest.mark.parametrize("wrong", [0, -1, 1.5, True, "2"])
def test_how_many_is_a_whole_number(executor, wrong):
    with pytest.raises(ParameterError, match=r"stack = .* is not allowed; it takes a whole number >= 1"):
        executor(stack=wrong)
    with pytest.raises(ParameterError, match=r"processes = .* is not allowed"):
        Processes(wrong)


# -- processes ----------------------------------------------------------------------------------------------------------------


def test_processes_find_what_this_process_finds():
    batch = Batch(game(how="step"), runs=9, points=POINTS)
    reference = rows(batch.play(executor=InProcess(1)))
    assert rows(batch.play(executor=InProcess(7))) == reference
    assert rows(batch.play(executor=InProcess())) == reference
    assert rows(batch.play(executor=Processes(2, 7))) == reference


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
        keys = set(clean[0]) - {"run", "point"}
        assert [{k: r[k] for k in keys} for r in own] == [{k: r[k] for k in keys} for r in theirs]
    assert not multiprocessing.active_children()


def test_a_mission_that_processes_cannot_load_is_told_once():
    module = ModuleType("a_module_that_is_only_here")
    module.Own = type("Own", (Metric,), {"__module__": module.__name__, "__doc__": "Own."})
    sys.modules[module.__name__] = module
    try:
        batch = Batch(game().replace(metrics=[module.Own()]), runs=8)
        assert not batch.play(executor=InProcess()).n_failed
        with pytest.raises(
            BatchError, match=r"cannot load the mission: ModuleNotFoundError: .*only_here.*; what its plugins"
        ):
            batch.play(executor=Processes(1))
    finally:
        del sys.modules[module.__name__]
    assert not multiprocessing.active_children()


def test_what_watches_is_heard_while_a_plugin_takes_its_time():
    batch = Batch(game(how="sleep"), runs=2, first_seed=3)
    messages = Processes(1).play(batch.package, [batch.run(0)])
    began = time.monotonic()
    assert isinstance(next(messages), Beat)
    assert isinstance(next(messages), Beat)
    children = multiprocessing.active_children()
    assert len(children) == 1
    messages.close()
    assert time.monotonic() - began < 300.0
    assert not children[0].is_alive()


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
from tussle.api import Metric


class Own(Metric):
    pass


"""


def test_a_script_with_a_plugin_of_its_own_needs_a_main_guard(tmp_path):
    play = "print(Batch(game().replace(metrics=[Own()]), runs=4).play(executor=Processes(1)).n_failed)"
    script = run_script(tmp_path, OWN + play)
    try:
        out, err = script.communicate(timeout=600)
    finally:
        script.kill()
    assert script.returncode == 1
    last = err.strip().splitlines()[-1]
    assert last.startswith(
        "tussle.errors.BatchError: a process that was to play ended as it started (exit code 1); a script"
    )
    assert 'if __name__ == "__main__":' in last
    assert out == "here\nhere\n"


def test_a_script_without_plugins_of_its_own_needs_none(tmp_path):
    script = run_script(tmp_path, "print(Batch(game(), runs=4).play(executor=Processes(1)).n_failed)")
    try:
        out, err = script.communicate(timeout=600)
    finally:
        script.kill()
    assert (script.returncode, out, err) == (0, "here\n0\n", "")


WATCHED = """\
import multiprocessing, time
from tussle.batch.tasks import Beat

if __name__ == "__main__":
    batch = Batch(game(how="sleep"), runs=4, first_seed=3)
    for message in Processes(1).play(batch.package, [batch.run(0)]):
        print(multiprocessing.active_children()[0].pid, flush=True)
"""


def test_processes_end_with_their_parent_whatever_they_are_at(tmp_path):
    script = run_script(tmp_path, WATCHED)
    try:
        assert script.stdout.readline() == "here\n"
        child = int(script.stdout.readline())
        time.sleep(2.0)  # by now its plugin sleeps, for ten
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
