"""Equations of motion of a rigid body, shared by motion models with six degrees of freedom.

Vectors are tuples of three numbers. The state of a body is (x, y, z, vx, vy, vz, qw, qx, qy, qz, p, q, r): position [m], velocity [m/s],
world frame; quaternion body to world; angular velocity [rad/s], body frame (forward, left, up).
"""

from tussle.numeric.kernel import device
from tussle.numeric.quaternion import quat_rotate, quat_rotate_inverse


@device
def cross(a, b):
    """Cross product of two vectors."""
    ax, ay, az = a
    bx, by, bz = b
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@device
def add(a, b):
    """Sum of two vectors."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@device
def scale(factor, a):
    """Vector times a number."""
    return factor * a[0], factor * a[1], factor * a[2]


@device
def to_world(state, a):
    """Body vector in the world frame."""
    return quat_rotate(state[6], state[7], state[8], state[9], a[0], a[1], a[2])


@device
def to_body(state, a):
    """World vector in the body frame."""
    return quat_rotate_inverse(state[6], state[7], state[8], state[9], a[0], a[1], a[2])


@device
def times(m, a):
    """Matrix times vector; m holds the nine elements row by row."""
    x, y, z = a
    return m[0] * x + m[1] * y + m[2] * z, m[3] * x + m[4] * y + m[5] * z, m[6] * x + m[7] * y + m[8] * z


@device
def solve(m, a):
    """Solution s of m s = a by Cramer's rule."""
    columns = (m[0], m[3], m[6]), (m[1], m[4], m[7]), (m[2], m[5], m[8])
    yz, zx, xy = cross(columns[1], columns[2]), cross(columns[2], columns[0]), cross(columns[0], columns[1])
    inverse = 1.0 / (columns[0][0] * yz[0] + columns[0][1] * yz[1] + columns[0][2] * yz[2])
    return times(
        (
            inverse * yz[0], inverse * yz[1], inverse * yz[2], inverse * zx[0], inverse * zx[1], inverse * zx[2],
            inverse * xy[0], inverse * xy[1], inverse * xy[2],
        ),
        a,
    )  # fmt: skip


@device
def state_rates(state, acceleration, angular_acceleration):
    """Time derivative of a state.

    q' = q (0, p, q, r) / 2 (Stevens and Lewis 2003, eq. 1.3-29). The term (1 - |q|^2) q does not turn the body; it keeps the quaternion
    at unit length, from which the errors of the integration move it.

    Args:
        state: As in the module's docstring.
        acceleration: Acceleration [m/s^2], world frame.
        angular_acceleration: p', q', r' [rad/s^2], body frame.
    """
    _, _, _, vx, vy, vz, w, x, y, z, p, q, r = state
    pull = 1.0 - (w * w + x * x + y * y + z * z)
    return (
        vx, vy, vz, *acceleration,
        -0.5 * (x * p + y * q + z * r) + pull * w, 0.5 * (w * p + y * r - z * q) + pull * x,
        0.5 * (w * q + z * p - x * r) + pull * y, 0.5 * (w * r + x * q - y * p) + pull * z,
        *angular_acceleration,
    )  # fmt: skip


@device
def newton_euler(state, force, torque, mass, inertia, gravity):
    """Time derivative of a state under loads: m v' = F - m g, I w' = T - w x I w (Euler's equations).

    Args:
        state: As in the module's docstring.
        force: Force without weight [N], world frame.
        torque: Torque about the center of mass [N m], body frame.
        mass: Mass [kg].
        inertia: Inertia tensor about the center of mass [kg m^2], body frame, nine elements.
        gravity: Acceleration of gravity [m/s^2].
    """
    omega = state[10], state[11], state[12]
    gyroscopic = cross(times(inertia, omega), omega)
    ax, ay, az = scale(1.0 / mass, force)
    return state_rates(state, (ax, ay, az - gravity), solve(inertia, add(torque, gyroscopic)))
