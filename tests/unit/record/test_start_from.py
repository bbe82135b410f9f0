"""A game starts from the first states of another."""

import numpy as np
import pandas as pd
import pytest
from recorded_games import hunt, record

from tussle import Block, Mission, Recorder, Simulation, load_run, read_table
from tussle.engine.snapshot import hashed
from tussle.errors import MissionError, ParameterError, RecordError
from tussle.record import FirstStates
from tussle.stock import Boids, Unicycle

COLUMNS = ["id", "team", "x", "y", "z", "qw", "qx", "qy", "qz", "vx", "vy", "vz"]


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return load_run(record(hunt(), tmp_path_factory.mktemp("runs") / "run", (1, 2)))


def flock(*counts):
    blocks = [
        Block(name=f"block{i}", team=team, count=count, autonomy=Boids(), motion=Unicycle(vel_max=20.0))
        for i, (team, count) in enumerate(counts)
    ]
    return Mission(blocks=blocks, end=3.0)


def births(run, world=0):
    frame = run.trajectory[run.trajectory["world"] == world]
    return frame.groupby("id").first().reset_index().sort_values(["t", "id"])


@pytest.mark.parametrize("world", [0, 1])
def test_a_recorded_game_can_be_played_again(run, tmp_path, world):
    """All that chance decided besides placement is drawn anew from the same seed; this game has nothing else."""
    table = read_table(run.path, world=world)
    sim = Simulation(hunt(), seeds=[world + 1, 77], start_from=table)
    with Recorder(sim, tmp_path / "again"):
        sim.run()
    again = load_run(tmp_path / "again")
    for again_world in (0, 1):  # whatever the seed
        one = run.trajectory[run.trajectory["world"] == world].drop(columns="world").reset_index(drop=True)
        two = (
            again.trajectory[again.trajectory["world"] == again_world]
            .drop(columns="world")
            .reset_index(drop=True)
        )
        assert one.equals(two)
    assert (again.events["kind"] == "birth").sum() == 2 * 18


@pytest.mark.parametrize("has_rate", [True, False])
def test_only_the_births_to_come_tell_a_game_from_the_one_that_it_starts_from(tmp_path, has_rate):
    mission = hunt(end=2.0)
    if not has_rate:
        mission = mission.replace(blocks=[b.replace(rate=None) for b in mission.blocks])
    sims = [Simulation(mission, 3)]
    sims.append(Simulation(mission, 3, start_from=read_table(record(mission, tmp_path / "run", (3,)))))
    for _ in range(mission.steps - 1):
        own, again = (list(hashed(sim.state, 0)) for sim in sims)
        differing = {
            name
            for (name, a), (_, b) in zip(own, again, strict=True)
            if not np.array_equal(a, b, equal_nan=True)
        }
        assert differing == ({"births"} if has_rate else set())
        for sim in sims:
            sim.step()
    for sim in sims:
        sim.run()
    assert (sims[0].state_hash() == sims[1].state_hash()) is not has_rate


def test_entities_enter_with_id_time_and_state(run, tmp_path):
    wanted = births(run)
    assert set(wanted["t"]) == {0.0, 0.5, 1.5, 2.5}
    sim = Simulation(hunt(), seeds=[9], start_from=read_table(run.path))
    with Recorder(sim, tmp_path / "again"):
        sim.step(30)
    found = births(load_run(tmp_path / "again"))
    for column in ["t", *COLUMNS]:
        np.testing.assert_array_equal(found[column], wanted[column])
    assert found["block"].to_list() == wanted["block"].to_list()


@pytest.mark.parametrize("suffix", [".csv", ".csv.gz", ".parquet"])
def test_tables_of_other_makers_are_read(run, tmp_path, suffix):
    frame = run.trajectory[run.trajectory["world"] == 0].rename(columns={"t": "time"})
    frame = frame[["time", *COLUMNS]].assign(mission="hunt").sample(frac=1.0, random_state=1)  # in any order
    path = tmp_path / f"table{suffix}"
    frame.to_parquet(path) if suffix == ".parquet" else frame.to_csv(path, index=False)
    table, own = read_table(path), read_table(run.path)
    for name in ("t", "id", "team", "pos", "quat", "vel"):
        np.testing.assert_array_equal(getattr(table, name), getattr(own, name))
    assert table.block is None
    assert len(table) == 18


def test_without_blocks_entities_fill_those_of_their_team_in_order_of_ids():
    ids = np.array([5, 2, 9, 4, 7])
    team = np.array([1, 2, 1, 1, 1])
    quat = np.zeros((4, 5))
    quat[0] = 1.0
    pos = np.arange(15.0).reshape(3, 5)
    table = FirstStates(np.zeros(5), ids, pos, quat, np.zeros((3, 5)), team)
    sim = Simulation(flock((1, 2), (2, 3), (1, 3)), start_from=table)
    bodies = sim.state.population.bodies
    found = {int(i): (int(b), list(p)) for i, b, p in zip(bodies.id, bodies.block, bodies.pos.T, strict=True)}
    block = {4: 0, 5: 0, 2: 1, 7: 2, 9: 2}
    assert found == {int(i): (block[int(i)], list(pos[:, k])) for k, i in enumerate(ids)}
    # who is born later has an id of its own
    sim.state.world_view.spawn("block1", [0], pos=[0.0, 0.0, 500.0])
    sim.step()
    assert sorted(sim.state.population.bodies.id) == [2, 4, 5, 7, 9, 10]


def test_a_world_begun_anew_and_a_snapshot_start_from_the_table_too(run):
    sim = Simulation(hunt(), seeds=[1, 2], start_from=read_table(run.path))
    sim.step(3)
    saved = sim.snapshot()
    sim.step(22)
    later = [sim.state_hash(0), sim.state_hash(1)]
    sim.restore(saved)
    sim.step(22)
    assert [sim.state_hash(0), sim.state_hash(1)] == later
    sim.reset([1])
    sim.step(25)
    assert sim.state_hash(1) == later[1]


def states(**changes):
    given = {
        "t": np.zeros(2), "id": np.array([1, 2]), "pos": np.zeros((3, 2)), "quat": np.array([[1.0, 1.0], [0, 0], [0, 0], [0, 0]]),
        "vel": np.zeros((3, 2)), "team": np.array([1, 1]),
    }  # fmt: skip
    return FirstStates(**given | changes)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"pos": np.zeros((3, 3))}, r"pos has shape \(3, 3\); expected \(3, 2\)"),
        ({"pos": np.array([[0.0, -1.1e9]] * 3)}, r"pos of entity 2 is not within \+-1e\+09 m"),
        ({"vel": np.array([[0.0, np.nan]] * 3)}, "vel of entity 2 is not finite"),
        ({"quat": np.full((4, 2), 0.4)}, "quaternion of entity 1 has length 0.8"),
        ({"id": np.array([3, 3])}, "unique"),
        ({"id": np.array([0, 3])}, "unique"),
    ],
)
def test_states_that_cannot_be_are_refused(changes, words):
    with pytest.raises(ParameterError, match=words):
        states(**changes)


@pytest.mark.parametrize(
    ("mission", "changes", "words"),
    [
        (flock((2, 5)), {}, "entity 1 is of team 1.* there are: 2"),
        (flock((1, 1)), {}, "entity 2 exceeds the 1 entities of team 1"),
        (flock((1, 1)), {"team": None}, "entity 2 exceeds the 1 entities of the"),
        (flock((1, 2)), {"block": ("block0", "blok0")}, "block 'blok0'.*did you mean 'block0'"),
    ],
)
def test_tables_that_do_not_fit_the_mission_are_refused(mission, changes, words):
    with pytest.raises(MissionError, match=words):
        Simulation(mission, start_from=states(**changes))


def test_files_that_are_no_tables_are_refused(tmp_path, run):
    with pytest.raises(RecordError, match="must be a run directory"):
        read_table(tmp_path / "table.xlsx")
    for suffix in (".arrow", ".csv"):
        with pytest.raises(RecordError, match="no such file"):
            read_table(tmp_path / f"none{suffix}")
    frame = pd.DataFrame([dict.fromkeys(["t", *COLUMNS], 1.0)])
    for name, table, words in [
        ("a", frame.drop(columns="qz"), "column 'qz' is missing"),
        ("b", frame.drop(columns="t"), "column 't' is missing"),
        ("c", frame.assign(x="east"), "column 'x' must hold numbers"),
        ("d", frame.iloc[:0], "there are no rows"),
    ]:
        table.to_csv(tmp_path / f"{name}.csv", index=False)
        with pytest.raises(RecordError, match=words):
            read_table(tmp_path / f"{name}.csv")
    (tmp_path / "e.parquet").write_bytes(b"no table")
    with pytest.raises(RecordError, match="cannot be read"):
        read_table(tmp_path / "e.parquet")
    with pytest.raises(RecordError, match="no rows of world 5"):
        read_table(run.path, world=5)
