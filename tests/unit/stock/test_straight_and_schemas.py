"""Straight, motor schemas and behaviours, by small cases computed by hand."""

from __future__ import annotations

import numpy as np
import pytest
from small_worlds import Drift, block, mission

from tussle import Simulation
from tussle.api import Autonomy, Behavior, Children, Interaction, Output, Param, Publish, State
from tussle.errors import MissionError
from tussle.messages import Waypoint
from tussle.plugins import stock
from tussle.stock import (
    AvoidEntityMS,
    Boundary,
    LocalNetwork,
    MotorSchemas,
    MoveToGoalMS,
    NoisyState,
    Straight,
    Unicycle,
    UnicyclePID,
)


def wants(sim, name="Straight", agent=0):
    columns = ("desired_heading", "desired_altitude", "desired_speed")
    return [float(sim.read(f"a.{name}.{c}")[0][0, agent]) for c in columns]


def straight(sensor=(), **values):
    return block(
        position=(10, 20, 30),
        heading="30 deg",
        climb="40 deg",
        autonomy=Straight(**values),
        controller=UnicyclePID(),
        motion=Unicycle(vel_max=50.0),
        sensor=sensor,
    )


def test_straight_holds_heading_altitude_and_speed():
    sim = Simulation(mission(straight(speed=15.0)))
    sim.step()
    # 1000 km ahead along the body x axis, at the height of the start.
    assert wants(sim) == pytest.approx([np.pi / 6, 30.0, 15.0])
    goal = np.array(
        [10 + 1e6 * np.cos(np.radians(40)) * np.cos(np.pi / 6), 20 + 1e6 * np.cos(np.radians(40)) * 0.5, 30.0]
    )
    assert sim.read("a.Straight.goal")[0][0, 0] == pytest.approx(goal)


def test_what_missions_call_follow_is_straight():
    """There it holds the initial heading and altitude at 21 m/s, since its body is commented out."""
    assert stock.load("follow") is Straight
    sim = Simulation(mission(straight()))
    sim.step()
    assert wants(sim) == pytest.approx([np.pi / 6, 30.0, 21.0])


def test_straight_flies_by_its_belief():
    noisy = NoisyState(pos_noise_0=(-2e6, 0.0))
    sim = Simulation(mission(straight(sensor=noisy)))
    sim.step(2)
    assert wants(sim)[0] != pytest.approx(np.pi / 6, abs=1e-3)


def test_straight_turns_back_at_a_boundary_and_keeps_its_height():
    fence = Boundary(lengths=(100.0, 100.0, 1000.0), center=(10.0, 0.0, 0.0))
    sim = Simulation(
        mission(straight(enable_boundary_control=True, speed=20.0), interactions=[fence], end=9.0)
    )
    sim.step(2)
    assert wants(sim)[0] == pytest.approx(np.pi / 6, abs=1e-6)
    sim.write("a.pos", (50.0, 60.0, 77.0))
    sim.step()
    assert wants(sim)[0] == pytest.approx(np.arctan2(-60.0, -40.0))
    assert wants(sim)[1] == 30.0
    free = Simulation(mission(straight(speed=20.0), interactions=[fence], end=9.0))
    free.step(2)
    free.write("a.pos", (50.0, 60.0, 77.0))
    free.step()
    assert wants(free)[0] == pytest.approx(np.pi / 6, abs=1e-3)


@pytest.mark.parametrize(
    ("normal", "heading"),
    [((1.0, 0.0, 0.0), np.pi), ((0.0, -2.0, 2.0), np.pi / 2), ((0.0, 0.0, 1.0), np.pi / 6)],
)
def test_straight_turns_straight_back_across_a_plane_unless_that_is_level(normal, heading):
    fence = Boundary(shape="plane", center=(0.0, 0.0, -100.0), normal=normal)
    sim = Simulation(
        mission(straight(enable_boundary_control=True, speed=0.0), interactions=[fence], end=9.0)
    )
    sim.step(2)
    sim.write("a.pos", (50.0, -60.0, 77.0))
    sim.step()
    assert abs(wants(sim)[0]) == pytest.approx(heading, abs=1e-3)
    assert wants(sim)[1] == 30.0


def test_straight_asks_for_company_every_two_seconds():
    child = block(
        "gen_straight",
        count=0,
        autonomy=Straight(speed=0.0),
        controller=UnicyclePID(),
        motion=Unicycle(vel_max=50.0),
    )
    parent = block(
        heading=0.0,
        autonomy=Straight(generate_entities=True, speed=10.0),
        controller=UnicyclePID(),
        motion=Unicycle(vel_max=50.0),
        speed=10.0,
    )
    sim = Simulation(mission(parent, child, end=5.0))
    sim.step(21)
    assert sim.read("gen_straight.pos")[1].sum() == 0
    born = []
    sim.observers.append(
        lambda s: born.append(
            (s.read("gen_straight.pos")[0][0].tolist(), s.read("gen_straight.yaw")[0][0].tolist())
        )
    )
    sim.step()
    assert born[0][0][0] == pytest.approx([20.0, 10.0, 0.0], abs=0.05)
    assert born[0][1][0] == pytest.approx(np.pi / 2)
    sim.run()
    assert sim.read("gen_straight.pos")[1].sum() == 2


def test_straight_with_a_template_that_is_not_there():
    parent = block(
        autonomy=Straight(generate_entities=True), controller=UnicyclePID(), motion=Unicycle(vel_max=50.0)
    )
    with pytest.raises(MissionError, match=r"Straight: there is no block 'gen_straight'; there are: a"):
        mission(parent, end=5.0)


class Wish(Behavior):
    to = Param((0.0, 0.0, 0.0), fields="x y z", unit="m/s")

    def step(self, g):
        self.desired_velocity[:] = self.to


def schemas(*behaviors, **values):
    values.setdefault("max_speed", 10.0)
    return block(
        position=(0, 0, 100),
        autonomy=MotorSchemas(behaviors=behaviors, **values),
        controller=UnicyclePID(),
        motion=Unicycle(vel_max=50.0),
        heading="90 deg",
    )


def wished(*behaviors, **values):
    sim = Simulation(mission(schemas(*behaviors, **values)))
    sim.step()
    return wants(sim, "MotorSchemas")


@pytest.mark.parametrize(
    ("behaviors", "velocity"),
    [
        ([Wish(to=(3, 4, 0))], (3, 4, 0)),
        ([Wish(to=(30, 40, 0))], (6, 8, 0)),  # shortened to 10 m/s
        (
            [Wish(to=(4, 0, 0)), Wish(to=(0, 8, 2), gain=3.0, name="B")],
            (1, 6, 1.5),
        ),  # (4 + 0, 0 + 24, 0 + 6) / 4
        ([Wish(to=(4, 0, 0)), Wish(gain=9.0, name="B")], (4, 0, 0)),  # who wishes nothing dilutes nothing
        ([Wish(to=(40, 0, 0)), Wish(to=(0, 2, 0), name="B")], (5, 1, 0)),  # shortened before the mean
        ([Wish()], (0, 10, 0)),  # no wish: on at full speed
        ([], (0, 10, 0)),
    ],
)
def test_motor_schemas_take_the_mean_by_gain_of_those_that_wish(behaviors, velocity):
    x, y, z = velocity
    assert wished(*behaviors) == pytest.approx([np.arctan2(y, x), 100.0 + z, np.sqrt(x * x + y * y + z * z)])


def test_motor_schemas_write_the_same_as_a_velocity():
    def fly(**values):
        flier = block(autonomy=MotorSchemas(behaviors=[Wish(to=(1.0, 2.0, -3.0))], **values))
        sim = Simulation(mission(flier))
        sim.run()
        return sim.read("a.pos")[0][0, 0].tolist()

    assert fly() == pytest.approx([1.0, 2.0, -3.0])
    assert fly(add_lower_bound_to_vz=True) == pytest.approx([1.0, 2.0, -1.0])
    assert fly(add_lower_bound_to_vz=True, vz_lower_bound=-2.5) == pytest.approx([1.0, 2.0, -2.5])


def test_each_behaviour_draws_its_own_numbers_and_so_does_who_steps_them():
    class Gambler(Behavior):
        def step(self, g):
            self.desired_velocity[:] = g.uniform("dice", 3)

    class Nest(Autonomy):
        inner = Children(Behavior)
        drawn = State("x y z")
        velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

        def step(self, g):
            for behavior in self.inner:
                g.step(behavior)
            self.drawn[:] = g.uniform("dice", 3)

    def drawn(autonomy, path):
        sim = Simulation(mission(block(autonomy=autonomy)))
        sim.step()
        return sim.read(path)[0][0, 0].tolist()

    nest = Nest(inner=[Gambler(), Gambler(name="other")])
    first, second = (
        drawn(nest, "a.Nest.Gambler.desired_velocity"),
        drawn(nest, "a.Nest.other.desired_velocity"),
    )
    assert first != second
    assert first == drawn(Nest(inner=[Gambler()]), "a.Nest.Gambler.desired_velocity")
    assert drawn(nest, "a.Nest.drawn") == drawn(Nest(), "a.Nest.drawn")


def avoiding(*others, **values):
    values.setdefault("sphere_of_influence", 10.0)
    values.setdefault("minimum_range", 4.0)
    me = block(autonomy=MotorSchemas(behaviors=[AvoidEntityMS(**values)], max_speed=6.0), team=1)
    there = [
        block(f"o{i}", team=team, position=pos, autonomy=Drift(to=(0, 0, 0)))
        for i, (pos, team) in enumerate(others)
    ]
    sim = Simulation(mission(me, *there))
    sim.step()
    return sim.read("a.MotorSchemas.AvoidEntityMS.desired_velocity")[0][0, 0].tolist()


def test_avoidance_grows_towards_the_minimum_range():
    assert avoiding(((7.0, 0, 0), 1)) == pytest.approx([-3.0, 0.0, 0.0])  # (10 - 7) / (10 - 4) * 6
    assert avoiding(((0, 4.6, 0), 1)) == pytest.approx([0.0, -5.4, 0.0])
    assert avoiding(((10.0, 0, 0), 1)) == [0.0, 0.0, 0.0]
    assert avoiding(((7.0, 0, 0), 1), ((0, 7.0, 0), 1)) == pytest.approx([-3.0, -3.0, 0.0])
    assert avoiding(((7.0, 0, 0), 1), ((-7.0, 0, 0), 1)) == pytest.approx([0.0, 0.0, 0.0])


def test_within_the_minimum_range_nothing_else_counts():
    desired_velocity = avoiding(((3.0, 0, 0), 1), ((0, 5.0, 0), 1))
    assert desired_velocity[0] < -1e9
    assert abs(desired_velocity[1] / desired_velocity[0]) < 1e-9


def test_others_are_avoided_if_asked_and_the_one_at_the_same_place_never():
    assert avoiding(((7.0, 0, 0), 2)) == pytest.approx([-3.0, 0.0, 0.0])
    assert avoiding(((7.0, 0, 0), 2), avoid_non_team=False) == [0.0, 0.0, 0.0]
    assert avoiding(((0.0, 0, 0), 1)) == [0.0, 0.0, 0.0]


def going(steps=1, **values):
    mover = block(autonomy=MotorSchemas(behaviors=[MoveToGoalMS(**values)], max_speed=1e6), heading="90 deg")
    sim = Simulation(mission(mover, end=5.0))
    sim.step(steps)
    return sim, sim.read("a.MotorSchemas.MoveToGoalMS.desired_velocity")[0][0, 0].tolist()


def test_move_to_goal_goes_at_half_the_distance_a_second():
    assert going(goal=(30.0, 0.0, 40.0))[1] == pytest.approx([15.0, 0.0, 20.0])
    assert going(goal=(30.0, 0.0, 40.0), distance_pid=(0.1, 0, 0, 0))[1] == pytest.approx([3.0, 0.0, 4.0])
    assert going(goal=(0.0, 0.0, 0.0))[1] == [0.0, 0.0, 0.0]


def test_integral_and_derivative_of_the_distance():
    # First step: integral 50 * 0.1 within its band of 100 m, and no change yet.
    _, first = going(goal=(50.0, 0, 0), distance_pid=(0.0, 0.2, 0.5, 100.0))
    assert first[0] == pytest.approx(0.2 * 5.0)
    # Second: 0.1 m nearer; integral 5 + 4.99, derivative -0.1 / 0.1.
    _, second = going(2, goal=(50.0, 0, 0), distance_pid=(0.0, 0.2, 0.5, 100.0))
    assert second[0] == pytest.approx(0.2 * (5.0 + 4.99) + 0.5 * -1.0)
    _, outside = going(goal=(50.0, 0, 0), distance_pid=(0.0, 0.2, 0.0, 49.0))
    assert outside[0] == 0.0


def test_the_goal_may_lie_straight_ahead():
    sim, desired_velocity = going(use_initial_heading=True)
    assert sim.read("a.MotorSchemas.MoveToGoalMS.target")[0][0, 0] == pytest.approx([0.0, 1e6, 0.0], abs=1e-6)
    assert desired_velocity == pytest.approx([0.0, 5e5, 0.0], abs=1e-6)


class Guide(Autonomy):
    """Tell itself a waypoint in step 2."""

    waypoints = Publish(Waypoint, network="LocalNetwork")

    def step(self, g):
        rows = np.flatnonzero(g.step_count == 2)
        self.waypoints.publish(rows, pos=np.array([[0.0], [8.0], [0.0]]) * g.id[rows])


def test_a_waypoint_replaces_the_goal_of_the_entity_it_is_for():
    mover = MotorSchemas(behaviors=[MoveToGoalMS(goal=(100.0, 0, 0), network_name="LocalNetwork")])
    sim = Simulation(mission(block(count=2, autonomy=[mover, Guide()]), networks=[LocalNetwork()]))
    sim.step(3)
    assert sim.read("a.MotorSchemas.MoveToGoalMS.target")[0][0].tolist() == [[100.0, 0.0, 0.0]] * 2
    sim.step()
    assert sim.read("a.MotorSchemas.MoveToGoalMS.target")[0][0].tolist() == [
        [0.0, 8.0, 0.0],
        [0.0, 16.0, 0.0],
    ]


def test_a_waypoint_of_the_world_is_heard_by_all():
    class Tower(Interaction):
        def step(self, w):
            w.publish(Waypoint, np.flatnonzero(w.step_count == 0), pos=(1.0, 2.0, 3.0))

    mover = MotorSchemas(behaviors=[MoveToGoalMS(network_name="GlobalNetwork")])
    sim = Simulation(mission(block(count=2, autonomy=mover), interactions=[Tower()]), seeds=[1, 2])
    sim.step(2)
    assert sim.read("a.MotorSchemas.MoveToGoalMS.target")[0].tolist() == [[[1.0, 2.0, 3.0]] * 2] * 2


def test_who_is_born_later_has_no_kick_of_the_derivative_either():
    mover = MoveToGoalMS(goal=(100.0, 0.0, 0.0), distance_pid=(0.0, 0.0, 1.0, 0.0))
    late = block(autonomy=MotorSchemas(behaviors=[mover], max_speed=1e6), count=1, rate=1.0, first_birth=0.5)
    sim = Simulation(mission(late))
    sim.step(6)
    desired_velocity, alive = sim.read("a.MotorSchemas.MoveToGoalMS.desired_velocity")
    assert alive.all()
    assert desired_velocity.tolist() == [[[0.0, 0.0, 0.0]]]
