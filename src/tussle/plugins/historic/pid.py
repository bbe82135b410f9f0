"""SCRIMMAGE's PID loop: the first call differentiates from an error of 0, and the difference of two angles is not wrapped."""

from __future__ import annotations

from typing import Any

from tussle.numeric.kernel import device
from tussle.plugins.historic.angles import angle_pi

MIN_DT = 1e-9
"""Least time that a difference is divided by [s]."""


@device
def pid_loop(error: Any, gains: Any, memory: Any, dt: Any) -> Any:
    """Return the command and the new memory of a PID loop.

    Args:
        error: Desired minus measured value.
        gains: kp, ki, kd, band.
        memory: Integral, last error (0 before the first call), and 1.0 after the first call.
        dt: Time since the last call [s].
    """
    kp, ki, kd, band = gains
    integral, last, _ = memory
    integral = 0.0 if abs(error) > band else integral + error * dt
    command = kp * error + ki * integral + kd * ((error - last) / max(MIN_DT, dt))
    return command, (integral, error, 1.0)


@device
def pid_angle_loop(error: Any, gains: Any, memory: Any, dt: Any) -> Any:
    """Like `pid_loop`, for an angle [rad]: the error is wrapped to (-pi, pi] by `angle_pi`, its difference is not."""
    return pid_loop(angle_pi(error), gains, memory, dt)


@device
def clamp(value: Any, limit: Any) -> Any:
    """Value clamped to [-limit, limit]."""
    return min(max(value, -limit), limit)
