"""What is recorded is what was played."""

import json

import numpy as np
import pyarrow as pa
import pyarrow.compute
import pytest
from recorded_games import head_on, hunt

import tussle
from tussle import Block, Mission, Recorder, Simulation, load_run
from tussle.api import Autonomy, Interaction, Output
from tussle.errors import ParameterError, RecordError
from tussle.mission.write import with_seed
from tussle.record.events import Events
from tussle.stock import GroundCollision, SingleIntegrator, Still

FILES = {"trajectory.arrow", "events.arrow", "summary.csv", "run.json"}


def play(directory, mission, seeds=1, steps=None, **settings):
    sim = Simulation(mission, seeds=seeds)
    with Recorder(sim, directory, **settings):
        if steps is None:
            sim.run()
        else:
            sim.step(steps)
    return sim, load_run(directory)


def of_world(table, world):
    return table.filter(pa.compute.equal(table["world"], world)).drop_columns("world").combine_chunks()


def test_every_state_is_recorded_to_the_last_bit(tmp_path):
    mission = hunt()
    seen = []

    def look(sim):
        b = sim.state.population.bodies
        order = np.lexsort((b.id, b.world))
        floats = np.concatenate([b.pos, b.quat, b.vel, b.health[None]])[:, order]
        seen.append(
            (sim.t[0], b.id[order].copy(), b.team[order].copy(), b.block[order].copy(), floats.copy())
        )

    sim = Simulation(mission)
    sim.observers.append(look)
    with Recorder(sim, tmp_path / "run"):
        sim.run()
        look(sim)  # the end
    frame = load_run(tmp_path / "run").trajectory
    assert list(frame.columns) == [
        *("world", "t", "step", "id", "block", "team", "x", "y", "z"),
        *("qw", "qx", "qy", "qz", "vx", "vy", "vz", "health"),
    ]
    steps = [part for _, part in frame.groupby("step")]
    assert len(steps) == len(seen) == 61
    for k, (part, (t, ids, team, block, floats)) in enumerate(zip(steps, seen, strict=True)):
        assert (part["step"] == k).all()
        assert (part["t"] == t).all()
        np.testing.assert_array_equal(part["id"], ids)
        np.testing.assert_array_equal(part["team"], team)
        assert list(part["block"]) == [mission.blocks[b].name for b in block]
        np.testing.assert_array_equal(part.iloc[:, 6:].to_numpy().T, floats)


def test_a_run_directory_holds_what_it_should(tmp_path):
    sim, run = play(
        tmp_path / "deep" / "run",
        hunt(),
        seeds=[5, 6],
        mission_text="<run/>\n",
        parameters={"prey.speed": np.float64(3.0)},
    )
    assert {p.name for p in run.path.iterdir()} == FILES | {"mission.xml"}
    assert run.is_complete
    assert run.notes == []
    assert run.mission == "<run/>\n"
    info = json.loads((run.path / "run.json").read_text())
    assert info.pop("checksum").startswith("tussle-crc32:")
    assert info == run.info
    assert set(info["checksums"]) == {"mission.xml", "summary.csv"}
    assert info["parameters"] == {"prey.speed": 3.0}
    assert set(info["versions"]) == {"python", "tussle", "numpy", "numba", "pyarrow"}
    assert info["grade"] == sim.grade
    assert info["steps"] == 120
    assert set(info["timings"]) == {"began", "wall_s", "cpu_s"}
    for k, (world, result) in enumerate(zip(info["worlds"], sim.result(), strict=True)):
        assert (world["world"], world["seed"], world["end"], world["steps"]) == (k, 5 + k, "time", 60)
        assert world["state_hash"] == result.state_hash == sim.state_hash(k)
        assert world["alive"] == {str(t): n for t, n in result.alive.items()}
    summary = run.summary.set_index(["world", "team"])
    for result in sim.result():
        for team, score in result.scores.items():
            row = summary.loc[(result.world, team)]
            assert row["score"] == score
            assert row["alive"] == result.alive[team]
            assert row["SimpleCaptureMetrics.NonTeamCapture"] == score


@pytest.mark.parametrize("mission", [hunt(n_prey=3, end=30.0), head_on()], ids=["hunt", "head on"])
def test_worlds_of_a_stack_have_the_tables_they_have_alone(tmp_path, mission):
    seeds = [1, 2, 3, 4]
    sim, stack = play(tmp_path / "stack", mission, seeds)
    assert mission.name != "hunt" or len(set(sim.steps)) > 1  # they end apart
    for world, seed in enumerate(seeds):
        _, alone = play(tmp_path / f"alone{world}", mission, seed)
        assert of_world(stack.trajectory_table, world) == of_world(alone.trajectory_table, 0)
        assert of_world(stack.events_table, world) == of_world(alone.events_table, 0)
        assert stack.info["worlds"][world]["state_hash"] == alone.info["worlds"][0]["state_hash"]


def test_the_same_inputs_give_the_same_tables_however_often_they_are_flushed(tmp_path):
    _, one = play(tmp_path / "one", hunt())
    _, two = play(tmp_path / "two", hunt(), flush_every=1e-9)
    assert one.trajectory_table == two.trajectory_table
    assert one.events_table == two.events_table
    assert one.info["worlds"] == two.info["worlds"]
    assert two.trajectory_table["x"].num_chunks >= 61 > one.trajectory_table["x"].num_chunks


def test_recording_changes_nothing_and_leaves_nothing_behind(tmp_path):
    sim, _ = play(tmp_path / "run", hunt(), steps=20)
    labels = [call.label for call in sim.schedule]
    other = Simulation(hunt())
    other.step(20)
    assert sim.state_hash() == other.state_hash()
    assert labels == [call.label for call in other.schedule]
    assert not sim.observers
    assert not sim.events


def test_events_tell_who_came_who_went_and_why(tmp_path):
    sim, run = play(tmp_path / "hunt", hunt())
    events, states = run.events, run.trajectory
    births, deaths, captures = (
        events[events["kind"] == k].set_index("id") for k in ("birth", "death", "capture")
    )
    first, last = states.groupby("id")["step"].min(), states.groupby("id")["step"].max()
    assert len(births) == 12 + 3 + 3
    assert births["step"].to_dict() == first.to_dict()
    assert set(births["text"]) == {"prey", "late", "hunters"}
    assert len(deaths) > 2
    for victim, death in deaths.iterrows():
        assert death["text"] == "captured"
        assert death["step"] == last[victim]
        credited = captures[captures["other"] == victim]
        assert list(credited.index) == [death["other"]]
        assert credited["step"].iloc[0] == death["step"]
    assert len(captures) == len(deaths) == sum(sim.result()[0].scores.values())
    assert events.iloc[-1][["kind", "text", "step", "t"]].to_list() == ["end", "time", 60, 6.0]
    assert (events["t"] == events["step"] * 0.1).all()

    _, run = play(tmp_path / "head_on", head_on())
    rows = run.events[["kind", "id", "other", "text"]].to_numpy().tolist()[3:]
    assert rows == [
        ["collision", 1, 2, ""],
        ["death", 1, 2, "collision"],
        ["death", 2, 1, "collision"],
        ["end", 0, 0, "one_team"],
    ]


def test_the_ground_is_told_as_a_collision_with_nobody(tmp_path):
    class Fall(Autonomy):
        """Fall at 10 m/s."""

        velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

        def step(self, g):
            self.velocity[2] = -10.0

    stones = Block(
        name="stones",
        count=2,
        position=(0, 0, 1.5),
        scatter_first=False,
        autonomy=Fall(),
        motion=SingleIntegrator(),
    )
    _, run = play(
        tmp_path / "run",
        Mission(blocks=[stones], end_conditions="all_dead", interactions=[GroundCollision()]),
    )
    rows = run.events[["kind", "step", "id", "other", "text"]].to_numpy().tolist()[2:]
    assert rows == [
        *(["collision", 1, i, 0, "ground"] for i in (1, 2)),
        *(["death", 1, i, 0, "ground"] for i in (1, 2)),
        ["end", 2, 0, 0, "all_dead"],
    ]


def test_a_period_thins_the_states_and_keeps_the_last(tmp_path):
    _, every = play(tmp_path / "every", hunt())
    _, some = play(tmp_path / "some", hunt(), period=0.7)
    steps = some.trajectory["step"].unique()
    assert list(steps) == [0, 7, 14, 21, 28, 35, 42, 49, 56, 60]
    wanted = every.trajectory[every.trajectory["step"].isin(steps)].reset_index(drop=True)
    assert some.trajectory.equals(wanted)
    assert some.events.equals(every.events)
    _, odd = play(
        tmp_path / "odd", hunt(), period=0.25, steps=10
    )  # no multiple of the step: the next step after
    assert list(odd.trajectory["step"].unique()) == [0, 3, 5, 8, 10]
    for wrong in (0.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(ParameterError, match="period"):
            Recorder(Simulation(hunt()), tmp_path / "wrong", period=wrong)
    assert not (tmp_path / "wrong").exists()


def test_a_game_that_is_left_is_recorded_up_to_there(tmp_path):
    sim, run = play(tmp_path / "run", hunt(), seeds=[1, 2], steps=20)
    assert run.is_complete  # nothing more had been asked for
    assert list(run.trajectory.groupby("world")["step"].max()) == [20, 20]
    assert [w["end"] for w in run.info["worlds"]] == ["", ""]
    assert run.info["worlds"][1]["state_hash"] == sim.state_hash(1)


def test_an_error_on_the_way_is_told_and_the_run_is_not_complete(tmp_path):
    sim = Simulation(hunt())

    def break_off():
        sim.step(20)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), Recorder(sim, tmp_path / "run"):
        break_off()
    run = load_run(tmp_path / "run")
    assert not run.is_complete
    assert run.notes == ["the run was interrupted: KeyboardInterrupt"]
    assert run.trajectory["step"].max() == 20
    assert "interrupted" in repr(run)


def test_recording_may_begin_late(tmp_path):
    sim = Simulation(hunt())
    sim.step(30)
    with Recorder(sim, tmp_path / "run"):
        sim.run()
    run = load_run(tmp_path / "run")
    assert run.trajectory["step"].min() == 30
    assert run.events["step"].min() == 30


@pytest.mark.parametrize("seeds", [[1], [1, 2]], ids=["all worlds", "some worlds"])
def test_a_world_that_is_begun_anew_ends_the_recording(tmp_path, seeds):
    sim = Simulation(hunt(), seeds=seeds)
    recorder = Recorder(sim, tmp_path / "run")
    sim.step(5)
    sim.reset([0])
    with pytest.raises(RecordError, match="reset or restored"):
        sim.step()
    run = load_run(tmp_path / "run")
    assert not run.is_complete
    assert "reset or restored" in run.notes[0]
    assert run.trajectory["step"].max() <= 5
    assert recorder.is_closed
    sim.step()  # the simulation itself is none the worse


def test_worlds_with_clocks_of_their_own_are_recorded(tmp_path):
    sim = Simulation(hunt(), seeds=[1, 2])
    sim.step(10)
    sim.reset([1])
    with Recorder(sim, tmp_path / "run", period=0.5):
        sim.run()
    run = load_run(tmp_path / "run")
    steps = run.trajectory.groupby("world")["step"].unique()
    assert list(steps[0]) == list(range(10, 61, 5))
    assert list(steps[1]) == list(range(0, 61, 5))


def test_a_directory_holds_one_run(tmp_path):
    play(tmp_path, hunt(end=0.5))
    before = (tmp_path / "run.json").read_bytes()
    with pytest.raises(RecordError, match="holds a run already"):
        Recorder(Simulation(hunt()), tmp_path)
    assert (tmp_path / "run.json").read_bytes() == before


@pytest.mark.parametrize("looks_first", [True, False])
def test_of_two_recorders_in_a_directory_the_second_is_refused(tmp_path, monkeypatch, looks_first):
    """Also where it has looked before the first one began."""
    with Recorder(Simulation(hunt(end=0.5), 7), tmp_path) as first:
        second = Simulation(hunt(end=0.2), 8)
        with monkeypatch.context() as patched:
            if not looks_first:
                patched.setattr("tussle.record.recorder.FILES", ())
            with pytest.raises(RecordError, match="holds a run already"):
                Recorder(second, tmp_path)
        first.sim.run()
    assert load_run(tmp_path).summary_table["seed"].to_pylist() == [7] * 2
    assert load_run(tmp_path).is_complete


def test_where_nothing_can_be_written_nothing_begins(tmp_path):
    (tmp_path / "file").write_text("in the way")
    sim = Simulation(hunt())
    with pytest.raises(RecordError, match="cannot record a run"):
        Recorder(sim, tmp_path / "file" / "run")
    with pytest.raises(RecordError, match="cannot record a run"):
        Recorder(sim, "/proc/no_such_run")
    assert not sim.observers
    assert not sim.events


def test_listeners_hear_while_they_listen():
    sim = Simulation(hunt())
    heard = []
    sim.events.listen(heard.append)
    sim.step(10)
    assert heard
    assert all(isinstance(e, Events) and len(e) for e in heard)
    sim.events.forget(heard.append)
    sim.events.forget(heard.append)
    n = len(heard)
    sim.run()
    assert len(heard) == n


def test_listeners_hear_the_kinds_they_ask_for():
    sim = Simulation(hunt())
    every, some = [], []
    sim.events.listen(every.append)
    sim.events.listen(some.append, ["death", "end"])
    sim.run()
    assert {e.kind for e in every} > {e.kind for e in some} == {"death", "end"}
    assert [id(e) for e in every if e.kind in ("death", "end")] == [id(e) for e in some]


def test_a_death_is_reported_once_for_its_first_reason():
    class Twice(Interaction):
        def step(self, w):
            w.kill(np.array([3, 1]), "first")
            w.kill(np.array([1, 2]), "second")

    block = Block(name="a", count=5, motion=Still())
    sim, heard = Simulation(Mission(blocks=[block], dt=0.1, end=1, interactions=[Twice()])), []
    sim.events.listen(heard.append, ["death"])
    sim.step()
    assert [(e.id.tolist(), e.text) for e in heard] == [([2, 3, 4], ["first", "second", "first"])]


def test_names_are_loaded_when_asked_for():
    assert tussle.Recorder is Recorder
    with pytest.raises(AttributeError, match="no attribute 'recorder_'"):
        _ = tussle.recorder_
    with pytest.raises(AttributeError, match="no attribute 'recorder_'"):
        _ = tussle.record.recorder_


@pytest.mark.parametrize(
    ("text", "seed", "wanted"),
    [
        ("<runscript><seed>7</seed><run/></runscript>", 9, "<runscript><seed>9</seed><run/></runscript>"),
        ('<runscript>\n <seed time="3" >7</seed ></runscript>', 9, '<runscript>\n <seed time="3" >9</seed></runscript>'),
        ("<runscript><seed/></runscript>", 9, "<runscript><seed>9</seed></runscript>"),
        ("<!-- <seed>1</seed> --><runscript><seed>7</seed></runscript>", 9, "<!-- <seed>1</seed> --><runscript><seed>9</seed></runscript>"),
        ('<runscript name="a"><run/></runscript>', 9, '<runscript name="a">\n  <seed>9</seed><run/></runscript>'),
        ("<runscript><seeds>7</seeds></runscript>", 1, "<runscript><seeds>7</seeds></runscript>"),
    ],
)  # fmt: skip
def test_the_mission_of_a_run_has_the_seed_that_was_played(text, seed, wanted):
    assert with_seed(text, seed) == wanted
