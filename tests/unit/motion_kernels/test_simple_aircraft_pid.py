import math

import numpy as np
import pytest
from bound_rows import bound, seen

from tussle.plugins.stock.controller.simple_aircraft_controller_pid import SimpleAircraftControllerPID
from tussle.plugins.stock.motion.simple_aircraft import SimpleAircraft
from tussle.plugins.stock.motion.simple_aircraft import kernels as aircraft

HEADING = (1.0, 0.01, 2.0, math.radians(9.0))
ALTITUDE = (1.0, 0.0, 0.8, 1.0)
SPEED = (1.0, 0.1, 0.0, 1.0)


def columns(*values):
    return [np.array([float(v)]) for v in values]


class Steering:
    def __init__(self, n=1, use_roll=False, use_slope=False, gains=(HEADING, ALTITUDE, SPEED)):
        heading, altitude, speed = (tuple(map(float, g)) for g in gains)
        flags = {"use_roll": use_roll, "use_glide_slope": use_slope}
        gained = {"heading_pid": heading, "alt_pid": altitude, "vel_pid": speed}
        self.plugin = bound(SimpleAircraftControllerPID(**flags, **gained), n)

    def step(self, lateral, vertical, speed, z, vx, vy, vz, angle, dt=0.1):
        own = self.plugin
        for name, values in zip(own.active_inputs(), (lateral, vertical, speed), strict=True):
            own.__dict__[name][:] = values
        pos, vel = np.stack([z, z, z]), np.stack([vx, vy, vz])
        own.step(seen(len(z), dt, pos=pos, vel=vel, yaw=angle, roll=angle))
        return np.stack([own.throttle, own.roll_rate, own.pitch_rate])


def proportional(use_roll=False, use_slope=False):
    return Steering(1, use_roll, use_slope, [(1.0, 0.0, 0.0, 0.0)] * 3)


def test_heading_altitude_and_speed_errors():
    throttle, roll_rate, pitch_rate = proportional().step(
        *columns(1.0, 120.0, 25.0, 100.0, 20.0, 0.0, 0.0, 0.5)
    )[:, 0]
    assert throttle == pytest.approx(5.0)
    assert roll_rate == pytest.approx(0.5), "a goal to the left banks the model positively, which turns left"
    assert pitch_rate == pytest.approx(20.0), "a goal above raises the nose"


def test_heading_error_takes_the_short_way():
    assert proportional().step(*columns(3.0, 0, 20, 0, 20, 0, 0, -3.0))[1, 0] == pytest.approx(6.0 - math.tau)


def test_a_bank_to_the_right_needs_a_negative_roll_rate():
    assert proportional(use_roll=True).step(*columns(0.3, 0, 20, 0, 20, 0, 0, 0.1))[1, 0] == pytest.approx(
        -0.2
    )


def test_a_steeper_descent_lowers_the_nose():
    level = proportional(use_slope=True).step(*columns(0.0, 0.1, 20, 0, 12, 16, 0, 0.0))[2, 0]
    assert level == pytest.approx(-0.1)
    descending = proportional(use_slope=True).step(*columns(0.0, 0.1, 20, 0, 12, 16, -20.0, 0.0))[2, 0]
    assert descending == pytest.approx(math.pi / 4 - 0.1)


def test_first_call_has_no_derivative_kick():
    first = Steering().step(*columns(1.0, 120.0, 20.0, 100.0, 20.0, 0.0, 0.0, 0.0))
    assert first[1, 0] == pytest.approx(1.0)
    assert first[2, 0] == pytest.approx(20.0)


def test_flies_an_aircraft_to_heading_altitude_and_speed():
    steering = Steering()
    x, advance = np.zeros((7, 1)), SimpleAircraft().advance
    x[6], x[2] = 20.0, 100.0
    p = np.array([13.0, 15.0, 40.0, *np.radians([30.0, 30.0, 57.3, 57.3]), 50.0, 0.0])[:, None]
    u, body = np.zeros((3, 1)), np.empty((13, 1))
    for _ in range(600):
        aircraft.to_body(x, (u[1], u[2]), tuple(p[3:7]), (p[0], p[8], p[7]), body, 0)
        u = out = steering.step(*columns(1.0, 130.0, 25.0), x[2], *body[3:6], x[5])
        advance(x, np.ascontiguousarray(out), p, 0.1, 1)
    assert x[5, 0] == pytest.approx(1.0, abs=0.02)
    assert x[2, 0] == pytest.approx(130.0, abs=1.0)
    assert x[6, 0] == pytest.approx(25.0, abs=0.1)
