"""Controllers of aeroplanes, as in SCRIMMAGE."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from tussle.api import GroupView, State, row_law
from tussle.numeric import atan2
from tussle.numeric.kernel import device
from tussle.plugins.historic.angles import angle_2pi, angle_pi
from tussle.plugins.historic.pid import clamp, pid_angle_loop, pid_loop
from tussle.plugins.stock.controller import (
    aircraft_pid_controller,
    fixed_wing_6dof_controller_pid,
    jsbsim_controllers,
    simple_aircraft_controller_pid,
)


class AircraftPIDController(aircraft_pid_controller.AircraftPIDController):
    """AircraftPIDController whose altitude error times its gain is the elevation, without regard to the angle of attack.

    With SCRIMMAGE's loops (module `historic.pid`). In tussle the altitude error commands a climb speed, and the elevation is that of
    the path plus an integrated trim, so that the aircraft does not pitch between its limits.
    """

    @row_law("aileron", "heading", "bank")
    @staticmethod
    def turn(
        desired_heading: float, yaw: float, roll: float, max_roll: float, heading_pid: Any, roll_pid: Any, heading: Any, bank: Any,
        dt: float,
    ) -> Any:  # fmt: skip
        """Heading loop and bank loop."""
        command, heading = pid_angle_loop(desired_heading - yaw, heading_pid, heading, dt)
        aileron, bank = pid_angle_loop(clamp(-command, max_roll) - roll, roll_pid, bank, dt)
        return clamp(aileron, 1.0), heading, bank

    @row_law("aileron", "bank")
    @staticmethod
    def hold_bank(
        desired_roll: float, roll: float, max_roll: float, roll_pid: Any, bank: Any, dt: float
    ) -> Any:
        """Bank loop."""
        aileron, bank = pid_angle_loop(clamp(desired_roll, max_roll) - roll, roll_pid, bank, dt)
        return clamp(aileron, 1.0), bank

    @row_law("elevator", "altitude", "elevation")
    @staticmethod
    def rise(
        desired_altitude: float, pos_z: float, climb: float, max_pitch: float, altitude_pid: Any, pitch_pid: Any,
        altitude: Any, elevation: Any, dt: float,
    ) -> Any:  # fmt: skip
        """Altitude loop and elevation loop; angles nose down."""
        command, altitude = pid_loop(desired_altitude - pos_z, altitude_pid, altitude, dt)
        elevator, elevation = pid_angle_loop(clamp(-command, max_pitch) + climb, pitch_pid, elevation, dt)
        return clamp(elevator, 1.0), altitude, elevation

    @row_law("throttle", "rudder", "forward")
    @staticmethod
    def push(desired_speed: float, vel: Any, speed_pid: Any, forward: Any, dt: float) -> Any:
        """Speed loop."""
        vx, vy, vz = vel
        command, forward = pid_loop(
            desired_speed - math.sqrt(vx * vx + vy * vy + vz * vz), speed_pid, forward, dt
        )
        return clamp(command, 1.0), 0.0, forward


RUDDER, AILERON, PULSE = 0.26, 0.5, 0.4
RUDDER_FROM, AILERON_FROM = 2.0, 8.0


class FixedWing6DOFControllerPID(fixed_wing_6dof_controller_pid.FixedWing6DOFControllerPID):
    """FixedWing6DOFControllerPID that moves the rudder from 2 s to 2.8 s and the aileron from 8 s to 8.8 s, and nothing else.

    In SCRIMMAGE it is a stub. In tussle it holds heading, altitude and speed.
    """

    grade = "machine"

    def step(self, g: GroupView) -> None:
        """Move rudder and aileron."""
        self.throttle[:] = self.elevator[:] = 0.0
        self.rudder[:] = RUDDER * _doublet(g.t, RUDDER_FROM)
        self.aileron[:] = AILERON * _doublet(g.t, AILERON_FROM)


def _doublet(t: np.ndarray, begin: float) -> np.ndarray:
    """-1 for 0.4 s from `begin` on, then 1 for 0.4 s; else 0."""
    is_down, is_up = (t >= begin) & (t <= begin + PULSE), (t > begin + PULSE) & (t <= begin + 2.0 * PULSE)
    return np.where(is_down, -1.0, np.where(is_up, 1.0, 0.0))


REVERSAL = 2.35619
"""Change of the heading from which it is filtered [rad]."""
FILTER = 0.75
"""Gain of the filter [1/s]."""


@device
def compass(angle: Any) -> Any:
    """Heading from North, clockwise, of an angle counter-clockwise from East [rad], in (-pi, pi]."""
    return angle_pi(0.5 * math.pi - angle_2pi(angle))


class JSBSimModelControllerHeadingPID(jsbsim_controllers.JSBSimModelControllerHeadingPID):
    """JSBSimModelControllerHeadingPID with SCRIMMAGE's loop, of compass headings.

    Where the desired heading differs by more than 135 degrees from the flown one, it follows a filter whose gain is 0.75 dt.
    """

    last_desired = State(unit="rad", doc="Desired compass heading after the filter.")

    @row_law("desired_roll", "altitude_out", "speed_out", "heading", "last_desired")
    @staticmethod
    def turn(
        desired_heading: float, altitude_in: float, speed_in: float, yaw: float, heading_pid: Any, max_bank: float, heading: Any,
        last_desired: float, dt: float,
    ) -> Any:  # fmt: skip
        """Heading loop; a turn to the right needs the right wing down."""
        desired, flown = compass(desired_heading), compass(yaw)
        gain = FILTER * dt if angle_pi(abs(desired - flown)) > REVERSAL else 1.0
        has_begun = heading[2] > 0.0
        filtered = desired * gain + (1.0 - gain) * last_desired if has_begun else desired
        command, heading = pid_angle_loop(filtered - flown, heading_pid, heading, dt)
        return clamp(command, max_bank), altitude_in, speed_in, heading, filtered


class JSBSimControlControllerHeadingPID(jsbsim_controllers.JSBSimControlControllerHeadingPID):
    """JSBSimControlControllerHeadingPID with SCRIMMAGE's loops: a compass heading is desired and one from East is flown.

    The elevator has the sign that lets the nose go on; commands have no limits; the throttle is never written.
    """

    @row_law("throttle", "elevator", "aileron", "rudder", "bank", "elevation", "heading")
    @staticmethod
    def hold(
        desired_heading: float, yaw: float, roll: float, climb: float, roll_pid: Any, pitch_pid: Any, yaw_pid: Any,
        cruise_throttle: float, bank: Any, elevation: Any, heading: Any, dt: float,
    ) -> Any:  # fmt: skip
        """The three loops."""
        aileron, bank = pid_angle_loop(-roll, roll_pid, bank, dt)
        lift, elevation = pid_angle_loop(climb, pitch_pid, elevation, dt)
        turn, heading = pid_angle_loop(angle_2pi(compass(desired_heading)) - yaw, yaw_pid, heading, dt)
        return 0.0, -lift, angle_pi(aileron), -turn, bank, elevation, heading


__all__ = ["JSBSimControlControllerHeadingPID", "JSBSimModelControllerHeadingPID"]


class SimpleAircraftControllerPID(simple_aircraft_controller_pid.SimpleAircraftControllerPID):
    """SimpleAircraftControllerPID with SCRIMMAGE's loops (`tussle.plugins.historic.pid`).

    The derivative has a kick in the first call, and where the heading error passes from pi to -pi.
    """

    @row_law("roll_rate", "lateral")
    @staticmethod
    def turn(desired_heading: float, yaw: float, heading_pid: Any, lateral: Any, dt: float) -> Any:
        """Heading loop."""
        return pid_angle_loop(desired_heading - yaw, heading_pid, lateral, dt)

    @row_law("roll_rate", "lateral")
    @staticmethod
    def bank(desired_roll: float, roll: float, heading_pid: Any, lateral: Any, dt: float) -> Any:
        """Bank loop."""
        command, lateral = pid_angle_loop(desired_roll - roll, heading_pid, lateral, dt)
        return -command, lateral

    @row_law("pitch_rate", "vertical")
    @staticmethod
    def rise(desired_altitude: float, pos_z: float, alt_pid: Any, vertical: Any, dt: float) -> Any:
        """Altitude loop."""
        return pid_loop(desired_altitude - pos_z, alt_pid, vertical, dt)

    @row_law("pitch_rate", "vertical")
    @staticmethod
    def glide(desired_glide_slope: float, vel: Any, alt_pid: Any, vertical: Any, dt: float) -> Any:
        """Slope loop; the published climb of SimpleAircraft has the wrong sign."""
        vx, vy, vz = vel
        slope = atan2(vz, math.sqrt(vx * vx + vy * vy))
        command, vertical = pid_loop(desired_glide_slope - slope, alt_pid, vertical, dt)
        return -command, vertical

    @row_law("throttle", "forward")
    @staticmethod
    def push(desired_speed: float, vel: Any, vel_pid: Any, forward: Any, dt: float) -> Any:
        """Speed loop."""
        vx, vy, vz = vel
        return pid_loop(desired_speed - math.sqrt(vx * vx + vy * vy + vz * vz), vel_pid, forward, dt)
