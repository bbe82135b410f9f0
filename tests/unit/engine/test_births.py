"""Who is born when and where."""

from __future__ import annotations

import numpy as np
import pytest
from small_worlds import Drift, Reaper, Wander, alone, block, hashes, mission

from tussle import Simulation
from tussle.api import Autonomy, Interaction, Metric, Param, Publish, State
from tussle.errors import MissionError, ParameterError, PluginError, TussleError
from tussle.messages import SpawnEntity, Waypoint
from tussle.mission.spec import WORLD_VALUES
from tussle.stock import SimpleCollision, SingleIntegrator


def ids(sim, name="a"):
    return [i for i in sim.read(f"{name}.id")[0][0].tolist() if i]


def births_of(game, name="a", seed=1):
    """Step in which each entity of a block is first there."""
    sim = Simulation(game, seeds=seed)
    born: list[int] = []
    while not sim.is_over:
        sim.step()
        born += [int(sim.steps[0]) - 1] * (sim.read(f"{name}.pos")[1].sum() - len(born))
    return born


def test_count_without_rate_is_there_from_the_start():
    sim = Simulation(mission(block("a", count=3), block("b", count=2)))
    assert ids(sim, "a") == [1, 2, 3]
    assert ids(sim, "b") == [4, 5]


@pytest.mark.parametrize(
    ("values", "steps"),
    [
        ({"rate": 5.0, "count": 4}, [0, 2, 4, 6]),
        ({"rate": 5.0, "count": 4, "first_birth": 0.3}, [3, 5, 7, 9]),
        ({"rate": 5.0, "count": 6, "slots": 3}, [0, 0, 0, 2, 2, 2]),
        ({"rate": 5.0, "count": 4, "slots": 3}, [0, 0, 0, 2]),
        ({"rate": "5 Hz", "count": 2}, [0, 2]),
        ({"rate": 10.0, "count": 3}, [0, 1, 2]),
        ({"rate": 50.0, "count": 12}, [0, *[1] * 5, *[2] * 5, 3]),  # five a step
        ({"rate": 50.0, "count": 6, "slots": 2}, [0, 0, 1, 1, 1, 1]),
        # 4 a second at 10 steps a second: on the average the rate that was asked for, each birth in the first step at or after its time
        ({"rate": 4.0, "count": 4}, [0, 3, 5, 8]),
        ({"rate": 0.1, "count": 4, "first_birth": 5.0}, []),
    ],
)
def test_births_come_at_their_rate(values, steps):
    assert births_of(mission(block(**values))) == steps


def test_a_rate_above_that_of_the_steps_holds_for_long_and_in_each_world():
    game = mission(block(rate=50.0, count=5001), end=1e3)
    sim = Simulation(game, seeds=[1, 2])
    sim.step(300)
    sim.reset([1])
    sim.step(701)
    assert sim.read("a.pos")[1].sum(axis=1).tolist() == [5001, 3501]


def test_births_that_were_due_before_the_start_begin_with_it():
    game = mission(block(rate=5.0, count=4), start=5.0, end=6.0)
    assert births_of(game) == [0, 2, 4, 6]
    assert births_of(game.replace(blocks=[block(rate=50.0, count=6)])) == [0, *[1] * 5]


def test_times_of_several_births_in_a_step_vary_too_and_are_as_alone():
    game = mission(block(rate=50.0, interval_sd=0.02, count=200), end=5.0)
    first = births_of(game)
    assert len(set(np.bincount(first))) > 3
    assert hashes(game, [1, 2]) == [alone(game, 1).state_hash(), alone(game, 2).state_hash()]


def test_times_between_births_vary_with_interval_sd_and_by_seed_only():
    game = mission(block(rate=2.0, interval_sd=0.2, count=10), end=5.0)
    first = births_of(game, seed=1)
    assert len(set(np.diff(first))) > 2
    assert first == births_of(game, seed=1)
    assert first != births_of(game, seed=2)
    more = mission(block("z", count=3), *game.blocks, end=5.0)
    assert first == births_of(more, seed=1)


def test_first_is_exactly_there_and_scatter_first_scatters_it():
    exact = Simulation(mission(block(count=3, position=(10, 20, 30), variance=(100, 100, 25)))).read("a.pos")[
        0
    ][0]
    assert exact[0].tolist() == [10.0, 20.0, 30.0]
    assert (exact[1:] != exact[0]).all()
    scattered = Simulation(
        mission(block(count=3, position=(10, 20, 30), variance=(100, 100, 25), scatter_first=True))
    ).read("a.pos")[0][0]
    assert (scattered[0] != exact[0]).all()
    assert np.array_equal(scattered[1:], exact[1:])


def test_variance_is_a_variance():
    game = mission(block(count=4000, position=(10, 0, -5), variance=(100, 25, 0), scatter_first=True))
    pos = Simulation(game).read("a.pos")[0][0]
    assert pos.mean(axis=0) == pytest.approx([10.0, 0.0, -5.0], abs=5 * 10 / np.sqrt(4000))
    assert pos.std(axis=0) == pytest.approx([10.0, 5.0, 0.0], rel=0.06)


def test_uniform_placement_fills_the_box_and_no_more():
    game = mission(block(count=2000, position=(10, 0, -5), placement="uniform", half_width=(4, 2, 0)))
    pos = Simulation(game).read("a.pos")[0][0]
    assert (np.abs(pos - [10, 0, -5]) <= [4, 2, 0]).all()
    assert pos.min(axis=0) == pytest.approx([6.0, -2.0, -5.0], abs=0.05)
    assert pos.std(axis=0) == pytest.approx(np.array([4, 2, 0]) / np.sqrt(3), rel=0.06)


def test_heading_and_speed_of_the_newborn():
    game = mission(block(count=2000, heading="90 deg", heading_variance=0.04, speed=5.0))
    sim = Simulation(game)
    yaw = sim.read("a.yaw")[0][0]
    assert yaw.mean() == pytest.approx(np.pi / 2, abs=0.03)
    assert yaw.std() == pytest.approx(0.2, rel=0.06)
    vel = sim.read("a.vel")[0][0]
    assert vel[:, 0] == pytest.approx(5.0 * np.cos(yaw))
    assert vel[:, 1] == pytest.approx(5.0 * np.sin(yaw))


def test_a_climbing_nose_points_the_velocity_up():
    sim = Simulation(mission(block(climb="30 deg", speed=2.0)))
    assert sim.read("a.vel")[0][0, 0] == pytest.approx([2.0 * np.cos(np.pi / 6), 0.0, 1.0])
    assert sim.read("a.climb")[0][0, 0] == pytest.approx(np.pi / 6)


def scattered(*extra, count=4, before=()):
    return mission(
        *before,
        block("a", count=count, variance=(100, 100, 9), heading_variance=0.1, autonomy=Wander()),
        *extra,
    )


def test_another_block_or_more_entities_change_no_draw():
    paths = {
        "as it is": scattered(),
        "more": scattered(count=9),
        "block before": scattered(before=[block("z", count=3, variance=(1, 1, 1), autonomy=Wander())]),
        "block behind": scattered(block("z", count=3, variance=(1, 1, 1), autonomy=Wander())),
        "another plugin": scattered().replace(metrics=[Quiet()]),
    }
    found = {name: alone(game, 3).read("a.pos")[0][0, :4] for name, game in paths.items()}
    for name, pos in found.items():
        assert np.array_equal(pos, found["as it is"]), name
    assert not np.array_equal(alone(scattered(), 4).read("a.pos")[0][0, :4], found["as it is"])


class Quiet(Metric):
    def step(self, w):
        w.normal("something", 3)


def test_referees_room_is_kept_at_placement_and_elsewhere_nothing_changes():
    crowd = {"count": 12, "position": (0, 0, 0), "variance": (4, 4, 4)}
    free = Simulation(mission(block(**crowd))).read("a.pos")[0][0]
    game = mission(
        block(**crowd),
        block("b", **crowd),
        interactions=[SimpleCollision(collision_range=0.0, startup_collision_range=1.45)],
    )
    sim = Simulation(game, seeds=[1, 2])
    for world in (0, 1):
        pos = np.concatenate([sim.read("a.pos")[0][world], sim.read("b.pos")[0][world]])
        gap = np.linalg.norm(pos[:, None] - pos[None], axis=-1) + 1e9 * np.eye(24)
        assert gap.min() >= 1.45
    assert np.linalg.norm(free[:, None] - free[None], axis=-1)[np.triu_indices(12, 1)].min() < 1.45
    assert np.array_equal(sim.read("a.pos")[0][0, 0], free[0])


def test_room_at_a_reset_is_that_of_a_fresh_start():
    game = mission(
        block(count=12, variance=(9, 9, 9), autonomy=Wander()),
        interactions=[SimpleCollision(collision_range=0.0)],
    )
    sim = Simulation(game, seeds=[1, 2])
    start = sim.read("a.pos")[0]
    sim.step(3)
    sim.reset([1])
    assert np.array_equal(sim.read("a.pos")[0][1], start[1])


def test_births_during_the_run_keep_room_to_those_that_are_there():
    game = mission(
        block("a", count=5, variance=(4, 4, 4), autonomy=Drift(to=(0, 0, 0))),
        block("b", count=5, rate=10.0, slots=5, variance=(4, 4, 4), autonomy=Drift(to=(0, 0, 0))),
        block("c", count=5, rate=10.0, slots=5, variance=(4, 4, 4), autonomy=Drift(to=(0, 0, 0))),
        interactions=[SimpleCollision(collision_range=0.0, startup_collision_range=1.5)],
    )
    sim = Simulation(game)
    sim.step()
    pos = np.concatenate([sim.read(f"{name}.pos")[0][0] for name in "abc"])
    assert len(pos) == 15
    assert (np.linalg.norm(pos[:, None] - pos[None], axis=-1) + 1e9 * np.eye(15)).min() >= 1.5


def test_a_mission_too_crowded_says_so():
    with pytest.raises(
        MissionError,
        match=r"block 'a': no free position for entity 2 of 2 after 10000 tries.*placement 'normal'",
    ):
        Simulation(mission(block(count=2), interactions=[SimpleCollision()]))


GATE = {"position": (0.0, 0.0, 0.0), "variance": (0.0, 0.0, 0.0), "rate": 2.0, "count": 3}
"""All are born at one place, two a second, and leave it at 1 m/s."""


def gate(**changes):
    """A game of three births at one place where entities keep 1.25 m between them."""
    values = {"autonomy": Drift(to=(1.0, 0.0, 0.0)), "motion": SingleIntegrator(), **GATE, **changes}
    leaver = block("a", **values)
    return mission(
        leaver,
        interactions=[SimpleCollision(startup_collision_range=1.25, startup_collisions_only=True)],
        dt=0.1,
        end=4.0,
    )


def test_a_birth_without_a_free_position_waits():
    alone = Simulation(gate(), seeds=[7])
    n = []
    while not alone.is_over:
        alone.step()
        n.append(int(alone.read("a.pos")[1].sum()))
    # Each is at its place in the step after the one before has gone 1.25 m, at 1 m/s.
    assert [n.index(k) for k in (1, 2, 3)] == [0, 13, 26]
    (result,) = alone.result()
    assert (result.born, result.alive, result.waited) == ({0: 3}, {0: 3}, 2)
    for seeds, place in (([7], 0), ([1, 7, 3], 1)):
        sim = Simulation(gate(), seeds=seeds)
        sim.step(9)
        saved = sim.snapshot()
        sim.run()
        assert sim.result()[place].state_hash == result.state_hash
        sim.restore(saved)
        sim.run()
        assert sim.result()[place].state_hash == result.state_hash
    sim.reset([0, 1, 2])
    sim.run()
    assert sim.result()[1].state_hash == result.state_hash


def test_a_birth_that_never_finds_a_position_is_not_counted_as_a_loss():
    sim = Simulation(gate(autonomy=Drift(to=(0.0, 0.0, 0.0))))
    sim.run()
    (result,) = sim.result()
    assert (result.end, result.born, result.alive, result.waited) == ("time", {0: 1}, {0: 1}, 2)


@pytest.mark.parametrize("changes", [{"without_space": "fail"}, {"rate": None}])
def test_a_birth_without_a_free_position_may_end_the_game(changes):
    with pytest.raises(TussleError, match="no free position for entity 2 of 3"):
        Simulation(gate(**changes)).run()


def test_with_the_laws_of_scrimmage_it_ends_the_game():
    with pytest.raises(TussleError, match="no free position for entity 2 of 3"):
        Simulation(gate().replace(compat="scrimmage")).run()


def test_ids_are_never_used_again():
    game = mission(
        block("a", team=1, count=2),
        block("b", team=2, rate=5.0, count=3),
        interactions=[Reaper(team=1, at=0.0)],
    )
    sim = Simulation(game)
    seen = []
    while not sim.is_over:
        sim.step()
        seen.append(ids(sim, "b"))
    assert seen[0] == [3, -1, -1]
    assert seen[-1] == [3, 4, 5]


class Mother(Interaction):
    """Spawn one child in step 2 of some worlds."""

    at = Param(2)
    count = State(dtype=int, per="world")

    def step(self, w):
        worlds = np.flatnonzero((w.step_count == self.at) & (np.bincount(w.world, minlength=w.n_worlds) > 0))
        w.spawn("child", worlds, pos=(5.0, 6.0, 7.0), team=2)
        self.count[worlds] += 1


def with_children(*world, **values):
    return mission(
        block("a", team=1),
        block("child", count=0, team=1, position=(1, 1, 1)),
        block("b", team=2, position=(9, 9, 9)),
        interactions=list(world),
        **values,
    )


def test_w_spawn_is_born_at_the_beginning_of_the_next_step():
    sim = Simulation(with_children(Mother()), seeds=[1, 2, 3], params={"Mother.at": [2, 4, 99]})
    sim.step(3)
    assert sim.read("child.pos")[1].sum() == 0
    seen = []
    sim.observers.append(lambda s: seen.append((int(s.steps[0]), s.read("child.pos")[0].tolist())))
    sim.step()
    ((step, pos),) = seen
    np.testing.assert_array_equal(pos, [[[5.0, 6.0, 7.0]], [[np.nan] * 3], [[np.nan] * 3]])
    assert step == 3
    sim.run()
    assert sim.read("child.pos")[1].tolist() == [[True], [True], [False]]
    assert sim.read("child.id")[0].tolist() == [[3], [3], [-1]]
    assert sim.read("child.team")[0].tolist() == [[2], [2], [-1]]


def test_w_spawn_without_a_place_takes_the_blocks():
    class Plain(Interaction):
        def step(self, w):
            w.spawn("child", np.flatnonzero(w.step_count == 0))

    sim = Simulation(with_children(Plain()))
    sim.step(2)
    assert sim.read("child.pos")[0][0, 0].tolist() == [1.1, 1.0, 1.0]


def test_w_spawn_takes_one_place_for_all_or_one_each():
    class Three(Interaction):
        def step(self, w):
            if w.step_count[0] == 0:
                w.spawn(
                    "child",
                    [0, 0, 0],
                    pos=(1.0, 2.0, 3.0),
                    vel=np.array([[1.0, 2.0, 3.0], [0, 0, 0], [0, 0, 0]]),
                )

    sim = Simulation(with_children(Three()))
    sim.step(1)
    starts = []
    sim.observers.append(
        lambda s: starts.append((s.read("child.pos")[0][0].tolist(), s.read("child.vel")[0][0].tolist()))
    )
    sim.step(1)
    assert starts[0] == ([[1.0, 2.0, 3.0]] * 3, [[1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [3.0, 0.0, 0.0]])


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda w: w.spawn("chld", [0]), r"there is no block 'chld' \(did you mean 'child'\?\)"),
        (lambda w: w.spawn("child", [0], speed=3), r"w.spawn: unknown argument 'speed'"),
        (lambda w: w.spawn("child", [0], team=7), r"w.spawn: team = 7 is not allowed"),
        (lambda w: w.spawn("child", [0], pos=(1, 2)), r"w.spawn: pos has shape \(2,\); it takes \(3, 1\)"),
        (lambda w: w.move([0], pos=(1, 2)), r"w.move: pos has shape \(2, 1\); it takes \(3, 1\)"),
        (
            lambda w: w.spawn("child", [1]),
            r"w.spawn: world = 1 is not allowed; it takes whole numbers from 0 to 0",
        ),
        (lambda w: w.spawn("child", 0.5), r"w.spawn: world = an array of float64, \(1,\) is not allowed"),
        (lambda w: w.spawn("child", [0], pos=(1, 2, np.inf)), r"w.spawn: pos is not finite"),
        (
            lambda w: w.spawn("child", [0], quat=(1, 1, 0, 0)),
            r"w.spawn: quat has the length 1.41421; it takes quaternions of length 1",
        ),
        (lambda w: w.move([0], quat=(0, 0, 0, 0)), r"w.move: quat has the length 0; it takes"),
        (
            lambda w: w.move([7], vel=(1, 2, 3)),
            r"w.move: rows = 7 is not allowed; it takes whole numbers from 0 to \d",
        ),
        (
            lambda w: w.kill(w.rows_of(w.id * 9), "x"),
            r"w.kill: rows = -1, as of a removed entity, is not allowed",
        ),
        (lambda w: w.kill([[0]], "x"), r"w.kill: rows = an array of int64, \(1, 1\) is not allowed"),
        (
            lambda w: w.kill(np.ones(99, bool), "x"),
            r"w.kill: rows = an array of bool, \(99,\) is not allowed; it .*, or a mask \(\d+,\)",
        ),
        (lambda w: w.publish(Waypoint, [-1], pos=(1, 2, 3)), r"w.publish: world = -1 is not allowed"),
    ],
)
def test_wrong_wishes_are_refused(call, message):
    class Wrong(Interaction):
        def step(self, w):
            call(w)

    with pytest.raises(PluginError, match=message):
        Simulation(with_children(Wrong())).step()


class Asker(Autonomy):
    """Ask for one more of a block in one step."""

    at = Param(2)
    template = Param("child")
    births = Publish(SpawnEntity)

    def step(self, g):
        rows = np.flatnonzero(g.step_count == self.at)
        turned = np.array([[0.0], [0.0], [0.0], [1.0]])
        self.births.publish(
            rows,
            block=[self.template] * len(rows),
            pos=g.pos[:, rows] + 10.0,
            vel=g.vel[:, rows],
            quat=turned,
        )


def asking(**values):
    return mission(
        block("a", team=1, count=2, autonomy=[Drift(), Asker(**values)], position=(100, 0, 0)),
        block("child", count=0, team=2),
    )


def test_an_autonomy_asks_for_an_entity_by_message():
    sim = Simulation(asking(), seeds=[1, 2], params={"a.Asker.at": [2, 5]})
    born = []
    sim.observers.append(lambda s: born.append(s.read("child.pos")[1].sum(axis=1).tolist()))
    sim.run()
    assert born == [[0, 0]] * 3 + [[2, 0]] * 3 + [[2, 2]] * 4
    assert sim.read("child.id")[0].tolist() == [[3, 4], [3, 4]]
    # Asked for at 100.2 + 10, and drifting at 1 m/s from step 3 on, seven steps.
    assert sim.read("child.pos")[0][0, 0] == pytest.approx([110.2 + 0.7, 10.0, 10.0])
    assert alone(asking(), 1).state_hash() == sim.state_hash(0)


def test_attitude_of_the_asked_for():
    sim = Simulation(asking())
    sim.step(3)
    sim.observers.append(lambda s: yaws.append(s.read("child.yaw")[0][0].tolist()))
    yaws: list[list[float]] = []
    sim.step()
    assert yaws[0] == pytest.approx([np.pi, np.pi])


def test_births_by_message_of_several_blocks_get_the_same_ids_in_any_stack():
    game = mission(
        block("a", autonomy=[Drift(), Asker(template="x"), Asker(template="y", name="Second")]),
        block("x", count=0),
        block("y", count=0),
    )
    params = {"a.Asker.at": [2, 2, 3], "a.Second.at": [3, 2, 2]}
    stack = Simulation(game, seeds=[1, 2, 3], params=params)
    stack.run()
    for world in range(3):
        one = Simulation(game, seeds=world + 1, params={k: v[world] for k, v in params.items()})
        one.run()
        assert one.state_hash() == stack.state_hash(world)
    assert stack.read("x.id")[0][:, 0].tolist() == [2, 2, 3]


START_VALUES = {
    "position": [(0, 0, 5), (40, 0, 5), (0, -9, 7)],
    "variance": [(9, 9, 0), (1, 2, 3), (0, 4, 0)],
    "half_width": [(3, 3, 0), (3, 4, 5), (9, 1, 0)],
    "heading": [0.0, 1.0, 2.0],
    "heading_variance": [0.0, 0.1, 0.2],
    "climb": [0.0, 0.1, -0.1],
    "roll": [0.0, 0.2, 0.0],
    "speed": [0.0, 1.0, 2.0],
    "health": [1.0, 2.0, 3.0],
    "radius": [0.5, 0.7, 0.9],
    "mass": [1.0, 2.0, 3.0],
}


@pytest.mark.parametrize("compat", ["", "scrimmage"])
@pytest.mark.parametrize("rate", [None, 20.0])
@pytest.mark.parametrize("scatter_first", [False, True])
@pytest.mark.parametrize("placement", ["normal", "uniform"])
def test_each_world_starts_with_its_values_as_alone(placement, scatter_first, rate, compat):
    assert set(START_VALUES) == set(WORLD_VALUES)
    one = block("a", count=6, placement=placement, scatter_first=scatter_first, rate=rate)
    game = mission(one, interactions=[SimpleCollision()]).replace(compat=compat)
    params = {f"a.{name}": values for name, values in START_VALUES.items()}
    stack = Simulation(game, seeds=[1, 2, 3], params=params)
    stack.step(5)
    for world in range(3):
        own = one.replace(**{name: values[world] for name, values in START_VALUES.items()})
        alone = Simulation(game.replace(blocks=[own]), seeds=world + 1)
        alone.step(5)
        assert len(ids(alone)) > 1
        assert alone.state_hash() == stack.state_hash(world)


@pytest.mark.parametrize("interactions", [[], [SimpleCollision()]])
@pytest.mark.parametrize(
    ("state", "message"),
    [
        ({"pos": (0, 0, np.inf)}, "pos is not finite"),
        ({"vel": (np.nan, 0, 0)}, "vel is not finite"),
        ({"quat": (2, 0, 0, 0)}, "quat has the length 2"),
        ({"quat": (np.nan, 0, 0, 0)}, "quat is not finite"),
    ],
)
def test_asking_with_a_state_that_is_none_names_who_asked(state, message, interactions):
    class Asks(Interaction):
        def step(self, w):
            w.publish(SpawnEntity, w.active_worlds(), block="a", **state)

    sim = Simulation(mission(block("a"), interactions=[*interactions, Asks()]))
    with pytest.raises(ParameterError, match=f"^SpawnEntity: {message}"):
        sim.publish(SpawnEntity, block="a", **state)
    with pytest.raises(PluginError, match=f"^sent by entity 0, world 0, step 0: SpawnEntity: {message}"):
        sim.step()


def test_asking_for_a_block_that_is_not_there_ends_that_world_only():
    game = asking(template="chil")
    sim = Simulation(game, seeds=[1, 2, 3], params={"a.Asker.at": [99, 4, 99]})
    results = sim.run()
    assert [r.end for r in results] == ["time", "error", "time"]
    assert results[1].steps == 5
    assert "there is no block 'chil' (did you mean 'child'?); there are: a, child" in str(results[1].error)
    with pytest.raises(PluginError, match="world 0, step 2"):
        Simulation(game, seeds=1).run()


def test_resetting_one_world_leaves_the_wishes_of_others():
    class Everywhere(Interaction):
        def step(self, w):
            w.spawn("child", np.flatnonzero(w.step_count == 0), pos=(5.0, 6.0, 7.0))

    sim = Simulation(with_children(Everywhere()), seeds=[1, 2])
    sim.step()
    sim.reset([0])
    sim.step()
    assert sim.read("child.pos")[1].tolist() == [[False], [True]]


def test_a_referee_due_in_some_worlds_asks_only_there():
    class Keen(Interaction):
        def step(self, w):
            w.spawn("child", np.arange(w.n_worlds), pos=(5.0, 6.0, 7.0))

    sim = Simulation(with_children(Keen(rate=5.0)), seeds=[1, 2])
    sim.step()
    sim.reset([0])  # clocks differ from now on: due in steps 0, 2, 4 ... of each world
    sim.step(4)
    assert sim.read("child.pos")[1].sum(axis=1).tolist() == [2, 2]


def test_negative_count_is_refused():
    with pytest.raises(MissionError, match=r"block 'a': count = -1 is not allowed"):
        block(count=-1)
