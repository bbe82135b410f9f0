"""A plugin whose dynamics run in another process: x' = u in a child, one child per entity."""

from __future__ import annotations

import contextlib
import gc
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
from small_worlds import VELOCITY, Drift, Wander, mission

from tussle import Block, Scene, Simulation
from tussle.api import Autonomy, Handle, Input, MotionModel, Output, Param, State
from tussle.errors import MissionError, PluginError, SnapshotError
from tussle.stock import SingleIntegrator

PROGRAM = Path(__file__).with_name("integrating_child.py")


@dataclass
class Link:
    """The child of one entity."""

    process: subprocess.Popen

    def ask(self, *words) -> list[float]:
        self.process.stdin.write(" ".join(map(str, words)) + "\n")
        self.process.stdin.flush()
        answer = self.process.stdout.readline()
        if not answer:
            raise ConnectionError(f"child {self.process.pid} has ended with status {self.process.wait()}")
        return [float.fromhex(word) for word in answer.split()]


class Diary:
    """What the tests keep of the children's lives; a plugin keeps nothing of its own."""

    opened: list[Link]
    closed: list[Link]

    def clear(self):
        self.opened, self.closed = [], []


diary = Diary()


@pytest.fixture(autouse=True)
def no_orphans():
    diary.clear()
    yield
    for link in diary.opened:
        assert link.process.poll() is not None, f"child {link.process.pid} lives on"
    assert len(diary.closed) == len({id(link) for link in diary.closed}) == len(diary.opened)


def start(pos) -> Link:
    command = [sys.executable, "-S", str(PROGRAM), *[repr(float(c)) for c in pos]]
    link = Link(
        subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env={**os.environ, "PYTHONPATH": ""},
        )
    )
    assert link.process.stdout.readline() == "ready\n"
    diary.opened.append(link)
    return link


class Outside(MotionModel):
    """x' = u, integrated by a child process."""

    grade = "external"

    crash_at = Param(10**9, doc="Step in which the child is told to crash.")
    x = State("x y z", unit="m")
    link = Handle(max_worlds=4, doc="Pipe to the child.")
    velocity = Input(VELOCITY, unit="m/s")

    def advance(x, u, p, dt, substeps):
        """Nothing: the child does it."""

    def open_one(self, row):
        return start(row.pos)

    def close_one(self, handle):
        diary.closed.append(handle)
        with contextlib.suppress(BrokenPipeError):  # of a child that has crashed
            handle.process.stdin.close()
        handle.process.stdout.close()
        handle.process.wait(timeout=300)

    def save_one(self, handle):
        return handle.ask("save")

    def load_one(self, row, state):
        return start(state)

    def from_body(self, body, rows):
        self.x[:, rows] = body.pos[:, rows]

    def to_body(self, body):
        for row in range(body.n):
            if body.step_count[row] == self.crash_at[row]:
                self.link[row].process.stdin.write("crash\n")
            try:
                self.x[:, row] = self.link[row].ask("step", body.dt, *self.velocity[:, row])
            except ConnectionError as error:
                body.fail(row, str(error))
        body.pos[:] = self.x
        body.vel[:] = self.velocity


def game(motion=None, count=2, autonomy=None, **values):
    blocks = Block(
        name="a",
        count=count,
        position=(1.0, 2.0, 3.0),
        autonomy=autonomy or Drift(to=(1.0, 0.5, 0.0)),
        motion=motion or Outside(),
    )
    return mission(blocks, **values)


def test_a_child_per_entity_flies_what_the_stock_integrator_flies():
    with Simulation(game(), seeds=[1, 2]) as sim:
        assert len(diary.opened) == 4
        assert len({link.process.pid for link in diary.opened}) == 4
        sim.run()
        found = sim.read("a.pos")[0]
    own = Simulation(game(SingleIntegrator()), seeds=[1, 2])
    own.run()
    np.testing.assert_allclose(found, own.read("a.pos")[0], rtol=1e-12)


def test_each_is_opened_once_and_closed_once():
    sim = Simulation(game(count=3))
    sim.step(2)
    assert (len(diary.opened), len(diary.closed)) == (3, 0)
    sim.close()
    sim.close()
    assert (len(diary.opened), len(diary.closed)) == (3, 3)


def test_children_of_ended_worlds_do_not_wait_for_close():
    sim = Simulation(game(count=2), seeds=[1, 2])
    sim.run()
    assert (len(diary.opened), len(diary.closed)) == (4, 4)
    sim.close()


def test_children_of_the_removed_and_of_reset_worlds_are_closed():
    with Simulation(game(count=2), seeds=[1, 2]) as sim:
        sim.step()
        sim.write("a.health", [[0.0, 1.0], [1.0, 1.0]])
        sim.step()
        assert (len(diary.opened), len(diary.closed)) == (4, 1)
        sim.reset([1])
        assert (len(diary.opened), len(diary.closed)) == (6, 3)
        sim.step(3)
        assert sim.read("a.pos")[1].tolist() == [[False, True], [True, True]]


def test_children_are_closed_when_the_simulation_is_forgotten():
    sim = Simulation(game(count=1))
    sim.step()
    del sim
    gc.collect()
    assert len(diary.closed) == 1


def test_snapshot_and_restore_take_the_children_along():
    with Simulation(game(autonomy=Wander()), seeds=3) as sim:
        sim.step(3)
        saved = sim.snapshot()
        sim.run()
        first = sim.read("a.pos")[0]
        sim.restore(saved)
        assert sim.steps.tolist() == [3]
        sim.run()
        assert np.array_equal(sim.read("a.pos")[0], first)


def test_restore_closes_the_children_of_those_born_since():
    block = Block(name="a", count=3, rate=5.0, autonomy=Drift(), motion=Outside())
    with Simulation(mission(block)) as sim:
        sim.step()
        saved = sim.snapshot()
        sim.step(5)
        assert len(diary.opened) == 3
        sim.restore(saved)
        assert (len(diary.opened), len(diary.closed)) == (4, 3)
        sim.run()
        assert sim.read("a.pos")[1].sum() == 3


def test_a_plugin_that_cannot_save_says_so():
    class Mute(Autonomy):
        link = Handle()

        def open_one(self, row):
            return object()

        def step(self, g):
            pass

    with (
        Simulation(game(SingleIntegrator(), autonomy=[Drift(), Mute()])) as sim,
        pytest.raises(SnapshotError, match=r"Mute .* has no method save_one"),
    ):
        sim.snapshot()


def test_handles_share_an_object_that_ends_with_the_simulation():
    events = []

    class Server:
        def __init__(self):
            events.append("begin")

        def end(self):
            events.append("end")

    class Client(Autonomy):
        link = Handle()

        def open_one(self, row):
            assert row.scene == Scene()
            return row.shared("server", Server), row.id

        def close_one(self, link):
            events.append(link[1])

        def step(self, g):
            assert len({id(server) for server, _ in self.link}) == 1

    block = Block(name="a", count=2, autonomy=[Drift(), Client()], motion=SingleIntegrator())
    with Simulation(mission(block), seeds=[1, 2]) as sim:
        sim.step(3)
        sim.reset([0])
        sim.step(3)
    assert (events.count("begin"), events[-1], events.count("end")) == (1, "end", 1)
    assert sorted(events[1:-1]) == [1, 1, 1, 2, 2, 2]


def test_largest_stack():
    with pytest.raises(MissionError, match=r"Outside .* at most 4 worlds .* not 5"):
        Simulation(game(), seeds=range(5))


def test_a_crash_of_a_child_ends_its_world_and_no_other():
    with Simulation(game(), seeds=[1, 2, 3], params={"a.Outside.crash_at": [10**9, 4, 10**9]}) as sim:
        results = sim.run()
        found = sim.read("a.pos")[0]
    assert [r.end for r in results] == ["time", "error", "time"]
    assert results[1].steps == 5
    text = str(results[1].error)
    assert text.startswith("Outside, a 1, world 1, step 4: child ")
    assert text.endswith(" has ended with status 3")
    with Simulation(game(), seeds=[1, 2, 3]) as whole:
        whole.run()
        assert np.array_equal(found[[0, 2]], whole.read("a.pos")[0][[0, 2]])
        assert results[0].state_hash == whole.state_hash(0)


def test_a_crash_alone_is_raised():
    message = r"Outside, a 1, world 0, step 2: child \d+ has ended with status 3"
    with Simulation(game(Outside(crash_at=2))) as sim, pytest.raises(PluginError, match=message):
        sim.run()


class Slow(Autonomy):
    """Lets a step wait for the outside; counts how often it was asked, and its calls."""

    grade = "external"
    patience = Param(3)
    asked = State(dtype=int)
    link = Handle(ready_timeout=300.0)
    calls: ClassVar[list[int]] = []

    def open_one(self, row):
        return [0]

    def ready(self, g):
        for held in self.link:
            held[0] += 1
        return all(held[0] >= patience for held, patience in zip(self.link, self.patience, strict=True))

    def step(self, g):
        self.calls.append(g.n)
        self.asked[:] = [held[0] for held in self.link]


class Hasty(Slow):
    link = Handle(ready_timeout=0.2)


def waiting(count=1, **values):
    return game(SingleIntegrator(), autonomy=[Drift(), Slow(**values)], count=count)


def test_a_step_waits_until_all_that_is_outside_is_ready():
    sim = Simulation(waiting(), seeds=[1, 2], params={"a.Slow.patience": [1, 3]})
    sim.step()
    assert sim.read("a.Slow.asked")[0].tolist() == [[3], [3]]
    sim.step()
    assert sim.read("a.Slow.asked")[0].tolist() == [[4], [4]]


def test_nobody_waits_for_ever():
    stuck = game(SingleIntegrator(), autonomy=[Drift(), Hasty(patience=10**9)], count=1)
    with pytest.raises(PluginError, match=r"^Hasty, a, world 0, step 0: was not ready within 0.2 s"):
        Simulation(stuck).step()
    sim = Simulation(stuck, seeds=[1, 2], params={"a.Hasty.patience": [1, 10**9]}, on_error="record")
    assert [str(r.error) for r in sim.run()] == ["Hasty, a, step 0: was not ready within 0.2 s"] * 2


@pytest.mark.parametrize("rate", [None, 5.0])
def test_one_call_serves_all_worlds(rate):
    Slow.calls.clear()
    sim = Simulation(waiting(count=3, patience=1, rate=rate), seeds=range(8))
    sim.step(4)
    assert Slow.calls == [24] * (4 if rate is None else 2)
    assert sim.read("a.Slow.asked")[0].tolist() == [[len(Slow.calls)] * 3] * 8  # nor is it asked more often


def test_a_child_that_does_not_start_says_whose_it_was():
    class Missing(Outside):
        def open_one(self, row):
            return subprocess.Popen(["/nonexistent/program"])

    with pytest.raises(PluginError, match=r"Missing, a 1, world 0.*FileNotFoundError"):
        Simulation(game(Missing()))


def test_spawn_is_not_called_for_no_rows():
    class Missing(Outside):
        def open_one(self, row):
            raise OSError("no such program")

        def spawn(self, g, rows):
            assert self.link[rows[0]] is not None

    with pytest.raises(PluginError, match=r"Missing, a 1, world 0.*OSError: no such program"):
        Simulation(game(Missing()))


def test_those_that_did_start_are_closed_when_another_does_not():
    class Third(Outside):
        def open_one(self, row):
            if row.id == 3:
                raise OSError("no more")
            return start(row.pos)

    with pytest.raises(PluginError, match=r"Third, a 3, world 0, step 0: test_external.py:\d+: OSError"):
        Simulation(game(Third(), count=3))
    assert len(diary.closed) == 2


def test_a_child_that_does_not_start_ends_its_world_only():
    class Second(Outside):
        def open_one(self, row):
            if row.world == 1:
                raise OSError("no more")
            return start(row.pos)

    with Simulation(game(Second(), count=1), seeds=[1, 2, 3]) as sim:
        results = sim.run()
    assert [r.end for r in results] == ["time", "error", "time"]
    assert "Second, a 1, world 1, step 0" in str(results[1].error)


def test_a_child_that_does_not_start_in_the_middle_ends_its_world_before_its_plugin_is_called():
    class Second(Outside):
        def open_one(self, row):
            if (row.world, row.id) == (1, 2):
                raise OSError("no more")
            return start(row.pos)

        def spawn(self, g, rows):
            assert all(self.link[row].process.poll() is None for row in rows)

    block = Block(name="a", count=2, rate=5.0, autonomy=Drift(), motion=Second())
    with Simulation(mission(block), seeds=[1, 2, 3]) as sim:
        results = sim.run()
    assert [(r.end, r.steps) for r in results] == [("time", 10), ("error", 2), ("time", 10)]
    assert "Second, a 2, world 1, step 2" in str(results[1].error)
    with Simulation(mission(block), seeds=3) as alone:
        assert alone.run()[0].state_hash == results[2].state_hash


def test_one_that_cannot_be_closed_is_told_and_the_others_are_closed():
    class Stuck(Outside):
        def close_one(self, handle):
            super().close_one(handle)
            if handle is diary.opened[0]:
                raise OSError("stuck")

    sim = Simulation(game(Stuck(), count=3))
    with pytest.warns(RuntimeWarning, match=r"Stuck, a: .* test_external.py:\d+: OSError: stuck"):
        sim.close()
    assert len(diary.closed) == 3


class Pen(Autonomy):
    """Draws on its own paper: a handle that easy mode and vector mode see as the same object."""

    paper = Handle()
    velocity = Output(VELOCITY, unit="m/s")

    def open_one(self, row):
        return {
            "id": row.id,
            "world": row.world,
            "seed": row.seed,
            "team": row.team,
            "dt": row.dt,
            "pos": row.pos.tolist(),
        }

    def save_one(self, handle):
        return handle

    def load_one(self, row, state):
        return state

    def step(self, g):
        assert [p["id"] for p in self.paper] == g.id.tolist()
        assert [p["world"] for p in self.paper] == g.world.tolist()


def test_what_open_one_is_told():
    sim = Simulation(game(SingleIntegrator(), autonomy=Pen()), seeds=[11, 12])
    sim.step()
    papers = sim.state.population.groups[0].autonomies[0].handles["paper"]
    first = papers[2]
    assert (first["id"], first["world"], first["seed"], first["team"], first["dt"]) == (1, 1, 12, 0, 0.1)
    assert first["pos"] == [1.0, 2.0, 3.0]
