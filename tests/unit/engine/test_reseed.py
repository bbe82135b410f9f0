"""Draws that go on with another seed from a time on."""

from __future__ import annotations

import numpy as np
import pytest
from small_worlds import block, mission

from tussle import Simulation
from tussle.api import Autonomy, Interaction, Output, State
from tussle.batch import Batch, InProcess
from tussle.errors import MissionError, ParameterError
from tussle.mission import read_mission, to_python, to_xml
from tussle.stock import SimpleCollision


class Draws(Autonomy):
    """Keeps its draw of the step."""

    grade = "portable"
    drawn = State()
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def step(self, g):
        self.drawn[:] = g.uniform("draw")


class WorldDraws(Interaction):
    """Keeps the draw of the world."""

    grade = "portable"
    drawn = State(per="world")

    def step(self, w):
        self.drawn[:] = w.uniform("draw")


def played(seeds, **values):
    """Draws of the entity and of the world, of each of ten steps; the first births are at the start, the last after 0.65 s."""
    late = block(
        "late",
        count=3,
        autonomy=Draws(),
        variance=(100.0, 100.0, 0.0),
        scatter_first=True,
        rate=5.0,
        slots=1,
        first_birth=0.25,
    )
    game = mission(block(autonomy=Draws()), late, interactions=[WorldDraws()], **values)
    sim, drawn = Simulation(game, seeds), []
    saved = None
    for k in range(10):
        if k == 3:
            saved = sim.snapshot()
        sim.step()
        drawn.append((sim.read("a.Draws.drawn")[0][:, 0].tolist(), sim.read("WorldDraws.drawn")[0].tolist()))
    last = sim.read("late.pos")[0]
    hashes = [result.state_hash for result in sim.run()]
    sim.restore(saved)
    assert [result.state_hash for result in sim.run()] == hashes
    sim.reset(range(len(seeds)))
    assert [result.state_hash for result in sim.run()] == hashes
    return drawn, last, hashes


def test_draws_go_on_with_the_other_seed_at_the_same_place():
    """A draw depends on seed and step, so after the change they are those of a game that had that seed all along."""
    values = {"reseed_time": 0.5, "reseed": 7}
    drawn, last, hashes = played([1, 2], **values)
    of_1_and_2, _, _ = played([1, 2])
    of_7, last_7, _ = played([7, 7])
    assert drawn[:5] == of_1_and_2[:5]
    assert drawn[5:] == of_7[5:]
    assert (last[:, 2] == last_7[:, 2]).all()  # born at 0.65 s
    assert (last[:, 0] != last_7[:, 0]).any()  # born at 0.25 s
    for seed, alone in zip([1, 2], hashes, strict=True):
        assert played([seed], **values)[2] == [alone]
        assert played([9, 8, seed], **values)[2][2] == alone


def test_without_a_second_seed_worlds_still_differ():
    drawn, _, _ = played([1, 2], reseed_time=0.5)
    before, _, _ = played([1, 2])
    assert drawn[:5] == before[:5]
    assert all(new != old and new[0][0] != new[0][1] for new, old in zip(drawn[5:], before[5:], strict=True))


FILE = '<runscript><run end="5" dt="0.1"/><seed{}>3</seed><entity><team_id>1</team_id></entity></runscript>'


def read(tmp_path, attributes):
    path = tmp_path / "game.xml"
    path.write_text(FILE.format(attributes))
    return read_mission(path)


def test_mission_files_take_and_keep_it(tmp_path):
    loaded = read(tmp_path, ' reseed_time="2" reseed="11"')
    game = loaded.mission
    assert (loaded.seed, game.reseed_time, game.reseed, loaded.notes) == (3, 2.0, 11, ())
    path = tmp_path / "again.xml"
    for seed in (3, None):
        path.write_text(to_xml(game, seed))
        again = read_mission(path)
        assert (again.mission.reseed_time, again.mission.reseed, again.seed) == (2.0, 11, seed)
    assert "reseed_time=2.0" in to_python(game)
    loaded = read(tmp_path, ' reseed_time="2 min"')
    assert (loaded.mission.reseed_time, loaded.mission.reseed) == (120.0, None)
    assert "depends on the first" in str(loaded.notes[0])
    loaded = read(tmp_path, ' reseed="4"')
    assert loaded.mission.reseed is None
    assert "ignored without reseed_time" in str(loaded.notes[0])


@pytest.mark.parametrize(
    ("attributes", "error"),
    [(' reseed_time="soon"', r"game.xml:1: seed@reseed_time.*'soon'"), (' reseed_time="1" reseed="-4"', r"seed@reseed.*-4.*>= 0")],
)  # fmt: skip
def test_bad_values_name_their_place(tmp_path, attributes, error):
    with pytest.raises(MissionError, match=error):
        read(tmp_path, attributes)


def test_a_second_seed_needs_a_time():
    with pytest.raises(MissionError, match=r"reseed = 7 needs a reseed_time"):
        Simulation(mission(reseed=7))
    points = Batch(mission(), vary={"run.reseed": [7, 8], "run.reseed_time": [0.5]}, runs=1)
    results = points.play(executor=InProcess())
    assert results.runs.column("end").to_pylist() == ["time", "time"]


def draws_of(sim, n=10):
    """The draw of the entity in each step, of each world, and the hash of each world at the end."""
    drawn = []
    for _ in range(n):
        sim.step()
        drawn.append(sim.read("a.Draws.drawn")[0][:, 0].tolist())
    return np.array(drawn), [result.state_hash for result in sim.run()]


def test_a_branch_is_the_same_game_up_to_its_step_and_then_has_other_luck():
    """Alone, in a stack, after a snapshot, and as a mission of its own, with the same bits."""
    late = block("late", count=3, autonomy=Draws(), variance=(100.0, 100.0, 0.0), rate=20.0, first_birth=0.4)
    game = mission(block(autonomy=Draws()), late, interactions=[WorldDraws()])
    whole, hashes = draws_of(Simulation(game, [1]))
    of_7, _ = draws_of(Simulation(game, [7]))
    stack = Simulation(game, [5, 6, 8])
    stack.reset([1, 2], [1, 1], rekeys=[((4, 7),), ()])
    saved = stack.snapshot()
    together, (_, branched, again) = draws_of(stack)
    assert (together[:4, 1] == whole[:4, 0]).all()
    assert (together[4:, 1] == of_7[4:, 0]).all()
    assert (again, (together[:, 2] == whole[:, 0]).all()) == (hashes[0], True)
    assert branched != again
    stack.restore(saved)
    stack.step(3)
    assert draws_of(stack, 7)[1][1] == branched
    own = Simulation(game.replace(rekeys=((4, 7),)), [1])
    states = []
    own.observers.append(lambda s: states.append(s.read("late.pos")[0]))
    assert draws_of(own)[1] == [branched]
    unlike = Simulation(game, [1])
    unlike.observers.append(
        lambda s: (
            np.testing.assert_array_equal(s.read("late.pos")[0], states[int(s.steps[0])])
            if s.steps[0] <= 4
            else None
        )
    )
    unlike.run()  # also what is born in step 4 is the same
    stack.reset([1])
    assert stack.state.rekeys == {}


def test_rekeys_of_a_mission_file(tmp_path):
    game = read(tmp_path, ' rekeys="4:7 9:18446744073709551615"').mission
    assert game.rekeys == ((4, 7), (9, 2**64 - 1))
    path = tmp_path / "again.xml"
    path.write_text(to_xml(game, 3))
    assert read_mission(path).mission.rekeys == game.rekeys
    assert "rekeys=((4, 7)" in to_python(game)


@pytest.mark.parametrize(
    "text", ["", "4", "4:7 4:8", "9:1 4:1", "-1:3", "4:18446744073709551616", "4294967296:1"]
)
def test_rekeys_that_are_none(text, tmp_path):
    with pytest.raises(MissionError, match="pairs of a step and a key"):
        read(tmp_path, f' rekeys="{text}"')


def test_rekeys_in_python_that_are_none():
    game = mission(block(autonomy=Draws()))
    for wrong in ([(4, 7.5)], [(4, True)], [4, 7], 3, [(4, -1)]):
        with pytest.raises(MissionError, match="rekeys = "):
            game.replace(rekeys=wrong)
    sim = Simulation(game, [1, 2])
    with pytest.raises(ParameterError, match="rekeys of 1 for 2 worlds"):
        sim.reset([0, 1], rekeys=[()])


class Losses(Interaction):
    """Keeps a draw for each entity, keyed by its id, and one of the world."""

    grade = "portable"
    drawn = State(per="entity")
    common = State(per="world")

    def step(self, w):
        self.drawn[:] = w.uniform_by("lot", w.world, w.id, np.zeros(w.n, np.int64))
        self.common[:] = w.uniform("common")


def of_targets(sim):
    """The draws of each of six steps: of entities (6, 1 + 3) for both plugins, and of the world, (6,)."""
    own, lots, common = [], [], []
    for _ in range(6):
        sim.step()
        own.append([*sim.read("a.Draws.drawn")[0][-1], *sim.read("swarm.Draws.drawn")[0][-1]])
        lots.append(sim.state.world_bindings[0].plugin.drawn[-4:].tolist())
        common.append(sim.read("Losses.common")[0][-1])
    return np.array(own), np.array(lots), np.array(common)


A, SWARM = [0], [1, 2, 3]


@pytest.mark.parametrize(
    ("target", "entities", "lots", "common"),
    [
        ("a", A, A, False),
        ("swarm", SWARM, SWARM, False),
        ("swarm/2", [2], [2], False),
        ("swarm/2/Draws", [2], [], False),
        ("swarm//Draws/draw", SWARM, [], False),
        ("swarm/3/Losses/lot", [], [3], False),
        ("swarm//Draws/other", [], [], False),
        ("Losses", [], A + SWARM, True),
        ("Losses///common", [], [], True),
    ],
)
def test_a_rekey_with_a_target_changes_its_draws_alone(target, entities, lots, common):
    """From its step on, alone and in a stack, until the whole world is re-keyed."""
    swarm = block("swarm", count=3, autonomy=Draws(), variance=(100.0, 100.0, 0.0))
    game = mission(block(autonomy=Draws()), swarm, interactions=[Losses()])
    whole = of_targets(Simulation(game, [1]))
    stack = Simulation(game, [4, 5, 1])
    stack.reset([0, 2], [4, 1], rekeys=[((0, 3, "a"),), ((2, 9, target), (4, 11))])
    found = of_targets(stack)
    for got, alone in zip(
        found, of_targets(Simulation(game.replace(rekeys=((2, 9, target), (4, 11))), [1])), strict=True
    ):
        np.testing.assert_array_equal(got, alone)
    for values, was, chosen in zip(found[:2], whole[:2], (entities, lots), strict=True):
        is_new = np.zeros((2, 4), bool)
        is_new[:, chosen] = True
        assert (values[:2] == was[:2]).all()
        assert ((values[2:4] != was[2:4]) == is_new).all()
    assert (found[2][:2] == whole[2][:2]).all()
    assert (found[2][2:4] != whole[2][2:4]).all() == common
    of_11 = of_targets(Simulation(game.replace(rekeys=((4, 11),)), [1]))
    assert all((got[4:] == alone[4:]).all() for got, alone in zip(found, of_11, strict=True))
    stack.reset([0, 2])
    assert stack.state.context.redraws == []


class Born(Autonomy):
    """Keeps what it drew when it was born, and the draw of its step."""

    grade = "portable"
    first = State()
    drawn = State()
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def spawn(self, g, rows):
        self.first[rows] = g.uniform("first")[rows]

    def step(self, g):
        self.drawn[:] = g.uniform("draw")


def born(sim):
    """Places, headings, what was drawn at the birth, and the draws of two steps, of the entities of `swarm` in the last world."""
    pos, vel, first = (sim.read(f"swarm.{name}")[0][-1] for name in ("pos", "vel", "Born.first"))
    drawn = []
    for _ in range(2):
        sim.step()
        drawn.append(sim.read("swarm.Born.drawn")[0][-1])
    return np.column_stack([pos[:, :2], vel[:, :2], first]), np.array(drawn)


@pytest.mark.parametrize(("target", "entities"), [("swarm/2/birth", [1]), ("swarm//birth", [0, 1, 2])])
def test_a_rekey_of_births_changes_starts_alone(target, entities, tmp_path):
    """Alone, in a stack, and beside a branch at step 0; later draws stay, also where others need room."""
    swarm = block(
        "swarm", count=3, autonomy=Born(), variance=(50.0, 50.0, 0.0), scatter_first=True, heading_variance=1.0, speed=2.0,
    )  # fmt: skip
    apart = SimpleCollision(startup_collision_range=8.0, startup_collisions_only=True)
    game = mission(block(autonomy=Draws(), position=(500.0, 0.0, 0.0)), swarm, interactions=[apart])
    start, drawn = born(Simulation(game, [1]))
    changed = []
    for key in (9, 10, 11, 12):
        stack = Simulation(game, [4, 5, 1])
        stack.step(3)
        stack.reset([0, 2], [4, 1], rekeys=[(), ((0, 7), (0, key, target))])
        found, luck = born(stack)
        own = Simulation(game.replace(rekeys=((0, key, target),)), [1])
        again, same = born(own)
        np.testing.assert_array_equal(found, again)
        np.testing.assert_array_equal(same, drawn)
        assert (luck != drawn).all()
        assert own.state.context.redraws == []
        changed.append((found != start).any(axis=1))
        assert (found[entities] != start[entities]).all()
        assert (found[:, 4] != start[:, 4]).tolist() == [i in entities for i in range(3)]
    assert changed[0].tolist() == [i in entities for i in range(3)]
    file = tmp_path / "game.xml"
    file.write_text(to_xml(game.replace(rekeys=((0, 9, target),)), 1).replace("Born<", "Draws<"))
    assert f"0:9:{target}" in file.read_text()


def test_targets_of_a_mission_file(tmp_path):
    game = read(tmp_path, ' rekeys="4:7 4:8:team_1/1 4:8:team_1/2 9:1"').mission
    assert game.rekeys == ((4, 7), (4, 8, "team_1/1"), (4, 8, "team_1/2"), (9, 1))
    path = tmp_path / "again.xml"
    path.write_text(to_xml(game, 3))
    assert read_mission(path).mission.rekeys == game.rekeys


@pytest.mark.parametrize(
    ("rekeys", "message"),
    [
        ([(4, 7, "b")], "there is no block or plugin 'b'; "),
        ([(4, 7, "a//Drawz")], "there is no block or plugin 'Drawz' .did you mean 'Draws'"),
        ([(4, 7, "WorldDraws/2")], "WorldDraws is a world plugin, of which there are no entities"),
        ([(4, 7, "a/1/birth")], "there is no block or plugin 'birth'"),
        ([(4, 7, "a/x")], "target 'a/x' of a re-key is not allowed"),
        ([(4, 7, "")], "target '' of a re-key is not allowed"),
        ([(4, 7, "a/1/Draws/draw/more")], "is not allowed; a target is a world plugin"),
        ([(4, 7, "a"), (4, 7)], "rekeys = "),
        ([(4, 7, "a"), (4, 8, "a")], "rekeys = "),
        ([(4, 7, 3)], "rekeys = "),
        ([(4, 7, "a", "b")], "rekeys = "),
    ],
)
def test_targets_that_are_none(rekeys, message):
    game = mission(block(autonomy=Draws()), interactions=[WorldDraws()])
    with pytest.raises(MissionError, match=message):
        game.replace(rekeys=rekeys)
    with pytest.raises(MissionError, match=message):
        Simulation(game, [1]).reset([0], rekeys=[rekeys])
