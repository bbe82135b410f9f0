"""A recording shows what was played, whatever the run directory has been through."""

import json
import shutil

import numpy as np
import pyarrow as pa
import pytest
from recorded_games import head_on, hunt, record

from tussle import Block, Recorder, Simulation
from tussle.errors import ParameterError, RecordError
from tussle.mission import read_mission
from tussle.record.schema import TRAJECTORY
from tussle.stock import Still
from tussle.view import Recording, frame_of

GAME = hunt(n_prey=3, end=30.0)


@pytest.fixture(scope="module")
def played(tmp_path_factory):
    """A stack of three worlds that end apart, and all frames of each."""
    directory = tmp_path_factory.mktemp("runs") / "run"
    sim = Simulation(GAME, seeds=[1, 2, 3])
    frames = [[], [], []]

    def look(sim):
        for world in np.flatnonzero(sim.state.running):
            frames[world].append(frame_of(sim, int(world)))

    with Recorder(sim, directory, flush_every=1e6):  # one batch of rows, however slow the machine is
        sim.observers.append(look)
        sim.run()
    for world in range(3):
        frames[world].append(frame_of(sim, world))
    return directory, frames


def assert_same(one, two):
    assert (one.t, one.step) == (two.t, two.step)
    for name in ("id", "team", "block", "pos", "quat", "vel", "health"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))
        assert getattr(one, name).dtype == getattr(two, name).dtype


def test_each_frame_is_what_was_to_be_seen(played):
    directory, frames = played
    for world in range(3):
        recording = Recording(directory, world)
        assert recording.n_frames == len(recording) == len(frames[world]) == len(recording.t)
        assert recording.notes == []
        for i, frame in enumerate(frames[world]):
            assert_same(recording.frame(i), frame)
        assert_same(recording.frame(-1), frames[world][-1])


def test_the_frame_at_a_time_is_the_last_one_not_after_it(played):
    recording = Recording(played[0], 1)
    for t, step in (
        (-1.0, 0),
        (0.0, 0),
        (0.1, 1),
        (0.30000000000000004, 3),
        (0.3, 3),
        (0.39, 3),
        (1e9, played[1][1][-1].step),
    ):
        assert recording.at(t).step == step


def test_what_it_says_of_the_mission_without_having_the_file(played):
    recording = Recording(played[0], 2)
    assert recording.name == "hunt"
    assert recording.blocks == ["prey", "late", "hunters"]
    assert recording.block_teams == [1, 1, 2]
    assert recording.teams == {1: "prey, late", 2: "hunters"}
    assert recording.mission.end == 30.0
    assert (recording.viewer, recording.notes) == ({}, [])
    assert [recording.style.model(b) for b in range(3)] == ["aircraft"] * 3


def test_the_extent_holds_all_positions_of_its_world_and_no_others(played):
    directory, frames = played
    for world in range(3):
        low, high = Recording(directory, world).extent
        pos = np.concatenate([f.pos for f in frames[world]])
        np.testing.assert_array_equal(low, pos.min(axis=0))
        np.testing.assert_array_equal(high, pos.max(axis=0))


def test_happenings_are_those_of_its_world_in_order(played):
    for world in range(3):
        recording = Recording(played[0], world)
        told = recording.events
        assert [h.t for h in told] == sorted(h.t for h in told)
        assert [h.kind for h in told].count("birth") == 9
        deaths = [h for h in told if h.kind == "death"]
        assert len(deaths) == 9 - len(recording.frame(-1))
        for death in deaths:
            assert death.text == "captured"
            before, after = recording.at(death.t), recording.at(death.t + 0.1)
            assert before.row_of(death.id) >= 0 > after.row_of(death.id)
            assert before.row_of(death.other) >= 0
        assert (told[-1].kind, told[-1].text, told[-1].t) == ("end", "one_team", recording.t[-1])


def test_frames_that_lie_across_batches_are_whole(tmp_path):
    sim = Simulation(hunt())
    frames = []
    with Recorder(sim, tmp_path / "run", flush_every=1e-9) as recorder:  # a batch for each step
        recorder._buffer._allocate(10)  # and some steps begin anew, since they do not fit
        sim.observers.append(lambda s: frames.append(frame_of(s)))
        sim.run()
    recording = Recording(tmp_path / "run")
    assert recording.run.trajectory_table["x"].num_chunks > 50
    for i, frame in enumerate(frames):
        assert_same(recording.frame(i), frame)
    several = Recording(tmp_path / "run")
    several._arrays.clear()
    several._batches = several.run.trajectory_table.combine_chunks().to_batches(max_chunksize=7)
    several._starts = np.cumsum([0, *(b.num_rows for b in several._batches)])
    for i, frame in enumerate(frames):
        assert_same(several.frame(i), frame)


@pytest.mark.parametrize("period", [None, 0.5])
def test_moments_in_which_nobody_is_there_are_empty_frames(tmp_path, period):
    late = Block(name="late", team=1, count=1, rate=1.0, first_birth=4.0, motion=Still())
    game = head_on(end=6.0, end_conditions="time")
    game = game.replace(blocks=[*game.blocks[:2], late])
    sim = Simulation(game)
    with Recorder(sim, tmp_path / "run", period=period):
        sim.run()
    recording = Recording(tmp_path / "run")
    counts = {round(t, 6): len(recording.at(t)) for t in recording.t}
    assert counts[0.0] == 2
    assert counts[3.0] == 0
    assert counts[4.5] == counts[6.0] == 1
    steps = np.diff(recording.steps)
    assert steps.max() == (1 if period is None else 5)
    assert recording.frame(0).t == 0.0
    assert recording.at(3.0).t == pytest.approx(3.0)
    # Killed before run.json was written: nobody says how often states were to be recorded, and the table shows it.
    (tmp_path / "run" / "run.json").unlink()
    cut = Recording(tmp_path / "run")
    np.testing.assert_allclose(cut.t, recording.t, rtol=1e-12)
    assert [len(cut.frame(i)) for i in range(len(cut))] == [len(recording.frame(i)) for i in range(len(cut))]
    assert cut.blocks == recording.blocks
    assert cut.teams == recording.teams


def test_an_end_with_nobody_left_is_a_frame(tmp_path):
    game = head_on(end=6.0, end_conditions="all_dead")
    sim = Simulation(game.replace(blocks=game.blocks[:2]))
    with Recorder(sim, tmp_path / "run"):
        sim.run()
    recording = Recording(tmp_path / "run")
    assert len(recording.frame(-1)) == 0
    assert len(recording.frame(-2)) == 2
    assert recording.t[-1] == sim.t[0]


def test_a_run_that_was_cut_in_the_midst_of_a_batch(tmp_path, played):
    directory = tmp_path / "cut"
    shutil.copytree(played[0], directory)
    (directory / "run.json").unlink()
    Recording(directory)
    whole = (directory / "trajectory.arrow").read_bytes()
    (directory / "trajectory.arrow").write_bytes(whole[: len(whole) - 500])
    recording = Recording(directory)
    assert any("run.json is missing" in note for note in recording.notes)
    assert any("trajectory.arrow is truncated" in note for note in recording.notes)
    assert recording.n_frames == 0
    with pytest.raises(IndexError):
        recording.at(0.0)
    assert recording.extent[0].tolist() == [0.0, 0.0, 0.0]
    assert recording.blocks == []


def test_what_is_no_run_and_worlds_that_are_not_there(tmp_path, played):
    with pytest.raises(RecordError, match="not a run directory"):
        Recording(tmp_path)
    for world in (3, -1, 0.5, "a", True):
        with pytest.raises(RecordError, match=f"there is no world {world}; there are worlds 0 to 2"):
            Recording(played[0], world)


def record_file(mission_file, directory, **settings):
    loaded = read_mission(mission_file, settings)
    sim = Simulation(loaded.mission)
    with Recorder(sim, directory, mission_text=loaded.text):
        sim.step(3)
    return loaded


def test_the_mission_of_the_run_with_its_colours(tmp_path):
    loaded = record_file("predator_prey", tmp_path / "run", prey="5")
    recording = Recording(tmp_path / "run")
    assert recording.mission == loaded.mission
    assert recording.viewer == loaded.viewer
    assert recording.name == loaded.mission.name
    assert recording.style.block_colour(0) == (77, 77, 255)
    assert recording.style.model(0) == "aircraft"
    assert recording.notes == []


def test_a_mission_whose_plugins_are_not_here(tmp_path):
    record_file("predator_prey", tmp_path / "run", prey="5")
    path = tmp_path / "run" / "mission.xml"
    path.write_text(path.read_text().replace(">Boids<", ">BoidsOfMine<"))
    recording = Recording(tmp_path / "run")
    assert recording.mission is None
    assert recording.scenery.boundaries == []
    assert len(recording.notes) == 1
    assert "BoidsOfMine" in recording.notes[0]


@pytest.mark.parametrize(
    ("name", "row", "value", "said"),
    [
        ("step", -1, 2**31 - 1, "frames without entities, by the steps of run.json and trajectory.arrow"),
        ("step", -1, 0, "the rows of a step are not contiguous"),
        ("t", 0, 1e9, "times go back from one step to the next"),
        ("id", 1, 1, "the ids of a step do not ascend in row 1"),
    ],
)
def test_a_table_whose_rows_do_not_fit_together_is_refused(tmp_path, played, name, row, value, said):
    shutil.copytree(played[0], tmp_path / "run")
    (tmp_path / "run" / "run.json").unlink()
    table = Recording(played[0]).run.trajectory_table
    table = table.filter(pa.array(table["world"].to_numpy() == 0)).combine_chunks()
    values = table[name].to_numpy().copy()
    values[row] = value
    table = table.set_column(table.schema.get_field_index(name), TRAJECTORY.field(name), pa.array(values))
    path = str(tmp_path / "run" / "trajectory.arrow")
    with pa.OSFile(path, "wb") as file, pa.ipc.new_stream(file, TRAJECTORY) as writer:
        writer.write_table(table)
    with pytest.raises(RecordError, match=said):
        Recording(tmp_path / "run")


def test_a_run_file_that_says_something_else_than_the_table_is_refused(tmp_path, played):
    shutil.copytree(played[0], tmp_path / "run")
    file = tmp_path / "run" / "run.json"
    info = json.loads(file.read_text())
    del info["checksum"]
    info["worlds"][0]["steps"] = 10**18
    file.write_text(json.dumps(info))
    with pytest.raises(RecordError, match=r"frames without entities, by the steps of run\.json"):
        Recording(tmp_path / "run")
    info["mission"]["blocks"].pop()
    file.write_text(json.dumps(info))
    with pytest.raises(RecordError, match=r"trajectory.arrow: the blocks differ from prey, late"):
        Recording(tmp_path / "run", 1)
    info["worlds"][0]["steps"] = "many"
    file.write_text(json.dumps(info))
    with pytest.raises(RecordError, match=r"run.json: worlds\[0\].steps = 'many' is not allowed"):
        Recording(tmp_path / "run")


def test_a_column_that_was_not_recorded_is_told(tmp_path):
    run = record(hunt(end=0.5), tmp_path / "run", columns="*.Boids.target")
    with pytest.raises(ParameterError, match=r"no column 'Boids.goal' was recorded.*there are: Boids.target"):
        Recording(run).values(0, "Boids.goal")
