import math

import numpy as np
import pytest
from bound_rows import bound, seen

from tussle.numeric.pid import pid
from tussle.plugins.stock.controller.unicycle_pid import UnicyclePID
from tussle.plugins.stock.motion.unicycle import Unicycle

HEADING, PITCH, ROLL, SPEED = range(4)
GAINS = np.array(
    [
        [1.0, 0.1, 0.1, math.radians(45.0)],
        [1.0, 0.2, 0.3, 10.0],
        [1.0, 0.0, 0.0, 10.0],
        [1.0, 0.1, 0.03, 10.0],
    ]
)


class Loop:
    """One PID, one number, in plain Python."""

    def __init__(self, gains, is_angle):
        self.gains, self.is_angle = gains, is_angle
        self.integral, self.last = 0.0, None

    def step(self, error, dt):
        kp, ki, kd, band = self.gains
        near = (lambda a: math.remainder(a, math.tau)) if self.is_angle else (lambda a: a)
        error = near(error)
        self.integral = self.integral + error * dt if abs(error) <= band else 0.0
        rate = 0.0 if self.last is None else near(error - self.last) / dt
        self.last = error
        return kp * error + ki * self.integral + kd * rate


class Steering:
    """n rows of the controller with their memory."""

    def __init__(self, n, gains=GAINS):
        names = "heading_pid", "pitch_pid", "roll_pid", "speed_pid"
        self.plugin = bound(UnicyclePID(**dict(zip(names, map(tuple, gains), strict=True))), n)

    @property
    def memory(self):
        own = self.plugin
        return np.concatenate([own.heading, own.elevation, own.bank, own.forward])

    def step(self, wanted, z, vel, attitude, dt=0.1):
        own = self.plugin
        own.desired_altitude[:], own.desired_speed[:], own.desired_heading[:] = wanted
        yaw, climb, roll = attitude
        pos = np.stack([0.0 * z, 0.0 * z, z])
        own.step(seen(len(z), dt, pos=pos, vel=np.stack(list(vel)), yaw=yaw, climb=climb, roll=roll))
        return np.stack([own.speed, own.acceleration_x, own.turn_rate, own.pitch_rate, own.roll_rate])


def one(**changed):
    """Inputs of one row: at rest in a level cruise, everything as wanted."""
    values = {
        "altitude": 100.0,
        "speed": 20.0,
        "heading": 0.3,
        "z": 100.0,
        "vx": 20.0,
        "vy": 0.0,
        "vz": 0.0,
        "yaw": 0.3,
        "climb": 0.0,
        "roll": 0.0,
    }
    values |= changed
    row = {k: np.array([v]) for k, v in values.items()}
    return (
        (row["altitude"], row["speed"], row["heading"]),
        row["z"],
        (row["vx"], row["vy"], row["vz"]),
        (row["yaw"], row["climb"], row["roll"]),
    )


def test_all_as_wanted_commands_nothing():
    out = Steering(1).step(*one())
    assert out[0, 0] == 20.0
    assert np.all(out[1:, 0] == 0.0)


@pytest.mark.parametrize("dt", [0.1, 0.1 / 12])
def test_loops_against_a_plain_one(dt):
    draw = np.random.default_rng(4)
    steering = Steering(1)
    loops = [
        Loop(GAINS[HEADING], True),
        Loop(GAINS[PITCH], False),
        Loop(GAINS[ROLL], True),
        Loop(GAINS[SPEED], False),
    ]
    for _ in range(60):
        altitude, speed, heading = draw.uniform(0, 200), draw.uniform(5, 40), draw.uniform(-9, 9)
        z, vel = draw.uniform(0, 200), draw.uniform(-30, 30, 3)
        yaw, climb, roll = draw.uniform(-3, 3), draw.uniform(-1.5, 1.5), draw.uniform(-3, 3)
        out = steering.step(
            *one(
                altitude=altitude,
                speed=speed,
                heading=heading,
                z=z,
                vx=vel[0],
                vy=vel[1],
                vz=vel[2],
                yaw=yaw,
                climb=climb,
                roll=roll,
            ),
            dt,
        )
        aim = math.atan2(altitude - z, speed)
        expected = [
            speed,
            loops[3].step(speed - math.sqrt(float(vel @ vel)), dt),
            loops[0].step(heading - yaw, dt),
            loops[1].step(aim - climb, dt),
            loops[2].step(-roll, dt),
        ]
        assert out[:, 0] == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_signs():
    assert Steering(1).step(*one(heading=0.5))[2, 0] > 0.0, "a goal to the left turns left"
    assert Steering(1).step(*one(altitude=120.0))[3, 0] > 0.0, "a goal above raises the nose"
    assert Steering(1).step(*one(roll=0.2))[4, 0] < 0.0, "a bank to the right rolls left"
    assert Steering(1).step(*one(vx=15.0))[1, 0] > 0.0, "too slow speeds up"
    assert Steering(1).step(*one(speed=-20.0, altitude=120.0))[3, 0] < 0.0, (
        "backwards, a goal above lowers the nose"
    )


def test_first_call_has_no_derivative_kick():
    gains = np.zeros((4, 4))
    gains[:, 2] = 1.0
    steering = Steering(1, gains)
    far = one(heading=2.0, altitude=500.0, speed=30.0, roll=0.5)
    assert np.all(steering.step(*far)[1:, 0] == 0.0)
    assert np.all(steering.step(*far)[1:, 0] == 0.0)
    assert steering.step(*one(heading=2.1, altitude=500.0, speed=30.0, roll=0.5))[2, 0] == pytest.approx(1.0)


def test_derivative_does_not_jump_where_the_error_passes_pi():
    gains = np.zeros((4, 4))
    gains[:, 2] = 1.0
    steering = Steering(1, gains)
    steering.step(*one(heading=math.pi - 0.01, yaw=0.0))
    rate = steering.step(*one(heading=math.pi + 0.01, yaw=0.0))[2, 0]
    assert rate == pytest.approx(0.02 / 0.1)


def test_integral_empties_outside_its_band():
    command, integral = pid(2.0, 0.0, 0.5, 0.0, 1.0, 0.0, 3.0, 0.25)
    assert (command, integral) == (1.25, 1.25)
    assert pid(3.5, 0.0, 0.5, 0.0, 1.0, 0.0, 3.0, 0.25) == (0.0, 0.0)


def test_flies_a_unicycle_to_heading_and_altitude():
    steering = Steering(
        1,
        np.array(
            [[1.0, 0.0, 0.1, 1.0], [1.0, 0.0, 0.0, 10.0], [1.0, 0.0, 0.0, 10.0], [1.0, 0.1, 0.03, 10.0]]
        ),
    )
    x, advance = np.zeros((5, 1)), Unicycle().advance
    p = np.array([[40.0], [1.0], [1.0], [0.0]])
    for _ in range(600):
        moving = one(heading=2.5, altitude=50.0, z=x[2, 0], yaw=x[3, 0], climb=x[4, 0])
        out = steering.step(*moving, 0.05)
        advance(x, np.ascontiguousarray(out[[0, 2, 3]]), p, 0.05, 1)
    assert x[3, 0] == pytest.approx(2.5, abs=1e-3)
    assert x[2, 0] == pytest.approx(50.0, abs=0.05)
    assert x[4, 0] == pytest.approx(0.0, abs=1e-3)
