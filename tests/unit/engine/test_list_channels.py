"""Lists as channels: who writes what whom reads, and what becomes of them from step to step."""

import numpy as np
import pytest
from small_worlds import Drift, Reaper, block, mission

from tussle import Simulation
from tussle.api import Autonomy, Behavior, Controller, EasyAutonomy, Input, Output, Param, Sensor, State
from tussle.errors import ConformanceError, PluginError, WiringError
from tussle.stock import AvoidEntityMS, MotorSchemas, NoisyContacts, Still
from tussle.testing import check_plugin
from tussle.testing.game import build
from tussle.testing.stacks import Traces, check_reset, check_snapshot, check_stacks
from tussle.testing.watch import check_calls


class Camera(Sensor):
    """Who is near, where from here, with noise."""

    grade = "portable"
    reach = Param(15.0, unit="m", gt=0.0)
    noise = Param(0.1, unit="m", ge=0.0)
    seen = Output(fields="x y z", unit="m", ragged=True)

    def step(self, g):
        near = g.near(self.reach)
        near = near[near.offset[0] > -0.5 * near.distance]
        self.seen.set(near.start, near.offset + self.noise[near.row] * g.normal_pairs("blur", near, k=3))


class Follow(Autonomy):
    """Fly to the middle of what is seen."""

    grade = "portable"
    seen = Input(fields="x y z", unit="m", ragged=True)
    known = State("x y z", unit="m", ragged=True)
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def step(self, g):
        self.velocity[:] = self.seen.mean(self.seen.data) + 0.1 * self.known.sum(self.known.data)
        self.known.set(self.seen.start, self.seen.data)


class EasyFollow(EasyAutonomy):
    """The same, without memory, in easy mode."""

    seen = Input(fields="x y z", unit="m", ragged=True)
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def step_one(self, me):
        total = np.zeros(3)
        for way in me.seen.T:
            total += way
        me.velocity = total / max(1, me.seen.shape[1])


class Count(Sensor):
    """The entity's id, as often as steps have passed, modulo 4."""

    grade = "portable"
    marks = Output(unit="m", ragged=True)

    def step(self, g):
        for row in range(g.n):
            self.marks[row] = np.full((g.step_count[row] + 1) % 4, float(g.id[row]))


class Reader(Autonomy):
    """Remembers how long the list was and what is in it."""

    grade = "portable"
    marks = Input(unit="m", ragged=True)
    length = State(dtype=int)
    total = State(unit="m")
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def step(self, g):
        self.length[:] = self.marks.count
        self.total[:] = self.marks.sum(self.marks.data)


def test_a_sensors_list_reaches_autonomies_in_the_next_step():
    sim = Simulation(mission(block(count=2, autonomy=Reader(), sensor=Count())), seeds=[1, 2])
    for step in range(6):
        sim.step()
        assert sim.read("a.Reader.length")[0].tolist() == [[step % 4] * 2] * 2
        assert sim.read("a.Reader.total")[0].tolist() == [[step % 4, 2.0 * (step % 4)]] * 2


def test_easy_mode_reads_the_same():
    class Alone(Follow):
        known = State("x y z", unit="m", ragged=True)

        def step(self, g):
            self.velocity[:] = self.seen.mean(self.seen.data)

    def flown(autonomy):
        game = mission(block(count=6, variance=(50.0, 50.0, 50.0), autonomy=autonomy, sensor=Camera()))
        sim = Simulation(game, seeds=[3])
        sim.run()
        return sim.read("a.pos")[0]

    assert np.array_equal(flown(Alone()), flown(EasyFollow()))


def test_lists_reach_controllers_and_the_last_writer_wins():
    class First(Autonomy):
        path = Output(fields="x", unit="m/s", ragged=True)
        level = Param(1.0)

        def step(self, g):
            self.path.set(np.arange(g.n + 1), self.level[None])

    class Never(First):
        def step(self, g):
            pass

    class Track(Controller):
        path = Input(fields="x", unit="m/s", ragged=True)
        velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

        def step(self, g):
            self.velocity[0] = self.path.sum(self.path.data[0])

    game = mission(
        block(count=2, autonomy=[First(), First(name="second", level=3.0), Never()], controller=Track())
    )
    sim = Simulation(game)
    assert "channel 'path' is written by First, then second, then Never; the last wins" in sim.describe()
    sim.step()
    assert sim.read("a.vel")[0][0, :, 0].tolist() == [3.0, 3.0]


@pytest.mark.parametrize(
    ("reader", "message"),
    [
        (
            Input(fields="x y", unit="m", ragged=True),
            r"reads channel 'seen' as a list of 2 fields \(x y\), but .* a list of 3 fields \(x y z\)",
        ),
        (
            Input(fields="z y x", unit="m", ragged=True),
            r"as a list of 3 fields \(z y x\), but .* a list of 3 fields",
        ),
        (Input(unit="m", ragged=True), r"as a list of numbers, but .* a list of 3 fields"),
        (Input(unit="m"), r"reads channel 'seen' as a number, but .* a list of 3 fields"),
        (
            Input(fields="x y z", unit="m m s", ragged=True),
            r"channel 'seen', field 'z', in 's', but .* in 'm'",
        ),
        (
            Input("seem", fields="x y z", unit="m", ragged=True),
            r"channel 'seem' for Other \(did you mean 'seen'\?\)",
        ),
    ],
)
def test_ends_of_a_wire_are_compared_when_the_mission_is_built(reader, message):
    other = type("Other", (Autonomy,), {"seen": reader, "step": lambda self, g: None})
    with pytest.raises(WiringError, match=message):
        Simulation(mission(block(autonomy=[Drift(), other()], sensor=Camera())))


def test_two_writers_of_one_list_agree():
    class Half(Sensor):
        seen = Output(fields="x", unit="m", ragged=True)

        def step(self, g):
            pass

    with pytest.raises(
        WiringError, match=r"Half.seen writes channel 'seen' as a list of 1 field \(x\), but .* a list of 3"
    ):
        Simulation(mission(block(sensor=[Camera(), Half()])))


def test_an_optional_list_that_nobody_writes_is_empty():
    class Maybe(Autonomy):
        seen = Input(fields="x y z", unit="m", ragged=True, optional=True)
        n = State(dtype=int, default=-1)

        def step(self, g):
            self.n[:] = self.seen.count + self.seen.data.shape[0]

    sim = Simulation(mission(block(autonomy=[Drift(), Maybe()])))
    sim.step()
    assert sim.read("a.Maybe.n")[0].tolist() == [[3]]


def test_a_reader_cannot_write():
    class Vandal(Autonomy):
        seen = Input(fields="x y z", unit="m", ragged=True)
        how = Param("data", choices=("data", "set"))

        def step(self, g):
            if self.how == "set":
                self.seen[0] = np.zeros((3, 1))
            self.seen.data[...] = 0.0

    for how in ("data", "set"):
        with pytest.raises(PluginError, match=r"Vandal, a, world 0, step 0: .*ValueError: .*read-only"):
            Simulation(mission(block(autonomy=[Drift(), Vandal(how=how)], sensor=Camera()))).step()


def test_lists_move_with_their_rows_when_others_die_and_are_born():
    late = block("late", count=4, rate=5.0, autonomy=Reader(), sensor=Count(rate=2.0))
    reaped = block("reaped", team=2, count=3, autonomy=Reader(), sensor=Count(rate=2.0))
    game = mission(late, reaped, interactions=[Reaper(team=2, at=0.7)], end=2.0)
    sim = Simulation(game, seeds=[1, 2])
    lengths = set()
    for _ in range(20):
        sim.step()
        for name in ("late", "reaped"):
            lists, alive = sim.read(f"{name}.Count.marks")
            ids = sim.read(f"{name}.id")[0]
            for where in np.argwhere(alive):
                own = lists[tuple(where)]
                assert set(own.tolist()) <= {float(ids[tuple(where)])}
                lengths.add((name, len(own)))
            assert all(lists[tuple(w)] is None for w in np.argwhere(~alive))
    assert {("late", 0), ("late", 1), ("late", 2), ("late", 3), ("reaped", 2)} <= lengths


def test_a_reset_empties_the_lists_of_its_worlds_alone():
    class Fixed(Count):
        """Has a parameter that is a list, too."""

        corners = Param(((1.0, 2.0),), fields="x y", ragged=True)

    sim = Simulation(mission(block(count=2, autonomy=Reader(), sensor=Fixed())), seeds=[1, 2, 3])
    sim.step(3)
    sim.reset([1])
    lists, _ = sim.read("a.Fixed.marks")
    assert [[own.tolist() for own in world] for world in lists] == [
        [[1.0] * 3, [2.0] * 3],
        [[], []],
        [[1.0] * 3, [2.0] * 3],
    ]
    assert [own.tolist() for own in sim.read("a.Fixed.corners")[0].ravel()] == [[[1.0], [2.0]]] * 6
    sim.step(1)
    assert sim.read("a.Reader.length")[0].tolist() == [[3, 3], [0, 0], [3, 3]]


def test_a_list_counts_in_the_hash():
    game = mission(block(count=2, autonomy=Reader(), sensor=Count()))
    hashed = []
    for change in (None, 1.0, 2.0):
        sim = Simulation(game)
        sim.step(4)
        if change is not None:
            binding = next(b for b in sim.state.population.groups[0].walk() if b.path == ("Count",))
            binding.plugin.marks[0] = [change]
        hashed.append(sim.state_hash())
    assert len(set(hashed)) == 3


def test_lists_of_worlds_that_have_ended_are_read():
    game = mission(block(count=2, autonomy=Reader(), sensor=Count()), interactions=[Reaper(team=5)])
    sim = Simulation(game, seeds=[1, 2])
    sim.step(3)
    sim.run()
    sim.reset([1])
    sim.step(2)
    lists, alive = sim.read("a.Count.marks")
    assert alive.all()
    assert [lists[0, 1].tolist(), lists[1, 1].tolist()] == [[2.0, 2.0], [2.0, 2.0]]


def test_a_list_that_is_not_finite_is_told_of():
    class Broken(Autonomy):
        path = Output(fields="x y", unit="m", ragged=True)
        velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

        def step(self, g):
            self.path[0] = [(1.0, np.nan), (0.0, 0.0)]
            self.velocity[:] = np.nan

    with pytest.raises(
        PluginError,
        match=r"Broken, a 1, world 0, step 0: an item of output 'path' = nan is not a finite number",
    ):
        Simulation(mission(block(autonomy=Broken())), on_error="raise").step()


# -- the kit ----------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("plugin", [Camera, Follow, EasyFollow, Count, Reader])
def test_plugins_with_lists_conform(plugin):
    check_plugin(plugin)


class Mixed(Sensor):
    """Gives everybody the first entity's list, whatever its world."""

    seen = Output(fields="x y z", unit="m", ragged=True)

    def step(self, g):
        near = g.near(40.0)
        self.seen.set(near.start, near.offset + g.pos[:, :1])


class Overflows(Sensor):
    """Divides by what may be zero."""

    scale = Param(1.0, ge=0.0)
    seen = Output(unit="m", ragged=True)

    def step(self, g):
        self.seen.set(np.arange(g.n + 1), 1.0 / self.scale)


class Twice(Sensor):
    """Draws the same numbers for pairs twice."""

    seen = Output(unit="m", ragged=True)

    def step(self, g):
        near = g.near(40.0)
        self.seen.set(near.start, g.normal_pairs("a", near) + g.uniform_pairs("a", near))


@pytest.mark.parametrize(
    ("plugin", "rule"),
    [
        (Twice, "step draws 'a' again in a step"),
        (Mixed, "stack invariance"),
        (Overflows, "an item of Overflows.seen is inf"),
    ],
)
def test_the_kit_looks_into_lists(plugin, rule):
    with pytest.raises(ConformanceError, match=rule):
        check_plugin(plugin)


# -- a stock reader of contacts -----------------------------------------------------------------------------------------------------

QUIET = {f"{k}_noise_{i}": (0.0, 0.0) for k in ("pos", "vel", "orient") for i in range(3)}


def shy(contacts, *others, noise=QUIET, **values):
    """What one that stays where it is wishes in the second step, with others at places and of teams."""
    avoid = AvoidEntityMS(contacts=contacts, sphere_of_influence=10.0, minimum_range=4.0, **values)
    motors = MotorSchemas(behaviors=[avoid], max_speed=6.0)
    me = block("me", autonomy=motors, motion=Still(), sensor=NoisyContacts(**noise))
    there = [
        block(f"o{i}", team=team, position=pos, autonomy=Drift(), motion=Still())
        for i, (pos, team) in enumerate(others)
    ]
    sim = Simulation(mission(me, *there))
    sim.step(2)
    return sim.read("me.MotorSchemas.AvoidEntityMS.desired_velocity")[0][0, 0].tolist()


@pytest.mark.parametrize(
    "others",
    [
        [((7.0, 0, 0), 1)],
        [((7.0, 0, 0), 1), ((0, -5.0, 3.0), 2)],
        [((10.0, 0, 0), 1), ((3.0, 0, 0), 2)],
        [((0.0, 0, 0), 1)],
        [],
    ],
)
def test_avoidance_of_contacts_without_noise_is_that_of_the_truth(others):
    assert shy("noisy", *others) == shy("truth", *others)
    assert shy("noisy", *others, avoid_non_team=False) == shy("truth", *others, avoid_non_team=False)


def test_avoidance_of_noisy_contacts_is_from_where_they_are_reported():
    desired_velocity = shy("noisy", ((7.0, 0, 0), 1), noise={**QUIET, "pos_noise_0": (-14.0, 0.0)})
    assert desired_velocity == pytest.approx([3.0, 0.0, 0.0])


def test_contacts_that_no_sensor_reports_are_missed():
    motors = MotorSchemas(behaviors=[AvoidEntityMS(contacts="noisy")])
    with pytest.raises(
        WiringError,
        match=r"AvoidEntityMS\.seen: .*'contacts'; there are: seen",
    ):
        Simulation(mission(block(autonomy=motors, motion=Still(), sensor=Camera())))


def test_a_behaviour_reads_channels_that_do_not_lie_side_by_side():
    class Wind(Sensor):
        wind = Output("wind_x wind_y wind_z", unit="m/s")

        def step(self, g):
            self.wind[:] = g.step_count + np.array([[1.0], [2.0], [3.0]])

    class Sail(Behavior):
        across = Input("wind_z wind_x", unit="m/s")

        def step(self, g):
            self.desired_velocity[:2] = self.across

    game = mission(block(autonomy=MotorSchemas(behaviors=[Sail()]), motion=Still(), sensor=Wind()))
    sim = Simulation(game)
    sim.step(3)
    assert sim.read("a.MotorSchemas.Sail.desired_velocity")[0][0, 0].tolist() == [4.0, 2.0, 0.0]


def test_avoidance_of_contacts_conforms():
    for companions in ((), (NoisyContacts(max_range=20.0),)):
        game = build(AvoidEntityMS(contacts="noisy", sphere_of_influence=20.0), companions)
        check_calls(game)
        traces = Traces(game)
        for rule in (check_stacks, check_reset, check_snapshot):
            rule(game, traces)
