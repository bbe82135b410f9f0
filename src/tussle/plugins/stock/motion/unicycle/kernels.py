"""The unicycle's laws, RK4 over any number of substeps in closed form, and the output of the state to the body table.

With constant speed and rates the derivative depends on time only, so RK4 is Simpson's rule, and its sum over N substeps
of length h is geometric. For an angle a with rate w and delta = h w / 2:

    h/6 sum_s [cos a_s + 4 cos(a_s + delta) + cos(a_s + 2 delta)] = N h g(delta) cos(a + N delta),
    g(delta) = (2 + cos delta)/3 * sin(N delta) / (N sin delta),

and the same for sin. With pitch, cos(pitch) cos(yaw) is split into the angles yaw + pitch and yaw - pitch. The result
equals RK4 up to rounding (with smaller rounding errors), and 12 substeps cost as much as one. The alternative, rotating
cosine and sine once per substep, is as accurate, but its cost grows with the number of substeps.

The output is computed in blocks of rows, with one scratch array each for angles, sines and cosines: LLVM vectorises only loops over
few arrays, and it recognizes that columns at fixed distances in one array do not overlap.
"""

import math

import numpy as np

from tussle.numeric import atan2, sincos, wrap
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
    """Return delta - k pi in [-pi/2, pi/2], and 1.0 if k is odd else 0.0. This avoids 0/0 in sin(N d)/sin(d) near multiples of pi."""
    k = (delta * INVERSE_PI + ROUNDER) - ROUNDER
    odd = abs(k - 2.0 * ((0.5 * k + ROUNDER) - ROUNDER))
    return (delta - k * PI_HIGH) - k * PI_LOW, odd


@device
def simpson_gain(delta, n, is_even):
    """Return g(delta) of the module's docstring; n: number of substeps; is_even: 1.0 if it is even, else 0.0."""
    folded, odd = fold(delta)
    sine, cosine = sincos(folded)
    sine_n, _ = sincos(n * folded)
    cosine = cosine - 2.0 * odd * cosine
    ratio = 1.0 if (n == 1.0) | (sine == 0.0) else sine_n / (n * sine)
    ratio = ratio - 2.0 * odd * is_even * ratio
    return (2.0 + cosine) * ratio * (1.0 / 3.0)


@device
def towards(sa, ca, sb, cb, plus, minus):
    """East and north of a mean direction, from sine and cosine of the middle yaw a and pitch b and half of Simpson's gains."""
    cc, ss, sc, cs = ca * cb, sa * sb, sa * cb, ca * sb
    return plus * (cc - ss) + minus * (cc + ss), plus * (sc + cs) + minus * (sc - cs)


@device
def flown(yaw, pitch, turn, rise, dt, substeps):
    """Mean direction (east, north, up) over a step of dt [s] that begins at yaw and pitch [rad] and turns at held rates [rad/s]."""
    n, is_even = float(substeps), 1.0 if substeps % 2 == 0 else 0.0
    turned, raised = 0.5 * dt / n * turn, 0.5 * dt / n * rise
    sa, ca = sincos(yaw + 0.5 * dt * turn)
    sb, cb = sincos(pitch + 0.5 * dt * rise)
    plus = 0.5 * simpson_gain(turned + raised, n, is_even)
    minus = 0.5 * simpson_gain(turned - raised, n, is_even)
    east, north = towards(sa, ca, sb, cb, plus, minus)
    return east, north, simpson_gain(raised, n, is_even) * sb


@device
def attitude(yaw, pitch, bank):
    """Return equivalent heading, elevation within [-pi/2, pi/2], and bank of any yaw, pitch and bank [rad]."""
    folded, odd = fold(pitch)
    return wrap(yaw + odd * math.pi), folded - 2.0 * odd * folded, wrap(bank + odd * math.pi)


@device
def bank_of(speed, turn):
    """Bank [rad] of a coordinated turn, right wing down positive."""
    return -atan2(speed * turn, GRAVITY)


@device
def pitched(
    x, y, z, yaw, pitch, speed, turn_rate, pitch_rate, vel_max, turn_rate_max, pitch_rate_max, enable_roll, dt, substeps
):  # fmt: skip
    """Law of the unicycle that pitches: state and body after dt; names, units and frames are the plugin's."""
    v, turn, rise = clamp(speed, vel_max), clamp(turn_rate, turn_rate_max), clamp(pitch_rate, pitch_rate_max)
    east, north, up = flown(yaw, pitch, turn, rise, dt, substeps)
    state = x + v * dt * east, y + v * dt * north, z + v * dt * up, yaw + dt * turn, pitch + dt * rise
    shown = attitude(state[3], state[4], bank_of(v, turn) if enable_roll else 0.0)
    return state, state[2], (v * east, v * north, v * up), *shown


@device
def level(
    x, y, z, yaw, pitch, speed, turn_rate, velocity_z, vel_max, turn_rate_max, velocity_z_max, enable_roll, dt, substeps
):  # fmt: skip
    """Law of the unicycle whose pitch is held and whose climb speed is an input."""
    v, turn, climb = clamp(speed, vel_max), clamp(turn_rate, turn_rate_max), clamp(velocity_z, velocity_z_max)
    east, north, _ = flown(yaw, pitch, turn, 0.0, dt, substeps)
    state = x + v * dt * east, y + v * dt * north, z + dt * climb, yaw + dt * turn, pitch
    shown = attitude(state[3], pitch, bank_of(v, turn) if enable_roll else 0.0)
    return state, state[2], (v * east, v * north, climb), *shown


@device
def put_sincos(angle, m, sine, cosine):
    """Sines and cosines of the first m angles [rad] of a row of scratch."""
    for l in range(m):
        sine[l], cosine[l] = sincos(angle[l])


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
    east, north = towards(sa, ca, sb, cb, plus, minus)
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
                angle[4, l] = 0.5 * bank_of(held[0, l], held[1, l])
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
