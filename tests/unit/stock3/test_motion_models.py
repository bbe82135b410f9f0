"""The oscillator, the vehicle that turns about all its axes, and what stands still."""

from __future__ import annotations

import math

import numpy as np
import pytest
from small_worlds import block, mission

from tussle import Simulation
from tussle.api import Autonomy, Interaction, Output, Param
from tussle.numeric.quaternion import quat_from_euler, quat_rotate
from tussle.stock import HarmonicOscillator, HarmonicOscillatorConstController, Still, Unicycle, Unicycle3D

DT = 0.1


def oscillation(t, z0, w, d, push):
    """Closed form of z'' = -w^2 z - 2 d w z' + push from rest at z0."""
    rest = push / (w * w)
    damped = w * math.sqrt(1.0 - d * d)
    decay = np.exp(-d * w * t)
    return rest + (z0 - rest) * decay * (np.cos(damped * t) + d * w / damped * np.sin(damped * t))


def released(dt, z0=10.0, w=5.0, d=0.1, push=-100.0):
    """Where an oscillator that is let go at z0 is after 3 s, and where it should be."""
    spring = block(
        position=(3.0, -2.0, z0), autonomy=(), controller=HarmonicOscillatorConstController(acceleration_z=push),
        motion=HarmonicOscillator(natural_frequency=w, damping_ratio=d), velocity=(1.0, 1.0, 0.0),
    )  # fmt: skip
    sim = Simulation(mission(spring, dt=dt, end=3.0))
    sim.run()
    return sim, oscillation(3.0, z0, w, d, push)


def test_the_oscillator_follows_its_closed_form():
    errors = []
    for dt in (0.02, 0.01):
        sim, z = released(dt)
        errors.append(abs(sim.read("a.pos")[0][0, 0, 2] - z))
    # RK4's phase error is (w dt)^4 / 120 of the phase w t, here of an amplitude of 14 m.
    assert errors[1] <= 14.0 * 15.0 * 0.05**4 / 120.0
    assert math.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.5)


@pytest.mark.parametrize(("damping", "frequency"), [(2.0, 10.0), (0.05, 200.0), (1e3, 1e3)])
def test_no_step_is_too_long_for_a_stiff_oscillator(damping, frequency):
    """Under a push it comes to rest where the spring balances that, whatever the step."""
    spring = HarmonicOscillator(damping_ratio=damping, natural_frequency=frequency)
    path = spring.rollout([3.0, -2.0], np.full((200, 1), 8.0), dt=50.0)
    assert np.abs(path).max() <= 3.0
    assert path[-1] == pytest.approx([8.0 / frequency**2, 0.0], abs=1e-9)


def test_an_undamped_oscillator_keeps_its_energy_in_long_steps():
    path = HarmonicOscillator(damping_ratio=0.0, natural_frequency=10.0).rollout(
        [3.0, 0.0], np.zeros((20, 1)), dt=1.0
    )
    # A Runge-Kutta step of x rad loses x^6 / 144 of the amplitude; here 64 steps make one of 1 s.
    lost = 20 * 64 * (10.0 / 64) ** 6 / 144
    assert np.hypot(path[:, 0], path[:, 1] / 10.0) == pytest.approx(3.0, rel=1.01 * lost)


def test_the_oscillator_moves_along_the_vertical_only():
    sim, _ = released(0.02)
    assert sim.read("a.pos")[0][0, 0, :2].tolist() == [3.0, -2.0]
    assert sim.read("a.vel")[0][0, 0, :2].tolist() == [0.0, 0.0]


def test_a_constant_push_moves_the_rest_position():
    spring = block(
        autonomy=(), controller=HarmonicOscillatorConstController(acceleration_z=8.0), motion=HarmonicOscillator(natural_frequency=2.0)
    )  # fmt: skip
    sim = Simulation(mission(spring, end=60.0))
    sim.run()
    assert sim.read("a.pos")[0][0, 0, 2] == pytest.approx(2.0, abs=1e-9)


def test_what_stands_still_stays_until_someone_puts_it_elsewhere():
    class Crane(Interaction):
        def step(self, w):
            w.move(np.flatnonzero(w.step_count[w.world] == 3), pos=(7.0, 8.0, 9.0))

    post = block(position=(1.0, 2.0, 3.0), heading=0.7, velocity=(5.0, 0.0, 0.0), autonomy=(), motion=Still())
    sim = Simulation(mission(post, interactions=[Crane()]))
    sim.step(3)
    assert sim.read("a.pos")[0][0, 0].tolist() == [1.0, 2.0, 3.0]
    assert sim.read("a.vel")[0][0, 0].tolist() == [0.0, 0.0, 0.0]
    assert sim.read("a.yaw")[0][0, 0] == pytest.approx(0.7)
    sim.step(3)
    assert sim.read("a.pos")[0][0, 0].tolist() == [7.0, 8.0, 9.0]


# -- Unicycle3D -------------------------------------------------------------------------------------------------------------------

RATES = "turn_rate pitch_rate roll_rate"
FREE = {"speed_max": 50.0, "turn_rate_max": 5.0, "pitch_rate_max": 5.0, "roll_rate_max": 5.0}


def start(roll=0.0, climb=0.0, yaw=0.0, v=0.0):
    return np.array([0.0, 0.0, 0.0, *quat_from_euler(roll, -climb, yaw), v])


def flown(x0, command, n_steps=10, dt=DT, substeps=1, **params):
    return Unicycle3D(**{**FREE, **params}).rollout(x0, np.tile(command, (n_steps, 1)), dt, substeps)[-1]


def euler_flight(x0, speed, turn, rise, bank, t, n=200_000):
    """The same by very many small turns about the body's own axes."""
    h = t / n
    half = 0.5 * h
    turned = np.array([1.0, half * bank, -half * rise, half * turn])
    turned /= np.linalg.norm(turned)
    pos, q = x0[:3].copy(), x0[3:7].copy()
    w, a, b, c = turned
    step = np.array([[w, -a, -b, -c], [a, w, c, -b], [b, -c, w, a], [c, b, -a, w]])  # q -> q * turned
    for _ in range(n):
        pos += (
            h
            * speed
            * np.array(
                [
                    1 - 2 * (q[2] ** 2 + q[3] ** 2),
                    2 * (q[1] * q[2] + q[0] * q[3]),
                    2 * (q[1] * q[3] - q[0] * q[2]),
                ]
            )
        )
        q = step @ q
    return pos, q


def test_with_level_wings_it_flies_as_the_unicycle():
    command = (7.0, 0.4, 0.0, 0.0)
    flat = Unicycle(vel_max=50.0, turn_rate_max=5.0).rollout(np.zeros(5), np.tile(command[:3], (20, 1)), DT)[
        -1
    ]
    end = flown(start(), command, 20)
    assert end[:3] == pytest.approx(flat[:3], abs=1e-5)
    assert end[3:7] == pytest.approx(quat_from_euler(0.0, 0.0, flat[3]), abs=1e-14)


def test_rates_are_about_the_axes_of_its_own_body():
    x0 = start(roll=0.7, climb=0.5, yaw=2.0)
    pos, q = euler_flight(x0, 9.0, 0.8, -0.6, 0.5, 2.0, 20_000)
    end = flown(x0, (9.0, 0.8, -0.6, 0.5), 20)
    assert end[3:7] == pytest.approx(q, abs=1e-3)
    assert end[:3] == pytest.approx(pos, abs=2e-2)


def test_banked_to_the_side_a_pitch_rate_turns_the_heading():
    right_wing_down = start(roll=math.pi / 2)
    end = flown(right_wing_down, (1.0, 0.0, 1.0, 0.0), 5)
    ahead = quat_rotate(end[3:7], np.array([1.0, 0.0, 0.0]))
    assert ahead == pytest.approx([math.cos(0.5), -math.sin(0.5), 0.0], abs=1e-12)


@pytest.mark.parametrize(("command", "axis"), [((0, 1, 0, 0), 2), ((0, 0, 1, 0), 1), ((0, 0, 0, 1), 0)])
def test_a_full_turn_about_each_axis_comes_back(command, axis):
    end = flown(start(), tuple(map(float, command)), 64, dt=2.0 * math.pi / 64)
    assert np.abs(end[3:7]) == pytest.approx([1.0, 0.0, 0.0, 0.0], abs=1e-13)
    quarter = flown(start(), tuple(map(float, command)), 16, dt=2.0 * math.pi / 64)
    sign = -1.0 if axis == 1 else 1.0  # nose up is a negative turn about the axis to the left
    expected = [math.cos(math.pi / 4), 0.0, 0.0, 0.0]
    expected[1 + axis] = sign * math.sin(math.pi / 4)
    assert quarter[3:7] == pytest.approx(expected, abs=1e-13)


def test_a_loop_is_a_circle_and_finer_substeps_draw_it_better():
    command, errors = (10.0, 0.0, 1.0, 0.0), []
    for substeps in (1, 2, 4):
        end = flown(start(), command, 10, dt=0.2, substeps=substeps)
        errors.append(np.abs(end[:3] - [10.0 * math.sin(2.0), 0.0, 10.0 * (1.0 - math.cos(2.0))]).max())
    assert errors[0] < 2e-4
    assert math.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.2)
    assert math.log2(errors[1] / errors[2]) == pytest.approx(4.0, abs=0.2)


def test_commands_are_held_within_their_limits():
    end = flown(start(), (9.0, 2.0, 0.0, 0.0), 1, speed_max=3.0, turn_rate_max=0.5)
    same = flown(start(), (3.0, 0.5, 0.0, 0.0), 1)
    assert end.tolist() == same.tolist()
    back = flown(start(), (-9.0, 0.0, 0.0, 0.0), 1, speed_max=3.0)
    assert back[0] == pytest.approx(-0.3)


def test_with_an_accelerating_command_the_speed_grows_to_its_limit():
    model = {"accel_max": 2.0, "speed_max": 3.0}
    assert flown(start(v=1.0), (1.0, 0.0, 0.0, 0.0), 10, **model)[[0, 7]] == pytest.approx([1.5, 2.0])
    assert flown(start(), (9.0, 0.0, 0.0, 0.0), 10, **model)[[0, 7]] == pytest.approx([1.0, 2.0])
    assert flown(start(), (-9.0, 0.0, 0.0, 0.0), 100, **model)[7] == -3.0


class Aerobat(Autonomy):
    """Fly with constant commands."""

    to = Param((5.0, 0.3, 0.2, 0.1), fields="v turn rise bank")
    commands = Output("speed turn_rate pitch_rate roll_rate", unit="m/s rad/s rad/s rad/s")

    def step(self, g):
        self.commands[:] = self.to


def test_what_it_publishes_is_its_motion():
    plane = block(autonomy=Aerobat(), motion=Unicycle3D(**FREE), roll=0.4, climb=0.3, heading=1.0)
    sim = Simulation(mission(plane, dt=1e-4))
    sim.step()
    pos, quat = sim.read("a.pos")[0][0, 0], sim.read("a.quat")[0][0, 0]
    sim.step()
    moved = (sim.read("a.pos")[0][0, 0] - pos) / 1e-4
    assert sim.read("a.vel")[0][0, 0] == pytest.approx(moved, abs=1e-3)
    w, *v = sim.read("a.quat")[0][0, 0] - quat
    qw, q = quat[0], quat[1:]
    dv = np.array(v) / 1e-4
    spin = 2.0 * (qw * dv - w / 1e-4 * q - np.cross(dv, q))  # 2 q' q*
    assert sim.read("a.omega")[0][0, 0] == pytest.approx(spin, abs=1e-3)


def test_it_goes_on_from_where_it_is_put():
    class Hand(Interaction):
        def step(self, w):
            rows = np.flatnonzero(w.step_count[w.world] == 1)
            w.move(rows, pos=(100.0, 0.0, 0.0), quat=quat_from_euler(0.0, 0.0, math.pi / 2))

    plane = block(autonomy=Aerobat(to=(5.0, 0.0, 0.0, 0.0)), motion=Unicycle3D(**FREE))
    sim = Simulation(mission(plane, interactions=[Hand()]))
    sim.step(4)
    assert sim.read("a.pos")[0][0, 0] == pytest.approx([100.0, 1.0, 0.0])
