"""Conversion of the states of JSBSim to the world frame."""

from __future__ import annotations

import math

from tussle.numeric import cos, sin
from tussle.numeric.kernel import device, kernel
from tussle.numeric.quaternion import quat_multiply, quat_rotate, quat_rotate_inverse


@device
def turn(angle):
    """Sine and cosine of half an angle [rad]."""
    return sin(0.5 * angle), cos(0.5 * angle)


@device
def earth_centred(latitude, longitude, altitude, ellipsoid):
    """Earth-centred position [m] of a geodetic place [rad, m]; ellipsoid: semi-major axis [m] and squared eccentricity."""
    s, c = sin(latitude), cos(latitude)
    normal = ellipsoid[0] / math.sqrt(1.0 - ellipsoid[1] * s * s)
    out = (normal + altitude) * c
    return out * cos(longitude), out * sin(longitude), (normal * (1.0 - ellipsoid[1]) + altitude) * s


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


@kernel("F2 (f8 f8 f8) (f8 f8) f8 F2w")
def to_rigid_bodies(read, origin, ellipsoid, foot, out):
    """Write the states of some rigid bodies.

    Args:
        read: Latitude, longitude [rad], altitude [ft], roll, pitch, yaw [rad], velocity north, east, down [ft/s], angular velocity
            forward, right, down [rad/s], (m, 12).
        origin: Latitude, longitude [rad] and altitude [m] of the world frame.
        ellipsoid: Semi-major axis [m] and squared eccentricity of the Earth.
        foot: [m].
        out: Position, velocity, quaternion, angular velocity in the body frame, world frame, SI, (13, m); written.
    """
    ox, oy, oz = earth_centred(origin[0], origin[1], origin[2], ellipsoid)
    w, x, y, z = from_world(origin[0], origin[1])
    for row in range(read.shape[0]):
        latitude, longitude = read[row, 0], read[row, 1]
        px, py, pz = earth_centred(latitude, longitude, foot * read[row, 2], ellipsoid)
        out[0, row], out[1, row], out[2, row] = quat_rotate_inverse(w, x, y, z, px - ox, py - oy, pz - oz)
        lw, lx, ly, lz = local_frame(latitude, longitude)
        lw, lx, ly, lz = quat_multiply(w, -x, -y, -z, lw, lx, ly, lz)
        out[3, row], out[4, row], out[5, row] = quat_rotate(
            lw, lx, ly, lz, foot * read[row, 6], foot * read[row, 7], foot * read[row, 8]
        )
        s, c = turn(read[row, 5])
        lw, lx, ly, lz = quat_multiply(lw, lx, ly, lz, c, 0.0, 0.0, s)
        s, c = turn(read[row, 4])
        lw, lx, ly, lz = quat_multiply(lw, lx, ly, lz, c, 0.0, s, 0.0)
        s, c = turn(read[row, 3])
        lw, lx, ly, lz = quat_multiply(lw, lx, ly, lz, c, s, 0.0, 0.0)
        # From axes forward, right, down to forward, left, up: half a turn about the first.
        out[6, row], out[7, row], out[8, row], out[9, row] = -lx, lw, lz, -ly
        out[10, row], out[11, row], out[12, row] = read[row, 9], -read[row, 10], -read[row, 11]
