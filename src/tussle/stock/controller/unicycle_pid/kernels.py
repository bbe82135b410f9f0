"""The control law of UnicyclePID. Rows are processed in blocks of scratch so that arc tangents and wraps are vectorised."""

from __future__ import annotations

import math

import numpy as np

from tussle.numeric import atan2, wrap
from tussle.numeric.kernel import kernel
from tussle.numeric.pid import pid

BLOCK = 128  # rows


@kernel("(F F F) (F F F F) (F F F) (F2 F2 F2 F2) F2w f8 (Fw Fw Fw Fw Fw)")
def steer(wanted, motion, attitude, gains, memory, dt, commands):
    """Run the heading, pitch, roll and speed loops once.

    Args:
        wanted: Desired altitude [m], speed [m/s] and heading [rad], (n,) each.
        motion: Altitude [m] and velocity [m/s], world frame, (n,) each.
        attitude: Heading, elevation (nose up), bank (right wing down) [rad], (n,) each.
        gains: kp, ki, kd and band of heading, pitch, roll and speed, (4, n) each.
        memory: Integral and last error of heading, pitch, roll and speed, and 1.0 once the last errors are valid, (9, n),
            updated in place.
        dt: Time since the last call [s].
        commands: Desired speed, passed through [m/s], acceleration of the speed loop [m/s^2], turn, pitch and roll rate [rad/s],
            (n,) each, written.
    """
    altitude, speed, heading = wanted
    z, vx, vy, vz = motion
    yaw, climb, roll = attitude
    out_speed, acceleration, turn_rate, pitch_rate, roll_rate = commands
    outs = turn_rate, pitch_rate, roll_rate, acceleration
    rise = np.empty(BLOCK)
    run = np.empty(BLOCK)
    error = np.empty((4, BLOCK))
    change = np.empty((4, BLOCK))
    seen = memory[8]
    n = speed.shape[0]
    for first in range(0, n, BLOCK):
        m = min(BLOCK, n - first)
        for l in range(m):
            i = first + l
            rise[l] = (altitude[i] - z[i]) * speed[i]
            run[l] = speed[i] * speed[i]
        for l in range(m):
            error[1, l] = atan2(rise[l], run[l]) - climb[first + l]
        for l in range(m):
            error[0, l] = wrap(heading[first + l] - yaw[first + l])
            error[2, l] = -roll[first + l]
        for l in range(m):
            i = first + l
            error[3, l] = speed[i] - math.sqrt(vx[i] * vx[i] + vy[i] * vy[i] + vz[i] * vz[i])
        for k in range(4):
            last = memory[2 * k + 1]
            for l in range(m):
                i = first + l
                change[k, l] = seen[i] * (error[k, l] - last[i])
                last[i] = error[k, l]
        for l in range(m):
            change[0, l] = wrap(change[0, l])
            change[2, l] = wrap(change[2, l])
            seen[first + l] = 1.0
        for k in range(4):
            out, integral = outs[k], memory[2 * k]
            kp, ki, kd, band = gains[k][0], gains[k][1], gains[k][2], gains[k][3]
            for l in range(m):
                i = first + l
                out[i], integral[i] = pid(
                    error[k, l], change[k, l], dt, kp[i], ki[i], kd[i], band[i], integral[i]
                )
    for i in range(n):
        out_speed[i] = speed[i]
