"""Closed forms of the kinematic vehicles: parabolas, arcs, helices, limits."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, Output
from tussle.numeric.paths import STEEPEST_BANK
from tussle.stock import (
    Ballistic,
    DoubleIntegrator,
    DubinsAirplane,
    DubinsAirplane3D,
    GroundCollision,
    SimpleCar,
    SimpleQuadrotor,
)

G = 9.81


def rolled(model, x0, command, n_steps=10, dt=0.1, substeps=1, **params):
    """State after n_steps with one command."""
    return model.rollout(x0, np.tile(np.array(command, float), (n_steps, 1)), dt, substeps, params)[-1]


# -- DoubleIntegrator -------------------------------------------------------------------------------------------------------------


def test_a_constant_acceleration_gives_a_parabola_whatever_the_steps():
    model = DoubleIntegrator(max_vel=100.0, max_acc=10.0)
    for n, substeps in ((1, 1), (10, 3)):
        x = rolled(model, [1, 2, 3, 4, 5, 6, 0, 0], [3, -2, 1, 0], n, 2.0 / n, substeps)
        assert x[:6] == pytest.approx([1 + 8 + 6, 2 + 10 - 4, 3 + 12 + 2, 10, 1, 8], rel=1e-14)
    assert x[6] == pytest.approx(math.atan2(1, 10))


def test_the_acceleration_and_the_speed_are_limited_in_any_direction():
    """From rest with a = 2 m/s^2 along (1, 2, 2)/3 the limit of 5 m/s is reached after 2.5 s; then 2.5 s at 5 m/s."""
    x = rolled(DoubleIntegrator(max_vel=5.0, max_acc=2.0), np.zeros(8), [100, 200, 200, 0], 50, 0.1)
    assert np.linalg.norm(x[3:6]) == pytest.approx(5.0, rel=1e-14)
    assert x[:3] * 3 == pytest.approx((0.5 * 2 * 2.5**2 + 5 * 2.5) * np.array([1, 2, 2]), rel=1e-12)


def test_the_yaw_rate_reaches_its_command_at_the_largest_angular_acceleration():
    """It grows for 0.8 s to 0.4 rad/s, the limit of a command of 3 rad/s, and stays there for 1.2 s."""
    model = DoubleIntegrator(max_yaw_vel=0.4, max_yaw_acc=0.5, motion_model_sets_yaw=False)
    for n in (1, 7, 40):
        x = rolled(model, np.zeros(8), [0, 0, 0, 3], n, 2.0 / n)
        assert x[6:] == pytest.approx([0.5 * 0.5 * 0.8**2 + 0.4 * 1.2, 0.4], rel=1e-13)
    stuck = rolled(model, np.zeros(8), [0, 0, 0, 3], max_yaw_acc=np.zeros(1))
    assert stuck[6:].tolist() == [0.0, 0.0]


class Push(Autonomy):
    """Command one acceleration, or one set of commands of another vehicle."""

    acceleration = Output("acceleration_x acceleration_y acceleration_z", unit="m/s^2")
    thrust = Output("x_thrust y_thrust z_thrust", unit="m/s^2")
    turn_force = Output(unit="rad/s^2")

    def step(self, g):
        self.acceleration[:] = self.thrust[:] = np.array([[0.0], [2.0], [0.0]])


def attitude(motion):
    """Heading, elevation and bank of a vehicle that faces East and flies North, (3,)."""
    block = Block(name="a", autonomy=Push(), motion=motion, variance=(0, 0, 0))
    sim = Simulation(Mission(blocks=[block], end=1.0))
    sim.run()
    assert sim.read("a.vel")[0][0, 0] == pytest.approx([0.0, 2.0, 0.0])
    return [sim.read(f"a.{name}")[0][0, 0] for name in ("yaw", "climb", "roll")]


def test_a_vehicle_faces_its_motion_or_tilts_like_a_copter():
    assert attitude(DoubleIntegrator(max_vel=4.0, max_acc=2.0)) == pytest.approx([math.pi / 2, 0, 0])
    level = DoubleIntegrator(max_vel=4.0, max_acc=2.0, motion_model_sets_yaw=False)
    assert attitude(level) == [0.0, 0.0, 0.0]
    tilted = level.replace(sim_copter_orientation=True, sim_copter_max_roll="40 deg")
    assert attitude(tilted) == pytest.approx([0, 0, math.radians(-20)])  # to the left: right wing up
    assert attitude(SimpleQuadrotor(max_vel=4.0, max_pitch="40 deg")) == pytest.approx(
        [0, 0, math.radians(-20)]
    )


# -- SimpleQuadrotor --------------------------------------------------------------------------------------------------------------


def test_a_thrust_without_turn_gives_a_parabola_along_the_heading():
    x = rolled(SimpleQuadrotor(), [0, 0, 0, 0, 0, 0, math.pi / 2, 0], [2, 1, 3, 0], 10, 0.2)
    assert x[:6] == pytest.approx([-0.5 * 4, 4, 6, -2, 4, 6], abs=1e-13)
    limited = rolled(SimpleQuadrotor(max_vel=5.0), np.zeros(8), [2, 0, 0, 0], 50, 0.1)
    assert limited[[0, 3]] == pytest.approx([0.5 * 2 * 2.5**2 + 5 * 2.5, 5.0], rel=1e-12)


def test_a_thrust_that_turns_at_a_constant_rate_follows_its_closed_form_in_fourth_order():
    """It obeys x'' = a cos(w t), y'' = a sin(w t), of which RK4 is Simpson's rule: an error of (w h)^4 / 2880 of a t / w."""
    a, w, t = 2.0, 1.5, 3.0
    exact = a / w**2 * np.array([1 - math.cos(w * t), w * t - math.sin(w * t)])
    errors = []
    for n in (10, 20):
        x = rolled(SimpleQuadrotor(), [0, 0, 0, 0, 0, 0, 0, w], [a, 0, 0, 0], n, t / n)
        errors.append(np.abs(x[:2] - exact).max())
    assert errors[0] < 5 * (w * t / 10) ** 4 / 2880 * a * t / w
    assert math.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.3)
    assert rolled(SimpleQuadrotor(), np.zeros(8), [0, 0, 0, 0.5], 3, 1.0)[6:] == pytest.approx([2.25, 1.5])


# -- SimpleCar --------------------------------------------------------------------------------------------------------------------


def test_a_car_drives_a_circle_of_wheelbase_over_tangent():
    steering = 0.3
    radius = 2.62 / math.tan(steering)
    for n in (1, 8):
        x = rolled(SimpleCar(), np.zeros(7), [10.0, steering, 0, 1], n, 4.0 / n)
        turn = 40.0 / radius
        assert x[[0, 1, 4]] == pytest.approx(
            [radius * math.sin(turn), radius * (1 - math.cos(turn)), turn], rel=1e-12
        )
    fast = rolled(SimpleCar(), np.zeros(7), [99.0, 2.0, 0, 1], 1, 0.1)  # limits: 20 m/s, 45 degrees
    assert fast[5:] == pytest.approx([20.0, 20.0 / 2.62], rel=3e-4)
    assert rolled(SimpleCar(), np.zeros(7), [-3.0, 0.0, 0, 1])[0] == 0.0


class Drive(Autonomy):
    speed = Output(unit="m/s")
    steering = Output(unit="rad")

    def step(self, g):
        self.speed[:] = 10.0


def test_a_car_falls_whatever_its_mass_until_the_ground_bears_it():
    car = Block(
        name="car", position=(0, 0, 4.9), variance=(0, 0, 0), autonomy=Drive(), motion=SimpleCar(enable_gravity=True), mass=1500.0
    )  # fmt: skip
    ground = GroundCollision(remove_on_collision=False)
    sim = Simulation(
        Mission(
            blocks=[car, car.replace(name="high", motion=SimpleCar())],
            interactions=[ground],
            dt=0.01,
            end=2.0,
        )
    )
    sim.step(90)
    assert sim.read("car.pos")[0][0, 0] == pytest.approx([9.0, 0.0, 4.9 - 0.5 * G * 0.9**2])
    sim.run()
    assert sim.read("high.pos")[0][0, 0].tolist() == pytest.approx([20.0, 0.0, 4.9])
    x, _, z = sim.read("car.pos")[0][0, 0]
    assert x == pytest.approx(20.0)
    assert z == pytest.approx(0.0, abs=1e-9)
    assert sim.read("car.vel")[0][0, 0, 2] == pytest.approx(0.0, abs=1e-9)


# -- Dubins ----------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("model", [DubinsAirplane(), DubinsAirplane3D()])
def test_an_aeroplane_flies_the_helix_of_a_coordinated_turn(model):
    """Radius V cos(pitch) / |yaw'|, yaw' = -(g / V) tan(roll): a bank to the right turns to the right."""
    v, pitch, roll, t = 20.0, 0.2, 0.5, 6.0
    rate = -G / v * math.tan(roll)
    radius = v * math.cos(pitch) / rate
    for n in (1, 13):
        x = rolled(model, [0, 0, 100, 0, 0, 0, 0, 0], [v, pitch, roll], n, t / n)
        assert x[:3] == pytest.approx(
            [radius * math.sin(rate * t), radius * (1 - math.cos(rate * t)), 100 + v * t * math.sin(pitch)], rel=1e-12
        )  # fmt: skip
        assert x[4:] == pytest.approx([pitch, roll, v, rate])


def test_an_aeroplane_keeps_within_its_limits_and_turns_at_no_infinite_rate():
    limited = DubinsAirplane(
        speed_max=25,
        speed_min=15,
        pitch_max="10 deg",
        pitch_min="-5 deg",
        roll_max="30 deg",
        roll_min="-20 deg",
    )
    x = rolled(limited, np.zeros(8), [99, 1, 1])
    assert x[4:7] == pytest.approx([math.radians(10), math.radians(30), 25])
    x = rolled(limited, np.zeros(8), [0, -1, -1])
    assert x[4:7] == pytest.approx([math.radians(-5), math.radians(-20), 15])
    steep = rolled(DubinsAirplane3D(), np.zeros(8), [300, 0, math.pi / 2])
    assert steep[7] == pytest.approx(-G / 300 * math.tan(STEEPEST_BANK))
    assert rolled(DubinsAirplane3D(), np.zeros(8), [1e-9, 0, 1])[7] == 0.0
    assert rolled(DubinsAirplane3D(), np.zeros(8), [700, 0, 0])[0] == pytest.approx(700)


# -- Ballistic --------------------------------------------------------------------------------------------------------------------


def test_a_ball_flies_a_parabola_and_keeps_its_attitude():
    ball = Block(
        name="ball", position=(1, 2, 3), variance=(0, 0, 0), heading="40 deg", climb="30 deg", velocity=(10, 5, 20), motion=Ballistic()
    )  # fmt: skip
    sim = Simulation(Mission(blocks=[ball], end=4.0))
    sim.run()
    assert sim.read("ball.pos")[0][0, 0] == pytest.approx([41, 22, 3 + 80 - 0.5 * G * 16], rel=1e-13)
    assert sim.read("ball.vel")[0][0, 0] == pytest.approx([10, 5, 20 - G * 4], rel=1e-13)
    assert sim.read("ball.yaw")[0][0, 0] == pytest.approx(math.radians(40))
    pushed = rolled(Ballistic(), np.zeros(6), [2.0, 0.0, 4 * G, 2.0], 5, 0.2)
    assert pushed == pytest.approx([0.5, 0, 0.5 * G, 1, 0, G])
