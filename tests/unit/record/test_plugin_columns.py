"""Columns of plugins in the trajectory table: which are recorded, their values to the last bit, and how they load."""

import shutil

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet
import pytest
from recorded_games import head_on, hunt, record

from tussle import Block, Mission, Recorder, Simulation, load_run, read_table
from tussle.api import Autonomy, EntityRef, Interaction, Output, State
from tussle.errors import DeclarationError, ParameterError, RecordError
from tussle.record.plugin_columns import PluginColumn
from tussle.record.schema import TRAJECTORY
from tussle.stock import MotorSchemas, MoveToGoalMS, Still, Unicycle, UnicyclePID
from tussle.view.export.tables import write_tables


class Searcher(Autonomy):
    """Has a column of each kind."""

    goal = State("x y", unit="m", doc="Where it goes.")
    n_steps = State(dtype=int, default=2**60, doc="Steps so far, and many more.")
    is_east = State(dtype=bool, doc="Whether it is east of the origin.")
    leader = EntityRef(doc="The entity before it.")
    seen = State("x y", unit="m", ragged=True, doc="What it saw.")
    course = Output(unit="rad", doc="Where it turns to.")
    unread = Output(unit="m", doc="Left out unless it is read.")

    def spawn(self, g, rows):
        self.goal[:, rows] = g.pos[:2, rows] + 100.0

    def step(self, g):
        self.goal += 0.1
        self.n_steps += g.id
        self.is_east[:] = g.pos[0] > 0.0
        self.leader[:] = g.id - 1
        self.course[:] = g.t
        if "unread" in self.wired:
            self.unread[:] = 1.0


class Declared(Autonomy):
    """Has columns that ask to be recorded."""

    fuel = State(unit="kg", default=5.0, doc="Fuel left.", recorded=True)
    heat = Output(unit="K", doc="Heat.", recorded=True)
    other = State()

    def step(self, g):
        self.fuel -= 0.5
        self.heat[:] = 300.0 + g.id


def searchers(**changes):
    where = {"position": (5, 0, 0), "variance": (100, 100, 0), "motion": Still()}
    flock = Block(name="flock", count=3, autonomy=Searcher(), **where)
    posts = Block(name="posts", count=2, autonomy=Declared(), **where)
    return Mission(blocks=[flock, posts], end=0.5).replace(**changes)


def recorded_columns(run):
    """Values of each plugin column, (rows, k), and which rows have one."""
    table = run.trajectory_table
    for name, column in run.columns.items():
        values = np.stack([table[part].to_numpy(zero_copy_only=False) for part in column.parts], axis=-1)
        yield name, values, np.asarray(table[column.parts[0]].is_valid())


def test_columns_have_names_units_types_and_docs(tmp_path):
    columns = "flock.Searcher.goal, *.n_steps,Searcher.is_east,*.leader"
    run = load_run(record(searchers(), tmp_path / "run", columns=columns))
    assert run.is_complete
    assert run.columns == {
        "Searcher.goal": PluginColumn("Searcher.goal", float, ("x", "y"), ("m", "m"), "Where it goes."),
        "Searcher.n_steps": PluginColumn("Searcher.n_steps", int, doc="Steps so far, and many more."),
        "Searcher.is_east": PluginColumn("Searcher.is_east", bool, doc="Whether it is east of the origin."),
        "Searcher.leader": PluginColumn("Searcher.leader", int, doc="The entity before it."),
        "Declared.fuel": PluginColumn("Declared.fuel", float, units=("kg",), doc="Fuel left."),
        "Declared.heat": PluginColumn("Declared.heat", float, units=("K",), doc="Heat."),
    }
    names = run.trajectory_table.schema.names
    assert names[: len(TRAJECTORY)] == TRAJECTORY.names
    assert names[len(TRAJECTORY) :] == [part for c in run.columns.values() for part in c.parts]
    assert names[len(TRAJECTORY) : len(TRAJECTORY) + 2] == ["Searcher.goal.x", "Searcher.goal.y"]


def test_without_columns_the_directory_is_what_it_was(tmp_path):
    run = load_run(record(hunt(end=1.0), tmp_path / "run"))
    assert run.trajectory_table.schema == TRAJECTORY
    assert run.columns == {}


def seen_columns(sim, paths):
    """Values of columns by (world, id), as `Simulation.read` gives them."""
    for path in paths:
        block = path.partition(".")[0]
        values, is_alive = sim.read(path)
        who, _ = sim.read(f"{block}.id")
        yield path, {(w, int(who[w, k])): values[w, k] for w, k in zip(*np.nonzero(is_alive), strict=True)}


PATHS = (
    "prey.Boids.target", "prey.Boids.speed", "prey.Unicycle.x", "late.Boids.target", "late.Boids.speed", "late.Unicycle.x",
    "hunters.Predator.target", "hunters.Predator.turn_rate", "hunters.Unicycle.x",
)  # fmt: skip


@pytest.mark.parametrize("seeds", [(1,), (4, 5, 6)])
@pytest.mark.parametrize("update", ["synchronous", "sequential"])
def test_values_are_those_of_the_game_to_the_last_bit(tmp_path, seeds, update):
    """Through births, captures and ends of worlds at different times."""
    sim, seen = Simulation(hunt(n_prey=2, update=update, end=30.0), seeds=list(seeds)), {}

    def look(sim):
        for path, values in seen_columns(sim, PATHS):
            for (world, who), value in values.items():
                seen[path.split(".", 1)[1], world, int(sim.steps[world]), who] = value

    sim.observers.append(look)
    with Recorder(sim, tmp_path / "run", columns=PATHS):
        sim.run()
        look(sim)
    run = load_run(tmp_path / "run")
    rows = list(zip(*(run.trajectory_table[n].to_pylist() for n in ("world", "step", "id")), strict=True))
    found = {
        (name, *row): value if len(value) > 1 else value[0]
        for name, values, is_there in recorded_columns(run)
        for row, value, there in zip(rows, values, is_there, strict=True)
        if there
    }
    assert len({r.steps for r in sim.result()}) == len(seeds)
    assert found.keys() == seen.keys()
    for key, value in found.items():
        np.testing.assert_array_equal(value, seen[key], err_msg=str(key))


class Tally(Interaction):
    """Has a state of each extent, which are told from world, step, team and id."""

    visits = State(dtype=int, doc="How often it was visited.", recorded=True)
    score = State(unit="s", per="team", doc="Of its team.", recorded=True)
    place = State("x y", unit="m", per="world", doc="Of its world.")
    is_old = State(dtype=bool)

    def step(self, w):
        self.visits[:] = w.id + 1000 * w.context.clock.step[w.world]
        self.score[:] = w.teams[:, None] * w.context.clock.step
        self.place[:] = w.context.seeds, w.context.clock.step
        self.is_old[:] = w.id < 4


@pytest.mark.parametrize("seeds", [(1,), (4, 5, 6)])
def test_columns_of_world_plugins_are_those_of_the_entity_its_team_and_its_world(tmp_path, seeds):
    """Through births, captures and ends of worlds at different times, their last states included."""
    mission = hunt(n_prey=2, end=30.0)
    mission = mission.replace(interactions=[*mission.interactions, Tally()])
    sim = Simulation(mission, seeds=list(seeds))
    with Recorder(sim, tmp_path / "run", columns="Tally.place,*.is_old"):
        sim.run()
    run = load_run(tmp_path / "run")
    assert run.columns == {
        "Tally.visits": PluginColumn("Tally.visits", int, doc="How often it was visited."),
        "Tally.score": PluginColumn("Tally.score", float, units=("s",), doc="Of its team."),
        "Tally.place": PluginColumn("Tally.place", float, ("x", "y"), ("m", "m"), "Of its world."),
        "Tally.is_old": PluginColumn("Tally.is_old", bool),
    }
    world, step, who = (run.trajectory_table[name].to_numpy().astype(int) for name in ("world", "step", "id"))
    _, first, which = np.unique([world, who], axis=1, return_index=True, return_inverse=True)
    is_new, played = step == step[first][which], step > 0
    assert is_new[played].any()
    team = np.where(
        np.isin(run.trajectory_table["block"].to_numpy(zero_copy_only=False), ["prey", "late"]), 1, 2
    )
    expected = {
        "Tally.visits": np.where(is_new, 0, who + 1000 * (step - 1)), "Tally.score": team * (step - 1),
        "Tally.place": np.stack([np.array(seeds)[world], step - 1], -1), "Tally.is_old": (who < 4) & ~is_new,
    }  # fmt: skip
    for name, values, is_there in recorded_columns(run):
        assert is_there.all()
        np.testing.assert_array_equal(
            values[played].T, expected[name][played].T.reshape(-1, played.sum()), err_msg=name
        )


def test_rows_of_other_blocks_are_null_even_in_the_same_group(tmp_path):
    run = load_run(record(hunt(end=2.0), tmp_path / "run", columns="late.Boids.target"))
    ((name, _, is_there),) = recorded_columns(run)
    assert name == "Boids.target"
    blocks = np.asarray(run.trajectory_table["block"].to_pylist())
    np.testing.assert_array_equal(is_there, blocks == "late")
    assert is_there.any()


def test_whole_numbers_keep_all_their_bits_and_truths_stay_truths(tmp_path):
    run = load_run(record(searchers(), tmp_path / "run", columns="*.n_steps,*.is_east"))
    table = run.trajectory
    mine = table[table["block"] == "flock"]
    numbers = run.trajectory_table["Searcher.n_steps"].to_pylist()
    assert [n for n in numbers if n is not None] == [
        2**60 + s * i for s, i in zip(mine["step"], mine["id"], strict=True)
    ]
    assert [int(n) for n in mine["Searcher.n_steps"]] == [n for n in numbers if n is not None]
    later = mine[mine["step"] > 0]
    assert list(later["Searcher.is_east"]) == list(later["x"] > 0.0)
    assert {True, False} == set(later["Searcher.is_east"])


def test_declared_columns_are_recorded_without_being_asked(tmp_path):
    run = load_run(record(searchers(), tmp_path / "run"))
    assert list(run.columns) == ["Declared.fuel", "Declared.heat"]
    assert run.trajectory_table["Declared.fuel"].to_pylist()[-1] == 5.0 - 0.5 * 5


def test_a_controller_that_runs_in_the_kernel_of_its_motion_model(tmp_path):
    """Its outputs are written in the kernel, into rows that it shares with the motion model."""
    sim = Simulation(head_on(end=1.0))
    with Recorder(sim, tmp_path / "run", columns="*PID.speed"):
        sim.run()
        after = dict(seen_columns(sim, ["west.UnicyclePID.speed"]))
    run = load_run(tmp_path / "run")
    last = run.trajectory_table.to_pandas().query("block == 'west'").iloc[-1]
    assert last["UnicyclePID.speed"] == after["west.UnicyclePID.speed"][0, last["id"]]
    assert run.trajectory_table.to_pandas()["UnicyclePID.speed"].ne(0.0).any()


def test_plugins_inside_others_have_their_whole_path(tmp_path):
    block = Block(
        name="one",
        autonomy=MotorSchemas(behaviors=[MoveToGoalMS()]),
        controller=UnicyclePID(),
        motion=Unicycle(),
    )
    run = load_run(record(Mission(blocks=[block], end=0.5), tmp_path / "run", columns="*.MoveToGoalMS.*"))
    assert run.columns
    assert all(name.startswith("MotorSchemas.MoveToGoalMS.") for name in run.columns)


class Brain(Autonomy):
    goal = State("x y", unit="m")

    def step(self, g):
        self.goal[:] = 1.0


class OtherBrain(Autonomy):
    goal = State(unit="rad")

    def step(self, g):
        self.goal[:] = 2.0


def test_equal_names_of_different_columns_have_their_blocks_in_front(tmp_path):
    blocks = [
        Block(name="a", autonomy=Brain(), motion=Still()),
        Block(name="b", autonomy=Brain(), motion=Still()),
        Block(name="c", autonomy=OtherBrain(name="Brain"), motion=Still()),
    ]
    run = load_run(record(Mission(blocks=blocks, end=0.3), tmp_path / "run", columns="*.goal"))
    assert {n: c.units for n, c in run.columns.items()} == {
        "a+b.Brain.goal": ("m", "m"),
        "c.Brain.goal": ("rad",),
    }
    last = run.trajectory_table.to_pylist()[-1]
    assert (last["block"], last["c.Brain.goal"], last["a+b.Brain.goal.x"]) == ("c", 2.0, None)


# -- wrong selectors and declarations -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        ("flock.Searcher.gaol", r"columns = 'flock.Searcher.gaol' is no State or Output .*did you mean 'flock.Searcher.goal'"),
        ("*.goal, *.nothing", r"columns = '\*.nothing' is no State .*there are: flock.Searcher.goal, Searcher.goal"),
        (["Searcher.goal", "prey.Searcher.goal"], r"columns = 'prey.Searcher.goal' .*did you mean 'Searcher.goal'"),
        ("flock.Searcher.seen", "columns = 'flock.Searcher.seen' is a list per entity; lists are not recorded"),
        ("flock.pos", "columns = 'flock.pos' is no State or Output of a plugin"),
    ],
)  # fmt: skip
def test_a_selector_that_selects_nothing_is_refused_before_anything_is_written(tmp_path, columns, said):
    with pytest.raises(ParameterError, match=said):
        Recorder(Simulation(searchers()), tmp_path / "run", columns=columns)
    assert not (tmp_path / "run").exists()


def test_a_pattern_leaves_lists_out(tmp_path):
    run = load_run(record(searchers(), tmp_path / "run", columns="*.Searcher.[gs]*,"))
    assert {"Searcher.goal", "Declared.fuel"} < run.columns.keys()
    assert "Searcher.seen" not in run.columns


def test_a_pattern_that_selects_only_lists_is_refused(tmp_path):
    with pytest.raises(ParameterError, match=r"columns = '\*.seen' is a list per entity"):
        Recorder(Simulation(searchers()), tmp_path / "run", columns="*.seen")


def test_what_has_no_value_per_entity_cannot_ask_to_be_recorded():
    with pytest.raises(DeclarationError, match="State: a ragged column is not recorded"):
        State("x y", ragged=True, recorded=True)
    with pytest.raises(DeclarationError, match="Output: a ragged column is not recorded"):
        Output(ragged=True, recorded=True)


def test_an_output_that_is_left_out_is_null_and_said_once(tmp_path):
    with pytest.warns(
        RuntimeWarning, match="since no plugin of the entity reads them.*: Searcher.unread of flock$"
    ):
        run = load_run(record(searchers(), tmp_path / "run", columns="*.unread,*.course"))
    table = run.trajectory_table.to_pandas().query("block == 'flock'")
    assert table[table["step"] > 0]["Searcher.unread"].isna().all()
    assert list(table["Searcher.course"].round(6)) == [max(0.0, round(t - 0.1, 6)) for t in table["t"]]


# -- the directory ----------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    directory = tmp_path_factory.mktemp("runs") / "run"
    return record(
        searchers(), directory, seeds=(1, 2), columns="*.goal,*.n_steps,*.is_east", flush_every=1e-9
    )


def test_the_table_is_the_same_in_every_format(recorded, tmp_path):
    table = load_run(recorded).trajectory_table
    write_tables(recorded, tmp_path / "states.csv", "csv")
    write_tables(recorded, tmp_path / "states.parquet", "parquet")
    types = {field.name: field.type for field in table.schema if field.name != "block"}
    options = pa.csv.ConvertOptions(column_types=types)
    as_csv = pa.csv.read_csv(tmp_path / "states.csv", convert_options=options)
    as_parquet = pa.parquet.read_table(tmp_path / "states.parquet")
    for name in table.schema.names:
        assert as_parquet[name].to_pylist() == as_csv[name].to_pylist() == table[name].to_pylist()


def test_a_mapped_table_and_frames_of_both_packages_have_the_columns(recorded):
    run = load_run(recorded)
    assert load_run(recorded, is_mapped=True).columns == run.columns
    assert run.trajectory["Searcher.goal.x"].notna().sum() == 2 * 6 * 3
    assert load_run(recorded, "polars").trajectory["Searcher.n_steps"].null_count() == 2 * 6 * 2


def test_a_run_can_start_from_a_table_with_columns_of_plugins(recorded):
    assert len(read_table(recorded)) == 5


def test_a_damaged_schema_costs_the_columns_of_plugins_only(recorded, tmp_path):
    run = shutil.copytree(recorded, tmp_path / "run")
    data = bytearray((run / "trajectory.arrow").read_bytes())
    data[100] ^= 1
    (run / "trajectory.arrow").write_bytes(data)
    found = load_run(run)
    assert "is damaged between bytes 0 and" in found.notes[0]
    assert found.trajectory_table == load_run(recorded).trajectory_table.select(TRAJECTORY.names)


@pytest.mark.parametrize(
    "extra",
    [
        pa.field("Searcher.goal", pa.float64()),
        pa.field("goal", pa.string(), metadata={"column": "goal", "field": "", "unit": "", "doc": ""}),
    ],
)
def test_other_columns_are_refused(recorded, tmp_path, extra):
    table = load_run(recorded).trajectory_table
    run = shutil.copytree(recorded, tmp_path / "run")
    foreign = table.select(TRAJECTORY.names).append_column(extra, pa.nulls(len(table), extra.type))
    with (
        pa.OSFile(str(run / "trajectory.arrow"), "wb") as file,
        pa.ipc.new_stream(file, foreign.schema) as writer,
    ):
        writer.write_table(foreign)
    with pytest.raises(RecordError, match="has other columns than a table of tussle"):
        load_run(run)
