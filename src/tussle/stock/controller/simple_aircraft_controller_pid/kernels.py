"""The control law of SimpleAircraftControllerPID."""

from __future__ import annotations

import math

import numpy as np

from tussle.numeric import atan2, wrap
from tussle.numeric.kernel import kernel
from tussle.numeric.pid import pid

BLOCK = 128  # rows


@kernel("(F F F) (F F F F) F (b1 b1) (F2 F2 F2) F2w f8 (Fw Fw Fw)")
def steer(wanted, motion, angle, flags, gains, memory, dt, commands):
    """Run the lateral, vertical and speed loops once.

    Args:
        wanted: Desired heading, or with use_roll bank (right wing down) [rad]; altitude [m], or with use_glide_slope slope of the
            descent [rad]; speed [m/s], (n,) each.
        motion: Altitude [m] and velocity [m/s], world frame, (n,) each.
        angle: Heading, or with use_roll bank (right wing down) [rad], (n,).
        flags: use_roll, whether the lateral loop holds a bank; use_glide_slope, whether the vertical loop holds a slope.
        gains: kp, ki, kd and band of the lateral, vertical and speed loop, (4, n) each.
        memory: Integral and last error of the lateral, vertical and speed loop, and 1.0 once the last errors are valid, (7,
            n), updated in place.
        dt: Time since the last call [s].
        commands: Throttle [-]; roll rate [rad/s], positive into a left turn; pitch rate [rad/s], nose up; (n,) each, written.
    """
    lateral, vertical, speed = wanted
    z, vx, vy, vz = motion
    use_roll, use_glide_slope = flags
    throttle, roll_rate, pitch_rate = commands
    error = np.empty((3, BLOCK))
    change = np.empty((3, BLOCK))
    # A bank to the right needs a negative roll rate of the model, a steeper descent a negative pitch rate.
    lateral_sign = -1.0 if use_roll else 1.0
    vertical_sign = -1.0 if use_glide_slope else 1.0
    seen = memory[6]
    n = speed.shape[0]
    for first in range(0, n, BLOCK):
        m = min(BLOCK, n - first)
        for l in range(m):
            i = first + l
            error[0, l] = wrap(lateral[i] - angle[i])
            error[2, l] = speed[i] - math.sqrt(vx[i] * vx[i] + vy[i] * vy[i] + vz[i] * vz[i])
        if use_glide_slope:
            for l in range(m):
                i = first + l
                error[1, l] = vertical[i] - atan2(-vz[i], math.sqrt(vx[i] * vx[i] + vy[i] * vy[i]))
        else:
            for l in range(m):
                error[1, l] = vertical[first + l] - z[first + l]
        for k in range(3):
            last = memory[2 * k + 1]
            for l in range(m):
                i = first + l
                change[k, l] = seen[i] * (error[k, l] - last[i])
                last[i] = error[k, l]
        for l in range(m):
            change[0, l] = wrap(change[0, l])
            seen[first + l] = 1.0
        for k in range(3):
            out = roll_rate if k == 0 else pitch_rate if k == 1 else throttle
            sign = lateral_sign if k == 0 else vertical_sign if k == 1 else 1.0
            integral = memory[2 * k]
            kp, ki, kd, band = gains[k][0], gains[k][1], gains[k][2], gains[k][3]
            for l in range(m):
                i = first + l
                command, integral[i] = pid(
                    error[k, l], change[k, l], dt, kp[i], ki[i], kd[i], band[i], integral[i]
                )
                out[i] = sign * command
