"""Trim and linearization: steady flight by Newton's method on the compiled accelerations, Jacobians by columns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tussle.aircraft.compile import CompiledAircraft
from tussle.aircraft.constants import EARTH_RATE, ECCENTRICITY_SQUARED
from tussle.aircraft.initial import CORE_SLOT, place, place_by_quaternion, rotation, run_initial
from tussle.errors import ParameterError
from tussle.numeric.quaternion import quat_conjugate, quat_multiply, quat_rotate

FOOT = 0.3048  # [m]
SETTLING = 4
"""Evaluations until terms in the rate of the angle of attack, which is that of the evaluation before, have settled."""
MAX_ITERATIONS = 60
TOLERANCE = 1e-6
"""Largest acceleration of steady flight [ft/s^2, rad/s^2]; JSBSim's own trim takes 1e-3 and 1e-4."""
RATES = "udot", "wdot", "qidot", "vdot", "pidot", "ridot"
UNKNOWNS = {  # first guess, limits, longest step of an iteration, difference for the Jacobian
    "alpha": (0.03, -0.35, 0.45, 0.06, 1e-5),
    "throttle": (0.6, 0.0, 1.0, 0.25, 1e-4),
    "pitch": (0.0, -1.0, 1.0, 0.3, 1e-5),
    "bank": (0.0, -0.6, 0.6, 0.1, 1e-5),
    "roll": (0.0, -1.0, 1.0, 0.3, 1e-5),
    "yaw": (0.0, -1.0, 1.0, 0.3, 1e-5),
}
COMMANDS = {
    "pitch": ("fcs/pitch-trim-cmd-norm", "fcs/elevator-cmd-norm"),
    "roll": ("fcs/roll-trim-cmd-norm", "fcs/aileron-cmd-norm"),
    "yaw": ("fcs/yaw-trim-cmd-norm", "fcs/rudder-cmd-norm"),
}
"""Property that each unknown of a surface sets: the first of them that the aircraft reads."""
STATES = "u", "v", "w", "p", "q", "r", "phi", "theta"
INPUTS = "throttle", "elevator", "aileron", "rudder"


@dataclass(frozen=True)
class TrimPoint:
    """Steady straight flight without sideslip.

    Attributes:
        state: The aircraft's state, (k, n), engines settled.
        values: Name of an unknown -> its values, (n,): alpha [rad], throttle, pitch, and with a full trim bank [rad], roll, yaw.
        residual: Largest acceleration that is left [ft/s^2, rad/s^2], (n,).
    """

    state: np.ndarray
    values: dict[str, np.ndarray]
    residual: np.ndarray


@dataclass(frozen=True)
class LinearModel:
    """x' = A (x - x0) + B (u - u0) near steady flight.

    Attributes:
        a: A, (8, 8); the states are u, v, w forward, right, down [m/s], p, q, r [rad/s], roll and pitch angle phi, theta [rad].
        b: B, (8, 4); the inputs are throttle, elevator, aileron, rudder, as commands in [-1, 1].
        x0: States of the steady flight, (8,).
        point: The steady flight, of one row.
    """

    a: np.ndarray
    b: np.ndarray
    x0: np.ndarray
    point: TrimPoint


def throttles_of(aircraft: CompiledAircraft) -> list[int]:
    """Slots of the throttles of all engines that have one."""
    names = [
        f"fcs/throttle-cmd-norm[{k}]" if k else "fcs/throttle-cmd-norm"
        for k in range(max(1, aircraft.n_engines))
    ]
    return [aircraft.slots[name] for name in names if name in aircraft.slots]


def settle(aircraft: CompiledAircraft, x: np.ndarray, dt: float) -> None:
    """Compute all models of placed aircraft, (k, n), with engines in their steady state."""
    n = x.shape[1]
    run_initial(aircraft, x, dt)
    aircraft.start(x, aircraft.tables, 0, n, 1, 0.0, dt)
    aircraft.advance(x, aircraft.tables, 0, n, 1, 0.0, dt)  # passes the commands on
    aircraft.start(x, aircraft.tables, 0, n, 1, dt, dt)
    for _ in range(SETTLING):
        aircraft.advance(x, aircraft.tables, 0, n, 1, 0.0, dt)
    run_initial(aircraft, x, dt)


def trim(aircraft: CompiledAircraft, x: np.ndarray, dt: float, full: bool = False) -> TrimPoint:
    """Find steady flight at the place and with the velocity of aircraft, with the nose as near to the direction of flight as it can be.

    Newton's method with limited steps, all aircraft and all columns of the Jacobians in one evaluation. Angle of attack, throttle and
    elevator are found such that the accelerations forward, down and in pitch vanish; with `full` also bank, aileron and rudder
    such that those to the right, in roll and in yaw do.

    Args:
        aircraft: The compiled aircraft.
        x: Their state, (k, n), placed; the attitude has the nose in the direction of flight. Not written.
        dt: Length of a step, at which its filters are frozen [s].
        full: Whether the lateral accelerations are trimmed too.

    Raises:
        ParameterError: The aircraft has no throttle or no elevator, or there is no such flight.
    """
    names = list(UNKNOWNS)[: 6 if full else 3]
    slots = {
        name: next((aircraft.slots[k] for k in COMMANDS[name] if k in aircraft.slots), -1)
        for name in COMMANDS
        if name in names
    }
    throttles = throttles_of(aircraft)
    if not throttles or min(slots.values()) < 0:
        lacking = "throttle" if not throttles else next(name for name, slot in slots.items() if slot < 0)
        raise ParameterError(f"trim: aircraft {aircraft.name} has no command of its {lacking}")
    n, m = x.shape[1], len(names)
    guess, low, high, longest, difference = np.array([UNKNOWNS[name] for name in names]).T

    def flown(z: np.ndarray) -> np.ndarray:
        """States of unknowns z, (m, j n)."""
        values = dict(zip(names, z, strict=True))
        out = np.tile(x, (1, z.shape[1] // n))
        turn = rotation(1, values["alpha"])
        if full:
            turn = quat_multiply(rotation(0, values["bank"]), turn)
        position = out[7:10].copy()
        spin = np.stack([-EARTH_RATE * position[1], EARTH_RATE * position[0], 0.0 * position[2]])
        still = np.zeros_like(position)
        place_by_quaternion(out, position, quat_multiply(out[:4], turn), out[10:13] - spin, still)
        for slot in throttles:
            out[slot] = values["throttle"]
        for name, slot in slots.items():
            out[slot] = values[name]
        settle(aircraft, out, dt)
        return out

    rows = [CORE_SLOT[name] for name in RATES[:m]]
    z = np.repeat(guess[:, None], n, axis=1)
    best, left = z.copy(), np.full(n, np.inf)
    for _ in range(MAX_ITERATIONS):
        columns = [z] + [z + (difference * (np.arange(m) == k))[:, None] for k in range(m)]
        f = flown(np.concatenate(columns, axis=1))[rows].reshape(m, m + 1, n)
        size = np.abs(f[:, 0]).max(axis=0)
        better = size < left
        best[:, better], left[better] = z[:, better], size[better]
        if (left < TOLERANCE).all():
            break
        jacobian = (f[:, 1:] - f[:, :1]) / difference[None, :, None]
        step = -_solved(jacobian, f[:, 0])
        step = np.where(np.isfinite(step), step, 0.0)
        scale = np.minimum(1.0, 1.0 / np.maximum((np.abs(step) / longest[:, None]).max(axis=0), 1e-300))
        z = np.clip(z + scale * step, low[:, None], high[:, None])
    if (left > 1e3 * TOLERANCE).any():
        row = int(left.argmax())
        found = ", ".join(f"{name} {value:.3g}" for name, value in zip(names, best[:, row], strict=True))
        raise ParameterError(
            f"trim: aircraft {aircraft.name} has no steady flight at this altitude and speed; the nearest, with {found}, "
            f"leaves an acceleration of {left[row]:.3g} ft/s^2 or rad/s^2"
        )
    return TrimPoint(flown(best), dict(zip(names, best, strict=True)), left)


def _solved(jacobian: np.ndarray, f: np.ndarray) -> np.ndarray:
    """Solutions of J s = f for each row, by least squares: J (m, m, n), f (m, n)."""
    inverse = np.linalg.pinv(jacobian.transpose(2, 0, 1))
    return np.asarray(np.einsum("nij,jn->in", inverse, f))


def level_flight(
    aircraft: CompiledAircraft, speed: float, altitude: float, dt: float = 1.0 / 120.0
) -> TrimPoint:
    """Steady level flight to the north at a latitude of 45 degrees, in calm air.

    Args:
        aircraft: The compiled aircraft.
        speed: [m/s].
        altitude: Above the ellipsoid [m].
        dt: As of `trim`.

    Raises:
        ParameterError: As of `trim`.
    """
    x = aircraft.first[:, None].copy()
    one, zero = np.ones(1), np.zeros((3, 1))
    velocity = np.array([[speed / FOOT], [0.0], [0.0]])
    place(x, 0.25 * np.pi * one, 0.0 * one, altitude / FOOT * one, zero, velocity, zero)
    return trim(aircraft, x, dt)


def linearize(
    aircraft: CompiledAircraft, point: TrimPoint, dt: float = 1.0 / 120.0, difference: float = 1e-4
) -> LinearModel:
    """A and B near steady flight, by central differences of all columns in one evaluation; engines are in their steady state.

    Args:
        aircraft: The compiled aircraft.
        point: Steady flight of one row, to any direction.
        dt: As of `trim`.
        difference: Of each state and input, in [m/s], [rad/s], [rad] or as a share of a command.
    """
    n = len(STATES) + len(INPUTS)
    offsets = difference * np.concatenate([np.eye(n), -np.eye(n)], axis=1)
    base = point.state[:, :1]
    x0, local = _states(base)
    x = np.repeat(base, 2 * n, axis=1)
    states = x0 + offsets[: len(STATES)]
    for name, offset in zip(INPUTS, offsets[len(STATES) :], strict=True):
        own = f"fcs/{name}-cmd-norm"
        for slot in throttles_of(aircraft) if name == "throttle" else [aircraft.slots.get(own, -1)]:
            if slot >= 0:
                x[slot] += offset
    yaw = _angles(quat_multiply(quat_conjugate(local), base[:4]))[2]
    attitude = quat_multiply(
        rotation(2, np.repeat(yaw, 2 * n)), quat_multiply(rotation(1, states[7]), rotation(0, states[6]))
    )
    quat = quat_multiply(np.repeat(local, 2 * n, axis=1), attitude)
    place_by_quaternion(x, x[7:10].copy(), quat, quat_rotate(quat, states[:3] / FOOT), states[3:6])
    settle(aircraft, x, dt)
    at = CORE_SLOT
    p, q, r, phi, theta = states[3:]
    rates = np.stack([
        *(FOOT * x[at[name]] for name in ("udot", "vdot", "wdot")), *(x[at[name]] for name in ("pidot", "qidot", "ridot")),
        p + (q * np.sin(phi) + r * np.cos(phi)) * np.tan(theta), q * np.cos(phi) - r * np.sin(phi),
    ])  # fmt: skip
    jacobian = (rates[:, :n] - rates[:, n:]) / (2.0 * difference)
    return LinearModel(jacobian[:, : len(STATES)], jacobian[:, len(STATES) :], x0[:, 0], point)


def _angles(quat: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Roll, pitch, yaw [rad] of attitudes in axes north, east, down."""
    w, x, y, z = quat
    roll = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    return (
        roll, np.arcsin(np.clip(2.0 * (w * y - x * z), -1.0, 1.0)), np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)),
    )  # fmt: skip


def _states(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The states of a linear model, (8, 1), and the quaternion from axes north, east, down to inertial ones."""
    place_ = x[7:10] / np.linalg.norm(x[7:10], axis=0)
    longitude, latitude = (
        np.arctan2(place_[1], place_[0]),
        np.arctan2(place_[2], (1.0 - ECCENTRICITY_SQUARED) * np.hypot(place_[0], place_[1])),
    )
    local = quat_multiply(rotation(2, longitude), rotation(1, -0.5 * np.pi - latitude))
    spin = np.stack([-EARTH_RATE * x[8], EARTH_RATE * x[7], 0.0 * x[9]])
    body = quat_conjugate(x[:4])
    velocity = FOOT * quat_rotate(body, x[10:13] - spin)
    turning = np.zeros_like(velocity)
    turning[2] = EARTH_RATE
    rates = x[4:7] - quat_rotate(body, turning)
    roll, pitch, _ = _angles(quat_multiply(quat_conjugate(local), x[:4]))
    return np.concatenate([velocity, rates, np.stack([roll, pitch])]), local
