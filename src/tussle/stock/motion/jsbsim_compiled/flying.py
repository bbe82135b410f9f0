"""Flight of compiled aircraft: commands, steps, and the rigid body in the world frame."""

from __future__ import annotations

from functools import cache

import numpy as np

from tussle.aircraft.constants import EARTH_RATE
from tussle.aircraft.equations import CORE
from tussle.api.range_kernel import RANGE_STEP
from tussle.numeric import cos, sin
from tussle.numeric.address import caller
from tussle.numeric.kernel import Kernel, device, kernel
from tussle.numeric.quaternion import quat_multiply, quat_rotate, quat_rotate_inverse

FOOT = 0.3048  # [m]


BODY, FRAME = 13, 7  # components of the rigid body and of the world frame, before the slots of the aircraft
SLOTS = BODY + FRAME
EARTH_ANGLE = SLOTS + CORE.index("earth_angle")
COMMAND = (
    4  # integers of a command: its input, its slot, a slot that is added or -1, and its index in the numbers
)


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
        for k in range(wholes[1]):
            at = 2 + COMMAND * k
            given, slot, base, place = wholes[at], wholes[at + 1], wholes[at + 2], wholes[at + 3]
            unit, low, high = numbers[place], numbers[place + 1], numbers[place + 2]
            for row in range(begin, end):
                value = u[given, row]
                if base >= 0:  # an altitude, from that of the world frame to the aircraft's
                    value = x[SLOTS + base, row] + (value - x[2, row]) / unit
                else:
                    value = value / unit
                x[SLOTS + slot, row] = min(max(value, low), high)
        step = dt / substeps
        advance(np.uint64(wholes[0]), x[SLOTS:], numbers, begin, end, substeps, step, step)
        for row in range(begin, end):
            to_world(x, row)

    return kernel(RANGE_STEP)(fly)
