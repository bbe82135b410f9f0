"""Unicycle kernels: RK4 over any number of substeps in closed form, and conversion to the body table.

With constant speed and rates the derivative depends on time only, so RK4 is Simpson's rule, and its sum over N substeps
of length h is geometric. For an angle a with rate w and delta = h w / 2:

    h/6 sum_s [cos a_s + 4 cos(a_s + delta) + cos(a_s + 2 delta)] = N h g(delta) cos(a + N delta),
    g(delta) = (2 + cos delta)/3 * sin(N delta) / (N sin delta),

and the same for sin. With pitch, cos(pitch) cos(yaw) is split into the angles yaw + pitch and yaw - pitch. The result
equals RK4 up to rounding (with smaller rounding errors), and 12 substeps cost as much as one. The alternative, rotating
cosine and sine once per substep, is as accurate, but its cost grows with the number of substeps.

Rows are processed in blocks, with one scratch array each for angles, sines and cosines, because LLVM vectorises only loops over
few arrays, and columns at fixed distances in one array are known not to overlap. The operations on a row do not depend on its
index.
"""

from __future__ import annotations

import math

import numpy as np

from tussle.numeric import atan2, sincos
from tussle.numeric.kernel import device, kernel

BLOCK = 128  # rows; the scratch of a block (about 32 kB) fits into the L1 cache
INVERSE_PI = 1.0 / math.pi
ROUNDER = 6755399441055744.0  # 1.5 * 2**52: adding and subtracting it rounds to an integer
PI_HIGH = 2.0 * 1.57079632673412561417  # 33 bits of pi: k * PI_HIGH is exact for |k| < 2**20
PI_LOW = math.pi - PI_HIGH  # exact; the sum of both differs from pi by 1e-16
GRAVITY = 9.81


@device
def clamp(value, limit):
    """Value clamped to [-limit, limit]."""
    return min(max(value, -limit), limit)


@device
def fold(delta):
    """(delta - k pi in [-pi/2, pi/2], 1.0 if k is odd else 0.0), which avoids 0/0 in sin(N d)/sin(d) near multiples of pi."""
    k = (delta * INVERSE_PI + ROUNDER) - ROUNDER
    odd = abs(k - 2.0 * ((0.5 * k + ROUNDER) - ROUNDER))
    return (delta - k * PI_HIGH) - k * PI_LOW, odd


@device
def simpson_gain(sin_delta, cos_delta, sin_n_delta, odd, n, n_is_even):
    """g(delta) of the module docstring, from sines of the folded delta; `odd` is the parity of k, n the number of substeps."""
    cosine = cos_delta - 2.0 * odd * cos_delta
    ratio = sin_n_delta / (n * sin_delta)
    ratio = 1.0 if sin_delta == 0.0 else ratio
    ratio = ratio - 2.0 * odd * n_is_even * ratio
    return (2.0 + cosine) * ratio * (1.0 / 3.0)


@device
def simpson_gain_once(cos_delta, odd):
    """g(delta) for one substep, where the ratio of the sines is 1."""
    return (2.0 + (cos_delta - 2.0 * odd * cos_delta)) * (1.0 / 3.0)


@device
def put_sincos(angle, m, sine, cosine):
    """Sines and cosines of the first m angles [rad] of a row of scratch."""
    for l in range(m):
        sine[l], cosine[l] = sincos(angle[l])


@device
def turn_and_rise(yaw, pitch, first, m, rates, dt, half_h, work):
    """Advance yaw and pitch of a block of rows.

    Writes to `work`: mid-step yaw and pitch, and half the change per substep of yaw + pitch, yaw - pitch and pitch.
    """
    turn_rate, turn_max, pitch_rate, pitch_max = rates
    for l in range(m):
        work[3, l] = clamp(turn_rate[first + l], turn_max[first + l])
    for l in range(m):
        work[4, l] = clamp(pitch_rate[first + l], pitch_max[first + l])
    for l in range(m):
        work[0, l] = yaw[first + l] + 0.5 * dt * work[3, l]
        yaw[first + l] += dt * work[3, l]
    for l in range(m):
        work[1, l] = pitch[first + l] + 0.5 * dt * work[4, l]
        pitch[first + l] += dt * work[4, l]
    for l in range(m):
        turn, raised = half_h * work[3, l], half_h * work[4, l]
        work[2, l] = turn + raised
        work[3, l] = turn - raised
        work[4, l] = raised


@kernel("F2w F2 F2 f8 i8")
def advance_pitch(x, u, p, dt, substeps):
    """Advance unicycles whose pitch rate is commanded, in place.

    Args:
        x: x, y, z [m], yaw, pitch [rad], (5, n), world frame, pitch nose up.
        u: speed [m/s], turn_rate, pitch_rate [rad/s], (3, n).
        p: vel_max [m/s], turn_rate_max, pitch_rate_max [rad/s], further rows unused, (>= 3, n).
        dt: Duration [s].
        substeps: Number of equal RK4 steps in dt.
    """
    east, north, up = x[0], x[1], x[2]
    speed, vel_max, rates = u[0], p[0], (u[1], p[1], u[2], p[2])
    count = float(substeps)
    n_is_even = 1.0 if substeps % 2 == 0 else 0.0
    angle = np.empty((8, BLOCK))
    sine = np.empty((8, BLOCK))
    cosine = np.empty((8, BLOCK))
    gain = np.empty((3, BLOCK))
    length = np.empty(BLOCK)
    n = x.shape[1]
    for first in range(0, n, BLOCK):
        m = min(BLOCK, n - first)
        turn_and_rise(x[3], x[4], first, m, rates, dt, 0.5 * dt / count, angle)
        for l in range(m):
            length[l] = clamp(speed[first + l], vel_max[first + l]) * dt
        for k in range(3):
            delta, n_delta, parity = angle[2 + k], angle[5 + k], gain[k]
            for l in range(m):
                delta[l], parity[l] = fold(delta[l])
                n_delta[l] = count * delta[l]
        for k in range(5 if substeps == 1 else 8):
            put_sincos(angle[k], m, sine[k], cosine[k])
        for k in range(3):
            sin_delta, cos_delta, sin_n_delta, out = sine[2 + k], cosine[2 + k], sine[5 + k], gain[k]
            if substeps == 1:
                for l in range(m):
                    out[l] = simpson_gain_once(cos_delta[l], out[l])
            else:
                for l in range(m):
                    out[l] = simpson_gain(
                        sin_delta[l], cos_delta[l], sin_n_delta[l], out[l], count, n_is_even
                    )
        for l in range(m):
            i = first + l
            cc = cosine[0, l] * cosine[1, l]
            ss = sine[0, l] * sine[1, l]
            sc = sine[0, l] * cosine[1, l]
            cs = cosine[0, l] * sine[1, l]
            plus = 0.5 * gain[0, l]
            minus = 0.5 * gain[1, l]
            east[i] += length[l] * (plus * (cc - ss) + minus * (cc + ss))
            north[i] += length[l] * (plus * (sc + cs) + minus * (sc - cs))
            up[i] += length[l] * (gain[2, l] * sine[1, l])


@kernel("F2w F2 F2 f8 i8")
def advance_level(x, u, p, dt, substeps):
    """Advance unicycles with constant pitch and commanded climb speed, in place.

    Args:
        x: x, y, z [m], yaw, pitch [rad], (5, n), world frame.
        u: speed [m/s], turn_rate [rad/s], velocity_z [m/s], (3, n).
        p: vel_max [m/s], turn_rate_max, pitch_rate_max (unused) [rad/s], velocity_z_max [m/s], (>= 4, n).
        dt: Duration [s].
        substeps: Number of equal RK4 steps in dt.
    """
    east, north, up, yaw, pitch = x[0], x[1], x[2], x[3], x[4]
    speed, turn_rate, velocity_z = u[0], u[1], u[2]
    vel_max, turn_max, velocity_z_max = p[0], p[1], p[3]
    count = float(substeps)
    n_is_even = 1.0 if substeps % 2 == 0 else 0.0
    half_dt = 0.5 * dt
    half_h = half_dt / count
    angle = np.empty(4 * BLOCK)
    sine = np.empty(4 * BLOCK)
    cosine = np.empty(4 * BLOCK)
    parity = np.empty(BLOCK)
    length = np.empty(BLOCK)
    n = x.shape[1]
    for first in range(0, n, BLOCK):
        m = min(BLOCK, n - first)
        for l in range(m):
            i = first + l
            turn = clamp(turn_rate[i], turn_max[i])
            folded, odd = fold(half_h * turn)
            length[l] = clamp(speed[i], vel_max[i]) * dt
            angle[l] = yaw[i] + half_dt * turn
            angle[m + l] = pitch[i]
            angle[2 * m + l] = folded
            angle[3 * m + l] = count * folded
            parity[l] = odd
            yaw[i] += dt * turn
            up[i] += dt * clamp(velocity_z[i], velocity_z_max[i])
        for j in range(4 * m):
            sine[j], cosine[j] = sincos(angle[j])
        for l in range(m):
            i = first + l
            gain = simpson_gain(
                sine[2 * m + l], cosine[2 * m + l], sine[3 * m + l], parity[l], count, n_is_even
            )
            travelled = length[l] * cosine[m + l] * gain
            east[i] += travelled * cosine[l]
            north[i] += travelled * sine[l]


@device
def from_half_angles(sr, cr, sp, cp, sy, cy):
    """Quaternion (w, x, y, z) from sine and cosine of half the roll, quaternion pitch (nose down) and yaw."""
    return (
        cr * (cp * cy) + sr * (sp * sy),
        sr * (cp * cy) - cr * (sp * sy),
        cr * (sp * cy) + sr * (cp * sy),
        cr * (cp * sy) - sr * (sp * cy),
    )


@device
def mean_direction(sy, cy, sp, cp, sd, cd, se, ce):
    """Mean direction (x, y, z) by Simpson's rule over the substep that ends at a yaw and pitch.

    The arguments are sine and cosine of yaw, of pitch (nose up), and of half the change of yaw and of pitch in the substep.
    """
    sa, ca = sy * cd - cy * sd, cy * cd + sy * sd
    sb, cb = sp * ce - cp * se, cp * ce + sp * se
    plus = (2.0 + (cd * ce - sd * se)) * (1.0 / 6.0)
    minus = (2.0 + (cd * ce + sd * se)) * (1.0 / 6.0)
    east = plus * (ca * cb - sa * sb) + minus * (ca * cb + sa * sb)
    north = plus * (sa * cb + ca * sb) + minus * (sa * cb - ca * sb)
    return east, north, (2.0 + ce) * sb * (1.0 / 3.0)


@kernel("F2 (F F F) (F F F) (b1 b1) f8 F2w i8 (i8 i8)")
def to_body(x, commands, limits, flags, h, table, first_row, part):
    """Write position, velocity, attitude and angular velocity to the body table.

    The velocity is the displacement of the last substep over its duration: the mean by Simpson's rule over the arc that
    ends at x, which does not need the previous position.

    Args:
        x: x, y, z [m], yaw, pitch [rad], (5, n), world frame, pitch nose up.
        commands: Commanded speed [m/s], turn rate [rad/s], and pitch rate [rad/s] with use_pitch, else climb speed [m/s], (n,) each.
        limits: Limits of the commands, (n,) each.
        flags: use_pitch; whether the attitude has the bank of a coordinated turn.
        h: Length of the last substep [s].
        table: Body table: position [m], velocity [m/s], quaternion body to world, angular velocity [rad/s], world frame, (>= 13, N);
            written.
        first_row: First row of the group in the table.
        part: First row and end of the rows to write.
    """
    pitches, banks = flags
    begin, end = part
    n = end - begin
    speed, turn_rate, third = commands[0][begin:end], commands[1][begin:end], commands[2][begin:end]
    vel_max, turn_max, third_max = limits[0][begin:end], limits[1][begin:end], limits[2][begin:end]
    yaw, pitch = x[3, begin:end], x[4, begin:end]
    for k in range(3):
        for i in range(begin, end):
            table[k, first_row + i] = x[k, i]
    half_h = 0.5 * h
    angle, sine, cosine = np.empty((5, BLOCK)), np.empty((5, BLOCK)), np.empty((5, BLOCK))
    held, made = (
        np.empty((3, BLOCK)),
        np.empty((10, BLOCK)),
    )  # clamped commands; velocity, quaternion, angular velocity
    sine[4] = 0.0
    cosine[4] = 1.0
    for first in range(0, n, BLOCK):
        m = min(BLOCK, n - first)
        for l in range(m):
            held[0, l] = clamp(speed[first + l], vel_max[first + l])
        for l in range(m):
            held[1, l] = clamp(turn_rate[first + l], turn_max[first + l])
        for l in range(m):
            held[2, l] = clamp(third[first + l], third_max[first + l])
        for l in range(m):
            angle[0, l] = 0.5 * yaw[first + l]
            angle[1, l] = -0.5 * pitch[first + l]
            angle[2, l] = half_h * held[1, l]
        for l in range(m):
            angle[3, l] = half_h * held[2, l] if pitches else 0.0
        if banks:
            for l in range(m):
                angle[4, l] = -0.5 * atan2(held[0, l] * held[1, l], GRAVITY)
        for k in range(5 if banks else 4):
            put_sincos(angle[k], m, sine[k], cosine[k])
        for l in range(m):
            made[3, l], made[4, l], made[5, l], made[6, l] = from_half_angles(
                sine[4, l], cosine[4, l], sine[1, l], cosine[1, l], sine[0, l], cosine[0, l]
            )
        for l in range(m):  # double the angles: half yaw to yaw, half quaternion pitch to pitch (nose up)
            sy, cy, sp, cp = sine[0, l], cosine[0, l], sine[1, l], cosine[1, l]
            sine[0, l], cosine[0, l] = 2.0 * sy * cy, cy * cy - sy * sy
            sine[1, l], cosine[1, l] = -2.0 * sp * cp, cp * cp - sp * sp
        for l in range(m):
            mean_x, mean_y, mean_z = mean_direction(
                sine[0, l],
                cosine[0, l],
                sine[1, l],
                cosine[1, l],
                sine[2, l],
                cosine[2, l],
                sine[3, l],
                cosine[3, l],
            )
            made[0, l] = held[0, l] * mean_x
            made[1, l] = held[0, l] * mean_y
            made[2, l] = held[0, l] * mean_z if pitches else held[2, l]
        for l in range(m):
            raised = held[2, l] if pitches else 0.0
            made[7, l] = raised * sine[0, l]
            made[8, l] = -raised * cosine[0, l]
            made[9, l] = held[1, l]
        for k in range(10):
            out, source = table[3 + k, first_row + begin : first_row + end], made[k]
            for l in range(m):
                out[first + l] = source[l]
