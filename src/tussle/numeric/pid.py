"""One step of a PID law with an integral band, for controllers."""

import math

from tussle.numeric.elementary import atan2, wrap
from tussle.numeric.kernel import device


@device
def pid(error, change, dt, kp, ki, kd, band, integral):
    """Return the command and the new integral of one PID step.

    u = kp e + ki I + kd de/dt; the integral is reset to 0 while |e| > band, which keeps it from winding up far from the
    goal.

    Args:
        error: Desired minus measured value e; of an angle, wrapped to (-pi, pi].
        change: Change of the error since the last call (of an angle, wrapped too); 0 at the first call, so that the
            desired value itself is not differentiated (no kick).
        dt: Time since the last call [s], > 0.
        kp: Gain on the error.
        ki: Gain on the integral.
        kd: Gain on the derivative.
        band: Largest |e| at which the integral grows.
        integral: I of the last call [unit of e times s].

    Returns:
        (u, I) with the integral of this call.
    """
    grown = integral + error * dt
    integral = grown if abs(error) <= band else 0.0
    return kp * error + ki * integral + kd * (change / dt), integral


@device
def pid_loop(error, gains, memory, dt):
    """Return the command and the new memory of a PID loop.

    Args:
        error: Desired minus measured value.
        gains: kp, ki, kd, band.
        memory: Integral, last error, and 1.0 once there is a last error.
        dt: Time since the last call [s].
    """
    kp, ki, kd, band = gains
    integral, last, has_error = memory
    command, integral = pid(error, has_error * (error - last), dt, kp, ki, kd, band, integral)
    return command, (integral, error, 1.0)


@device
def pid_angle_loop(error, gains, memory, dt):
    """Like `pid_loop`, for an angle [rad]: error and change are wrapped to (-pi, pi]."""
    kp, ki, kd, band = gains
    integral, last, has_error = memory
    error = wrap(error)
    command, integral = pid(error, wrap(has_error * (error - last)), dt, kp, ki, kd, band, integral)
    return command, (integral, error, 1.0)


TRIM_TIME = 2.0
"""Time constant [s] of the trim in `slope_error`: slower than an aircraft pitches."""
TRIM_MAX = 0.5
"""Largest trim [rad], so that it does not wind up where the slope cannot be flown."""


@device
def slope_error(slope, climb, vel, trim, dt):
    """Return the error of the elevation that flies a slope, and the new trim.

    The desired elevation is the slope plus the trim, which becomes the angle of attack: it is the integral of the error of the slope.
    So the loop of the elevation is fast, and no error of the slope remains.

    Args:
        slope: Desired slope of the path [rad].
        climb: Elevation [rad].
        vel: Velocity [m/s], world frame.
        trim: Trim of the last call [rad].
        dt: Time since the last call [s].
    """
    vx, vy, vz = vel
    trim = trim + min(dt / TRIM_TIME, 1.0) * (slope - atan2(vz, math.sqrt(vx * vx + vy * vy)))
    trim = min(max(trim, -TRIM_MAX), TRIM_MAX)
    return slope + trim - climb, trim
