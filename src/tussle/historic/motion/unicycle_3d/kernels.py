"""Kernel of SCRIMMAGE's Unicycle3D: RK4 on the turn since the start."""

from __future__ import annotations

import math

from tussle.numeric.kernel import device, kernel


@device
def multiply(aw, ax, ay, az, bw, bx, by, bz):
    """Hamilton product a b."""
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


@device
def normalize(w, a, b, c):
    """The quaternion scaled to length 1."""
    length = math.sqrt(w * w + a * a + b * b + c * c)
    return w / length, a / length, b / length, c / length


@device
def rates(w, a, b, c, sw, sa, sb, sc, bank, dive, turn, speed):
    """Derivative of (relative quaternion, position) for a start attitude s."""
    pull = 1.0 - (w * w + a * a + b * b + c * c)
    nw, na, nb, nc = normalize(w, a, b, c)
    ow, oa, ob, oc = multiply(nw, na, nb, nc, sw, sa, sb, sc)
    return (
        -0.5 * (a * bank + b * dive + c * turn) + pull * w,
        0.5 * (w * bank + b * turn - c * dive) + pull * a,
        0.5 * (w * dive + c * bank - a * turn) + pull * b,
        0.5 * (w * turn + a * dive - b * bank) + pull * c,
        speed * (1.0 - 2.0 * (ob * ob + oc * oc)),
        speed * 2.0 * (oa * ob + ow * oc),
        speed * 2.0 * (oa * oc - ow * ob),
    )


@device
def ahead(q, k, h):
    """Quaternion q moved along the derivative k for h."""
    return q[0] + h * k[0], q[1] + h * k[1], q[2] + h * k[2], q[3] + h * k[3]


@kernel("F2w F2 F2 f8 i8")
def advance(x, u, p, dt, substeps):
    """Advance all rows, in place.

    Args:
        x: x, y, z [m], quaternion body to world, speed [m/s], inverse of the start attitude, (12, n).
        u: speed [m/s], turn_rate, pitch_rate, roll_rate [rad/s], (4, n).
        p: Their limits, (4, n).
        dt: Duration [s].
        substeps: Number of equal RK4 steps in dt.
    """
    h = dt / substeps
    for i in range(x.shape[1]):
        speed = min(max(u[0, i], -p[0, i]), p[0, i])
        turn = min(max(u[1, i], -p[1, i]), p[1, i])
        dive = -min(max(u[2, i], -p[2, i]), p[2, i])
        bank = min(max(u[3, i], -p[3, i]), p[3, i])
        sw, sa, sb, sc = x[8, i], -x[9, i], -x[10, i], -x[11, i]
        for _ in range(substeps):
            q = multiply(x[3, i], x[4, i], x[5, i], x[6, i], sw, -sa, -sb, -sc)
            k1 = rates(*q, sw, sa, sb, sc, bank, dive, turn, speed)
            k2 = rates(*ahead(q, k1, 0.5 * h), sw, sa, sb, sc, bank, dive, turn, speed)
            k3 = rates(*ahead(q, k2, 0.5 * h), sw, sa, sb, sc, bank, dive, turn, speed)
            k4 = rates(*ahead(q, k3, h), sw, sa, sb, sc, bank, dive, turn, speed)
            for j in range(3):
                x[j, i] += h / 6.0 * (k1[4 + j] + 2.0 * k2[4 + j] + 2.0 * k3[4 + j] + k4[4 + j])
            w = q[0] + h / 6.0 * (k1[0] + 2.0 * k2[0] + 2.0 * k3[0] + k4[0])
            a = q[1] + h / 6.0 * (k1[1] + 2.0 * k2[1] + 2.0 * k3[1] + k4[1])
            b = q[2] + h / 6.0 * (k1[2] + 2.0 * k2[2] + 2.0 * k3[2] + k4[2])
            c = q[3] + h / 6.0 * (k1[3] + 2.0 * k2[3] + 2.0 * k3[3] + k4[3])
            w, a, b, c = normalize(w, a, b, c)
            w, a, b, c = multiply(w, a, b, c, sw, sa, sb, sc)
            x[3, i], x[4, i], x[5, i], x[6, i] = normalize(w, a, b, c)
        x[7, i] = speed
