"""Conversion between the world frame and the state of compiled aircraft."""

from __future__ import annotations

from tussle.numeric import cos, sin
from tussle.numeric.kernel import kernel
from tussle.numeric.quaternion import quat_multiply, quat_rotate, quat_rotate_inverse

FOOT = 0.3048  # [m]


@kernel("F2 i8 f8 F2 F2w")
def to_world(x, earth_angle, earth_rate, frame, out):
    """Write the rigid bodies of some aircraft.

    Args:
        x: State of the aircraft, (k, n): quaternion, angular velocity, position, velocity in inertial axes, foot and second.
        earth_angle: Its row with the Earth's angle [rad].
        earth_rate: Angular velocity of the Earth [rad/s].
        frame: Quaternion from the world frame to Earth-centred axes, and the world frame's origin in these [m], (7, n).
        out: Position [m], velocity [m/s], world frame, quaternion, angular velocity, body frame [rad/s], (13, n); written.
    """
    for row in range(x.shape[1]):
        w, a, b, c = frame[0, row], frame[1, row], frame[2, row], frame[3, row]
        angle = x[earth_angle, row]
        turn_w, turn_z = cos(0.5 * angle), -sin(0.5 * angle)
        rx, ry = x[7, row], x[8, row]
        vx, vy = x[10, row] + earth_rate * ry, x[11, row] - earth_rate * rx
        px, py, pz = quat_rotate(turn_w, 0.0, 0.0, turn_z, rx, ry, x[9, row])
        vx, vy, vz = quat_rotate(turn_w, 0.0, 0.0, turn_z, vx, vy, x[12, row])
        out[0, row], out[1, row], out[2, row] = quat_rotate_inverse(
            w, a, b, c, FOOT * px - frame[4, row], FOOT * py - frame[5, row], FOOT * pz - frame[6, row]
        )
        out[3, row], out[4, row], out[5, row] = quat_rotate_inverse(
            w, a, b, c, FOOT * vx, FOOT * vy, FOOT * vz
        )
        qw, qx, qy, qz = x[0, row], x[1, row], x[2, row], x[3, row]
        spin_x, spin_y, spin_z = quat_rotate_inverse(qw, qx, qy, qz, 0.0, 0.0, earth_rate)
        qw, qx, qy, qz = quat_multiply(turn_w, 0.0, 0.0, turn_z, qw, qx, qy, qz)
        qw, qx, qy, qz = quat_multiply(w, -a, -b, -c, qw, qx, qy, qz)
        # From axes forward, right, down to forward, left, up: half a turn about the first.
        out[6, row], out[7, row], out[8, row], out[9, row] = -qx, qw, qz, -qy
        out[10, row], out[11, row], out[12, row] = x[4, row] - spin_x, spin_y - x[5, row], spin_z - x[6, row]
