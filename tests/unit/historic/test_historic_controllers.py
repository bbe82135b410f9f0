"""SCRIMMAGE's controllers, held to short calculations of their laws, and when they are called."""

from __future__ import annotations

import math

import pytest

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, Controller, Input, Output
from tussle.mission.cadence import TimerCadence
from tussle.plugins import historic
from tussle.stock import SingleIntegrator, Still

NEW = (0.0, 0.0, 0.0)
GAINS = (2.0, 0.5, 0.25, 1.0)


def law(plugin, name):
    """The law of a controller, as Python."""
    return historic.load(plugin).row_laws[name].function


def test_loops_kick_in_the_first_call_and_where_the_error_jumps():
    turn = law("UnicyclePID", "turn")
    command, memory = turn(desired_heading=0.5, yaw=0.1, heading_pid=GAINS, heading=NEW, dt=0.1)
    assert command == pytest.approx(2 * 0.4 + 0.5 * 0.04 + 0.25 * 0.4 / 0.1)
    assert memory == pytest.approx((0.04, 0.4, 1.0))
    jumping, _ = turn(math.pi + 0.01, 0.0, GAINS, (0.0, math.pi - 0.01, 1.0), 0.1)
    assert jumping == pytest.approx(-2 * (math.pi - 0.01) - 0.25 * (2 * math.pi - 0.02) / 0.1)
    # Beyond the band there is no integral; exactly at it there is one.
    assert turn(2.0, 0.0, (0.0, 1.0, 0.0, 1.0), (3.0, 0.0, 1.0), 0.1)[0] == 0.0
    assert turn(1.0, 0.0, (0.0, 1.0, 0.0, 1.0), (3.0, 0.0, 1.0), 0.1)[0] == pytest.approx(3.1)


def test_aircraft_pitch_by_their_altitude_error():
    rise = law("AircraftPIDController", "rise")
    gains = (0.1, 0.0, 0.0, 10.0)
    elevator, *_ = rise(110.0, 105.0, 0.2, 0.6, gains, (0.5, 0.0, 0.0, 1.0), NEW, NEW, 0.1)
    assert elevator == pytest.approx(0.5 * (-0.5 + 0.2))
    elevator, *_ = rise(150.0, 105.0, 0.0, 0.6, gains, (0.5, 0.0, 0.0, 1.0), NEW, NEW, 0.1)
    assert elevator == pytest.approx(0.5 * -0.6)  # at most max_pitch
    glide = law("SimpleAircraftControllerPID", "glide")
    command, _ = glide(0.0, (10.0, 0.0, 10.0), (1.0, 0.0, 0.0, 1.0), NEW, 0.1)
    assert command == pytest.approx(math.pi / 4)  # published as a climb, it dives


def test_laws_of_points_and_velocities():
    push = law("DoubleIntegratorControllerVelYaw", "push")
    plain = (1.0, 0.0, 0.0, 1.0)
    (ax, ay, az), *_ = push(12.0, 5.0, math.pi / 2, 10.0, (3.0, 0.0, 4.0), plain, plain, NEW, NEW, 0.1)
    assert (ax, ay, az) == pytest.approx((0.0, 0.0, 2.0))  # at its speed, so it never turns
    pull = law("UnicycleControllerPoint", "pull")
    assert pull((3.0, 4.0, 5.0), (0.0, 0.0, 0.0), 0.0, 2.0, 0.1) == pytest.approx((0.3, 0.2, 0.0, 0.5))
    ahead = law("SimpleQuadrotorControllerLQR", "push")
    gains = (20.0, 1.0, 0.0, 0.0, 1.0)
    near, _ = ahead((9.0, 0.0, 1.0), (0.0, 0.0, 0.0), (0.0, 2.0, 1.0), *gains, NEW, 0.1)
    assert near == pytest.approx((-2.0, 0.0, 1.0 - math.sqrt(2.0)))
    far, _ = ahead((0.0, 50.0, 0.0), (0.0, 0.0, 0.0), (0.0, 2.0, 0.0), *gains, NEW, 0.1)
    assert far == pytest.approx((3.0, 0.0, 0.0))
    turn = law("SimpleQuadrotorControllerLQR", "turn")
    first, seen = turn(0.5, 0.2, (0.0, 0.0), 0.1)
    assert first == pytest.approx(0.3)
    assert turn(0.5, 0.25, seen, 0.1)[0] == pytest.approx(0.25 - math.sqrt(2.0) * 0.5)


def test_laws_of_vehicles():
    deplete = law("UUV6DOFLinearEnergy", "deplete")
    assert deplete((-1.0, 0.2, 0.3), 0.0, 5.0, 0.1) == ((-1.0, 0.2, 0.3), 5.1)
    assert deplete((1.0, 0.2, 0.3), 0.0, 0.1, 0.1)[0] == (0.0, 0.2, 0.3)
    rise = law("UUV6DOFPIDController", "rise")
    assert rise(-5.0, 1.5, -4.0, 0.1, (2.0, 0.0, 0.0, 0.5), NEW, 0.1)[0] == pytest.approx(
        -2.0 * (math.atan2(-1.0, 1.5) - 0.1)
    )
    steer = law("RigidBody6DOFControllerPID", "steer")
    gains = (1.0, 0.0, 0.0, 1.0)
    assert steer(0.5, 10.0, 0.2, 0.1, 0.05, 7.0, gains, gains, NEW, NEW, 0.1)[:3] == pytest.approx(
        (0.35, 0.1 - 3.0, 0.0)
    )


class Listener(Controller):
    """Passes velocities, and keeps the times between its calls."""

    command = Input("velocity_x velocity_y velocity_z", unit="m/s")
    passed = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def step(self, g):
        CALLS.append(("controller", int(g.step_count[0]), float(g.dt)))
        self.passed[:] = self.command


class Rated(Autonomy):
    """Flies East, and keeps the times between its calls."""

    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def step(self, g):
        CALLS.append(("autonomy", int(g.step_count[0]), float(g.dt)))
        self.velocity[0] = 1.0


CALLS: list[tuple[str, int, float]] = []


def calls(kind, compat):
    """Steps and dt of the calls of an autonomy at 4 Hz and its controller, in 1 s of steps of 1/8 s with two substeps each."""
    block = Block(name="a", motion=SingleIntegrator(), autonomy=Rated(rate=4), controller=Listener())
    mission = Mission(blocks=[block], dt=0.125, end=1.0, motion_multiplier=2, compat=compat)
    CALLS.clear()
    with Simulation(mission) as simulation:
        simulation.run()
    return [(step, dt) for each, step, dt in CALLS if each == kind]


def test_calls_get_the_dt_of_a_step_and_come_by_a_timer():
    assert calls("controller", "")[:4] == [(0, 0.0625), (0, 0.0625), (1, 0.0625), (1, 0.0625)]
    assert calls("controller", "scrimmage")[:4] == [(0, 0.125), (0, 0.125), (1, 0.125), (1, 0.125)]
    assert calls("autonomy", "") == [(0, 0.25), (2, 0.25), (4, 0.25), (6, 0.25)]
    assert calls("autonomy", "scrimmage") == [(0, 0.125), (1, 0.125), (3, 0.125), (5, 0.125), (7, 0.125)]
    timer = TimerCadence(0.4, 1.0, 1)
    assert [k for k in range(12) if timer.since(k)] == [0, 2, 4, 7, 9]


def test_an_empty_battery_removes_its_entity():
    rows = "[ velocity_x, 1.0, Delta, true, 0.25 ] [ velocity_y, 0, NonZero, false, 0 ] [ velocity_z, 0, NonZero, false, 0 ]"
    battery = historic.MotionBattery(charge_initial=0.35, depletion_map=rows)
    block = Block(name="a", motion=SingleIntegrator(), autonomy=Rated(), controller=battery)
    mission = Mission(
        blocks=[block], dt=0.125, end=2.0, end_conditions=["all_dead", "time"], compat="scrimmage"
    )
    with Simulation(mission) as simulation:
        result = simulation.run()[0]
    assert (result.end, result.steps) == ("all_dead", 3)


def test_the_stub_of_an_aircraft_moves_at_fixed_times():
    class Told(Controller):
        command = Input("throttle elevator aileron rudder")
        passed = Output("throttle elevator aileron rudder")

        def step(self, g):
            heard[round(float(g.t[0]), 3)] = self.command[:, 0].tolist()
            self.passed[:] = self.command

    heard: dict[float, list[float]] = {}

    class Silent(Autonomy):
        wanted = Output("desired_heading desired_altitude desired_speed", unit="rad m m/s")

        def step(self, g):
            self.wanted[:] = 1.0

    controllers = [historic.FixedWing6DOFControllerPID(), Told()]
    block = Block(name="a", motion=Still(), autonomy=Silent(), controller=controllers)
    with Simulation(Mission(blocks=[block], dt=0.5, end=9.0, compat="scrimmage")) as simulation:
        simulation.run()
    assert {t: v for t, v in heard.items() if any(v)} == {
        2.0: [0, 0, 0, -0.26], 2.5: [0, 0, 0, 0.26], 8.0: [0, 0, -0.5, 0], 8.5: [0, 0, 0.5, 0],
    }  # fmt: skip


def test_aircraft_of_jsbsim_turn_by_compass_headings():
    turn = law("JSBSimModelControllerHeadingPID", "turn")
    gains, bank = (1.0, 0.5, 0.0, 0.1), math.pi / 4
    # From East to 0.05 rad to the left: the compass heading decreases, the left wing goes down.
    roll, altitude, speed, memory, desired = turn(0.05, 300.0, 20.0, 0.0, gains, bank, NEW, 0.0, 0.1)
    assert (roll, altitude, speed) == pytest.approx((-0.05 - 0.5 * 0.005, 300.0, 20.0))
    assert (memory, desired) == (pytest.approx((-0.005, -0.05, 1.0)), pytest.approx(math.pi / 2 - 0.05))
    # A reversal is filtered: the desired heading moves by 0.75 dt of the change.
    roll, *_, desired = turn(
        -math.pi / 2 - 0.2, 0.0, 0.0, math.pi / 2, gains, bank, (0.0, 0.0, 1.0), 0.0, 0.1
    )
    assert desired == pytest.approx(0.075 * (0.2 - math.pi))
    assert roll == pytest.approx(desired)
    # In the first call nothing is filtered.
    assert turn(-math.pi / 2, 0.0, 0.0, math.pi / 2, gains, bank, NEW, 0.0, 0.1)[-1] == pytest.approx(math.pi)


def test_surfaces_of_jsbsim_have_scrimmages_signs():
    hold = law("JSBSimControlControllerHeadingPID", "hold")
    plain = (2.0, 0.0, 0.0, 1.0)
    throttle, elevator, aileron, rudder, *_ = hold(
        0.0, 0.3, 0.1, 0.2, plain, plain, plain, 0.75, NEW, NEW, NEW, 0.1
    )
    assert (throttle, elevator, aileron) == pytest.approx((0.0, -0.4, -0.2))
    assert rudder == pytest.approx(-2.0 * (math.pi / 2 - 0.3))  # East is 90 degrees of the compass
