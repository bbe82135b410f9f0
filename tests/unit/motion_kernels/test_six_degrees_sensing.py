"""The state sensor of rigid bodies, and commands by hand."""

from __future__ import annotations

import math
import os
import struct

import numpy as np
import pytest
from six_degrees import Pilot, flight, seen

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, State, Subscribe
from tussle.errors import ParameterError, PluginError
from tussle.plugins.stock.autonomy.joystick import JoystickButtons
from tussle.stock import (
    JoystickAutonomy,
    JoystickController,
    Multirotor,
    MultirotorControllerOmega,
    MultirotorTests,
    RigidBody6DOF,
    RigidBody6DOFStateSensor,
    Unicycle,
    UnicyclePID,
)


def test_rates_and_accelerations_are_those_of_a_circle():
    pilot = Pilot(heading=0.0, speed=20.0)
    sensor = RigidBody6DOFStateSensor(pos_noise_0=(2.0, 0.0), pos_noise_1=(0.0, 0.0), pos_noise_2=(0.0, 3.0))
    circle = Block(name="a", count=400, autonomy=Circle(), motion=Unicycle(vel_max=20.0), sensor=sensor)
    sim = Simulation(Mission(blocks=[circle], dt=0.01, end=1.0))
    sim.step(50)
    read = lambda name: sim.read(f"a.RigidBody6DOFStateSensor.{name}")[0][0]  # noqa: E731
    assert read("body_velocity")[0] == pytest.approx([20.0, 0.0, 0.0], abs=0.06)
    assert read("body_rate")[0] == pytest.approx([0.0, 0.0, 0.5])
    assert read("body_acceleration")[0] == pytest.approx([0.0, 10.0, 0.0], abs=0.06)  # V^2 / r = V w
    assert read("body_rate_change")[0] == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)
    error = read("measured_pos") - sim.read("a.pos")[0][0]
    assert error[:, :2] == pytest.approx(np.tile([2.0, 0.0], (400, 1)))
    # of 400 draws with deviation 3, the mean is within 4 standard errors, the deviation too
    assert abs(error[:, 2].mean()) < 4.0 * 3.0 / 20.0
    assert error[:, 2].std() == pytest.approx(3.0, abs=4.0 * 3.0 / math.sqrt(800.0))
    assert pilot.values["speed"] == 20.0


class Circle(Autonomy):
    """Flies a circle."""

    from tussle.api import Output

    speed = Output(unit="m/s")
    turn_rate = Output(unit="rad/s")
    pitch_rate = Output(unit="rad/s")

    def step(self, g):
        self.speed[:], self.turn_rate[:], self.pitch_rate[:] = 20.0, 0.5, 0.0


def test_equal_pulses_lift_a_multirotor():
    sim = flight(Multirotor(), [MultirotorControllerOmega()], MultirotorTests(pwm=1800.0), 0.01, 1.0)
    assert seen(sim, "vel")[2] > 1.0
    assert seen(sim, "omega") == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)


def event(kind, number, value):
    return struct.pack("<IhBB", 0, value, kind, number)


@pytest.fixture
def device(tmp_path):
    """A pipe in place of a joystick: its path, and what writes events."""
    path = tmp_path / "js0"
    os.mkfifo(path)
    keep = os.open(path, os.O_RDWR)
    yield str(path), lambda *events: os.write(keep, b"".join(event(*each) for each in events))
    os.close(keep)


def test_axes_drive_a_body(device):
    path, send = device
    sim = flight(RigidBody6DOF(), [JoystickController(device=path, axis_map=THRUST)], (), 0.1, 0.1, later=1.0)
    send((2, 2, -16384), (0x82, 0, 32767), (1, 0, 1))
    sim.step(5)
    outputs = [
        sim.read(f"a.JoystickController.{name}_out")[0][0, 0, 0] for name in ("thrust", "aileron", "rudder")
    ]
    assert outputs == pytest.approx([2.0 * 16384 / 32767, 1.0, 0.0], abs=1e-9)
    assert seen(sim, "vel")[0] > 0.3
    assert seen(sim, "omega")[0] > 0.3
    sim.close()


THRUST = """[ thrust 2 -32767 +32767 -2 +2 -1 ] [ elevator 1 -32767 +32767 -1 +1 -1 ]
    [ aileron 0 -32767 +32767 -1 +1 +1 ] [ rudder 3 -32767 +32767 -1 +1 -1 ]"""


class Listener(Autonomy):
    """Hears buttons."""

    heard = Subscribe(JoystickButtons, network="LocalNetwork", topic="joystick_buttons")
    button = State(default=-1.0)

    def step(self, g):
        rows, messages = self.heard.latest()
        for row, pressed in zip(rows, messages.pressed, strict=True):
            self.button[row] = pressed[0] if len(pressed) else -1.0


def test_buttons_are_published_and_channels_reach_controllers(device):
    path, send = device
    wanted = "[ desired_speed 0 0 100 0 10 1 ] [ desired_heading 1 -100 100 -1 1 1 ] [ desired_altitude 2 -100 100 -1 1 1 ]"
    hand = JoystickAutonomy(device=path, axis_map=wanted, publish_button_state=True)
    sim = flight(Unicycle(vel_max=20.0), [UnicyclePID()], [hand, Listener()], 0.1, 0.1, later=1.0)
    send((2, 0, 50), (1, 7, 1), (1, 4, 1), (1, 4, 0))
    sim.step(3)
    assert seen(sim, "vel")[0] == pytest.approx(5.0)
    assert seen(sim, "Listener.button") == 7.0
    sim.close()


def test_an_absent_joystick_is_one_clear_line(tmp_path):
    absent = JoystickController(device=str(tmp_path / "js7"), axis_map=THRUST)
    with pytest.raises(
        PluginError, match=r"js7' cannot be opened: No such file or directory; plug in a joystick"
    ) as error:
        flight(RigidBody6DOF(), [absent], (), 0.1, 0.1)
    assert "\n" not in str(error.value)


def test_a_joystick_that_goes_away_ends_the_world(device, monkeypatch):
    path, _ = device
    sim = flight(RigidBody6DOF(), [JoystickController(device=path, axis_map=THRUST)], (), 0.1, 0.1)

    def gone(*_):
        raise OSError(19, "No such device")

    monkeypatch.setattr(os, "read", gone)
    with pytest.raises(PluginError, match="is gone: No such device"):
        sim.step()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[ thrust 2 -1 1 -1 1 ]", "has 5 numbers; it takes 6"),
        ("[ trust 2 -1 1 -1 1 1 ]", "no channel 'trust'.*thrust"),
        ("[ thrust 2 1 1 -1 1 1 ]", "input_min and input_max are equal"),
        ("", "names no channel"),
    ],
)
def test_what_is_no_axis_map_is_refused(text, message):
    with pytest.raises(ParameterError, match="Joystick.axis_map: .*" + message):
        JoystickController(axis_map=text)
