"""Flight of compiled aircraft: commands, steps, and the rigid body in the world frame."""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from tussle.aircraft.constants import EARTH_RATE, ECCENTRICITY_SQUARED
from tussle.aircraft.equations import CORE
from tussle.api.range_kernel import RANGE_STEP
from tussle.numeric import cos, sin
from tussle.numeric.address import caller
from tussle.numeric.dryden import any_altitude, gust, passed
from tussle.numeric.kernel import Kernel, device, kernel
from tussle.numeric.quaternion import quat_multiply, quat_rotate, quat_rotate_inverse
from tussle.numeric.rng import normal2

FOOT = 0.3048  # [m]


BODY, FRAME = 13, 7  # components of the rigid body and of the world frame, before the slots of the aircraft
SLOTS = BODY + FRAME
EARTH_ANGLE = SLOTS + CORE.index("earth_angle")
COMMAND = (
    4  # integers of a command: its input, its slot, a slot that is added or -1, and its index in the numbers
)


GUSTS = 9
"""Rows of the state behind the slots of an aircraft in gusts: five filter states, seed, number of draws, wind at 20 ft [m/s], and
deviation of high gusts [m/s]."""
GUST_STREAM = np.uint64(0x67757374)


@device
def blow(x, row, places, dt):  # type: ignore[no-untyped-def]
    """Advance the gust at an aircraft by a step [s], along its flight through the air.

    Args:
        x: State, (k, n).
        row: Of the aircraft.
        places: Rows of the gust's state, of altitude and ground [ft], of the wind north, east, down, and so of the gust [ft/s], (9,).
        dt: [s].
    """
    own, altitude, ground = places[0], places[1], places[2]
    rx, ry, rz = x[SLOTS + 7, row], x[SLOTS + 8, row], x[SLOTS + 9, row]
    vx, vy, vz = (
        x[SLOTS + 10, row] + EARTH_RATE * ry,
        x[SLOTS + 11, row] - EARTH_RATE * rx,
        x[SLOTS + 12, row],
    )
    axial = math.sqrt(rx * rx + ry * ry)
    away, east = (rx * vx + ry * vy) / axial, (rx * vy - ry * vx) / axial
    # Geodetic latitude, as if on the ground: 5e-6 rad off at 10 km.
    level = (1.0 - ECCENTRICITY_SQUARED) * axial
    size = math.sqrt(level * level + rz * rz)
    sine, cosine = rz / size, level / size
    north = FOOT * (cosine * vz - sine * away - x[places[3], row])
    east = FOOT * (east - x[places[4], row])
    down = FOOT * (-cosine * away - sine * vz - x[places[5], row])
    across = math.sqrt(north * north + east * east)
    path = dt * math.sqrt(across * across + down * down)
    c, s = (north / across, east / across) if across > 0.0 else (1.0, 0.0)
    height = FOOT * (x[altitude, row] - x[ground, row])
    scale_uv, scale_w, sd_uv, sd_w = any_altitude(height, x[own + 7, row], x[own + 8, row])
    seed, count = np.uint64(x[own + 5, row]), np.uint64(x[own + 6, row])
    zero = np.uint64(0)
    d0, d1 = normal2(seed, GUST_STREAM, zero, count, zero, zero)
    d2, d3 = normal2(seed, GUST_STREAM, zero, count, zero, np.uint64(1))
    d4, _ = normal2(seed, GUST_STREAM, zero, count, zero, np.uint64(2))
    u, v1, v2, w1, w2 = passed(
        x[own, row],
        x[own + 1, row],
        x[own + 2, row],
        x[own + 3, row],
        x[own + 4, row],
        path / scale_uv,
        path / scale_w,
        d0,
        d1,
        d2,
        d3,
        d4,
    )
    x[own, row], x[own + 1, row], x[own + 2, row], x[own + 3, row], x[own + 4, row] = u, v1, v2, w1, w2
    x[own + 6, row] += 1.0
    along, side, up = gust(u, v1, v2, w1, w2)
    along, side, up = along * sd_uv / FOOT, side * sd_uv / FOOT, up * sd_w / FOOT
    x[places[6], row], x[places[7], row], x[places[8], row] = c * along - s * side, s * along + c * side, -up


@device
def to_world(x, row):  # type: ignore[no-untyped-def]
    """Write the rigid body of an aircraft from its state; x is (k, n): rigid body, frame, slots, in foot and second."""
    w, a, b, c = x[BODY, row], x[BODY + 1, row], x[BODY + 2, row], x[BODY + 3, row]
    angle = x[EARTH_ANGLE, row]
    turn_w, turn_z = cos(0.5 * angle), -sin(0.5 * angle)
    rx, ry = x[SLOTS + 7, row], x[SLOTS + 8, row]
    vx, vy = x[SLOTS + 10, row] + EARTH_RATE * ry, x[SLOTS + 11, row] - EARTH_RATE * rx
    px, py, pz = quat_rotate(turn_w, 0.0, 0.0, turn_z, rx, ry, x[SLOTS + 9, row])
    vx, vy, vz = quat_rotate(turn_w, 0.0, 0.0, turn_z, vx, vy, x[SLOTS + 12, row])
    x[0, row], x[1, row], x[2, row] = quat_rotate_inverse(
        w, a, b, c, FOOT * px - x[BODY + 4, row], FOOT * py - x[BODY + 5, row], FOOT * pz - x[BODY + 6, row]
    )
    x[3, row], x[4, row], x[5, row] = quat_rotate_inverse(w, a, b, c, FOOT * vx, FOOT * vy, FOOT * vz)
    qw, qx, qy, qz = x[SLOTS, row], x[SLOTS + 1, row], x[SLOTS + 2, row], x[SLOTS + 3, row]
    spin_x, spin_y, spin_z = quat_rotate_inverse(qw, qx, qy, qz, 0.0, 0.0, EARTH_RATE)
    qw, qx, qy, qz = quat_multiply(turn_w, 0.0, 0.0, turn_z, qw, qx, qy, qz)
    qw, qx, qy, qz = quat_multiply(w, -a, -b, -c, qw, qx, qy, qz)
    # From axes forward, right, down to forward, left, up: half a turn about the first.
    x[6, row], x[7, row], x[8, row], x[9, row] = -qx, qw, qz, -qy
    x[10, row] = x[SLOTS + 4, row] - spin_x
    x[11, row], x[12, row] = spin_y - x[SLOTS + 5, row], spin_z - x[SLOTS + 6, row]


@device
def command(x, u, numbers, places, begin, end):  # type: ignore[no-untyped-def]
    """Set the commands of rows; places are the whole numbers of `flight`."""
    for k in range(places[1]):
        at = 2 + COMMAND * k
        given, slot, base, place = places[at], places[at + 1], places[at + 2], places[at + 3]
        unit, low, high = numbers[place], numbers[place + 1], numbers[place + 2]
        for row in range(begin, end):
            value = u[given, row]
            if base >= 0:  # an altitude, from that of the world frame to the aircraft's
                value = x[SLOTS + base, row] + (value - x[2, row]) / unit
            else:
                value = value / unit
            x[SLOTS + slot, row] = min(max(value, low), high)


@cache
def flight() -> Kernel:
    """Return the kernel that flies any compiled aircraft. It is built on first use, because this module must not import the compiler."""
    advance = caller("F2w F i8 i8 i8 f8 f8")

    def fly(x, u, p, numbers, wholes, begin, end, dt, substeps):  # type: ignore[no-untyped-def]
        """Set the commands of rows and make steps.

        Args:
            x: State, (k, n): rigid body, frame, and slots of the aircraft.
            u: Inputs, (m, n).
            p: Parameters; not used.
            numbers: Tables of the aircraft, then unit, lower and upper limit of each command.
            wholes: Address of the aircraft's kernel, number of commands, and those of each.
            begin: First row.
            end: Behind the last row.
            dt: Time to advance [s].
            substeps: Number of steps in it.
        """
        command(x, u, numbers, wholes, begin, end)
        step = dt / substeps
        advance(np.uint64(wholes[0]), x[SLOTS:], numbers, begin, end, substeps, step, step)
        for row in range(begin, end):
            to_world(x, row)

    return kernel(RANGE_STEP)(fly)


@cache
def gusty_flight() -> Kernel:
    """Like `flight`, with gusts that change in each step."""
    advance = caller("F2w F i8 i8 i8 f8 f8")

    def fly_in_gusts(x, u, p, numbers, wholes, begin, end, dt, substeps):  # type: ignore[no-untyped-def]
        """Set the commands of rows and make steps; as in `flight`, but wholes end with what `blow` takes."""
        command(x, u, numbers, wholes, begin, end)
        step = dt / substeps
        places = wholes[2 + COMMAND * wholes[1] :]
        for _ in range(substeps):
            for row in range(begin, end):
                blow(x, row, places, step)
            advance(np.uint64(wholes[0]), x[SLOTS:], numbers, begin, end, 1, step, step)
        for row in range(begin, end):
            to_world(x, row)

    return kernel(RANGE_STEP)(fly_in_gusts)
