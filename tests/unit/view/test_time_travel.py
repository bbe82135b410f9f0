"""Wound back and played again, a game is the same to the last bit; said something else, it is another one."""

import random

import numpy as np
import pytest
from golden_runs import kept, simulation
from missions import STEPS
from recorded_games import hunt
from watched_plugins import GoWhereClicked, clickable

from tussle import Block, Mission, Recorder, Simulation, load_run
from tussle.api import Autonomy, Handle, Output
from tussle.messages import CustomKeyPress, WorldPointClicked
from tussle.stock import SingleIntegrator
from tussle.view import Live
from tussle.view.timeline import History, Timeline, memory_of


def hashes_of(sim, steps):
    """State hash at the beginning of each step, and at the end."""
    found = [sim.state_hash()]
    for _ in range(steps):
        sim.step()
        found.append(sim.state_hash())
    return found


# -- the same bits ------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "memory"),
    [("chase_sequential", 0.05), ("births_and_radio", 0.05), ("births_and_radio", 256.0), ("slow_clocks", 0.05), ("cars", 256.0)],
)  # fmt: skip
def test_every_step_that_is_visited_again_has_the_state_it_had(name, memory):
    n = STEPS[name]
    hashes = hashes_of(simulation(name, 1), n)
    assert hashes[-1] == kept(name, 1)
    chance = random.Random(name)
    sim = simulation(name, 1)
    live = Live(sim, threaded=False, snapshot_every=0.35, memory=memory)
    farthest = 0
    for _ in range(60):
        step = chance.randint(0, n)
        way = chance.choice(["seek", "step", "back"])
        if way == "seek":
            live.seek(sim.mission.start + step * sim.mission.dt)
        else:
            step = live.step_number + (k := chance.randint(0, 6)) * (1 if way == "step" else -1)
            live.step(k) if way == "step" else live.step_back(k)
            step = min(max(step, 0), n if n == sim.mission.steps else 10**9)
            if step > n:  # beyond what is known
                live.seek(sim.mission.start)
                step = 0
        assert live.step_number == step
        assert sim.state_hash() == hashes[step]
        farthest = max(farthest, step)
        assert live.span[1] >= sim.mission.start + farthest * sim.mission.dt
    live.seek(sim.mission.start + n * sim.mission.dt)
    assert sim.state_hash() == kept(name, 1)


def test_a_game_that_has_ended_is_wound_back_and_ends_again():
    game = hunt(n_prey=3, end=30.0)
    alone = Simulation(game)
    alone.run()
    live = Live(Simulation(game), threaded=False)
    live.step(10_000)
    for _ in range(2):
        assert live.is_over
        assert live.step_number == alone.steps[0]
        assert live.simulation.state_hash() == alone.state_hash()
        assert live.simulation.result() == alone.result()
        live.step_back(7)
        assert not live.is_over
        live.step(100)


# -- what is said from outside --------------------------------------------------------------------------------------------------------


def test_a_click_is_heard_and_heard_again_when_its_step_is_played_again():
    live = Live(Simulation(clickable()), threaded=False)
    live.step(10)
    live.publish_click((30.0, 40.0, 5.0))
    live.publish_key("k")
    assert [(i.step, i.type) for i in live.injections] == [(10, WorldPointClicked), (10, CustomKeyPress)]
    hashes = {}
    for _ in range(40):
        hashes[live.step_number] = live.simulation.state_hash()
        live.step()
    assert live.simulation.read("CountsSteps.keys")[0] == [ord("k")]
    assert live.simulation.read("CountsSteps.calls")[0] == [50]
    np.testing.assert_allclose(live.frame().pos, [[30.0, 40.0, 5.0]] * 3, atol=5.0)
    for step in (40, 12, 11, 10, 35):
        live.seek(step * 0.1)
        assert live.simulation.state_hash() == hashes[step]
    live.step_back(30)
    live.step(50)
    other = Simulation(clickable())
    other.step(10)
    other.publish(WorldPointClicked, pos=(30.0, 40.0, 5.0))
    other.publish(CustomKeyPress, key="k")
    other.step(45)
    assert live.step_number == 55
    assert live.simulation.state_hash() == other.state_hash()
    assert len(live.injections) == 2


def test_something_said_in_the_past_makes_another_future():
    live = Live(Simulation(clickable()), threaded=False)
    live.step(5)
    live.publish_click((1.0, 2.0, 3.0))
    live.step(20)
    live.publish_click((-9.0, -9.0, -9.0))
    live.step(20)
    live.seek(1.5)
    live.publish_click((50.0, 0.0, 0.0))
    assert live.span == (0.0, pytest.approx(1.5))
    assert [i.step for i in live.injections] == [5, 15]
    live.step(30)
    other = Simulation(clickable())
    other.step(5)
    other.publish(WorldPointClicked, pos=(1.0, 2.0, 3.0))
    other.step(10)
    other.publish(WorldPointClicked, pos=(50.0, 0.0, 0.0))
    other.step(30)
    assert live.simulation.state_hash() == other.state_hash()
    live.seek(1.2)
    live.seek(4.5)
    assert live.simulation.state_hash() == other.state_hash()
    assert live.frame_at(1.5).t == pytest.approx(1.5)
    assert live.frame_at(1e9).step <= 45


def test_after_the_end_nobody_hears():
    live = Live(Simulation(clickable()), threaded=False)
    live.seek(100.0)
    live.publish_key("k")
    assert live.injections == []
    assert live.notes == ["CustomKeyPress: the game is over, so the message is dropped"]


def test_happenings_of_a_future_that_will_not_be_are_forgotten():
    block = Block(name="drone", autonomy=GoWhereClicked(), motion=SingleIntegrator())
    game = hunt()
    live = Live(Simulation(game.replace(blocks=[*game.blocks, block])), threaded=False)
    live.step(60)
    all_told = live.events
    assert {h.kind for h in all_told} >= {"birth", "death", "end"}
    live.seek(1.2)
    live.publish_click((1.0, 2.0, 3.0))
    assert live.events == [h for h in all_told if h.t < 1.15]
    live.step(60)
    assert [h.kind for h in live.events].count("birth") == [h.kind for h in all_told].count("birth")
    assert live.events[-1].kind == "end"


# -- recorders ------------------------------------------------------------------------------------------------------------------------


def tables(directory):
    run = load_run(directory)
    return run.trajectory_table, run.events_table, run


def test_a_recording_of_a_game_that_is_wound_back_is_of_one_game(tmp_path):
    with Recorder(alone := Simulation(hunt()), tmp_path / "alone"):
        alone.run()
    with Recorder(sim := Simulation(hunt()), tmp_path / "live") as recorder:
        live = Live(sim, threaded=False)
        for t in (2.0, 0.5, 1.0, 3.0, 2.9, 0.0, 5.0, 4.0, 10.0, 1.0, 10.0):
            live.seek(t)
        live.stop()
        assert not recorder.is_closed
    assert tables(tmp_path / "live")[:2] == tables(tmp_path / "alone")[:2]
    run = load_run(tmp_path / "live")
    assert run.is_complete
    assert run.info["worlds"] == load_run(tmp_path / "alone").info["worlds"]


@pytest.mark.parametrize("change", ["said", "begun anew"])
def test_a_recording_ends_as_of_the_farthest_step_when_the_game_takes_another_course(tmp_path, change):
    with Recorder(alone := Simulation(clickable()), tmp_path / "alone"):
        alone.step(40)
    sim = Simulation(clickable())
    heard = []
    sim.observers.append(lambda s: heard.append(int(s.steps[0])))
    with Recorder(sim, tmp_path / "live") as recorder:
        live = Live(sim, threaded=False)
        live.step(40)
        live.seek(1.0)
        assert not recorder.is_closed
        if change == "said":
            live.publish_click((1.0, 2.0, 3.0))
            first = 10
        else:
            live.reset(5)
            first = 0
        assert recorder.is_closed
        assert live.step_number == first
        live.step(5)
        assert live.error is None
    one, two = load_run(tmp_path / "alone"), load_run(tmp_path / "live")
    assert two.trajectory_table == one.trajectory_table
    assert two.events_table == one.events_table
    assert two.info["worlds"] == one.info["worlds"]
    assert "took another course" in two.info["interrupted"]
    assert [n for n in live.notes if "the recording ends at 4 s" in n]
    assert heard == [*range(40), *range(first, first + 5)]


# -- what cannot be rewound --------------------------------------------------------------------------------------------------------


class Mute(Autonomy):
    """Holds something that it cannot save."""

    link = Handle()
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def open_one(self, row):
        return object()

    def step(self, g):
        self.velocity[:] = 1.0


class Elsewhere(Autonomy):
    """Promises nothing."""

    grade = "external"
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def step(self, g):
        self.velocity[:] = 1.0


@pytest.mark.parametrize(
    ("plugin", "why"), [(Mute(), "Mute holds objects outside"), (Elsewhere(), "external")]
)
def test_games_with_something_outside_go_forward_only_and_say_why(plugin, why):
    block = Block(name="robot", autonomy=plugin, motion=SingleIntegrator())
    with Simulation(Mission(blocks=[block], end=5.0)) as sim:
        live = Live(sim, threaded=False)
        live.step(10)
        live.step_back(3)
        live.seek(0.0)
        assert live.step_number == 10
        (note,) = live.notes
        assert note.startswith("the game cannot be rewound: ")
        assert why in note
        live.seek(2.0)
        assert live.step_number == 20
        assert live.frame_at(0.5).step == 5
        live.reset()
        assert live.step_number == 0
        assert live.error is None


# -- memory -----------------------------------------------------------------------------------------------------------------------------


def test_snapshots_stay_within_their_memory_and_lie_closer_near_the_present():
    sim = Simulation(clickable(end=1e4))
    one = memory_of(sim.snapshot())
    timeline = Timeline(sim, 0, every=0.1, limit=30 * one)
    for step in range(1000):
        timeline.keep(step)
        sim.step()
        assert timeline.size <= 31 * one
    steps = np.array(timeline.steps)
    assert steps[0] == 0
    assert steps[-1] == 999
    assert 25 <= len(steps) <= 31
    # Replaying from the snapshot before any step takes at most a part of the way back to it.
    gap, age = np.diff(steps), 999 - steps[:-1]
    assert (gap <= np.maximum(2, 0.5 * age)).all()
    assert gap[-3:].max() <= 4
    for step in (0, 5, 700, 998, 999, 5000):
        found, snapshot = timeline.nearest(step)
        assert found == steps[steps <= step].max()
        assert snapshot.world["step"] == [found]
    assert timeline.nearest(-1) is None
    timeline.forget_after(500)
    assert timeline.steps == [s for s in steps if s <= 500]
    timeline.clear()
    assert (timeline.steps, timeline.size) == ([], 0)


def test_snapshots_are_taken_as_often_as_is_wanted():
    sim = Simulation(clickable(end=1e4))
    live = Live(sim, threaded=False, snapshot_every=2.0)
    live._player.timeline._allowance.share = 1e9  # time is no object here
    live.step(100)
    assert live._player.timeline.steps == [0, 20, 40, 60, 80, 100]


def test_the_memory_of_a_snapshot_is_that_of_its_arrays():
    sim = Simulation(hunt(n_prey=1000, end=10.0))
    sim.step(3)
    n = 1000 + 3
    body = 8 * (22 + 5) * n
    size = memory_of(sim.snapshot())
    assert body < size < 5 * body
    sim.run()
    assert memory_of(sim.snapshot()) > size  # the last states of the world are parked


def test_the_history_thins_itself_out_evenly():
    sim = Simulation(clickable(end=1e4))
    history = History(sim, 0, limit=100 * (11 * 3 * 4 + 200))
    history._allowance.share = 1e9  # time is no object here
    for step in range(1000):
        history.offer(step)
        history.offer(step)
        sim.step()
    steps = history.steps
    assert history.size <= 100 * (11 * 3 * 4 + 200)
    assert 50 <= len(steps) <= 100
    assert set(np.diff(steps)) == {16}
    assert steps[0] == 0
    history.forget_after(500)
    assert history.steps == [s for s in steps if s <= 500]
    history.clear()
    assert history.at(10) is None
    assert history.size == 0
