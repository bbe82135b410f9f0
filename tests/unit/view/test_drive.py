"""Entities that an operator drives: what the sticks do, and that they are part of the game."""

import numpy as np
import pytest

from tussle import Block, Mission, Recorder, Simulation, stock
from tussle.api import Autonomy, Output, State
from tussle.engine.manual import axes_of
from tussle.messages import ManualControl
from tussle.mission import mission_of, read_mission
from tussle.record import load_inputs
from tussle.stock import DoubleIntegrator, SimpleCar, SingleIntegrator, Still, Straight, Unicycle, UnicyclePID
from tussle.view import Live


class Once(Autonomy):
    """Commands once, at birth."""

    is_done = State(dtype=bool)
    speed = Output(unit="m/s")
    steering = Output(unit="rad")

    def step(self, g):
        self.speed[~self.is_done] = 3.0
        self.is_done[:] = True


def mission():
    """Two cars, a vehicle that is told headings, and one that is told velocities, far from each other."""
    blocks = [
        Block(name="car", team=1, count=2, autonomy=Once(), motion=SimpleCar(max_velocity=8.0), variance=(90, 90, 0)),
        Block(name="jet", team=2, autonomy=Straight(speed=9.0), controller=UnicyclePID(), motion=Unicycle(vel_max=20.0)),
        Block(name="post", team=2, motion=Still()),
    ]  # fmt: skip
    return Mission(name="driven", blocks=blocks, end=60.0, dt=0.1, end_conditions="time")


@pytest.fixture
def live():
    with Simulation(mission(), 1) as simulation, Live(simulation, threaded=False, is_paused=True) as live:
        yield live


def body(live, who):
    frame = live.frame()
    return frame.pos[frame.id.tolist().index(who)].astype(float)


def speed_of(live, block, place=0):
    return float(np.linalg.norm(live.simulation.read(f"{block}.vel")[0][0, place]))


def test_the_sticks_take_the_place_of_the_commands_and_give_them_back(live):
    live.step(2)
    others = live.simulation.read("car.pos")[0][0, 1]
    live.drive(1, (0.5, 1.0, 0.0))
    live.step(3)
    assert live.entity(1).is_driven
    assert live.entity(1).axes == {"ahead": ["speed"], "left": ["steering"], "up": []}
    assert speed_of(live, "car") == pytest.approx(round(0.5 * 127) / 127 * 8.0, rel=0.05)
    assert live.simulation.read("car.Once.speed")[0][0].tolist() == [3, 3]
    assert np.linalg.norm(live.simulation.read("car.pos")[0][0, 1] - others) == pytest.approx(0.9, rel=1e-3)
    live.drive(1, None)
    live.step(2)
    assert not live.entity(1).is_driven
    assert speed_of(live, "car") == pytest.approx(3.0)
    live.drive(1, (0.0, 0.0, 0.0))  # as a stick is that was given back
    live.step(2)
    assert live.entity(1).is_driven


def test_a_stick_is_an_input_where_it_changes_and_one_a_step(live):
    for sticks in ((0.5, 0, 0), (0.501, 0, 0), (0.9, 0, 0), (0.7, 0, 0)):
        live.drive(1, sticks)
    live.step(1)
    live.drive(1, (0.7, 0, 0))
    live.step(1)
    assert [(each.step, each.fields["sticks"].tolist()) for each in live.injections] == [
        (0, [round(0.7 * 127) / 127, 0, 0])
    ]


def test_headings_and_heights_are_held_and_limits_are_those_of_the_model(live):
    live.step(1)
    live.drive(3, (1.0, 1.0, 0.0))
    live.step(40)
    (yaw,) = live.simulation.read("jet.yaw")[0][0]
    assert abs(yaw) > 0.3
    assert speed_of(live, "jet") == pytest.approx(20.0, rel=0.05)
    live.drive(3, (0.0, 0.0, 0.0))
    live.step(40)
    there = live.simulation.read("jet.yaw")[0][0, 0]
    live.step(5)
    assert live.simulation.read("jet.yaw")[0][0, 0] == pytest.approx(there, abs=0.05)


def test_a_driven_game_is_repeated_bit_for_bit_alone_in_a_stack_and_after_a_seek(tmp_path):
    prey, _ = mission_of("predator_prey", "test")
    with (
        Simulation(prey, [1, 2]) as simulation, Recorder(simulation, tmp_path / "run") as recorder,
        Live(simulation, threaded=False, is_paused=True) as live,
    ):  # fmt: skip
        who = int(live.frame().id[0])
        assert live.entity(who).axes["ahead"]
        live.step(3)
        live.drive(who, (1.0, -1.0, 0.25))
        live.step(12)
        live.drive(who, (0.3, 1.0, 0.0))
        live.step(8)
        live.drive(who, None)
        live.step(7)
        assert not live.notes
        there = simulation.state_hash()
        for t in (0.0, 10 * prey.dt, 20 * prey.dt):
            live.seek(t)
            live.step(30 - live.step_number)
            assert simulation.state_hash() == there
        other = simulation.state_hash(1)
        recorder.flush()
        inputs = load_inputs(tmp_path / "run")
    assert [each.step for each in inputs] == [3, 15, 23]
    for seeds, world in (([1], 0), ([8, 1, 3], 1)):
        with Simulation(prey, seeds) as again:
            again.play_inputs(inputs, world)
            again.step(30)
            assert again.state_hash(world) == there
    with Simulation(prey, [2, 1]) as plain:
        plain.step(30)
        assert plain.state_hash(0) == other
        assert plain.state_hash(1) != there


def test_another_course_lets_go_of_sticks_that_nobody_holds(live):
    live.step(2)
    live.drive(1, (1.0, 0, 0))
    live.step(5)
    live.drive(1, None)
    live.step(2)
    live.seek(0.5)
    live.drive(2, (1.0, 0, 0))
    live.step(2)
    assert {who for _, who in live.simulation.state.manual} == {2}
    # Who goes while the past is shown lets go where the game goes on.
    live.seek(0.3)
    live.drive(2, None)
    live.step(5)
    assert not live.simulation.state.manual


def test_what_cannot_be_driven_is_refused_by_name(live):
    live.step(1)
    assert live.entity(4).axes == {}
    live.drive(4, (1, 0, 0))
    live.drive(77, (1, 0, 0))
    assert live.notes == [
        "drive: entity 4 has no channel that sticks can drive",
        "drive: world 0 has no entity 77 now",
    ]
    live.drive(77, None)
    assert live.injections == []


def test_death_and_a_reset_let_go(live):
    live.drive(1, (1.0, 0, 0))
    live.drive(2, (1.0, 0, 0))
    live.step(3)
    live.remove([1])
    live.step(3)
    assert set(live.simulation.state.manual) == {(0, 2)}
    live.reset()
    live.step(1)
    assert not live.simulation.state.manual


MODELS = [
    name
    for name, path in stock.examples().items()
    if "motion" in path.parts and not name.startswith("JSBSim")
]


def driven(name, sticks, seconds):
    """Drive the first entity of the first block of an example that can be driven; returns it and its yaws, or None."""
    mission = read_mission(stock.examples()[name]).mission.replace(end=1e4, interactions=())
    with Simulation(mission, 1) as simulation, Live(simulation, threaded=False, is_paused=True) as live:
        live.step(2)
        group = next((g for g in simulation.state.population.groups if g.n and axes_of(g)), None)
        if group is None:
            return None
        who = int(simulation.state.population.bodies.id[group.first])
        live.drive(who, sticks)
        yaws = []
        while live.t < seconds:
            live.step(1)
            yaws.append(float(simulation.read(f"{group.name}.yaw")[0][0, 0]))
        assert not live.notes
        assert live.entity(who).is_driven
        return live.entity(who), np.unwrap(yaws)


@pytest.mark.parametrize("name", MODELS)
def test_every_model_that_ships_flies_where_the_sticks_are_in_the_middle_and_ahead(name):
    slow, fast = (driven(name, sticks, 2.0) for sticks in ((0, 0, 0), (1, 0, 0)))
    if slow is None:
        assert name in {"Ballistic", "External", "FreeBody", "HarmonicOscillator", "Still"}
        return
    speeds = [float(np.linalg.norm(each.body["vel"].value)) for each, _ in (slow, fast)]
    assert np.isfinite(speeds).all()
    assert speeds[0] <= speeds[1]
    assert speeds[1] > 0.3


@pytest.mark.parametrize("name", ["FixedWing6DOF", "DubinsAirplane3D", "DubinsAirplane"])
def test_an_aircraft_does_not_stall_where_nobody_touches_the_sticks(name):
    """Without a lowest speed its speed is that which its autonomy wants; half a stick is a quarter more or less."""
    slow, middle, fast = (driven(name, (stick, 0, 0), 10.0)[0] for stick in (-1, 0, 1))
    before, there, after = (float(np.linalg.norm(each.body["vel"].value)) for each in (slow, middle, fast))
    assert there > 15.0
    assert before < there < after


@pytest.mark.parametrize("name", ["Multirotor", "SimpleQuadrotor"])
def test_who_moves_sideways_does_not_spin(name):
    entity, yaws = driven(name, (0, 1, 0), 5.0)
    assert entity.body["vel"].value[0] < -0.5
    assert np.abs(yaws - yaws[0]).max() < 0.3
    assert all("desired_heading" not in channels for channels in entity.axes.values())


@pytest.mark.parametrize("update", ["synchronous", "sequential"])
def test_velocities_are_driven_north_and_west(update):
    class Still0(Autonomy):
        velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

        def step(self, g):
            self.velocity[:] = 0.0

    class Turns(Autonomy):
        acceleration = Output("acceleration_x acceleration_y acceleration_z", unit="m/s^2")
        turn_rate = Output(unit="rad/s")

        def step(self, g):
            self.acceleration[:], self.turn_rate[:] = 0.0, 0.5

    top = Block(name="top", position=(90, 0, 0), autonomy=Turns(), motion=DoubleIntegrator())
    with Simulation(Mission(blocks=[top], end=9.0, dt=0.1, update=update), 1) as simulation:
        simulation.publish(ManualControl, entity=1, is_on=True, sticks=np.array([0.0, 1.0, 0.0]))
        simulation.step(5)
        assert simulation.read("top.vel")[0][0, 0, 0] < -0.3
        assert axes_of(simulation.state.population.groups[0])["left"] == ["acceleration_x"]
    block = Block(name="dot", autonomy=Still0(), motion=SingleIntegrator(max_speed=5.0))
    with Simulation(Mission(blocks=[block], end=9.0, dt=0.1, update=update), 1) as simulation:
        simulation.publish(ManualControl, entity=1, is_on=True, sticks=np.array([1.0, 0.0, 0.0]))
        simulation.step(2)
        assert simulation.read("dot.vel")[0][0, 0].tolist() == [0, 5, 0]
        simulation.publish(ManualControl, entity=1, is_on=True, sticks=np.array([0.0, 7.0, 0.0]))
        simulation.step(2)
        assert simulation.read("dot.vel")[0][0, 0].tolist() == [-5, 0, 0]
