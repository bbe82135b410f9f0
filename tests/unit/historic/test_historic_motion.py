"""SCRIMMAGE's motion models, held to short calculations of their laws."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, Output
from tussle.numeric.quaternion import quat_from_euler, quat_to_yaw
from tussle.plugins import historic

H = 0.1
LEVEL = (1.0, 0.0, 0.0, 0.0)


def after(model, x0, *inputs, steps=1):
    """State after some steps with constant inputs."""
    return model.rollout(x0, np.tile(inputs, (steps, 1)), H)[-1]


def test_ballistic_falls_with_the_cube_of_time():
    end = after(historic.Ballistic(), [0, 0, 100, 3, 0, 5, 0], 2.0, steps=20)
    assert end[:3] == pytest.approx([6.0, 0.0, 100.0 + 5.0 * 2 - 2.0 * 9.81 * 2.0**3 / 6], rel=1e-12)


def test_double_integrator_moves_with_the_old_velocity():
    model = historic.DoubleIntegrator(max_vel=10, max_acc=2, motion_model_sets_yaw=False)
    end = after(model, [0, 0, 0, 3, 0, 0, 0, 0], 1.0, 0.0, 0.0, 0.4)
    assert end == pytest.approx([3 * H, 0, 0, 3 + H, 0, 0, 0.4 * H, 0.4])
    pushed = after(model, [0, 0, 0, 3, 0, 0, 0, 0], 3.0, 4.0, 0.0, 5.0)
    assert pushed[3:] == pytest.approx([3 + 1.2 * H, 1.6 * H, 0, H, 1.0])
    fast = after(model, [0, 0, 0, 8, 8, 0, 0, 0], 0.0, 0.0, 0.0, 0.0)
    assert fast[:6] == pytest.approx([0.8, 0.8, 0, *[10 / math.sqrt(2)] * 2, 0])


def test_single_integrator_climbs_nose_down_and_rests_to_the_east():
    model = historic.SingleIntegrator()
    climbing = after(model, np.zeros(8), 0.0, 3.0, 4.0)
    assert climbing == pytest.approx([0, 0.3, 0.4, 0, 3, 4, math.pi / 2, -math.atan2(4, 3)])
    assert after(model, climbing, 0.0, 0.0, 0.0)[6:].tolist() == [0.0, 0.0]
    assert after(historic.SingleIntegrator(max_speed=10), np.zeros(8), 0.0, 3.0, 4.0)[3:6] == pytest.approx(
        [0, 6, 8]
    )


def test_simple_car_turns_and_falls_by_its_own_gravity():
    still = (0.0, 0.0, 0.0)
    end = after(historic.SimpleCar(), np.zeros(8), 30.0, 0.2, *still)
    turn = 20 / 2.62 * math.tan(0.2) * H
    arc = 2.62 / math.tan(0.2)
    assert end[:5] == pytest.approx([arc * math.sin(turn), arc * (1 - math.cos(turn)), 0, 0, turn], abs=1e-6)
    assert end[5:7] == pytest.approx(end[:2] / H)
    falling = historic.SimpleCar(enable_gravity=True, mass=3)
    assert after(falling, np.zeros(8), 5.0, 0.0, *still)[2] == pytest.approx(-3 * 9.8 * H**2 / 2)
    held = after(falling, np.zeros(8), 5.0, 0.0, 1.0, 0.0, 40.0)
    assert held[:4] == pytest.approx([0.0, 0.0, 0.0, -3 * 9.8 * H])


def test_simple_quadrotor_counts_speed_up_to_its_limits():
    end = after(historic.SimpleQuadrotor(), [0, 0, 0, 30, 5, 20, 0, 0], 1.0, 2.0, 3.0, 0.0)
    assert end == pytest.approx([1.5, 0, 1.0, 30.1, 5.2, 20.3, 0, 0])
    back = after(historic.SimpleQuadrotor(), [0, 0, 0, -30, 0, -20, 0, 0], 0.0, 0.0, 0.0, 0.0)
    assert back[:3] == pytest.approx([-3.0, 0, -2.0])


def test_dubins_airplanes_dive_by_a_positive_pitch():
    pitch, roll, speed = 0.3, 0.5, 20.0
    turn = -9.81 / speed * math.tan(roll)
    end = after(historic.DubinsAirplane(), np.zeros(9), speed, pitch, roll)
    assert end[2:6] == pytest.approx([-speed * math.sin(pitch) * H, turn * H, pitch, roll])
    assert end[6:] == pytest.approx(end[:3] / H)
    x0 = [0, 0, 0, *LEVEL, 0, 0, 0, *LEVEL]
    end = after(historic.DubinsAirplane3D(), x0, speed, pitch, roll, *[0.0] * 6)
    assert end[2] == pytest.approx(-speed * math.sin(pitch) * H, rel=0.1)
    # The rate about the body z axis turns the heading by cos(roll) / cos(pitch) of it.
    assert quat_to_yaw(end[3:7]) == pytest.approx(turn * H * math.cos(roll) / math.cos(pitch), rel=0.02)
    assert after(historic.DubinsAirplane3D(), x0, 0.0, 0.0, roll, *[0.0] * 6)[:7] == pytest.approx(
        [0, 0, 0, *quat_from_euler(roll, 0.0, 0.0)]
    )


def test_unicycle_3d_takes_no_command_of_its_acceleration_and_forces_as_velocities():
    none = [0.0] * 6
    x0 = [0, 0, 0, *LEVEL, 10, 0, 0, *LEVEL]
    model = historic.Unicycle3D(accel_max=2, speed_max=1)
    for command in (-5.0, 0.0, 5.0):
        assert after(model, x0, command, 0.0, 0.0, 0.0, *none)[7] == pytest.approx(10 + 2 * H)
    east = after(historic.Unicycle3D(speed_max=30), x0, 20.0, 0.0, 0.0, 0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 0.5)
    assert east[:2] == pytest.approx([2.0, 0.3 + 20 * 0.05 * H / 2], rel=0.01)
    assert quat_to_yaw(east[3:7]) == pytest.approx(0.05)
    # Started with another attitude, a roll is about the world's axis.
    north = quat_from_euler(0.0, 0.0, math.pi / 2)
    rolled = after(historic.Unicycle3D(), [0, 0, 0, *north, 0, 0, 0, *north], 0.0, 0.0, 0.0, 1.0, *none)
    assert rolled[3:7] == pytest.approx(quat_from_euler(0.0, -0.1, math.pi / 2), abs=1e-7)


@pytest.mark.parametrize(
    ("limits", "command", "rate"),
    [
        ({}, 9.0, 1.0),
        ({"pitch_rate_max": 0.5}, -9.0, -0.5),
        ({"pitch_rate_max": -0.5, "pitch_rate_min": 0.2}, 9.0, 0.2),
        ({"pitch_rate_max": -0.5, "pitch_rate_min": 0.2}, -9.0, -0.5),
        ({"pitch_rate_max": -0.5}, 9.0, 0.5),
    ],
)
def test_unicycle_3d_has_two_limits_and_swaps_them(limits, command, rate):
    x0 = [0, 0, 0, *LEVEL, 0, 0, 0, *LEVEL]
    end = after(historic.Unicycle3D(**limits), x0, 0.0, 0.0, command, 0.0, *[0.0] * 6)
    assert end[3:7] == pytest.approx(quat_from_euler(0.0, -rate * H, 0.0), abs=1e-7)


def test_rigid_body_hardly_turns():
    end = after(historic.RigidBody6DOF(), [0, 0, 0, 10, 0, 0, *LEVEL, *LEVEL], 3.0, 0.0, 0.0, 0.0, steps=10)
    assert end[3] == pytest.approx(13.0)
    assert 2 * end[7:10] == pytest.approx([0.001] * 3, rel=1e-3)
    pushed = after(historic.RigidBody6DOF(), [0, 0, 0, 10, 0, 0, *LEVEL, *LEVEL], 0.0, 0.0, 0.0, 5.0)
    assert quat_to_yaw(pushed[6:10]) == pytest.approx(0.001 * H + 5.0 * H**2 / 2, rel=1e-3)


def test_multirotor_has_two_velocities():
    x0 = [0, 0, 0, 4, 0, 0, *LEVEL, *[0] * 6]
    still, none = [0.0] * 4, [0.0] * 3
    end = after(historic.Multirotor(omega_min=0), x0, *still, *none)
    assert end[:6] == pytest.approx([0, 0, -9.81 * H**2 / 2, 4, 0, -9.81 * H])
    idle = after(historic.Multirotor(), x0, *still, *none)  # at omega_min there is no thrust
    assert idle[5] == pytest.approx(-9.81 * H)
    hover = math.sqrt(1.5 * 9.81 / (4 * 5.45e-6))
    assert after(historic.Multirotor(), x0, *[hover] * 4, *none)[2:6] == pytest.approx(
        [0, 4, 0, 0], abs=1e-12
    )
    landed = after(historic.Multirotor(), x0, *[400.0] * 4, 0.0, 0.0, 50.0)  # thrust 3.5 N of 14.7 N
    assert landed[2] == pytest.approx(0.0, abs=0.02)


def test_uuv_has_thrust_without_throttle_and_stops_at_the_surface():
    model = historic.UUV6DOF(c_g=(0, 0, 0), buoyancy=30.479102956 * 9.81)
    x0 = [0, 0, -5, 1, 0, 0, *LEVEL, 1, 0, 0, *[0] * 9]
    end = after(model, x0, 0.0, 0.0, 0.0)
    thrust, mass = 0.5 * (3.6936 - 2.0), 30.479102956
    assert end[16] == pytest.approx((thrust - 1.62) / (mass + 0.93), rel=0.01)
    assert end[3] - 1 == pytest.approx((thrust - 1.62) / mass * H, rel=0.01)
    again = after(model, end, 0.0, 0.0, 0.0)  # now added mass pushes, too
    assert again[16] == pytest.approx(
        (thrust - 1.62 * end[10] ** 2 - 0.93 * end[16]) / (mass + 0.93), rel=0.01
    )
    x0[2] = 0.01
    assert -1e-12 < after(model, x0, 0.0, 0.0, 0.0)[2] < 0.0


def test_an_oscillator_diverges_at_long_steps():
    model = historic.HarmonicOscillator(natural_frequency=100, damping_ratio=0)
    assert abs(after(model, [1, 0], 0.0, steps=9)[0]) > 1e6
    slow = after(historic.HarmonicOscillator(damping_ratio=0), [1, 0], 0.0, steps=10)
    assert slow == pytest.approx([math.cos(1.0), -math.sin(1.0)], abs=1e-5)


def test_aircraft_with_surfaces_falls_over_with_the_wind():
    rest = [0, 0, 100, 50, 0, 0, *LEVEL, 0, 0, 0]
    ahead, behind = (
        historic.FixedWing6DOF(wind=(wind, 0, 0)).rollout(rest, np.zeros((1, 4)), H)[-1] for wind in (10, -10)
    )
    assert ahead[5] > behind[5]  # the wind is added: more lift


def pilot(model):
    """An autonomy that commands a model at random."""
    inputs = type(model).inputs()
    columns = {
        f"out_{channel}": Output(channel, unit=column.unit)
        for name in model.active_inputs()
        for column in [inputs[name]]
        for channel in column.channels
    }

    def step(self, g):
        for name in columns:
            getattr(self, name)[:] = g.normal(name)

    return type("Pilot", (Autonomy,), {**columns, "step": step})()


def test_worlds_of_a_stack_are_as_alone():
    """All models in one game by random commands."""
    names = [name for name, path in historic.manifest().items() if ".motion." in path and "-" not in name]
    names = [name for name in names if not name.startswith("JSBSim")]  # which need a script
    blocks = [
        Block(name=name, count=2, position=(0, 50 * i, 200), speed=20, motion=model, autonomy=pilot(model))
        for i, name in enumerate(names)
        for model in [historic.load(name)()]
    ]
    mission = Mission(blocks=blocks, dt=0.05, end=0.5, motion_multiplier=2, compat="scrimmage")
    with Simulation(mission, range(3)) as stack:
        hashes = [result.state_hash for result in stack.run()]
    with Simulation(mission, 2) as alone:
        assert alone.run()[0].state_hash == hashes[-1]
    assert len(set(hashes)) == 3
