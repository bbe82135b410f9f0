"""Frames, attitudes and measurements against closed forms."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from autopilot_peers import LONG, JsonServant, free_ports

from tussle import Block, Mission, Simulation
from tussle.api import Input, MotionModel, Param, State
from tussle.numeric.quaternion import quat_from_euler
from tussle.plugins.links.autopilots.frames import to_frd, to_ned, to_ned_frd
from tussle.plugins.stock.autonomy.px4.link import atmosphere, limited, to_body
from tussle.stock import ArduPilot, DirectController

G = 9.80665


def rotation(w, x, y, z):
    """The matrix of a quaternion, from its definition v' = q v q*."""
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def test_an_attitude_takes_forward_right_down_to_north_east_down():
    draws = np.random.default_rng(1).normal(size=(4, 50))
    quats = draws / np.linalg.norm(draws, axis=0)
    turned = to_ned_frd(quats)
    swap, flip = np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]]), np.diag([1.0, -1, -1])
    for quat, ned in zip(quats.T, turned.T, strict=True):
        assert rotation(*ned) == pytest.approx(swap @ rotation(*quat) @ flip, abs=1e-12)
    vectors = draws[:3]
    assert np.array_equal(to_ned(vectors), swap @ vectors)
    assert np.array_equal(to_frd(vectors), flip @ vectors)


class Orbit(MotionModel):
    """A level turn to the left: a circle of radius 50 m at 20 m/s, with the bank of a coordinated turn."""

    bank = Param(0.0, unit="rad")
    x = State("angle", unit="rad")
    throttle = Input()

    @staticmethod
    def derivative(throttle):
        return 20.0 / 50.0

    def from_body(self, body, rows):
        pass

    def to_body(self, body):
        angle = self.x[0]
        body.pos[:] = 50.0 * np.cos(angle), 50.0 * np.sin(angle), 100.0 + 0.0 * angle
        body.vel[:] = -20.0 * np.sin(angle), 20.0 * np.cos(angle), 0.0 * angle
        body.quat[:] = quat_from_euler(-self.bank, 0.0 * angle, angle + 0.5 * math.pi)
        body.omega[:] = 0.0 * angle, 0.0 * angle, 0.4 + 0.0 * angle


def test_a_coordinated_turn_presses_into_the_seat_and_turns_about_down():
    """Bank atan(v w / g): the specific force g / cos(bank) is along the seat.

    The rates are yaw rate times sin(roll) about the right wing and times cos(roll) about down; both angles are negative.
    """
    bank, dt = math.atan(20.0 * 0.4 / G), 1e-3
    port = free_ports()
    autonomy = ArduPilot(
        protocol="json",
        json_port=port,
        timeout=LONG,
        resend_period=LONG,
        servo_map="[ throttle 0 1000 2000 0 1 1 ]",
    )
    block = Block(name="plane", autonomy=autonomy, controller=DirectController(), motion=Orbit(bank=bank))
    with JsonServant(port) as servant, Simulation(Mission(blocks=[block], dt=dt)) as sim:
        sim.step(5)
    state = json.loads(servant.states[port][-1])
    assert state["imu"]["gyro"] == pytest.approx([0.0, 0.4 * math.sin(bank), -0.4 * math.cos(bank)], abs=1e-9)
    assert state["imu"]["accel_body"] == pytest.approx([0.0, 0.0, -G / math.cos(bank)], abs=8.0 * 0.4 * dt)
    attitude = rotation(*state["quaternion"])
    forward, right = attitude[:, 0], attitude[:, 1]
    assert forward == pytest.approx(np.array(state["velocity"]) / 20.0, abs=1e-12)
    assert right[2] == pytest.approx(-math.sin(bank))  # the right wing is up


def test_a_field_in_the_body_frame():
    draws = np.random.default_rng(2).normal(size=(7, 20))
    for *quat, x, y, z in draws.T:
        unit = np.array(quat) / np.linalg.norm(quat)
        assert to_body(unit, (x, y, z)) == pytest.approx(rotation(*unit).T @ (x, y, z))


def test_the_air_is_that_of_the_standard_atmosphere():
    # U.S. Standard Atmosphere, 1976, tables 1 and 3.
    for altitude, pressure, temperature, density in (
        (0.0, 1013.25, 288.150, 1.2250),
        (1000.0, 898.76, 281.651, 1.1117),
        (5000.0, 540.48, 255.676, 0.73643),
    ):
        # The table is by geometric altitude; the formula takes geopotential altitude, r h / (r + h).
        found = atmosphere(6356766.0 * altitude / (6356766.0 + altitude))
        assert found == pytest.approx((pressure, temperature, density), rel=1e-4)


def test_whole_numbers_stay_within_their_bits():
    assert [limited(x, 16) for x in (1e9, -1e9, 1.6)] == [32767, -32768, 2]
    assert [limited(x, 16, False) for x in (1e9, -3.0)] == [65535, 0]
