"""What came from outside is recorded with its step, and a game to which it comes again is the same game."""

from __future__ import annotations

import numpy as np
import pyarrow as pa
import pytest

from tussle import Block, Mission, Recorder, Simulation, load_run
from tussle.api import EasyAutonomy, Field, Handle, Interaction, Message, Output, Param, State, Subscribe
from tussle.errors import ParameterError, RecordError
from tussle.record import ExternalInput, given_by, load_inputs
from tussle.record.input_table import inputs_of
from tussle.record.inputs import fields_of
from tussle.record.schema import INPUTS
from tussle.stock import SingleIntegrator, Still
from tussle.view import Live
from tussle.view.serve import Session


class Course(Message):
    """A stranger's message."""

    to = Field("x y z", "m m m")
    speed = Field(unit="m/s")
    who = Field(dtype=int)
    marks = Field("x y", "m m", ragged=True)
    why = Handle(doc="Text.")


class Steered(EasyAutonomy):
    """Goes where the last message says."""

    orders = Subscribe(Course)
    velocity = Output("velocity_x velocity_y velocity_z", "m/s")
    haste = Param(1.0, doc="Factor of the speed.")
    target = State("x y z", "m")
    tempo = State(unit="m/s")
    n_marks = State(dtype=int)

    def step_one(self, me):
        """Follow the newest order."""
        for order in me.orders:
            if order.who in (0, me.id):
                me.target, me.tempo = order.to, order.speed
                me.n_marks = me.n_marks + len(order.why) + int(np.sum(order.marks))
        away = me.target - me.pos
        me.velocity = me.haste * me.tempo * away / (1.0 + np.linalg.norm(away))


class Wind(Interaction):
    """Counts, per world."""

    strength = Param(0.5, unit="m/s")
    blown = State(unit="m", per="world")

    def step(self, w):
        """Add up."""
        self.blown += self.strength * w.dt


def mission(end=6.0):
    kind = {"motion": SingleIntegrator(), "autonomy": Steered(), "variance": (20, 20, 5), "radius": 0.5}
    fleet = Block(name="fleet", count=5, position=(0, 0, 10), **kind)
    late = Block(name="late", count=3, position=(50, 0, 10), rate=1.0, first_birth=1.0, slots=1, **kind)
    return Mission(name="steered", blocks=[fleet, late], interactions=[Wind()], end=end, dt=0.1)


def meddle(sim, rng, world=None):
    """One to three inputs of random kinds."""
    worlds = None if world is None else [world]
    for kind in rng.integers(0, 5, rng.integers(1, 4)):
        if kind in (0, 4):
            marks = rng.normal(size=(2, rng.integers(0, 4)))
            some = rng.choice(np.arange(1, 6), rng.integers(1, 4), replace=False) if kind == 4 else ()
            sim.publish(
                Course, worlds, receivers=some, to=rng.normal(size=3) * 100, speed=rng.uniform(0, 20), who=int(rng.integers(0, 6)),
                marks=[marks] * (sim.n_worlds if world is None else 1), why="because",
            )  # fmt: skip
        elif kind == 1:
            values, _ = sim.read("fleet.Steered.haste")
            values[...] = np.nan_to_num(values, nan=1.0) * rng.uniform(0.5, 2.0)
            sim.write("fleet.Steered.haste", values)
        elif kind == 2:
            values, _ = sim.read("fleet.pos")
            sim.write("fleet.pos", np.nan_to_num(values) + rng.normal(size=3))
        else:
            sim.write("Wind.strength", rng.uniform(0, 3))


def played(folder, seed=1, every=4):
    """A recorded game with inputs; its hash."""
    rng = np.random.default_rng(7)
    with Simulation(mission(), seed) as sim, Recorder(sim, folder, columns="*.target"):
        while not sim.is_over:
            if sim.steps[0] % every == 0:
                meddle(sim, rng)
            sim.step()
        return sim.state_hash()


def test_a_game_to_which_the_inputs_come_again_is_the_same(tmp_path):
    wanted = played(tmp_path / "first")
    inputs = load_inputs(tmp_path / "first")
    assert {each.kind for each in inputs} == {"message", "column"}
    assert {bool(each.to) for each in inputs if each.kind == "message"} == {False, True}
    assert [each.step for each in inputs] == sorted(each.step for each in inputs)
    with Simulation(mission(), 1) as sim:
        sim.run()
        assert sim.state_hash() != wanted
    with Simulation(mission(), 1) as sim, Recorder(sim, tmp_path / "second", columns="*.target"):
        sim.play_inputs(inputs)
        sim.run()
        assert sim.state_hash() == wanted
    assert load_inputs(tmp_path / "second") == inputs
    first, second = (load_run(tmp_path / name).trajectory_table for name in ("first", "second"))
    assert first.equals(second)


def test_in_a_stack_with_others_after_a_reset_and_after_a_restore(tmp_path):
    wanted = played(tmp_path / "run", seed=3)
    inputs = load_inputs(tmp_path / "run")
    with Simulation(mission(), 5) as alone:
        alone.run()
        bystander = alone.state_hash()
    with Simulation(mission(), [5, 3, 9]) as sim:
        sim.play_inputs(inputs, 1)
        sim.step(23)
        kept = sim.snapshot()
        sim.step(11)
        sim.restore(kept)
        sim.run()
        assert [sim.state_hash(0), sim.state_hash(1)] == [bystander, wanted]
        sim.reset([1])
        sim.run()
        assert sim.state_hash(1) == wanted


def test_each_world_of_a_stack_has_its_own(tmp_path):
    rng = np.random.default_rng(11)
    with Simulation(mission(), [4, 8]) as sim, Recorder(sim, tmp_path / "run"):
        for _ in range(40):
            meddle(sim, rng, int(rng.integers(0, 2)))
            sim.step()
        hashes = [sim.state_hash(0), sim.state_hash(1)]
    for world, seed in enumerate((4, 8)):
        with Simulation(mission(), seed) as sim:
            sim.play_inputs(load_inputs(tmp_path / "run", world))
            sim.step(40)
            assert sim.state_hash() == hashes[world]


def test_an_order_reaches_those_whom_it_is_for():
    with Simulation(mission(), [4, 8]) as sim:
        sim.publish(Course, [1], receivers=[2, 5], why="x", speed=3.0, to=(9, 9, 9))
        sim.step(2)
        tempo, _ = sim.read("fleet.Steered.tempo")
    assert tempo.tolist() == [[0, 0, 0, 0, 0], [0, 3, 0, 0, 3]]


def test_an_order_that_nobody_would_get_is_refused(tmp_path):
    deaf = Block(name="deaf", motion=Still(), radius=0.5)
    with (
        Simulation(mission().replace(blocks=[*mission().blocks, deaf]), 4) as sim,
        Recorder(sim, tmp_path / "run"),
    ):
        deaf_id = int(sim.state.population.bodies.id[sim.state.population.bodies.block == 2][0])
        with pytest.raises(
            ParameterError, match=r"receivers = 77 is not allowed; world 0 has no entity 77 now"
        ):
            sim.publish(Course, receivers=[1, 77])
        with pytest.raises(ParameterError, match=rf"no plugin of entity {deaf_id} subscribes to \S+/Course"):
            sim.publish(Course, receivers=[deaf_id])
        with pytest.raises(ParameterError, match=r"subscribes to \S+/Cours \(did you mean '\S+/Course'"):
            sim.publish(Course, topic="Cours", receivers=[1])
        sim.step()
    assert load_inputs(tmp_path / "run") == ()


def test_an_order_of_the_live_game_is_part_of_it(tmp_path):
    with (
        Simulation(mission(), 2) as sim, Recorder(sim, tmp_path / "run"),
        Live(sim, threaded=False, is_paused=True) as live,
    ):  # fmt: skip
        live.step(5)
        live.publish(Course, receivers=[3], why="x", speed=4.0, to=(50, 0, 0))
        live.publish(Course, receivers=[99], speed=4.0)
        assert live.notes == ["publish: receivers = 99 is not allowed; world 0 has no entity 99 now"]
        live.step(20)
        there = sim.state_hash()
        live.seek(0.2)
        live.step(23)
        assert sim.state_hash() == there
    with Simulation(mission(), 2) as again:
        again.play_inputs(load_inputs(tmp_path / "run"))
        again.step(25)
        assert again.state_hash() == there


class Numbers(Message):
    """A stranger's list of whole numbers."""

    of = Field(dtype=int, ragged=True)


def test_whole_numbers_in_lists_keep_their_64_bits(tmp_path):
    wanted = np.array([2**62 + 1, 2**53 + 1, -(2**63)])
    with Simulation(mission(), 1) as sim, Recorder(sim, tmp_path / "run"):
        sim.publish(Numbers, of=[wanted])
        sim.step()
    (sent,) = load_inputs(tmp_path / "run")
    (again,) = fields_of(Numbers, sent.values)["of"]
    assert again.tolist() == wanted.tolist()
    with Simulation(mission(), 1) as sim, Recorder(sim, tmp_path / "again"):
        sim.play_inputs([sent])
        sim.step()
    assert load_inputs(tmp_path / "again") == (sent,)


def test_a_killed_run_keeps_those_that_were_flushed(tmp_path):
    with Simulation(mission(), 1) as sim:
        recorder = Recorder(sim, tmp_path / "run")
        sim.publish(Course, to=(1, 2, 3), why="x")
        sim.step()
        recorder.flush()
        assert [each.name for each in load_inputs(tmp_path / "run")] == ["Course"]
        recorder.close()
    assert load_run(tmp_path / "run").inputs["topic"].tolist() == [""]


def test_an_object_is_told_and_not_repeated(tmp_path):
    with Simulation(mission(), 1) as sim, Recorder(sim, tmp_path / "run"):
        sim.publish(Course, why=object())
        sim.step()
    inputs = load_inputs(tmp_path / "run")
    assert inputs == (ExternalInput(0, "message", "Course", None),)
    with Simulation(mission(), 1) as sim:
        with pytest.raises(
            ParameterError, match=r"the message Course before step 0 held an object that was not recorded"
        ):
            sim.play_inputs(inputs)
        with pytest.raises(ParameterError, match=r"world = 1 is not allowed; there are worlds 0 to 0"):
            sim.play_inputs((), 1)


@pytest.mark.parametrize(
    ("given", "error"),
    [
        (
            ExternalInput(2, "message", "Coarse", {}),
            r"there is no message 'Coarse' \(did you mean 'Course'\?\)",
        ),
        (
            ExternalInput(2, "message", "Course", {"too": 1.0}),
            r"Course has no field 'too' \(did you mean 'to'\?\)",
        ),
        (ExternalInput(2, "column", "fleet.Steered.hast", [1.0] * 5), r"hast.*did you mean 'haste'"),
        (
            ExternalInput(2, "column", "fleet.Steered.haste", ["a"] * 5),
            r"Steered.haste = 'a' is not allowed; it takes a finite number",
        ),
    ],
)
def test_what_does_not_fit_the_game_is_an_error(given, error):
    with Simulation(mission(), 1) as sim:
        sim.play_inputs([given])
        sim.step(2)
        with pytest.raises(ParameterError, match=error):
            sim.step()


@pytest.mark.parametrize("text", ["{", "[1]", "nul", '"a"'])
def test_damaged_values_are_told(text):
    row = {
        "world": 0,
        "t": 0.0,
        "step": 3,
        "kind": "message",
        "name": "Course",
        "network": "",
        "topic": "",
        "values": text,
    }
    with pytest.raises(RecordError, match=r"the values of the message Course before step 3 are damaged"):
        inputs_of(pa.Table.from_pylist([row], INPUTS), 0)


def test_orders_of_a_served_game_are_recorded(tmp_path):
    with Simulation(mission(), 1) as sim, Recorder(sim, tmp_path / "run"):
        session = Session(sim)
        session.call("publish", {"message": "Course", "fields": {"to": [5, 6, 7], "speed": 3, "why": "go"}})
        session.call("write", {"path": "fleet.Steered.haste", "values": [[2, 2, 2, 2, 2]]})
        sim.run()
        wanted = sim.state_hash()
    with Simulation(mission(), 1) as sim:
        sim.play_inputs(load_inputs(tmp_path / "run"))
        sim.run()
        assert sim.state_hash() == wanted


def test_an_operator_takes_over_a_recorded_game(tmp_path):
    wanted = played(tmp_path / "run")
    inputs = load_inputs(tmp_path / "run")
    with Simulation(mission(), 1) as sim, Live(sim, threaded=False, is_paused=True, inputs=inputs) as live:
        live.step(60)
        assert sim.state_hash() == wanted
        live.seek(2.0)
        assert (live.notes, sim.steps[0]) == ([], 20)
        live.step(40)
        assert sim.state_hash() == wanted
        live.seek(2.0)
        live.publish(Course, to=(0.0, 0.0, 0.0), speed=1.0, why="stay")
        n = sum(each.step >= 20 for each in inputs)
        assert live.notes == [
            f"{n} recorded inputs after this moment will not come: the game takes another course"
        ]
        live.step(40)
        assert sim.state_hash() != wanted
        other = sim.state_hash()
    rest = [each for each in inputs if each.step < 20]
    with Simulation(mission(), 1) as sim:
        sim.play_inputs(rest)
        sim.step(20)
        sim.publish(Course, to=(0.0, 0.0, 0.0), speed=1.0, why="stay")
        sim.run()
        assert sim.state_hash() == other


def test_who_gave_an_input_is_recorded_and_kept_when_it_comes_again(tmp_path):
    with Simulation(mission(), 1) as sim, Recorder(sim, tmp_path / "first"):
        with given_by("Ada"):
            sim.publish(Course, speed=1.0, why="so")
            with given_by("Ben"):
                sim.write("Wind.strength", [3.0])
            sim.publish(Course, speed=2.0, why="so")
        sim.publish(Course, speed=3.0, why="so")
        sim.step(3)
    inputs = load_inputs(tmp_path / "first")
    assert [each.by for each in inputs] == ["Ada", "Ben", "Ada", ""]
    with Simulation(mission(), 1) as sim, Recorder(sim, tmp_path / "second"), given_by("who plays it"):
        sim.play_inputs(inputs)
        sim.step(3)
    assert load_inputs(tmp_path / "second") == inputs


def test_inputs_of_a_run_that_does_not_say_who_gave_them(tmp_path):
    played(tmp_path / "run")
    inputs = load_inputs(tmp_path / "run")
    table = load_run(tmp_path / "run").inputs_table
    assert inputs_of(table.drop_columns(["by"]), 0) == inputs


@pytest.mark.parametrize("name", [3, None, "\ud800", "a\nb", "x" * 101])
def test_a_name_that_cannot_be_recorded_is_refused_and_loses_nothing(tmp_path, name):
    with Simulation(mission(), 1) as sim, Recorder(sim, tmp_path / "run"):
        with (
            pytest.raises(ParameterError, match=r"given_by: .* is not allowed; it takes a printable text"),
            given_by(name),
        ):
            pass
        sim.publish(Course, speed=1.0, why="so")
        sim.step(2)
    assert [each.by for each in load_inputs(tmp_path / "run")] == [""]
