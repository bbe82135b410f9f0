"""Controllers of aircraft in JSBSim."""

from __future__ import annotations

import math
from typing import Any, ClassVar

from tussle.api import Controller, HistoricAttributes, Input, Output, Param, State, row_law
from tussle.numeric.pid import pid_angle_loop

GAINS = "kp ki kd band"
UNITS, TEXT_UNITS = "1 1/s s rad", "1 1/s s deg"
LOOP = "integral error has_error"
LOOP_DOC = "integral, last error, and 1 after the first call."
SIDE = (2.0, 0.5, 0.0, math.radians(4.5))


class JSBSimModelControllerDirect(Controller):
    """Passes bank, altitude and speed from the autonomies to a JSBSimModel unchanged, as a DirectController does."""

    grade = "portable"
    historic_attributes = HistoricAttributes(unread=("use_pitch",))
    passthrough: ClassVar[bool] = True


class JSBSimModelControllerHeadingPID(Controller):
    """Controls the heading of a JSBSimModel by its bank; altitude and speed go to the autopilot.

    The integral of the loop is zero while its error exceeds `band`.

    Differences from SCRIMMAGE: the error is that of the heading, also after a large change (there, the desired heading was
    delayed by a filter whose gain depended on the step); the first call has no derivative kick.
    """

    grade = "portable"
    historic_attributes = HistoricAttributes(unread=("gain",))

    heading_pid = Param(
        (1.0, 0.5, 0.0, math.radians(4.5)), fields=GAINS, unit=UNITS, text_unit=TEXT_UNITS, doc="Heading to bank."
    )  # fmt: skip
    max_bank = Param(math.radians(45.0), unit="rad", text_unit="deg", ge=0.0, doc="Largest bank.")
    desired_heading = Input(unit="rad", doc="Desired heading, counter-clockwise from East.")
    altitude_in = Input("desired_altitude", unit="m", doc="Desired altitude, passed on.")
    speed_in = Input("desired_speed", unit="m/s", doc="Desired speed, passed on.")
    desired_roll = Output(unit="rad", doc="Desired bank, right wing down.")
    altitude_out = Output("desired_altitude", unit="m", doc="Desired altitude.")
    speed_out = Output("desired_speed", unit="m/s", doc="Desired speed.")
    heading = State(LOOP, doc="Of the heading: " + LOOP_DOC)

    @row_law("desired_roll", "altitude_out", "speed_out", "heading")
    @staticmethod
    def turn(
        desired_heading: float, altitude_in: float, speed_in: float, yaw: float, heading_pid: Any, max_bank: float, heading: Any,
        dt: float,
    ) -> Any:  # fmt: skip
        """Heading loop; a turn to the left needs the left wing down."""
        command, heading = pid_angle_loop(desired_heading - yaw, heading_pid, heading, dt)
        return -min(max(command, -max_bank), max_bank), altitude_in, speed_in, heading


class JSBSimControlControllerHeadingPID(Controller):
    """Holds the wings and the nose of a JSBSimControl level, and turns it by the rudder; the throttle is a parameter.

    The integral of a loop is zero while its error exceeds `band`. For altitude and speed take AircraftPIDController or GoTo.

    Differences from SCRIMMAGE: desired and flown heading are both counter-clockwise from East (there, one was a compass
    heading); the throttle is written (there, never); commands are limited to [-1, 1].
    """

    grade = "portable"
    historic_attributes = HistoricAttributes(unread=("gain",))

    roll_pid = Param(
        (10.0, 0.5, 0.0, math.radians(4.5)), fields=GAINS, unit=UNITS, text_unit=TEXT_UNITS, doc="Bank to aileron."
    )  # fmt: skip
    pitch_pid = Param(SIDE, fields=GAINS, unit=UNITS, text_unit=TEXT_UNITS, doc="Elevation to elevator.")
    yaw_pid = Param(SIDE, fields=GAINS, unit=UNITS, text_unit=TEXT_UNITS, doc="Heading to rudder.")
    cruise_throttle = Param(0.75, ge=0.0, le=1.0, doc="Throttle.")
    desired_heading = Input(unit="rad", doc="Desired heading, counter-clockwise from East.")
    throttle = Output(doc="Throttle.")
    elevator = Output(doc="Elevator, nose down positive.")
    aileron = Output(doc="Aileron, right wing down positive.")
    rudder = Output(doc="Rudder, nose left positive.")
    bank = State(LOOP, doc="Of the bank: " + LOOP_DOC)
    elevation = State(LOOP, doc="Of the elevation: " + LOOP_DOC)
    heading = State(LOOP, doc="Of the heading: " + LOOP_DOC)

    @row_law("throttle", "elevator", "aileron", "rudder", "bank", "elevation", "heading")
    @staticmethod
    def hold(
        desired_heading: float, yaw: float, roll: float, climb: float, roll_pid: Any, pitch_pid: Any, yaw_pid: Any,
        cruise_throttle: float, bank: Any, elevation: Any, heading: Any, dt: float,
    ) -> Any:  # fmt: skip
        """The three loops."""
        aileron, bank = pid_angle_loop(-roll, roll_pid, bank, dt)
        lift, elevation = pid_angle_loop(-climb, pitch_pid, elevation, dt)
        turn, heading = pid_angle_loop(desired_heading - yaw, yaw_pid, heading, dt)
        return (
            cruise_throttle, -min(max(lift, -1.0), 1.0), min(max(aileron, -1.0), 1.0), min(max(turn, -1.0), 1.0), bank, elevation,
            heading,
        )  # fmt: skip
