"""Batches on a Dask cluster: two worker processes of this machine, met as those of any other would be."""

import asyncio
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import pytest

import tussle
from tussle.batch import Batch, InProcess
from tussle.batch.code import code_of
from tussle.batch.dask_runner import OnDask, _Playing, connect
from tussle.batch.dask_worker import check_same_code
from tussle.batch.slurm import executor_for
from tussle.batch.tasks import Finished, Heartbeat
from tussle.errors import BatchError, MissingExtraError, ParameterError
from tussle.mission import read_mission

pytestmark = [
    pytest.mark.skipif(
        find_spec("distributed") is None, reason="Dask is not installed: pip install 'tussle[cluster]'"
    ),
    # Dask warns where the disk of a busy machine needs more than a second for a folder.
    pytest.mark.filterwarnings("ignore:Creating scratch directories is taking"),
]

SHORT = {"end": "10", "prey": "10"}
WALKER = """
import os
import signal
import time

from tussle.api import EasyAutonomy, Output, Param

class Walker(EasyAutonomy):
    fast = Param(1.0)
    speed = Output(unit="m/s")
    turn_rate = Output(unit="rad/s")
    pitch_rate = Output(unit="rad/s")

    def step_one(self, me):
        me.speed, me.turn_rate, me.pitch_rate = 10.0 * me.fast, 0.1, 0.0
"""
MISSION = """<?xml version="1.0"?>
<runscript name="walk">
  <run start="0" end="5" dt="0.1"/>
  <entity>
    <team_id>1</team_id> <count>4</count> <variance_x>50</variance_x> <variance_y>50</variance_y>
    <motion_model>Unicycle</motion_model>
    <autonomy fast="${fast=1}">Walker</autonomy>
  </entity>
</runscript>
"""


def cluster_of(n_workers, **options):
    from distributed import LocalCluster

    return LocalCluster(
        n_workers=n_workers,
        **{"threads_per_worker": 1, "dashboard_address": "127.0.0.1:0", "host": "127.0.0.1"} | options,
    )


@pytest.fixture(scope="module")
def cluster():
    import dask
    import distributed  # noqa: F401 - its settings are there before one of them is changed, so that all are there afterwards

    # Dask gives up a worker of this machine that has not come back by then, which on a busy machine takes its time.
    with dask.config.set({"distributed.deploy.lost-worker-timeout": "10 minutes"}), cluster_of(2) as cluster:
        yield cluster


@pytest.fixture
def client(cluster):
    with connect(cluster.scheduler_address) as client:
        client.wait_for_workers(2, timeout=600)
        yield client


def short_batch(runs=12, **more):
    return Batch(
        "predator_prey", runs=runs, settings=SHORT, vary=["prey=5,10", "prey.Boids.max_speed=20,30"], **more
    )


def rows(results):
    """All of the tables that must not depend on who played."""
    return [*results.table.drop_columns(["cpu_s", "host"]).to_pylist(), *results.alive.to_pylist()]


def kill(client, worker):
    (process,) = client.run(os.getpid, workers=[worker]).values()
    os.kill(process, signal.SIGKILL)


def test_rows_are_those_of_one_process(client):
    batch = short_batch()
    assert rows(batch.play(None, OnDask(client))) == rows(batch.play(None, InProcess()))


def test_each_worker_has_one_chunk_and_no_more_chunks_exist_than_workers(cluster, client):
    from distributed.diagnostics.plugin import SchedulerPlugin

    class ChunksWithWorkers(SchedulerPlugin):
        now, most = frozenset(), 0

        def transition(self, key, start, finish, *args, **kwargs):
            if str(key).startswith("play_chunk"):
                self.now = self.now | {key} if finish == "processing" else self.now - {key}
                self.most = max(self.most, len(self.now))

    batch = short_batch(40)
    chunks = ChunksWithWorkers()
    cluster.scheduler.add_plugin(chunks, name="chunks")
    with closing(OnDask(client, stack=5).play(batch.package, [batch.run(i) for i in range(160)])) as messages:
        played = [message.number for message in messages if not isinstance(message, Heartbeat)]
    cluster.scheduler.remove_plugin("chunks")
    assert chunks.most == 2
    assert sorted(played) == list(range(160))


# -- workers that are lost --------------------------------------------------------------------------------------------------


def walk(folder, line="", **more):
    """A batch with a plugin of its own, which does a line more in each of its steps."""
    plugin, mission = folder / "walker.py", folder / "walk.xml"
    plugin.write_text(f"{WALKER}        {line}\n")
    mission.write_text(MISSION)
    return Batch(mission, plugin_files=[plugin], **{"runs": 1, "vary": ["fast=1,7,2,3"]} | more)


@pytest.mark.slow
def test_what_a_killed_worker_played_is_played_again_and_nothing_twice(cluster, client, tmp_path):
    batch = walk(tmp_path, "time.sleep(0.002)", runs=6)
    runs = [batch.run(i) for i in range(24)]
    finished, killed = [], ""
    for message in OnDask(client, stack=6).play(batch.package, runs):
        if isinstance(message, Finished):
            finished.append(message)
        elif not killed:
            busy = [
                t.processing_on.address
                for t in list(cluster.scheduler.tasks.values())
                if str(t.key).startswith("play_chunk") and t.processing_on
            ]
            if busy:
                killed = busy[0]
                kill(client, killed)
    assert killed not in client.nthreads()
    assert sorted(f.number for f in finished) == list(range(24))
    alone = {f.number: f for f in InProcess().play(batch.package, runs) if isinstance(f, Finished)}
    assert {f.number: f.state_hash for f in finished} == {n: f.state_hash for n, f in alone.items()}


@pytest.mark.slow
def test_results_that_are_lost_with_their_worker_before_they_are_used_are_played_again(client, monkeypatch):
    batch, collect, killed = short_batch(2), _Playing._collect, []

    def kill_first(playing):
        for worker, chunk in playing.under_way.items():
            if not killed and chunk.future.done():
                killed.append(worker)
                kill(client, worker)
                chunk.future = Future()  # as if it had not been fetched
                del playing.workers[worker]
        collect(playing)

    monkeypatch.setattr(_Playing, "_collect", kill_first)
    assert rows(batch.play(None, OnDask(client))) == rows(batch.play(None, InProcess()))
    assert killed[0] not in client.nthreads()


@pytest.mark.slow
def test_a_run_that_kills_its_workers_has_failed_and_takes_no_other_with_it(client, tmp_path):
    batch = walk(tmp_path, "if me.fast == 7.0: os.kill(os.getpid(), signal.SIGKILL)")
    results = batch.play(None, OnDask(client))
    assert results.failed()["run"].to_pylist() == [1]
    assert results.failed()["error"].to_pylist() == ["the workers that played it died, 2 of 2"]
    harmless = walk(tmp_path, "pass").play(None, InProcess())
    others = [row for row in rows(harmless) if row["run"] != 1]
    assert [row for row in rows(results) if row["run"] != 1] == others


def dask(command, *arguments, **options):
    """A scheduler or worker as one starts it by hand."""
    words = [sys.executable, "-m", f"distributed.cli.dask_{command}", *map(str, arguments)]
    words += ["--no-dashboard", "--host", "127.0.0.1"]
    return subprocess.Popen(words, stderr=subprocess.DEVNULL, **options)


def worker_of(address, **options):
    return dask("worker", address, "--nthreads", 1, "--no-nanny", "--death-timeout", 10, **options)


def wait_for(path):
    end = time.monotonic() + 300.0
    while not path.exists() and time.monotonic() < end:
        time.sleep(0.05)
    return path


@pytest.mark.slow
def test_a_scheduler_that_goes_away_ends_the_batch_and_what_was_finished_is_kept(tmp_path):
    batch = short_batch(6)
    scheduler = dask("scheduler", "--port", 0, "--scheduler-file", tmp_path / "where.json")
    address = json.loads(wait_for(tmp_path / "where.json").read_text())["address"]
    worker = worker_of(address)

    def kill_scheduler(progress):
        if progress.n_done:
            scheduler.kill()

    try:
        match = f"{address}: the Dask scheduler is gone; finished runs are kept"
        with connect(address) as client, pytest.raises(BatchError, match=match):
            batch.play(tmp_path / "b", OnDask(client, stack=4), on_progress=kill_scheduler)
    finally:
        worker.kill()
        scheduler.kill()
        worker.wait()
        scheduler.wait()
    told = []
    results = batch.play(
        tmp_path / "b", InProcess(), on_progress=lambda progress: told.append(progress.n_before)
    )
    assert told[0] >= 4
    assert rows(results) == rows(batch.play(None, InProcess()))


def test_without_workers_it_waits_only_so_long():
    with cluster_of(0) as own, connect(own.scheduler_address) as client:
        executor = OnDask(client, patience=0.2)
        began = time.monotonic()
        with pytest.raises(
            BatchError,
            match=r"tcp://127.0.0.1:\d+: the Dask scheduler has had no worker for 0.2 s; `dask worker tcp",
        ):
            short_batch(1).play(None, executor)
        assert time.monotonic() - began < 300.0


@pytest.mark.slow
def test_workers_that_come_later_play_and_threads_that_are_of_no_use_are_told_once():
    batch = short_batch(3)
    match = "2 threads are idle; start more workers of one thread each"
    with (
        cluster_of(0, threads_per_worker=3) as own,
        connect(own.scheduler_address) as client,
        pytest.warns(RuntimeWarning, match=match) as told,
    ):
        results = batch.play(None, OnDask(client, stack=2, look=lambda _: own.scale(1)))
    assert len(told) == 1
    assert rows(results) == rows(batch.play(None, InProcess()))


def test_closing_it_ends_what_is_under_way(cluster, client, tmp_path):
    def executing(dask_worker):  # in here, since a worker cannot import this file
        return dask_worker.state.executing_count

    batch = walk(tmp_path, "time.sleep(0.001)", runs=8, settings={"run.end": "1e5"})
    runs = [batch.run(i) for i in range(batch.plan.n_runs)]
    with closing(OnDask(client).play(batch.package, runs)) as messages:
        assert next(m.under_way for m in messages if m.under_way > 0.0) < len(runs)
    began = time.monotonic()
    while any(client.run(executing).values()) and time.monotonic() - began < 300.0:
        time.sleep(0.05)
    assert not any(client.run(executing).values())
    assert not [key for key in cluster.scheduler.tasks if str(key).startswith("play_chunk")]


# -- what travels -----------------------------------------------------------------------------------------------------------


def test_a_plugin_file_travels_and_one_that_has_changed_is_loaded_anew(client, tmp_path):
    line, pace = "import pace; me.speed = pace.PACE * me.fast", tmp_path / "pace.py"
    pace.write_text("PACE = 9.0")
    batch = walk(tmp_path, line)
    first = rows(batch.play(None, OnDask(client)))
    assert first == rows(batch.play(None, InProcess()))
    for name in ("walker.py", "pace.py"):
        shutil.move(tmp_path / name, tmp_path / f"{name}.moved")  # as on a machine that does not have it
    assert rows(batch.play(None, OnDask(client))) == first
    pace.write_text("PACE = 3.0")
    changed = walk(tmp_path, line)
    second = rows(changed.play(None, OnDask(client)))
    assert second == rows(changed.play(None, InProcess()))
    assert second != first


SCRIPT = """
import sys
from tussle import Block, Mission
from tussle.batch import Batch, InProcess
from tussle.batch.dask_runner import OnDask, connect
from tussle.stock import Unicycle
{walker}

def mission(fast):
    return Mission(blocks=[Block(name="a", team=1, count=3, variance=(50, 50, 0), autonomy=Walker(fast=fast), motion=Unicycle())], end=2)

def main():
    batch = Batch(mission, runs=2, vary=dict(fast=[1.0, 2.0]))
    with connect(sys.argv[1]) as client:
        there = batch.play(None, OnDask(client)).table["state_hash"].to_pylist()
    assert there == batch.play(None, InProcess()).table["state_hash"].to_pylist()
    print(len(there), "rows")

{main}
"""


def run_script(cluster, *command):
    return subprocess.run(
        [sys.executable, *command, cluster.scheduler_address], capture_output=True, text=True, check=False
    )


@pytest.mark.parametrize("is_file", [True, False], ids=["script", "prompt"])
@pytest.mark.slow
def test_plugins_of_a_script_or_prompt_travel(cluster, tmp_path, is_file):
    script, text = tmp_path / "sweep.py", SCRIPT.format(walker=WALKER, main="main()")
    script.write_text(text)
    run = run_script(cluster, *([str(script)] if is_file else ["-c", text]))
    assert run.stdout == "8 rows\n", run.stderr


def test_a_package_that_workers_lack_is_named(client, tmp_path, monkeypatch):
    (tmp_path / "walkers_of_mine.py").write_text(WALKER)
    monkeypatch.syspath_prepend(tmp_path)
    walker = import_module("walkers_of_mine").Walker()
    game = read_mission("predator_prey", SHORT).mission
    mission = game.replace(blocks=[game.blocks[0].replace(autonomy=[walker])])
    with pytest.raises(
        BatchError,
        match=r"worker tcp://.* cannot play: ModuleNotFoundError: No module named 'walkers_of_mine'",
    ):
        Batch(mission, runs=1).play(None, OnDask(client))


# -- what workers are -------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_worker_with_another_tussle_is_refused(tmp_path):
    copy = tmp_path / "tussle"
    shutil.copytree(Path(tussle.__file__).parent, copy, ignore=shutil.ignore_patterns("__pycache__"))
    with (copy / "units.py").open("a") as file:
        file.write("# changed\n")
    with cluster_of(0) as own, connect(own.scheduler_address) as client:
        worker = worker_of(
            own.scheduler_address, env=os.environ | {"PYTHONPATH": str(tmp_path)}, cwd=tmp_path
        )
        try:
            with pytest.raises(BatchError, match=r"worker tcp://.* has source of tussle"):
                short_batch(1).play(None, OnDask(client))
        finally:
            worker.kill()
            worker.wait()


def test_versions_that_differ_are_named_on_both_sides():
    here = code_of(read_mission("predator_prey").mission)
    check_same_code(here, "tcp://a:1")
    with pytest.raises(
        BatchError, match=r"worker tcp://a:1 has numpy .*, numba .*; the batch has numpy 1.0, numba 0.1"
    ):
        check_same_code(here | {"numpy": "1.0", "numba": "0.1"}, "tcp://a:1")


# -- the way there ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "127.0.0.1:9", "nowhere://a", "tcp://127.0.0.1"])
def test_a_scheduler_that_is_not_there_is_told_soon(address):
    import distributed  # noqa: F401 - which takes a while the first time

    began = time.monotonic()
    with (
        pytest.raises(BatchError, match=f"^{address}: no Dask scheduler answers") as error,
        connect(address, timeout=1.0),
    ):
        pass
    assert "\n" not in str(error.value)
    assert time.monotonic() - began < 300.0


@pytest.mark.parametrize(("scheduler", "slurm"), [(None, None), ("tcp://a:1", "2")])
def test_the_command_line_names_one_place(scheduler, slurm):
    with pytest.raises(ParameterError, match="give one of the two"), executor_for(scheduler, slurm, None):
        pass


def test_an_asynchronous_client_is_refused(cluster):
    from distributed import Client

    async def give_it_one():
        async with Client(cluster.scheduler_address, asynchronous=True, set_as_default=False) as client:
            OnDask(client)

    # In a thread of its own: in this one, a browser of other tests may keep an event loop.
    with ThreadPoolExecutor(1) as thread, pytest.raises(ParameterError, match="asynchronous=False"):
        thread.submit(lambda: asyncio.run(give_it_one())).result()


@pytest.mark.slow
def test_without_dask_it_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    match = r"distributed, which is not installed: pip install 'tussle\[cluster\]'"
    with pytest.raises(MissingExtraError, match=match), executor_for("tcp://a:1", None, None):
        pass
