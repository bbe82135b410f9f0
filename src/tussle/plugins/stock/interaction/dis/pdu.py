"""Entity State PDUs of Distributed Interactive Simulation, IEEE Std 1278.1-2012, clause 7.2.2, as rows of NumPy arrays."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from tussle.numeric.quaternion import (
    quat_from_euler,
    quat_multiply,
    quat_rotate,
    quat_to_pitch,
    quat_to_roll,
    quat_to_yaw,
)
from tussle.world.geodesy import FORWARD_RIGHT_DOWN, Origin, to_forward_right_down

ENTITY_STATE, ENTITY_INFORMATION = 1, 1
"""PDU type and protocol family."""
VERSIONS = (5, 6, 7)
"""Protocol versions that are read: 1278.1-1995, 1278.1A-1998, 1278.1-2012. The entity state PDU is the same in all."""
HEADER_BYTES, ARTICULATION_BYTES = 12, 16
DEACTIVATED = 1 << 23
"""Bit of the appearance: the entity leaves the exercise."""
ASCII = 1
MARKING_CHARACTERS = 11
MAX_ENTITY = 65533
"""Largest number of an entity: 0, 65534 and 65535 have meanings of their own."""
HOUR = 3600.0
TYPE_FIELDS = ("kind", "domain", "country", "category", "subcategory", "specific", "extra")
TYPE = np.dtype([(name, ">u2" if name == "country" else "u1") for name in TYPE_FIELDS])
LAYOUT = np.dtype(
    [
        ("version", "u1"), ("exercise", "u1"), ("pdu_type", "u1"), ("family", "u1"), ("timestamp", ">u4"),
        ("length", ">u2"), ("status", "u1"), ("padding", "u1"),
        ("site", ">u2"), ("application", ">u2"), ("entity", ">u2"), ("force", "u1"), ("n_articulations", "u1"),
        ("type", TYPE), ("alternative_type", TYPE),
        ("velocity", ">f4", 3), ("location", ">f8", 3), ("orientation", ">f4", 3), ("appearance", ">u4"),
        ("algorithm", "u1"), ("other", "u1", 15), ("acceleration", ">f4", 3), ("angular_velocity", ">f4", 3),
        ("character_set", "u1"), ("marking", f"S{MARKING_CHARACTERS}"), ("capabilities", ">u4"),
    ]
)  # fmt: skip
"""The 144 bytes before the articulation parameters."""
ROTATING, ACCELERATED, IN_BODY_AXES = (3, 4, 7, 8), (4, 5, 8, 9), (6, 7, 8, 9)
"""Dead reckoning algorithms by what they do; 1 is static, 2 is constant velocity."""
STATIC, CONSTANT_RATES = 1, 3
"""Algorithms Static, and DRM(R, P, W): constant velocity and angular velocity."""


def timestamp(t: float) -> int:
    """Relative timestamp of a time [s]: units of an hour / 2^31 past the hour, and a last bit 0."""
    return int(t % HOUR / HOUR * 2**31) % 2**31 << 1


def encode(
    origin: Origin, pos: np.ndarray, vel: np.ndarray, quat: np.ndarray, omega: np.ndarray
) -> np.ndarray:
    """Return PDUs, (n,), with locations, orientations and motions of entities; the other fields are 0.

    Args:
        origin: Where the world frame is.
        pos: Position [m], (3, n), world frame; vel [m/s] and omega [rad/s] likewise.
        vel: Velocity.
        quat: Attitude, (4, n).
        omega: Angular velocity.
    """
    out = np.zeros(pos.shape[1], LAYOUT)
    attitude = origin.earth_attitude(quat)
    out["pdu_type"], out["family"], out["length"] = ENTITY_STATE, ENTITY_INFORMATION, LAYOUT.itemsize
    out["location"] = origin.to_earth_centred(pos).T
    out["velocity"] = quat_rotate(origin.quat, vel).T
    out["orientation"] = _angles(attitude)
    out["algorithm"], out["character_set"] = CONSTANT_RATES, ASCII
    out["angular_velocity"] = to_forward_right_down(quat, omega).T
    return out


def split(datagram: bytes, exercise: int) -> tuple[list[bytes], int]:
    """Entity State PDUs of an exercise in a datagram, without articulation parameters, and how many parts of it are refused.

    A datagram may bundle several PDUs. PDUs of other types are passed over.
    """
    found: list[bytes] = []
    n_refused = first = 0
    while first < len(datagram):
        head = datagram[first : first + HEADER_BYTES]
        length = int.from_bytes(head[8:10], "big")
        if len(head) < HEADER_BYTES or length < HEADER_BYTES or first + length > len(datagram):
            return found, n_refused + 1
        if head[0] not in VERSIONS or head[1] != exercise:
            n_refused += 1
        elif head[2] == ENTITY_STATE:
            pdu = datagram[first : first + length]
            if length >= LAYOUT.itemsize and length == LAYOUT.itemsize + ARTICULATION_BYTES * pdu[19]:
                found.append(pdu[: LAYOUT.itemsize])
            else:
                n_refused += 1
        first += length
    return found, n_refused


def decode(pdus: Iterable[bytes]) -> np.ndarray:
    """PDUs of `split` as an array (n,) with the fields of LAYOUT."""
    return np.frombuffer(b"".join(pdus), LAYOUT)


def reckon(records: np.ndarray, age: np.ndarray, origin: Origin) -> tuple[np.ndarray, ...]:
    """Where entities are by the dead reckoning algorithms of their last PDUs; Annex E of IEEE Std 1278.1-2012.

    Args:
        records: The PDUs, (n,).
        age: Time since each [s], (n,).
        origin: Where the world frame is.

    Returns:
        Position [m] (3, n), velocity [m/s] (3, n), attitude (4, n), angular velocity [rad/s] (3, n), in the world frame.
    """
    pos, vel, attitude, omega = _extrapolated(records, age)
    back = origin.quat * np.array([1.0, -1.0, -1.0, -1.0])
    quat = quat_multiply(quat_multiply(back, attitude), FORWARD_RIGHT_DOWN)
    omega = quat_rotate(quat_multiply(back, attitude), omega)
    return origin.from_earth_centred(pos), quat_rotate(back, vel), quat, omega


def moved_on(records: np.ndarray, age: np.ndarray) -> np.ndarray:
    """PDUs, (n,), of the same entities some time [s], (n,), later, by their dead reckoning algorithms."""
    out = records.copy()
    pos, vel, attitude, _ = _extrapolated(records, age)
    out["location"], out["velocity"], out["orientation"] = pos.T, vel.T, _angles(attitude)
    return out


def _angles(attitude: np.ndarray) -> np.ndarray:
    """Psi, theta, phi [rad], (n, 3), of attitudes in the earth-centred frame."""
    return np.stack([quat_to_yaw(attitude), quat_to_pitch(attitude), quat_to_roll(attitude)]).T


def _extrapolated(
    records: np.ndarray, age: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """What `extrapolate` returns, in the earth-centred frame."""
    psi, theta, phi = records["orientation"].astype(float).T
    return extrapolate(
        records["algorithm"], records["location"].astype(float).T, records["velocity"].astype(float).T,
        records["acceleration"].astype(float).T, quat_from_euler(phi, theta, psi),
        records["angular_velocity"].astype(float).T, age,
    )  # fmt: skip


def extrapolate(
    algorithm: np.ndarray, pos: np.ndarray, vel: np.ndarray, acceleration: np.ndarray, quat: np.ndarray,
    omega: np.ndarray, t: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:  # fmt: skip
    """Move bodies by dead reckoning, in any frame that does not rotate with them.

    Args:
        algorithm: Number of the algorithm of each, (n,); what is no algorithm is static.
        pos: Position [m], (3, n).
        vel: Velocity [m/s], (3, n); of algorithms in body axes, as acceleration, in body axes.
        acceleration: Acceleration [m/s^2], (3, n).
        quat: Attitude, from body axes to the frame, (4, n).
        omega: Angular velocity [rad/s], (3, n), body axes.
        t: Time [s], (n,).

    Returns:
        Position, velocity, attitude, in the frame, and angular velocity in body axes.
    """
    is_body = np.isin(algorithm, IN_BODY_AXES)
    is_moving = (algorithm >= 2) & (algorithm <= 9)
    v = np.where(is_moving, vel, 0.0)
    a = np.where(np.isin(algorithm, ACCELERATED), acceleration, 0.0)
    rates = np.where(np.isin(algorithm, ROTATING), omega, 0.0)
    # In body axes, velocity turns with the body: the integrals of the rotation exp([w] s) and of s exp([w] s) by Rodrigues' formula.
    spin = np.where(is_body, rates, 0.0)
    w = np.sqrt((spin * spin).sum(axis=0))
    p0, p1, p2, q1, q2 = _integrals(w, t)
    path = v * t + _twice(spin, v, p1, p2) + a * p0 + _twice(spin, a, q1, q2)
    turned = quat_multiply(quat, _turn(rates, t))
    now = v + a * t
    identity = np.array([1.0, 0.0, 0.0, 0.0])[:, None]
    frame = np.where(is_body, quat, identity)
    return (
        pos + quat_rotate(frame, path),
        np.asarray(quat_rotate(np.where(is_body, turned, identity), now)),
        np.asarray(turned),
        rates,
    )


def _integrals(w: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, ...]:
    """t^2 / 2, and the weights of w x v and w x (w x v) in the integrals of exp([w] s) v and of s exp([w] s) v over s from 0 to t."""
    x = w * t
    is_small = (
        x < 0.03
    )  # here the next term of the series and the lost digits of the formulas are both 1e-9 of the whole
    safe = np.where(is_small, 1.0, w)
    y = np.where(is_small, 1.0, x)
    sine, cosine = np.sin(y), np.cos(y)
    t2 = t * t
    p1 = np.where(is_small, t2 * (1 / 2 - x * x / 24), (1.0 - cosine) / safe**2)
    p2 = np.where(is_small, t2 * t * (1 / 6 - x * x / 120), (y - sine) / safe**3)
    q1 = np.where(is_small, t2 * t * (1 / 3 - x * x / 30), (sine - y * cosine) / safe**3)
    q2 = np.where(
        is_small, t2 * t2 * (1 / 8 - x * x / 144), (0.5 * y * y - y * sine - cosine + 1.0) / safe**4
    )
    return 0.5 * t2, p1, p2, q1, q2


def _twice(w: np.ndarray, v: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """First * w x v + second * w x (w x v)."""
    once = np.cross(w, v, axis=0)
    return np.asarray(first * once + second * np.cross(w, once, axis=0))


def _turn(omega: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Quaternion of the rotation by omega * t, (4, n)."""
    length = np.sqrt((omega * omega).sum(axis=0))
    half = 0.5 * length * t
    scale = np.where(length > 0.0, np.sin(half) / np.where(length > 0.0, length, 1.0), 0.5 * t)
    return np.concatenate([np.cos(half)[None], omega * scale])
