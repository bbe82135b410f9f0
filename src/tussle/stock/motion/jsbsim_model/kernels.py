"""Conversion of the states of JSBSim to the world frame."""

from __future__ import annotations

import math

from tussle.geodesy import ECCENTRICITY_SQUARED, SEMI_MAJOR
from tussle.numeric import cos, sin
from tussle.numeric.kernel import device, kernel
from tussle.numeric.quaternion import quat_multiply, quat_rotate, quat_rotate_inverse
from tussle.stock.motion.jsbsim_model.units import FOOT


@device
def turn(angle):
    """Sine and cosine of half an angle [rad]."""
    return sin(0.5 * angle), cos(0.5 * angle)


@device
def earth_centred(latitude, longitude, altitude):
    """Earth-centred position [m] of a geodetic place [rad, m]."""
    s, c = sin(latitude), cos(latitude)
    normal = SEMI_MAJOR / math.sqrt(1.0 - ECCENTRICITY_SQUARED * s * s)
    out = (normal + altitude) * c
    return out * cos(longitude), out * sin(longitude), (normal * (1.0 - ECCENTRICITY_SQUARED) + altitude) * s


@device
def local_frame(latitude, longitude):
    """Quaternion that turns vectors north, east, down at a geodetic place [rad] to Earth-centred ones."""
    s, c = turn(longitude)
    t, d = turn(-0.5 * math.pi - latitude)
    return quat_multiply(c, 0.0, 0.0, s, d, 0.0, t, 0.0)


@device
def from_world(latitude, longitude):
    """Quaternion that turns vectors east, north, up at a geodetic place [rad] to Earth-centred ones."""
    w, x, y, z = local_frame(latitude, longitude)
    half = math.sqrt(0.5)
    return quat_multiply(w, x, y, z, 0.0, half, half, 0.0)


@kernel("F2 (f8 f8 f8) I F2w")
def to_rigid_bodies(read, origin, rows, out):
    """Write the states of some rigid bodies.

    Args:
        read: Latitude, longitude [rad], altitude [ft], roll, pitch, yaw [rad], velocity north, east, down [ft/s], angular velocity
            forward, right, down [rad/s], (m, 12).
        origin: Latitude, longitude [rad] and altitude [m] of the world frame.
        rows: Their rows, (m,).
        out: Position, velocity, quaternion, angular velocity in the body frame, world frame, SI, (13, n); written.
    """
    ox, oy, oz = earth_centred(origin[0], origin[1], origin[2])
    w, x, y, z = from_world(origin[0], origin[1])
    for k in range(rows.shape[0]):
        row = rows[k]
        latitude, longitude = read[k, 0], read[k, 1]
        px, py, pz = earth_centred(latitude, longitude, FOOT * read[k, 2])
        out[0, row], out[1, row], out[2, row] = quat_rotate_inverse(w, x, y, z, px - ox, py - oy, pz - oz)
        lw, lx, ly, lz = local_frame(latitude, longitude)
        lw, lx, ly, lz = quat_multiply(w, -x, -y, -z, lw, lx, ly, lz)
        out[3, row], out[4, row], out[5, row] = quat_rotate(
            lw, lx, ly, lz, FOOT * read[k, 6], FOOT * read[k, 7], FOOT * read[k, 8]
        )
        s, c = turn(read[k, 5])
        lw, lx, ly, lz = quat_multiply(lw, lx, ly, lz, c, 0.0, 0.0, s)
        s, c = turn(read[k, 4])
        lw, lx, ly, lz = quat_multiply(lw, lx, ly, lz, c, 0.0, s, 0.0)
        s, c = turn(read[k, 3])
        lw, lx, ly, lz = quat_multiply(lw, lx, ly, lz, c, s, 0.0, 0.0)
        # From axes forward, right, down to forward, left, up: half a turn about the first.
        out[6, row], out[7, row], out[8, row], out[9, row] = -lx, lw, lz, -ly
        out[10, row], out[11, row], out[12, row] = read[k, 9], -read[k, 10], -read[k, 11]
