"""Motion models of SCRIMMAGE that integrate their turn since the start: Unicycle3D and DubinsAirplane3D."""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.api import MotionBody, State
from tussle.numeric.quaternion import quat_conjugate, quat_multiply
from tussle.plugins.historic.integration import normalized, quat_rates, rk4_step, rotated, unrotated

LOADS = ("force_x", "force_y", "force_z", "torque_x", "torque_y", "torque_z")


def relative_state() -> State:
    """Declaration of the state."""
    return State(
        "x y z qw qx qy qz vx vy vz sw sx sy sz",
        unit="m m m 1 1 1 1 m/s m/s m/s 1 1 1 1",
        doc="Position, quaternion body to world, velocity along the body axes, quaternion of the start.",
    )


def begin(x: np.ndarray, body: MotionBody, rows: np.ndarray) -> None:
    """Copy position, velocity and attitude, which is that of the start."""
    quat = body.quat[:, rows]
    x[:3, rows], x[3:7, rows], x[10:, rows] = body.pos[:, rows], quat, quat
    x[7:10, rows] = unrotated(quat, body.vel[:, rows])


def publish(x: np.ndarray, body: MotionBody) -> None:
    """Write position, attitude and velocity."""
    body.pos[:], body.quat[:], body.vel[:] = x[:3], x[3:7], rotated(x[3:7], x[7:10])


def turn(x: np.ndarray, u: dict[str, np.ndarray], commands: Any, h: float) -> None:
    """Advance states, (14, n), in place.

    Rates act about axes that move with the vehicle but were the world's at the start. A force adds a velocity of force over 1 kg,
    a torque a rate.

    Args:
        x: States; the speed forwards is x[7].
        u: Inputs by name, among them force and torque.
        commands: Acceleration along the nose [m/s^2], and rates about the axes x, y, z [rad/s].
        h: Duration [s].
    """
    acceleration, *rates = commands
    start = x[10:]
    local = np.asarray(quat_multiply(x[3:7], quat_conjugate(start)))
    force = unrotated(local, [u[name] for name in LOADS[:3]])
    x[7] += force[0]
    x[8:10] = force[1:]
    spin = np.array(rates) + np.array([u[name] for name in LOADS[3:]])

    def f(s: np.ndarray) -> np.ndarray:
        moved = rotated(np.asarray(quat_multiply(normalized(s[3:7]), start)), s[7:])
        return np.concatenate([moved, quat_rates(s[3:7], spin), [acceleration], 0.0 * s[8:]])

    s = rk4_step(f, np.concatenate([x[:3], local, x[7:10]]), h)
    x[:3], x[7:10] = s[:3], s[7:]
    x[3:7] = normalized(quat_multiply(normalized(s[3:7]), start))
