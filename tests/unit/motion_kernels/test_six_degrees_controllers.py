"""Controllers of vehicles with six degrees of freedom: each reaches and holds what it is told."""

from __future__ import annotations

import math

import numpy as np
import pytest
from six_degrees import Pilot, flight, seen

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, Output
from tussle.errors import MissionError, PluginError, WiringError
from tussle.plugins import stock
from tussle.stock import (
    UUV6DOF,
    AircraftPIDController,
    FixedWing6DOF,
    FixedWing6DOFControllerPID,
    Multirotor,
    MultirotorControllerOmega,
    MultirotorControllerPID,
    RigidBody6DOF,
    RigidBody6DOFControllerPID,
    Still,
    UUV6DOFLinearEnergy,
    UUV6DOFPIDController,
)

RASCAL = stock.load("FixedWing6DOF-Rascal")()


@pytest.mark.parametrize(
    ("motion", "controller", "dt", "speed", "seconds"),
    [
        (RigidBody6DOF(), RigidBody6DOFControllerPID(), 0.05, 30.0, 70.0),
        (FixedWing6DOF(), FixedWing6DOFControllerPID(), 0.02, 220.0, 70.0),
        (RASCAL, FixedWing6DOFControllerPID(), 0.02, 20.0, 70.0),
        (RASCAL, AircraftPIDController(), 0.02, 20.0, 50.0),
    ],
    ids=["body", "skyhawk", "rascal", "rascal-aircraft-pid"],
)
def test_heading_altitude_and_speed_are_held(motion, controller, dt, speed, seconds):
    pilot = Pilot(heading=0.5, altitude=110.0, speed=speed)
    sim = flight(motion, [controller], pilot, dt, seconds, position=(0.0, 0.0, 100.0), speed=speed)
    assert seen(sim, "yaw") == pytest.approx(0.5, abs=0.01)
    assert seen(sim, "pos")[2] == pytest.approx(110.0, abs=0.5)
    assert np.linalg.norm(seen(sim, "vel")) == pytest.approx(speed, abs=0.1)
    assert abs(seen(sim, "roll")) < 0.02


def test_an_aircraft_holds_a_bank():
    roll = Roll()
    entity = Block(
        name="a", position=(0.0, 0.0, 100.0), speed=20.0, autonomy=[Pilot(altitude=100.0, speed=20.0), roll],
        controller=AircraftPIDController(use_roll_control=True), motion=RASCAL,
    )  # fmt: skip
    sim = Simulation(Mission(blocks=[entity], dt=0.02, end=20.0))
    sim.step(900)
    assert seen(sim, "roll") == pytest.approx(-0.4, abs=0.01)
    before = seen(sim, "yaw")
    sim.step(50)
    # A coordinated turn to the left would be g tan(bank) / V; without rudder it slips, which lowers the rate.
    coordinated = 9.81 * math.tan(0.4) / 20.0
    assert 0.8 * coordinated < (seen(sim, "yaw") - before) % (2.0 * math.pi) < coordinated


class Roll(Autonomy):
    """Wants the left wing down."""

    desired_roll = Output(unit="rad")

    def step(self, g):
        self.desired_roll[:] = -0.4


def test_a_multirotor_flies_to_a_velocity_and_heading():
    pilot = Pilot(heading=1.0, vel=(3.0, -2.0, 1.0))
    sim = flight(Multirotor(), [MultirotorControllerPID()], pilot, 0.01, 40.0, position=(0.0, 0.0, 50.0))
    assert seen(sim, "vel") == pytest.approx([3.0, -2.0, 1.0], abs=0.02)
    assert seen(sim, "yaw") == pytest.approx(1.0, abs=0.02)


def test_without_commands_it_hovers_with_any_rotors():
    six = " ".join(
        f"[{'CW' if k % 2 else 'CCW'} {math.cos(k * 1.0472)} {math.sin(k * 1.0472)} 0 0 0 0]"
        for k in range(6)
    )
    motion = Multirotor(rotor_config=six, omega_min=100.0)
    sim = flight(motion, [MultirotorControllerPID()], (), 0.01, 5.0, position=(0.0, 0.0, 50.0))
    assert seen(sim, "pos") == pytest.approx([0.0, 0.0, 50.0], abs=1e-6)
    motors = sim.read("a.MultirotorControllerPID.motors")[0][0, 0]
    assert motors[:6] == pytest.approx([math.sqrt(1.5 * 9.81 / 6.0 / 5.45e-6)] * 6, rel=1e-5)
    assert motors[6:].tolist() == [0.0, 0.0]


def test_rotors_that_cannot_turn_it_are_refused():
    motion = Multirotor(rotor_config="[CW 1 0 0 0 0 0] [CW -1 0 0 0 0 0] [CCW 2 0 0 0 0 0] [CCW 3 0 0 0 0 0]")
    with pytest.raises(
        PluginError, match=r"4 rotors at .* cannot give every thrust, roll, pitch and yaw moment"
    ):
        flight(motion, [MultirotorControllerPID()], (), 0.01, 0.1)


class Pulses(Autonomy):
    """Writes pulse widths and speeds of four rotors."""

    pwm = Output("pwm_0 pwm_1 pwm_2 pwm_3")
    omega = Output("omega_0 omega_1 omega_2 omega_3", unit="rad/s")

    def step(self, g):
        self.pwm[:], self.omega[:] = 1500.0, 700.0


@pytest.mark.parametrize(("command", "omega"), [("pwm", 0.5 * (346.41 + 1200.0)), ("omega", 700.0)])
def test_rotors_are_driven_by_pulse_widths_or_speeds(command, omega):
    sim = flight(Multirotor(c_D=0.0), [MultirotorControllerOmega(command=command)], Pulses(), 0.01, 1.0)
    rise = 4.0 * 5.45e-6 * omega**2 / 1.5 - 9.81
    assert seen(sim, "vel")[2] == pytest.approx(rise, rel=1e-9)


def test_rotors_without_commands_are_an_error():
    with pytest.raises(WiringError, match="no plugin writes channel 'pwm_0' for MultirotorControllerOmega"):
        flight(Multirotor(), [MultirotorControllerOmega()], Pilot(), 0.01, 0.1)


def test_a_controller_of_rotors_needs_a_multirotor():
    with pytest.raises(MissionError, match="MultirotorControllerPID: no plugin offers a service 'airframe'"):
        flight(Still(), [MultirotorControllerPID()], Pilot(), 0.01, 0.1)


def test_remus_dives_to_a_depth_and_turns_to_a_heading_at_its_speed():
    neutral = UUV6DOF(buoyancy=30.479102956 * 9.81)
    pilot = Pilot(heading=0.5, altitude=-25.0, speed=3.0)
    controllers = [UUV6DOFPIDController(), UUV6DOFLinearEnergy()]
    sim = flight(neutral, controllers, pilot, 0.05, 100.0, position=(0.0, 0.0, -20.0), speed=1.0)
    assert seen(sim, "yaw") == pytest.approx(0.5, abs=0.05)
    assert seen(sim, "pos")[2] == pytest.approx(-25.0, abs=0.1)
    assert np.linalg.norm(seen(sim, "vel")) == pytest.approx(1.5, abs=0.02)  # the throttle is at its limit
    assert sim.read("a.UUV6DOFLinearEnergy.energy")[0][0, 0] == pytest.approx(4000.0 - 100.0, abs=0.1)


def test_an_empty_battery_stops_the_propeller():
    battery = UUV6DOFLinearEnergy(energy_initial=2.0, energy_min=0.5)
    sim = flight(
        UUV6DOF(),
        [UUV6DOFPIDController(), battery],
        Pilot(altitude=-20.0, speed=3.0),
        0.05,
        3.0,
        position=(0.0, 0.0, -20.0),
    )
    assert sim.read("a.UUV6DOFLinearEnergy.energy")[0][0, 0] == pytest.approx(0.5, abs=1e-9)
    assert sim.read("a.UUV6DOFLinearEnergy.passed")[0][0, 0, 0] == 0.0
