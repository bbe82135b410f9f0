"""Conversion of the states of JSBSim to the world frame."""

import math

from tussle.numeric import cos, sin
from tussle.numeric.kernel import device, kernel
from tussle.numeric.quaternion import quat_multiply, quat_rotate


@device
def turn(angle):
    """Sine and cosine of half an angle [rad]."""
    return sin(0.5 * angle), cos(0.5 * angle)


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


@device
def to_world(latitude, longitude, origin):
    """Quaternion that turns vectors north, east, down at a geodetic place [rad] to the world frame with this origin [rad]."""
    w, x, y, z = from_world(origin[0], origin[1])
    lw, lx, ly, lz = local_frame(latitude, longitude)
    return quat_multiply(w, -x, -y, -z, lw, lx, ly, lz)


@kernel("F F (f8 f8) F2w")
def local_frames(latitude, longitude, origin, out):
    """Write the quaternions of `to_world` of some places, (n,), to out, (4, n)."""
    for i in range(latitude.shape[0]):
        out[0, i], out[1, i], out[2, i], out[3, i] = to_world(latitude[i], longitude[i], origin)


@kernel("F2 (f8 f8) f8 F2w")
def to_rigid_bodies(read, origin, foot, out):
    """Write velocity and attitude of some rigid bodies.

    Args:
        read: Latitude, longitude [rad], altitude, roll, pitch, yaw [rad], velocity north, east, down [ft/s], angular velocity forward,
            right, down [rad/s], (m, 12).
        origin: Latitude and longitude of the world frame [rad].
        foot: [m].
        out: Velocity, world frame, quaternion, angular velocity, body frame, SI, (10, m); written.
    """
    for row in range(read.shape[0]):
        w, x, y, z = to_world(read[row, 0], read[row, 1], origin)
        out[0, row], out[1, row], out[2, row] = quat_rotate(
            w, x, y, z, foot * read[row, 6], foot * read[row, 7], foot * read[row, 8]
        )
        s, c = turn(read[row, 5])
        w, x, y, z = quat_multiply(w, x, y, z, c, 0.0, 0.0, s)
        s, c = turn(read[row, 4])
        w, x, y, z = quat_multiply(w, x, y, z, c, 0.0, s, 0.0)
        s, c = turn(read[row, 3])
        w, x, y, z = quat_multiply(w, x, y, z, c, s, 0.0, 0.0)
        # From axes forward, right, down to forward, left, up: half a turn about the first.
        out[3, row], out[4, row], out[5, row], out[6, row] = -x, w, z, -y
        out[7, row], out[8, row], out[9, row] = read[row, 9], -read[row, 10], -read[row, 11]
