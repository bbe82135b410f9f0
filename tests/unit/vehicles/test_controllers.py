"""Controllers of the kinematic vehicles, each with its vehicle: what they settle at, and how fast."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, Output, Param
from tussle.stock import (
    AircraftToSingleIntegratorController,
    DoubleIntegrator,
    DoubleIntegratorControllerVelYaw,
    DoubleIntegratorControllerWaypoint,
    SimpleCar,
    SimpleCarControllerHeading,
    SimpleQuadrotor,
    SimpleQuadrotorControllerLQR,
    SingleIntegrator,
    SingleIntegratorControllerWaypoint,
    Unicycle,
    UnicycleControllerPoint,
)

POINT = np.array([30.0, -20.0, 60.0])


class Want(Autonomy):
    """Wants one point, speed, heading and altitude for ever."""

    speed = Param(5.0, unit="m/s")
    heading = Param(2.0, unit="rad")
    point = Output("position_x position_y position_z", unit="m")
    desired_speed = Output(unit="m/s")
    desired_heading = Output(unit="rad")
    desired_altitude = Output(unit="m")

    def step(self, g):
        self.point[:] = POINT[:, None]
        self.desired_speed[:], self.desired_heading[:], self.desired_altitude[:] = (
            self.speed,
            self.heading,
            POINT[2],
        )


def flown(controller, motion, end, dt=0.01, speed=0.0, heading="90 deg", **want):
    """Position, velocity, heading and nose of a vehicle, from (0, 0, 50) after `end` s."""
    block = Block(
        name="a", position=(0, 0, 50), variance=(0, 0, 0), heading=heading, speed=speed, autonomy=Want(**want), controller=controller,
        motion=motion,
    )  # fmt: skip
    sim = Simulation(Mission(blocks=[block], dt=dt, end=end))
    sim.run()
    return tuple(sim.read(f"a.{name}")[0][0, 0] for name in ("pos", "vel", "yaw", "forward"))


def test_a_single_integrator_comes_to_a_point_at_the_rate_of_its_gain():
    pos, _, _, _ = flown(SingleIntegratorControllerWaypoint(gain=0.7), SingleIntegrator(), 2.0)
    left = (1 - 0.7 * 0.01) ** 200  # its velocity is held for each step of 0.01 s
    assert (POINT - pos) / (POINT - [0, 0, 50]) == pytest.approx([left] * 3, rel=1e-9)


def test_a_double_integrator_comes_to_a_point_critically_damped():
    """Both poles at -1 /s: the error is (1 + t) e^-t of the first, but for the commands' half step of delay."""
    free = DoubleIntegrator(max_vel=1e3, max_acc=1e3)
    pos, _, _, _ = flown(DoubleIntegratorControllerWaypoint(), free, 3.0, dt=1e-3)
    assert (POINT - pos) / (POINT - [0, 0, 50]) == pytest.approx([4 * math.exp(-3)] * 3, rel=2e-3)
    limited = DoubleIntegrator(max_vel=3.0, max_acc=2.0)
    pos, vel, _, _ = flown(DoubleIntegratorControllerWaypoint(), limited, 60.0)
    assert pos == pytest.approx(POINT, abs=1e-3)
    assert np.abs(vel).max() < 1e-3


def test_a_double_integrator_at_its_speed_turns_to_another_heading_and_settles_at_its_altitude():
    """SCRIMMAGE's law would fly on to the North, and oscillate about the altitude for ever."""
    motion = DoubleIntegrator(max_vel=20.0, max_acc=5.0, motion_model_sets_yaw=False)
    pos, vel, yaw, _ = flown(DoubleIntegratorControllerVelYaw(), motion, 120.0, dt=0.05, speed=5.0)
    assert vel == pytest.approx([5 * math.cos(2), 5 * math.sin(2), 0], abs=1e-3)
    assert (pos[2], yaw) == pytest.approx((60.0, 2.0), abs=0.02)


def test_an_aircrafts_commands_move_a_single_integrator():
    pos, _, _, _ = flown(AircraftToSingleIntegratorController(), SingleIntegrator(), 4.0)
    assert pos[:2] == pytest.approx([20 * math.cos(2), 20 * math.sin(2)])
    assert 60.0 - pos[2] == pytest.approx(10 * 0.99**400)


def test_a_car_turns_to_its_heading():
    pos, vel, yaw, _ = flown(SimpleCarControllerHeading(), SimpleCar(), 60.0, dt=0.05)
    assert np.linalg.norm(vel) == pytest.approx(5.0)
    assert yaw == pytest.approx(2.0, abs=0.05)  # the integral, which nothing limits, unwinds in minutes
    assert pos[2] == 50.0


@pytest.mark.parametrize("pitches", [True, False])
def test_the_point_ahead_of_a_unicycle_comes_at_the_rate_of_the_gain(pitches):
    """In each component alone, whatever the attitude."""
    controller = UnicycleControllerPoint(l=2.0, gain=0.5)
    motion = Unicycle(
        vel_max=100, turn_rate_max=100, pitch_rate_max=100, velocity_z_max=100, use_pitch=pitches
    )
    pos, _, _, forward = flown(controller, motion, 4.0, dt=1e-3)
    left = (POINT - pos - 2.0 * forward) / (POINT - [0, 2, 50])
    assert left == pytest.approx([math.exp(-2)] * 3, rel=2e-3)
    pos, _, _, _ = flown(controller, motion, 60.0, dt=0.05)
    assert np.linalg.norm((POINT - pos)[: 3 if pitches else 2]) == pytest.approx(2.0, abs=1e-3)


def test_a_quadrotor_comes_to_a_point_beside_it_and_faces_its_heading():
    """SCRIMMAGE's law would fly along the heading, whatever the place of the point."""
    pos, vel, yaw, _ = flown(SimpleQuadrotorControllerLQR(), SimpleQuadrotor(), 120.0, dt=0.02)
    assert pos == pytest.approx(POINT, abs=0.01)
    assert yaw == pytest.approx(2.0, abs=1e-6)
    pos, vel, _, _ = flown(SimpleQuadrotorControllerLQR(max_vel=2.0), SimpleQuadrotor(), 8.0, dt=0.02)
    assert np.linalg.norm(vel[:2]) == pytest.approx(2.0, rel=0.01)


def test_the_regulator_of_the_height_is_that_of_a_double_integrator():
    """Closed loop s^2 + sqrt(2) s + 1: the error after t is e^-k (cos k + sin k) with k = t / sqrt(2)."""
    pos, _, _, _ = flown(SimpleQuadrotorControllerLQR(), SimpleQuadrotor(), 2.0, dt=1e-3)
    k = 2.0 / math.sqrt(2.0)
    assert (60.0 - pos[2]) / 10.0 == pytest.approx(math.exp(-k) * (math.cos(k) + math.sin(k)), abs=2e-3)
