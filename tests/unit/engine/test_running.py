"""Ends, pauses, resets, and what is read and written from outside."""

from __future__ import annotations

import threading
import time

import numpy as np
import pytest
from small_worlds import (
    Drift,
    Listener,
    NoteMetric,
    Reaper,
    Talker,
    Wander,
    alone,
    block,
    hashes,
    mission,
)

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, Interaction, Metric, Output, Param, State
from tussle.errors import MissionError, ParameterError, SnapshotError
from tussle.scene import Cuboid, Scene
from tussle.stock import FreeBody, NoisyContacts, Predator, SimpleCapture, SimpleCollision, Still, Unicycle


class Tally(Metric):
    n = State(dtype=int, per="world")

    def step(self, w):
        self.n[:] += 1

    def result(self, w):
        return {"n": self.n}


class Substeps(Autonomy):
    speed = Output(unit="m/s")
    turn_rate = Output(unit="rad/s")
    pitch_rate = Output(unit="rad/s")

    def step(self, g):
        self.speed[:] = 1.0


# -- ends -----------------------------------------------------------------------------------------------------------------------


def teams(**values):
    return [block("one", team=1, count=2), block("two", team=2, count=3, **values)]


@pytest.mark.parametrize(
    ("conditions", "reapers", "end", "steps"),
    [
        ("time", {1: 0.3, 2: 0.5}, "time", 10),
        ("time, one_team", {1: 0.3}, "one_team", 3),
        ("one_team", {2: 0.5}, "one_team", 5),
        ("time, all_dead", {1: 0.3}, "time", 10),
        ("time, all_dead", {1: 0.3, 2: 0.5}, "all_dead", 5),
        ("one_team", {1: 0.3, 2: 0.3}, "all_dead", 3),
    ],
)
def test_end_conditions(conditions, reapers, end, steps):
    judges = [Reaper(team=team, at=at, name=f"Reaper{team}") for team, at in reapers.items()]
    result = Simulation(mission(*teams(), end_conditions=conditions, interactions=judges)).run()[0]
    assert (result.end, result.steps) == (end, steps)
    assert result.t == pytest.approx(0.1 * steps)


def test_no_condition_ends_nothing():
    sim = Simulation(
        mission(
            *teams(),
            end_conditions="none",
            interactions=[Reaper(team=1, at=0.1), Reaper(team=2, at=0.1, name="R")],
        )
    )
    sim.step(30)
    assert not sim.is_over
    assert sim.steps[0] == 30
    assert sim.result()[0].end == ""


def test_a_mission_of_one_team_is_no_last_team_standing():
    assert Simulation(mission(block(), end_conditions="time, one_team")).run()[0].end == "time"


@pytest.mark.parametrize("team", [1, 2])
def test_the_game_is_open_while_births_are_to_come_and_ends_when_the_last_one_changes_nothing(team):
    """Team 1 is gone at 0.2 s, and one is born at 0.5 s: of it, or of team 2, so that nobody dies in the step that decides."""
    late = block("late", team=team, count=1, rate=1.0, first_birth=0.5)
    blocks = block("one", team=1), block("two", team=2), late
    game = mission(*blocks, end_conditions="time, one_team", interactions=[Reaper(team=1, at=0.2)])
    result = Simulation(game).run()[0]
    assert (result.end, result.steps) == ("one_team", 6)


def test_a_game_that_is_decided_before_it_begins_ends_with_the_first_step_also_after_a_reset():
    game = mission(block("one", team=1, count=0), block("two", team=2), end_conditions="time, one_team")
    assert Simulation(game).run()[0].steps == 1
    sim = Simulation(
        game.replace(
            blocks=[block("one", team=1), block("two", team=2)], interactions=[Reaper(team=1, at=0.5)]
        ),
        seeds=[1, 2],
    )
    sim.step(3)
    sim.reset([1], params={"Reaper.at": 0.0})
    assert [r.steps for r in sim.run()] == [5, 1]


def test_without_health_an_entity_is_removed():
    class Doctor(Interaction):
        def step(self, w):
            w.bodies.health[w.id == 2] -= 0.3

    sim = Simulation(mission(block(count=3), interactions=[Doctor()]))
    sim.step(3)
    assert sim.read("a.health")[0][0].tolist() == pytest.approx([1.0, 0.1, 1.0])
    sim.step()
    assert sim.read("a.id")[0][0].tolist() == [1, -1, 3]
    assert sim.result()[0].alive == {0: 2}


def test_the_killed_are_seen_until_the_end_of_the_step():
    class Watch(Metric):
        n = State(dtype=int, per="world")

        def step(self, w):
            self.n[:] = np.bincount(w.world, minlength=w.n_worlds)

    sim = Simulation(
        mission(
            block(team=1, count=2),
            interactions=[Reaper(team=1, at=0.0)],
            metrics=[Watch()],
            end_conditions="none",
        )
    )
    sim.step()
    assert sim.read("Watch.n")[0].tolist() == [2]
    assert sim.read("a.pos")[1].sum() == 0


# -- running --------------------------------------------------------------------------------------------------------------------


def test_run_until_a_time_or_a_condition():
    sim = Simulation(mission())
    sim.run(until=0.35)
    assert sim.steps[0] == 4
    sim.run(until=0.4)
    assert sim.steps[0] == 4
    sim.run_until(lambda s: s.read("a.pos")[0][0, 0, 0] > 0.55)
    assert sim.steps[0] == 6
    assert sim.run()[0].steps == 10
    sim.step(5)
    assert sim.steps[0] == 10
    assert sim.is_over


def test_observers_see_each_step_before_it_is_made():
    sim, seen = Simulation(mission()), []
    sim.observers.append(lambda s: seen.append((int(s.steps[0]), float(s.read("a.pos")[0][0, 0, 0]))))
    sim.run()
    assert [k for k, _ in seen] == list(range(10))
    assert [x for _, x in seen] == pytest.approx([0.1 * k for k in range(10)])


def test_pause_holds_run_in_its_thread_and_changes_nothing():
    game = mission(block(autonomy=Wander(), count=5), end=3.0)
    sim = Simulation(game, seeds=7)
    sim.observers.append(lambda s: s.pause() if s.steps[0] == 11 else None)
    thread = threading.Thread(target=sim.run)
    thread.start()
    limit = time.monotonic() + 300.0
    while sim.steps[0] < 12 and time.monotonic() < limit:
        time.sleep(0.005)
    time.sleep(0.05)
    assert sim.is_paused
    assert sim.steps[0] == 12
    sim.step()
    assert sim.steps[0] == 13
    sim.observers.clear()
    sim.resume()
    thread.join(timeout=300.0)
    assert not thread.is_alive()
    assert sim.state_hash() == alone(game, 7).state_hash()


# -- reset ------------------------------------------------------------------------------------------------------------------------


def rich(**values):
    """A game with nearly everything in it that a reset has to put back."""
    return mission(
        block(
            "a",
            team=1,
            count=4,
            variance=(50, 50, 50),
            autonomy=[Wander(), Talker(), Listener(rate=2.5)],
            sensor=NoisyContacts(),
        ),
        block(
            "late",
            team=2,
            count=5,
            rate=4.0,
            interval_sd=0.05,
            variance=(50, 50, 50),
            autonomy=[Wander(), Listener()],
        ),
        interactions=[SimpleCollision(collision_range=3.0)],
        metrics=[NoteMetric()],
        end=2.0,
        **values,
    )


def test_a_slot_takes_the_next_seed_while_its_neighbours_go_on():
    game = rich(end_conditions="time")
    fresh = hashes(game, [1, 2, 3, 4])
    sim = Simulation(game, seeds=[1, 2])
    sim.step(5)
    sim.reset([1], seeds=[2])
    sim.run(until=None)
    done = {r.seed: r.state_hash for r in sim.result()}
    sim.reset([0, 1], seeds=[3, 4])
    sim.run()
    done |= {r.seed: r.state_hash for r in sim.result()}
    assert [done[s] for s in (1, 2, 3, 4)] == fresh


def test_the_last_to_end_stay_as_they_are_when_another_begins_anew():
    sim = Simulation(mission(block(autonomy=Wander())), seeds=[1, 2])
    sim.run()
    before, hash_ = sim.read("a.pos")[0][1].copy(), sim.state_hash(1)
    sim.reset([0])
    sim.run()
    assert np.array_equal(sim.read("a.pos")[0][1], before)
    assert sim.state_hash(1) == hash_


def test_reset_gives_seeds_and_params_in_the_order_of_the_worlds():
    sim = Simulation(mission(), seeds=[1, 2, 3])
    sim.reset([2, 0], seeds=[30, 10], params={"a.Drift.to": [(3.0, 0, 0), (1.5, 0, 0)]})
    assert sim.state.context.seeds.tolist() == [10, 2, 30]
    sim.step()
    assert sim.read("a.pos")[0][:, 0, 0].tolist() == pytest.approx([0.15, 0.1, 0.3])
    sim.reset(w for w in (0, 1))
    assert sim.steps.tolist() == [0, 0, 1]
    assert sim.read("a.pos")[1].sum() == 3


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([0, 0],), r"reset: worlds = \[0, 0\] .*0 to 1, each once"),
        (([0, 1], [5]), r"reset: 1 seeds for 2 worlds"),
        (([0], None, {"a.Drift.two": 1}), r"Drift has no 'two' \(did you mean 'to'\?\)"),
    ],
)
def test_resets_that_cannot_be(arguments, message):
    sim = Simulation(mission(), seeds=[1, 2])
    sim.step()
    with pytest.raises(ParameterError, match=message):
        sim.reset(*arguments)
    assert sim.state.context.seeds.tolist() == [1, 2]
    assert sim.steps.tolist() == [1, 1]


# -- snapshots --------------------------------------------------------------------------------------------------------------------


def test_restore_takes_parameters_back_for_those_yet_to_be_born():
    game = mission(block(count=3, rate=5.0), end=1.0)
    sim = Simulation(game, seeds=[1, 2])
    sim.step(3)
    saved = sim.snapshot()
    sim.reset([0], params={"a.Drift.to": (5.0, 0.0, 0.0)})
    sim.step(3)
    sim.restore(saved)
    assert [r.state_hash for r in sim.run()] == hashes(game, [1, 2])


def test_snapshots_of_something_else_are_refused():
    saved = Simulation(mission()).snapshot()
    with pytest.raises(SnapshotError, match=r"has 1 worlds of mission .*, the simulation 2"):
        Simulation(mission(), seeds=[1, 2]).restore(saved)


@pytest.mark.parametrize(
    ("other", "differs"),
    [
        (mission(block("b")), r"a = Block \(here absent\), b = absent \(here Block\)$"),
        (mission(dt=0.25), r"run.dt = 0.1 \(here 0.25\)$"),
        (mission(block(count=7)), r"a.count = 1 \(here 7\)$"),
        (mission(block(autonomy=Drift(to=(1, 2, 3)))), r"a.Drift.to = .* \(here \(1.0, 2.0, 3.0\)\)$"),
        (mission(block(motion=Unicycle(), autonomy=Substeps())), r"a.Drift = Drift \(here absent\), .*, and \d more$"),
        (mission(scene=Scene(walls=[Cuboid((0, 0, 0), (1, 1, 1))])), r"run.scene = Scene.*"),
    ],
)  # fmt: skip
def test_a_snapshot_of_another_mission_says_what_differs(other, differs):
    saved = Simulation(mission()).snapshot()
    with pytest.raises(SnapshotError, match=rf"missions must be equal; in the snapshot, {differs}"):
        Simulation(other).restore(saved)


def test_snapshot_of_groups_that_are_not_there():
    game = mission(block(motion=Unicycle(), autonomy=Substeps()))
    split = Simulation(game, seeds=[1, 2], params={"a.Unicycle.enable_roll": [False, True]})
    saved = split.snapshot()
    with pytest.raises(SnapshotError, match="a block that has had none"):
        Simulation(game, seeds=[1, 2]).restore(saved)


# -- from outside -----------------------------------------------------------------------------------------------------------------


def test_read_is_in_stable_agent_order_with_who_lives():
    sim = Simulation(
        mission(block("a", count=3, autonomy=Wander(), variance=(9, 9, 9)), block("b", team=1)), seeds=[1, 2]
    )
    pos, alive = sim.read("a.pos")
    assert pos.shape == (2, 3, 3)
    sim.write("a.health", [[1.0, 0.0, 1.0], [1.0, 1.0, 1.0]])
    sim.step()
    after, alive = sim.read("a.pos")
    assert alive.tolist() == [[True, False, True], [True, True, True]]
    assert np.abs(after - pos)[alive].max() < 1.0
    assert sim.read("a.id")[0].tolist() == [[1, -1, 3], [1, 2, 3]]
    assert sim.read("a.yaw")[0].shape == (2, 3)
    assert sim.read("a.forward")[0].shape == (2, 3, 3)


def test_worlds_that_have_ended_are_read_as_they_ended():
    game = mission(
        block(team=1), block("b", team=2), end_conditions="time, one_team", interactions=[Reaper(team=2)]
    )
    sim = Simulation(game, seeds=[1, 2], params={"Reaper.at": [0.3, 99.0]})
    sim.run()
    assert sim.read("a.pos")[0][:, 0, 0].tolist() == pytest.approx([0.3, 1.0])
    assert sim.read("a.Drift.velocity")[0][:, 0, 0].tolist() == [1.0, 1.0]


def test_write_reaches_the_plugins_and_the_motion():
    sim = Simulation(mission(block(count=2), block("b", position=(5, 0, 0))), seeds=[1, 2])
    sim.write("a.Drift.to", [[(1.0, 0, 0), (2.0, 0, 0)], [(3.0, 0, 0), (4.0, 0, 0)]])
    sim.write("b.pos", (100.0, 0.0, 0.0))
    sim.step()
    assert sim.read("a.pos")[0][..., 0].tolist() == [pytest.approx([0.1, 0.2]), pytest.approx([0.3, 0.4])]
    assert sim.read("b.pos")[0][..., 0].tolist() == [[100.1], [100.1]]


def hunt():
    """Two hunters, who come first, and three prey."""
    hunter = block(
        "hunter", team=2, count=2, autonomy=Predator(allow_prey_switching=False), motion=Unicycle()
    )
    prey = block("prey", team=1, count=3, position=(500, 0, 0), variance=(100, 100, 0))
    return mission(hunter, prey, interactions=[SimpleCapture()])


@pytest.mark.parametrize("target", [-1, 6, 10**6, 2**62, -(2**63)])
def test_a_reference_that_names_nobody_is_nobody(target):
    sim = Simulation(hunt(), seeds=[1, 2])
    untouched = Simulation(hunt(), seeds=[1, 2])
    for each in (sim, untouched):
        each.step(2)
    assert sim.read("hunter.Predator.target")[0].min() >= 3
    sim.write("hunter.Predator.target", target)
    sim.step()
    untouched.write("hunter.Predator.target", 0)
    untouched.step()
    assert [sim.state_hash(w) for w in (0, 1)] == [untouched.state_hash(w) for w in (0, 1)]


@pytest.mark.parametrize("target", [0.5, 1e300])
def test_a_reference_is_a_whole_number(target):
    with pytest.raises(ParameterError, match=r"'hunter.Predator.target': values must be whole numbers"):
        Simulation(hunt()).write("hunter.Predator.target", target)


def test_world_columns_are_read_and_written_by_world():
    sim = Simulation(mission(metrics=[Tally()]), seeds=[1, 2])
    sim.step(2)
    sim.write("Tally.n", [10, 20])
    sim.step()
    values, there = sim.read("Tally.n")
    assert values.tolist() == [11, 21]
    assert there.all()


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        ("a.pso", 0.0, r"'a.pso': a has no 'pso' \(did you mean 'pos'\?\)"),
        ("c.pos", 0.0, r"'c.pos': the mission has no 'c'; there are: run, a, GlobalNetwork"),
        ("a", 0.0, r"'a' is not a value; in a there are: pos, vel"),
        ("a.Drft.to", 0.0, r"'a.Drft.to': a has no 'Drft' \(did you mean 'Drift'\?\)"),
        ("a.Drift.too", 0.0, r"'a.Drift.too': Drift has no 'too' \(did you mean 'to'\?\)"),
        ("a.yaw", 0.0, r"'a.yaw' cannot be written; there are: pos, vel, quat"),
        ("a.id", 0.0, r"'a.id' cannot be written"),
        ("a.pos", [1.0, 2.0], r"'a.pos': values have shape \(2,\); .*\(1, 1, 3\)"),
        ("a.pos", np.nan, r"'a.pos': values hold NaN|'a.pos': values must be finite"),
        ("a.pos", np.inf, r"'a.pos': values must be finite"),
        ("a.Unicycle.vel_max", -1.0, r"a.Unicycle.vel_max: Unicycle.vel_max = .*-1.0.* is not allowed"),
        ("GlobalNetwork.comm_dely", 0.0, r"GlobalNetwork has no 'comm_dely' \(did you mean 'comm_delay'\?\)"),
    ],
)
def test_paths_and_values_that_are_refused(path, value, message):
    sim = Simulation(mission(block(motion=Unicycle(), autonomy=[Substeps(), Drift()])))
    with pytest.raises(ParameterError, match=message):
        sim.write(path, value)


def test_reading_what_has_no_fixed_shape_is_refused():
    class Marks(Interaction):
        mark = State(per="entity")

    sim = Simulation(mission(interactions=[Marks()]))
    with pytest.raises(ParameterError, match=r"Marks.mark.*per entity"):
        sim.read("Marks.mark")


def test_parameters_with_several_fields_are_checked_when_written():
    class Bounded(Autonomy):
        box = Param((1.0, 2.0), fields="a b", ge=0.0)

        def step(self, g):
            pass

    sim = Simulation(mission(block(autonomy=[Drift(), Bounded()])))
    with pytest.raises(ParameterError, match=r"Bounded.box = .* is not allowed.*>= 0"):
        sim.write("a.Bounded.box", [[(1.0, -2.0)]])


class Limits:
    low = Param(0.0, ge=-9.0)
    high = Param(1.0)
    size = Param(3, structural=True)
    name_ = Param("a", choices=("a", "b"))
    seen = State("x y")

    def check_values(self):
        self.check_order("low", "high")


class LimitsOfAll(Limits, Interaction):
    pass


class LimitsOfEach(Limits, Autonomy):
    def step(self, g):
        pass


@pytest.mark.parametrize(("owner", "shape"), [("LimitsOfAll", (2,)), ("a.LimitsOfEach", (2, 2))])
def test_values_that_plugins_compare_are_compared_when_one_is_written(owner, shape):
    game = mission(block(count=2, autonomy=[Drift(), LimitsOfEach()]), interactions=[LimitsOfAll()])
    sim = Simulation(game, [1, 2])
    sim.write(f"{owner}.high", 5.0)
    sim.write(f"{owner}.low", 3.0)
    one = np.full(shape, 3.0)
    one[-1] = 5.5
    for values in (6.0, one):
        text = rf"'{owner}.low': Limits\w+.low = \S+ with high = 5.0 is not allowed; low must not be larger than high"
        with pytest.raises(ParameterError, match=text):
            sim.write(f"{owner}.low", values)
    with pytest.raises(ParameterError, match=r"low = 3.0 with high = 2.0"):
        sim.write(f"{owner}.high", 2.0)
    np.testing.assert_array_equal(sim.read(f"{owner}.low")[0], np.full(shape, 3.0))


@pytest.mark.parametrize(
    "path", ["LimitsOfAll.size", "a.LimitsOfEach.size", "a.count", "a.heading", "run.dt"]
)
def test_what_is_fixed_in_a_simulation_is_told_from_what_does_not_exist(path):
    sim = Simulation(mission(block(autonomy=[Drift(), LimitsOfEach()]), interactions=[LimitsOfAll()]))
    for use in (sim.read, lambda path: sim.write(path, 1)):
        with pytest.raises(ParameterError, match=rf"'{path}' is fixed once the simulation is built"):
            use(path)
    with pytest.raises(ParameterError, match=r"has no 'siz'"):
        sim.write("a.LimitsOfEach.siz", 1)


# -- parameters per world -------------------------------------------------------------------------------------------------------


def test_params_differ_between_worlds_and_each_is_as_alone():
    game = mission(block(count=2, variance=(9, 9, 9), autonomy=Wander()), interactions=[SimpleCollision()])
    values = {
        "a.Wander.spread": [0.5, 2.0, 1.0],
        "a.speed": [1.0, 2.0, 3.0],
        "a.heading": ["90 deg", 0.0, 1.0],
        "SimpleCollision.collision_range": [0.0, 1.0, 50.0],
    }
    sim = Simulation(game, seeds=[1, 2, 3], params=values)
    assert sim.read("a.yaw")[0][:2, 0].tolist() == pytest.approx([np.pi / 2, 0.0])
    assert sim.read("a.pos")[1].tolist() == [[True] * 2, [True] * 2, [False] * 2]
    sim.run()
    for k in range(3):
        one = Simulation(game, seeds=k + 1, params={path: v[k] for path, v in values.items()})
        one.run()
        assert one.state_hash() == sim.state_hash(k)


def test_structural_params_split_groups_and_each_world_is_as_alone():
    game = mission(
        block(
            count=2,
            variance=(9, 9, 9),
            motion=Unicycle(vel_max=9.0),
            autonomy=[Substeps(), Talker(), Listener()],
            speed=1.0,
        ),
        end=1.0,
    )
    roll = [False, True, False]
    sim = Simulation(
        game, seeds=[1, 2, 3], params={"a.Unicycle.enable_roll": roll, "a.Unicycle.vel_max": [1.0, 2.0, 3.0]}
    )
    assert len([g for g in sim.state.population.groups if g.n]) == 2
    sim.run()
    assert sim.read("a.pos")[1].all()
    for k in range(3):
        one = Simulation(
            game, seeds=k + 1, params={"a.Unicycle.enable_roll": roll[k], "a.Unicycle.vel_max": k + 1.0}
        )
        one.run()
        assert one.state_hash() == sim.state_hash(k)


@pytest.mark.parametrize(
    ("params", "message"),
    [
        ({"b.Drift.to": 1}, r"'b.Drift.to': the mission has no 'b'; there are: run, a"),
        ({"a.Drif.to": 1}, r"'a.Drif.to': a has no 'Drif' \(did you mean 'Drift'\?\)"),
        ({"a.Drift.two": 1}, r"'a.Drift.two': Drift has no 'two' \(did you mean 'to'\?\)"),
        ({"a.sped": 1}, r"'a.sped': a has no 'sped' .did you mean 'speed'"),
        ({"a": 1}, r"'a' is not a value; in a there are: name, team"),
        ({"a.speed": "3 kg"}, r"a.speed = '3 kg'"),
        ({"a.speed": -1.0}, r"a.speed = -1.0 is not allowed"),
        ({"a.health": 0.0}, r"a.health = 0.0 is not allowed"),
        ({"a.mass": [1.0, -1.0]}, r"a.mass = -1.0 is not allowed"),
        ({"a.Drift.to": (1, 2)}, r"Drift.to = \(1, 2\) is not allowed; it takes 3 values \(x, y, z\)"),
        ({"a.Drift.to": float("nan")}, r"Drift.to = nan is not allowed"),
        ({"GlobalNetwork.comm_delay": [0.0, -1.0]}, r"comm_delay = -1.0 is not allowed"),
    ],
)
def test_bad_params_are_refused_with_their_path(params, message):
    with pytest.raises(ParameterError, match=message):
        Simulation(mission(), seeds=[1, 2], params=params)


def test_a_structural_param_of_a_world_plugin_belongs_to_the_mission():
    game = mission(interactions=[SimpleCollision()])
    with pytest.raises((MissionError, ParameterError), match="startup_collisions_only"):
        Simulation(game, seeds=[1, 2], params={"SimpleCollision.startup_collisions_only": [True, False]})


def test_a_ragged_param_belongs_to_the_mission():
    class Path(Autonomy):
        points = Param([(1.0, 2.0)], fields="x y", ragged=True)
        n = State(dtype=int)

        def step(self, g):
            for row in range(g.n):
                self.n[row] = self.points[row].shape[1]

    game = mission(
        block("a", count=2, autonomy=[Drift(), Path(points=[(1, 2), (3, 4), (5, 6)])]),
        block("b", autonomy=[Drift(), Path()]),
    )
    sim = alone(game, 1)
    assert sim.read("a.Path.n")[0].tolist() == [[3, 3]]
    assert sim.read("b.Path.n")[0].tolist() == [[1]]
    with pytest.raises(ParameterError, match=r"a\.Path\.points"):
        Simulation(game, params={"a.Path.points": [(1.0, 2.0)]})


def test_an_error_in_one_part_is_raised_when_all_parts_have_ended():
    begun = []

    def run(first, last):
        begun.append((first, last))
        if first == 0:
            raise ZeroDivisionError

    with Simulation(Mission(blocks=[Block(name="a", motion=Still())]), threads=3) as sim:
        with pytest.raises(ZeroDivisionError):
            sim.state.context.split(1000, run)
        assert sum(last - first for first, last in begun) == 1000


def test_an_angular_velocity_that_is_written_is_flown_on_with():
    block = Block(name="a", count=2, motion=FreeBody(), position=(0, 0, 1000))
    with Simulation(Mission(blocks=[block], dt=0.01, end=1.0), 1) as sim:
        sim.step(3)
        sim.write("a.omega", [[[0.0, 0.0, 0.0], [0.0, 0.0, 2.0]]])
        sim.step(10)
        omega, quat = sim.read("a.omega")[0][0], sim.read("a.quat")[0][0]
    np.testing.assert_allclose(omega, [[0, 0, 0], [0, 0, 2]], atol=1e-9)
    np.testing.assert_allclose(quat, [[1, 0, 0, 0], [np.cos(0.1), 0, 0, np.sin(0.1)]], atol=1e-9)
