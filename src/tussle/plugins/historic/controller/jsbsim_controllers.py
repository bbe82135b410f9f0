"""The heading controllers of aircraft in JSBSim, as in SCRIMMAGE."""

from __future__ import annotations

import math
from typing import Any

from tussle.api import State, row_law
from tussle.numeric.kernel import device
from tussle.plugins.historic.angles import angle_2pi, angle_pi
from tussle.plugins.historic.pid import clamp, pid_angle_loop
from tussle.plugins.stock.controller import jsbsim_controllers

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
