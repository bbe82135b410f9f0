"""Lists of waypoints: when they are told, and how an entity is led along them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from small_worlds import Drift, block, mission

from tussle import Simulation
from tussle.api import Autonomy, Output, Publish, RaggedColumn, State, Subscribe
from tussle.messages import WAYPOINT_MODES, Waypoint, WaypointList, WaypointStatus
from tussle.plugins import historic, stock
from tussle.stock import (
    MotorSchemas,
    MoveToGoalMS,
    SingleIntegrator,
    Still,
    WaypointDispatcher,
    WaypointGenerator,
)


def point(x, y=0.0, z=0.0, time=0.0, tolerance=5.0):
    return (time, x, y, z, 0.1, 0.2, 0.3, tolerance, -1.0)


class Ear(Autonomy):
    """Remembers what it hears of waypoints, and counts it."""

    n_lists = State(dtype=int)
    n_points = State(dtype=int)
    mode = State(dtype=int, default=-1)
    first = State("x y z roll pitch yaw tolerance turn")
    goal = State("x y z")
    n_told = State(dtype=int)
    index = State(dtype=int, default=-1)
    is_done = State(dtype=bool)
    is_skipped = State(dtype=bool)
    lists = Subscribe(WaypointList)
    goals = Subscribe(Waypoint, network="LocalNetwork")
    reached = Subscribe(WaypointStatus, network="LocalNetwork")

    def step(self, g):
        rows, heard = self.lists.pairs()
        np.add.at(self.n_lists, rows, 1)
        for number, row in enumerate(rows):
            self.n_points[row] = heard.points[number].shape[1]
            if self.n_points[row]:
                self.first[:, row] = heard.points[number][:, 0]
            self.mode[row] = heard.mode[number]
        rows, heard = self.goals.latest()
        self.goal[:, rows] = heard.pos
        rows, heard = self.reached.pairs()
        np.add.at(self.n_told, rows, 1)
        for number, row in enumerate(rows):
            self.index[row], self.is_done[row] = heard.index[number], heard.is_done[number]
            self.is_skipped[row] = heard.is_skipped[number]


# -- WaypointGenerator ------------------------------------------------------------------------------------------------------------


def station(end=10.0, seeds=1, **values):
    blocks = [
        block("station", autonomy=WaypointGenerator(**values), motion=Still()),
        block("ear", autonomy=Ear(), motion=Still()),
    ]
    return Simulation(mission(*blocks, end=end), seeds)


def heard(sim, column):
    return sim.read(f"ear.Ear.{column}")[0][0, 0].tolist()


def test_a_list_is_told_when_its_time_has_come():
    sim = station(
        waypoints=[point(1.0), point(2.0, time=0.5), point(3.0, time=0.3), point(4.0, time=0.5)],
        mode="loiter",
    )
    sim.step(2)
    assert (heard(sim, "n_lists"), heard(sim, "n_points")) == (1, 1)
    sim.step(2)  # step 3 begins at 0.30000000000000004 s, and the list is heard in the step after that
    assert heard(sim, "n_lists") == 1
    sim.step()
    assert (heard(sim, "n_lists"), heard(sim, "first")[0]) == (2, 3.0)
    sim.step(2)
    assert (heard(sim, "n_lists"), heard(sim, "n_points"), heard(sim, "first")[0]) == (3, 2, 2.0)
    sim.step(50)
    assert heard(sim, "n_lists") == 3
    assert WAYPOINT_MODES[heard(sim, "mode")] == "loiter"


def test_a_time_that_no_step_begins_at_exactly_is_met_all_the_same():
    for k in range(1, 60):
        sim = station(waypoints=[point(1.0, time=float(f"{k / 10:.1f}"))])
        sim.step(k + 1)
        assert heard(sim, "n_lists") == 0
        sim.step()
        assert heard(sim, "n_lists") == 1


def test_what_a_list_carries():
    sim = station(waypoints=[point(1.0, 2.0, 3.0, tolerance=-1.0)])
    sim.step(2)
    assert heard(sim, "first") == [1.0, 2.0, 3.0, 0.1, 0.2, 0.3, math.inf, math.inf]


def test_by_default_it_tells_two_points_and_later_one_more():
    sim = station(end=60.0)
    sim.step(501)
    assert (heard(sim, "n_lists"), heard(sim, "n_points")) == (1, 2)
    sim.step()
    assert (heard(sim, "n_lists"), heard(sim, "first")[:3]) == (2, [0.0, 0.0, 100.0])


# -- WaypointDispatcher -----------------------------------------------------------------------------------------------------------


def flight(points, pos, *, mode="follow_once", end=60.0, steps=2, velocity=(0.0, 0.0, 0.0), **values):
    """A dispatcher at a place, with an ear in the same entity, after some steps."""
    led = block(
        "led", position=pos, motion=SingleIntegrator(),
        autonomy=[WaypointDispatcher(**values), Ear(), Drift(to=velocity)],
    )  # fmt: skip
    tower = block("tower", autonomy=WaypointGenerator(waypoints=points, mode=mode), motion=Still())
    sim = Simulation(mission(led, tower, end=end))
    sim.step(steps + 1)
    return sim


def led(sim, column):
    return sim.read(f"led.Ear.{column}")[0][0, 0].tolist()


def test_towards_the_first_waypoint_the_line_is_from_the_entity_itself():
    sim = flight([point(300.0, 400.0)], (0.0, 0.0, 0.0))
    assert led(sim, "goal") == pytest.approx([30.0, 40.0, 0.0])
    sim = flight([point(300.0, 400.0)], (0.0, 0.0, 0.0), lead_distance=100.0)
    assert led(sim, "goal") == pytest.approx([60.0, 80.0, 0.0])
    sim = flight([point(3.0, 4.0)], (0.0, 0.0, 10.0))
    assert led(sim, "goal") == pytest.approx([3.0, 4.0, 0.0])


def on_the_way(pos, **values):
    """From (0, 0, 0), which is reached at once, to (200, 0, 0): an entity that has been moved to pos since."""
    sim = flight([point(0.0), point(200.0)], (0.0, 0.0, 0.0), **values)
    sim.write("led.pos", pos)
    sim.step(2)
    return led(sim, "goal")


def test_the_point_lies_on_the_line_ahead_of_the_foot():
    assert on_the_way((60.0, 35.0, -20.0)) == pytest.approx([110.0, 0.0, 0.0])


def test_behind_the_begin_of_the_line_the_point_stays_ahead_of_that():
    assert on_the_way((-80.0, 10.0, 0.0)) == pytest.approx([50.0, 0.0, 0.0])


def test_the_point_never_lies_beyond_the_waypoint():
    assert on_the_way((170.0, 10.0, 0.0)) == pytest.approx([200.0, 0.0, 0.0])
    assert on_the_way((250.0, 10.0, 0.0)) == pytest.approx([200.0, 0.0, 0.0])


def visits(mode, n_points, n_events):
    """Numbers of the next waypoint, one per waypoint reached, with everything near enough to everything."""
    points = [point(10.0 * i, tolerance=-1.0) for i in range(n_points)]
    sim = flight(points, (0.0, 0.0, 0.0), mode=mode, steps=0)
    seen = []
    for _ in range(n_events):
        sim.step()
        seen.append(sim.read("led.WaypointDispatcher.current")[0][0, 0].item())
    return seen


def test_round_and_round():
    assert visits("racetrack", 3, 7) == [1, 2, 0, 1, 2, 0, 1]


def test_back_and_forth():
    assert visits("back_and_forth", 3, 8) == [1, 2, 1, 0, 1, 2, 1, 0]
    assert visits("back_and_forth", 2, 4) == [1, 0, 1, 0]
    assert visits("back_and_forth", 1, 3) == [0, 0, 0]


def test_once_through():
    assert visits("follow_once", 3, 5) == visits("loiter", 3, 5) == [1, 2, 2, 2, 2]


def test_what_is_reached_is_told_once():
    sim = flight([point(0.0), point(100.0)], (0.0, 0.0, 0.0), velocity=(10.0, 0.0, 0.0))
    assert (led(sim, "n_told"), led(sim, "index"), led(sim, "is_done")) == (1, 1, False)
    sim.step(88)
    assert led(sim, "n_told") == 1
    sim.step(30)
    assert (led(sim, "n_told"), led(sim, "index"), led(sim, "is_done")) == (2, 1, True)


def test_near_enough_may_mean_in_the_plane():
    points = [point(0.0, z=50.0), point(100.0)]
    assert led(flight(points, (0.0, 0.0, 0.0)), "n_told") == 0
    assert led(flight(points, (0.0, 0.0, 0.0), tolerance_in_2d=True), "n_told") == 1


def test_waypoints_on_top_of_the_one_before_are_dropped():
    points = [point(500.0), point(500.5), point(501.2), point(501.9), point(900.0)]

    def kept(**values):
        groups = flight(points, (0.0, 0.0, 0.0), **values).state.population.groups
        binding = next(b for g in groups for b in g.walk() if b.path == ("WaypointDispatcher",))
        return binding.plugin.points[0][0].tolist()

    assert kept() == [500.0, 501.2, 900.0]
    assert kept(filter_dist=0.0) == [500.0, 500.5, 501.2, 501.9, 900.0]


def test_a_new_list_begins_anew():
    points = [point(0.0), point(100.0), point(0.0, 700.0, time=1.0)]
    sim = flight(points, (0.0, 0.0, 0.0), steps=3)
    assert led(sim, "goal") == pytest.approx([50.0, 0.0, 0.0])
    sim.step(12)
    assert led(sim, "goal") == pytest.approx([0.0, 50.0, 0.0])


def test_entities_are_led_each_along_its_own_list_and_without_one_not_at_all():
    own = [
        block(
            f"led{i}", position=(0.0, 100.0 * i, 0.0), motion=SingleIntegrator(),
            autonomy=[
                *([WaypointGenerator(waypoints=[point(300.0, 100.0 * i)] * n, network_name="LocalNetwork")] if n else []),
                WaypointDispatcher(waypointlist_network="LocalNetwork"),
                MotorSchemas(behaviors=[MoveToGoalMS(goal=(0.0, -500.0, 0.0))]),
            ],
        )
        for i, n in ((1, 1), (2, 2), (3, 0))
    ]  # fmt: skip
    sim = Simulation(mission(*own, end=5.0), seeds=[1, 2])
    sim.step(4)
    target = [sim.read(f"led{i}.MotorSchemas.MoveToGoalMS.target")[0][:, 0].tolist() for i in (1, 2, 3)]
    assert target[0][0][1:] == pytest.approx([100.0, 0.0], abs=15.0)
    assert target[1][1][1:] == pytest.approx([200.0, 0.0], abs=15.0)
    assert target[2] == [[0.0, -500.0, 0.0]] * 2


def passed(laws, points, speed, *, tolerance=0.3, steps=40, mode="follow_once"):
    """Number of the next waypoint after each step, flying East at a constant speed from (0, 0, 0)."""
    listed = [point(x, y, tolerance=tolerance) for x, y in points]
    blocks = [
        block("led", autonomy=[laws.WaypointDispatcher(filter_dist=0.0), Drift(to=(speed, 0.0, 0.0))], motion=SingleIntegrator()),
        block("tower", autonomy=WaypointGenerator(waypoints=listed, mode=mode), motion=Still()),
    ]  # fmt: skip
    sim, seen = Simulation(mission(*blocks, end=60.0), seeds=[1, 2]), []
    for _ in range(steps):
        sim.step()
        seen.append(sim.read("led.WaypointDispatcher.current")[0][:, 0].tolist())
    assert all(a == b for a, b in seen)
    return [a for a, _ in seen]


def test_a_waypoint_between_two_steps_is_reached_by_its_nearest_distance_to_the_way():
    ahead = (100.0, 0.0)
    assert passed(stock, [(5.25, 0.0), ahead], 15.0)[-1] == 1
    assert passed(stock, [(5.25, 0.29), ahead], 15.0)[-1] == 1
    assert passed(stock, [(5.25, 0.31), ahead], 15.0)[-1] == 0
    assert passed(historic, [(5.25, 0.0), ahead], 15.0)[-1] == 0


def test_all_waypoints_that_a_step_passes_are_reached_in_order():
    row = [(1.0 * x, 0.0) for x in range(10, 30)]
    assert passed(stock, row, 40.0)[-1] == 19
    assert passed(historic, row, 40.0)[-1] < 5
    # Against the order: the second one lies behind the first.
    assert passed(stock, [(12.5, 0.0), (11.5, 0.0), (90.0, 0.0)], 40.0)[-1] == 1
    assert passed(stock, [(10.5, 0.0), (11.5, 0.0)], 40.0, mode="racetrack")[-1] == 0


def test_what_was_passed_before_the_list_came_is_not_reached():
    blocks = [
        block("led", autonomy=[WaypointDispatcher(), Drift(to=(40.0, 0.0, 0.0))], motion=SingleIntegrator()),
        block("tower", autonomy=WaypointGenerator(waypoints=[point(38.0, time=0.9, tolerance=0.5)]), motion=Still()),
    ]  # fmt: skip
    sim = Simulation(mission(*blocks, end=60.0))
    sim.step(20)
    assert sim.read("led.WaypointDispatcher.points")[0][0][0].shape[1] == 1
    assert not sim.read("led.WaypointDispatcher.is_done")[0].any()


@pytest.mark.parametrize("aside", [0.0, 0.25, 3.0])
@pytest.mark.parametrize("speed", [10.0, 12.5])
def test_with_the_tolerance_0_a_waypoint_is_reached_when_it_is_passed(speed, aside):
    """Also at the end of a step, and at a distance; in SCRIMMAGE only in it."""
    seen = passed(stock, [(10.0, aside), (25.0, aside), (30.0, aside), (100.0, 0.0)], speed, tolerance=0.0)
    assert [seen.index(k) for k in (1, 2, 3)] == [math.ceil(10.0 * x / speed) for x in (10.0, 25.0, 30.0)]
    assert seen[-1] == 3
    assert passed(historic, [(3.3, aside), (100.0, 0.0)], speed, tolerance=0.0)[-1] == 0


class Circle(Autonomy):
    """Flies round a place."""

    command = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def step(self, g):
        x, y = g.pos[:2]
        self.command[:] = np.stack([-y, x, 0.0 * x])


def circling(laws, **values):
    """A dispatcher that circles its first waypoint at 20 m, 1 rad/s."""
    ring = block(
        "led",
        position=(20.0, 0.0, 0.0),
        autonomy=[laws.WaypointDispatcher(**values), Ear(), Circle()],
        motion=SingleIntegrator(),
    )
    tower = block("tower", autonomy=WaypointGenerator(waypoints=[point(0.0), point(300.0)]), motion=Still())
    return Simulation(mission(ring, tower, end=60.0))


def test_a_waypoint_that_is_circled_is_skipped_after_a_turn_and_a_warning_says_so():
    sim = circling(stock)
    sim.step(60)
    assert led(sim, "n_told") == 0
    with pytest.warns(
        RuntimeWarning, match="WaypointDispatcher: an entity skips a waypoint that it has circled"
    ):
        sim.step(10)
    assert (led(sim, "n_told"), led(sim, "index")) == (1, 1)
    assert led(sim, "is_skipped") is True
    for laws, values in ((stock, {"max_turns": 0.0}), (historic, {})):
        sim = circling(laws, **values)
        sim.step(200)
        assert led(sim, "n_told") == 0


class Silent(Autonomy):
    """Says a list without points, once."""

    lists = Publish(WaypointList)

    def step(self, g):
        if (g.step_count == 0).all():
            nothing = RaggedColumn.empty(g.n, WaypointList.fields["points"])
            self.lists.publish(np.arange(g.n), points=nothing, mode=0)


def test_an_empty_list_leads_nowhere():
    blocks = [
        block("led", autonomy=[WaypointDispatcher(), Ear(), Drift(to=(0.0, 0.0, 0.0))]),
        block("silent", autonomy=Silent(), motion=Still()),
    ]
    sim = Simulation(mission(*blocks))
    sim.run()
    assert led(sim, "n_lists") == 1
    assert led(sim, "goal") == [0.0, 0.0, 0.0]


def test_loiter_circles_around_the_last_waypoint():
    led = block(
        "led", position=(0.0, 0.0, 100.0), motion=SingleIntegrator(),
        autonomy=[
            WaypointDispatcher(loiter_radius=50.0, lead_distance=20.0),
            MotorSchemas(max_speed=10.0, behaviors=[MoveToGoalMS(distance_pid=(1e3, 0.0, 0.0, 0.0))]),
        ],
    )  # fmt: skip
    tower = block(
        "tower",
        autonomy=WaypointGenerator(waypoints=[point(100.0, 0.0, 120.0)], mode="loiter"),
        motion=Still(),
    )
    sim = Simulation(mission(led, tower, end=1000.0))
    sim.step(800)
    angle = []
    for _ in range(300):
        sim.step()
        x, y, z = sim.read("led.pos")[0][0, 0]
        # The point is a step old, v dt L / R = 0.4 m, and steps of 1 m are chords, (L - v dt) v dt / (2 R) = 0.19 m.
        assert math.hypot(x - 100.0, y) == pytest.approx(50.58, abs=0.02)
        assert z == pytest.approx(120.0, abs=0.1)
        angle.append(math.atan2(y, x - 100.0))
    turned = np.diff(np.unwrap(angle))
    assert turned == pytest.approx(np.full(299, 1.0 / 50.58), rel=0.01)  # counter-clockwise at 10 m/s


def test_a_circle_begins_at_its_center_too():
    sim = flight([point(0.0)], (0.0, 0.0, 0.0), mode="loiter", steps=3)
    assert led(sim, "goal") == pytest.approx([50.0, 50.0, 0.0])
