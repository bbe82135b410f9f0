"""The states of vehicles in the frames of autopilots: North-East-Down for the world, forward-right-down for the body."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from tussle.api import GroupView
from tussle.numeric.quaternion import quat_rotate_inverse

GRAVITY = 9.80665  # [m/s^2], standard acceleration of gravity (CGPM 1901), which autopilots assume
HALF = math.sqrt(0.5)


class VehicleState(NamedTuple):
    """The state of one vehicle.

    Attributes:
        t: Time [s].
        position: North, east, down of the mission's origin [m].
        velocity: North, east, down [m/s].
        quat: Attitude (w, x, y, z), from the body frame to the world frame.
        euler: Roll, pitch, yaw [rad]: right wing down, nose up, clockwise from North in [0, 2 pi).
        rate: Angular velocity, body frame [rad/s].
        acceleration: Rate of the velocity, body frame [m/s^2].
        force: What an accelerometer measures, body frame: acceleration less gravity [m/s^2].
        geodetic: Latitude [rad], longitude [rad], altitude above the ellipsoid [m].
        speed: Magnitude of the velocity [m/s].
    """

    t: float
    position: tuple[float, ...]
    velocity: tuple[float, ...]
    quat: tuple[float, ...]
    euler: tuple[float, ...]
    rate: tuple[float, ...]
    acceleration: tuple[float, ...]
    force: tuple[float, ...]
    geodetic: tuple[float, ...]
    speed: float


def to_ned(vector: np.ndarray) -> np.ndarray:
    """Vectors in the world frame, East-North-Up, as North-East-Down, (3, n)."""
    return np.stack([vector[1], vector[0], -vector[2]])


def to_frd(vector: np.ndarray) -> np.ndarray:
    """Vectors in the body frame, forward-left-up, as forward-right-down, (3, n)."""
    return np.stack([vector[0], -vector[1], -vector[2]])


def to_ned_frd(quat: np.ndarray) -> np.ndarray:
    """Attitudes (forward-left-up to East-North-Up) as those of forward-right-down to North-East-Down, (4, n).

    The product of half a turn about (1, 1, 0), of the attitude, and of half a turn about (1, 0, 0).
    """
    w, x, y, z = quat
    return HALF * np.stack([w + z, x + y, x - y, w - z])


def vehicle_states(g: GroupView, last_vel: np.ndarray) -> list[VehicleState]:
    """The true states of the rows of a view. Accelerations are the change since `last_vel`, (3, n), over the step."""
    rows = slice(g.first, g.last)
    pos, vel, quat, omega = (
        np.asarray(getattr(g.bodies, k)[:, rows]) for k in ("pos", "vel", "quat", "omega")
    )
    acceleration = (vel - last_vel) / g.dt
    force = acceleration + np.array([[0.0], [0.0], [GRAVITY]])
    roll, climb, yaw = (np.asarray(getattr(g.bodies, k)[rows]) for k in ("roll", "climb", "yaw"))
    columns = (
        to_ned(pos),
        to_ned(vel),
        to_ned_frd(quat),
        np.stack([roll, climb, (0.5 * np.pi - yaw) % (2.0 * np.pi)]),
        *(to_frd(quat_rotate_inverse(quat, vector)) for vector in (omega, acceleration, force)),
        g.scene.origin.to_geodetic(pos),
    )
    lists = zip(*(map(tuple, column.T.tolist()) for column in columns), strict=True)
    times, speeds = g.t.tolist(), [math.hypot(*v) for v in columns[1].T.tolist()]
    return [VehicleState._make((t, *parts, v)) for t, parts, v in zip(times, lists, speeds, strict=True)]
