"""Initial states from files of JSBSim, and scripts that name them."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from tussle.aircraft.compile import CompiledAircraft
from tussle.aircraft.constants import EARTH_RATE, ECCENTRICITY_SQUARED, SEMI_MAJOR
from tussle.aircraft.equations import CORE
from tussle.aircraft.files import NAME
from tussle.aircraft.node import AircraftError, Element, read_file
from tussle.errors import clipped
from tussle.numeric import cos, sin
from tussle.numeric.quaternion import quat_multiply, quat_rotate, quat_rotate_inverse

CORE_SLOT = {name: k for k, name in enumerate(CORE)}


def rotation(axis: int, angle: np.ndarray) -> np.ndarray:
    """Quaternions of rotations about an axis, (4, n)."""
    out = np.zeros((4, len(angle)))
    out[0], out[1 + axis] = cos(0.5 * angle), sin(0.5 * angle)
    return out


def place(x: np.ndarray, latitude: np.ndarray, longitude: np.ndarray, altitude: np.ndarray, euler: np.ndarray, velocity: np.ndarray,
          rates: np.ndarray) -> None:  # fmt: skip
    """Set the core of the state.

    Args:
        x: The state, (k, n); written.
        latitude: Geodetic latitude [rad], (n,).
        longitude: [rad], (n,).
        altitude: Above the ellipsoid [ft], (n,).
        euler: Roll, pitch, yaw from north [rad], (3, n).
        velocity: North, east, down [ft/s], (3, n).
        rates: Angular velocity relative to the Earth, forward, right, down [rad/s], (3, n).
    """
    frame = quat_multiply(rotation(2, longitude), rotation(1, -0.5 * np.pi - latitude))
    attitude = quat_multiply(
        rotation(2, euler[2]), quat_multiply(rotation(1, euler[1]), rotation(0, euler[0]))
    )
    normal = SEMI_MAJOR / np.sqrt(1.0 - ECCENTRICITY_SQUARED * sin(latitude) ** 2)
    across = (normal + altitude) * cos(latitude)
    along = ((1.0 - ECCENTRICITY_SQUARED) * normal + altitude) * sin(latitude)
    position = np.stack([across * cos(longitude), across * sin(longitude), along])
    place_by_quaternion(x, position, quat_multiply(frame, attitude), quat_rotate(frame, velocity), rates)


def place_by_quaternion(
    x: np.ndarray, position: np.ndarray, quat: np.ndarray, velocity: np.ndarray, rates: np.ndarray
) -> None:
    """Set the core of the state from Earth-centred values.

    Args:
        x: The state, (k, n); written.
        position: [ft], (3, n).
        quat: From body axes forward, right, down, (4, n).
        velocity: Relative to the Earth [ft/s], (3, n).
        rates: As of `place`.
    """
    spin = np.zeros_like(position)
    spin[2] = EARTH_RATE
    x[:4] = quat
    x[4:7] = rates + quat_rotate_inverse(quat, spin)
    x[7:10] = position
    x[10:13] = velocity + np.stack([-EARTH_RATE * position[1], EARTH_RATE * position[0], 0.0 * position[2]])


def run_initial(aircraft: CompiledAircraft, x: np.ndarray, dt: float) -> None:
    """Run the models twice without a step of time, as JSBSim does, and begin the integrators' histories; x is (k, n), contiguous."""
    n = x.shape[1]
    aircraft.advance(x, aircraft.tables, 0, n, 1, 0.0, dt)
    at = CORE_SLOT
    x[at["vx1"] : at["vz1"] + 1] = x[at["vx"] : at["vz"] + 1]
    x[at["vx2"] : at["vz2"] + 1] = x[at["vx"] : at["vz"] + 1]
    x[at["ax1"] : at["az1"] + 1] = x[at["ax"] : at["az"] + 1]
    aircraft.advance(x, aircraft.tables, 0, n, 1, 0.0, dt)


START = ("simulation/sim-time-sec", "ge", "0")
COMPARISONS = {">=": "ge", "ge": "ge", "gt": "ge", ">": "ge"}


class Script(NamedTuple):
    """The aircraft of a script, and the properties that it sets at the start."""

    aircraft: str
    settings: tuple[tuple[str, float], ...]


def read_script(root: Path, name: str) -> Script:
    """Read a script.

    Raises:
        AircraftError: It cannot be read, or does anything but set properties at the start.
    """
    if not NAME.fullmatch(name):
        raise AircraftError(f"script_name {clipped(name)!r} is no name of a file below {root / 'scripts'}")
    top = read_file(root / "scripts" / name)
    settings: list[tuple[str, float]] = []
    run = top.find("run")
    for event in run.find_all("event") if run is not None else ():
        if not _is_at_start(event):
            raise event.error(
                "only events at the start (simulation/sim-time-sec ge 0) are compiled; motion=JSBSimControl plays all"
            )
        for each in event.find_all("set"):
            if each.find("function") is not None or each.get("action", "FG_STEP") != "FG_STEP":
                raise each.error("only a constant value can be set; motion=JSBSimControl plays all")
            settings.append((each.get("name"), each.attribute_number("value", 0.0)))
    return Script(top.need("use").get("aircraft"), tuple(settings))


def _is_at_start(event: Element) -> bool:
    words = event.need("condition").text.split()
    if len(words) != 3 or words[1] not in COMPARISONS:
        return False
    try:
        return (words[0], COMPARISONS[words[1]], float(words[2])) == (*START[:2], 0.0)
    except ValueError:
        return False
