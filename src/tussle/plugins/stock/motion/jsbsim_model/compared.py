"""Flies an aircraft for a second in JSBSim and compiled, to tell whether a mission may fly it compiled."""

from __future__ import annotations

import importlib.util
import math
from functools import cache
from pathlib import Path

import numpy as np

from tussle.aircraft.compile import CompiledAircraft, compile_aircraft
from tussle.aircraft.files import package_root
from tussle.aircraft.initial import Script, place, read_script, run_initial
from tussle.aircraft.node import AircraftError
from tussle.errors import ParameterError
from tussle.plugins.stock.motion.jsbsim_model.flight import FOOT, THROTTLES, Aircraft, JSBSimFlight
from tussle.world.geodesy import Origin

DT, STEPS = 1.0 / 120.0, 120
NEAR = 1e-4
"""Distance after the second up to which both flights are the same [m]."""
START = [0.0, 0.0, 5000.0, 0.0, 0.0, 0.0, 180.0, 0.0, 0.0, 0.0, 0.0, 0.0]
"""Latitude, longitude, altitude [ft]; roll, pitch, heading; velocity north, east, down [ft/s]; rates, at the begin of the second."""
ALTITUDE = "position/geod-alt-ft"
COMMANDS = {"ap/altitude_setpoint": 5000.0, "ap/airspeed_setpoint": 100.0, THROTTLES: 0.7}
"""Values of properties in that second; others are 0.1."""


@cache
def unlike_compiled(
    root: str, aircraft: str, script: str, commanded: tuple[str, ...], is_autopilot: bool
) -> str:
    """Return why an aircraft does not fly compiled as in JSBSim; "" if it does, or if JSBSim is not installed.

    Args:
        root: Folder of aircraft, engine, systems and scripts; empty for that of the package.
        aircraft: Its name, or empty.
        script: File of the script, or empty.
        commanded: Properties that are set in each step; THROTTLES stands for those of all engines.
        is_autopilot: They are setpoints of its autopilot.
    """
    folder, values = Path(root) if root else None, [COMMANDS.get(name, 0.1) for name in commanded]
    try:
        chosen = read_script(folder or package_root(), script) if script else Script(aircraft, ())
        keep = [ALTITUDE, *(name for name, _ in chosen.settings), *(commanded if is_autopilot else ())]
        made = compile_aircraft(folder, chosen.aircraft, keep)  # the kernel of JSBSimCompiled
        if importlib.util.find_spec("jsbsim") is None:
            return ""
        flight = JSBSimFlight(Aircraft(root, aircraft, script, "none", None, commanded, ()), DT)
        flight.place([*START, 0.0, 0.0, 0.0, 0.0, 0.0], Origin.from_degrees(0.0, 0.0, 0.0))
        flight.fly(values, STEPS)
        there = [flight.fdm[f"position/eci-{axis}-ft"] for axis in "xyz"]
        distance = FOOT * math.dist(there, flown(made, chosen, dict(zip(commanded, values, strict=True))))
    except (AircraftError, ParameterError) as error:
        return str(error)
    return (
        "" if distance < NEAR else f"after a second, the compiled aircraft is {distance:.2g} m from JSBSim's"
    )


def flown(aircraft: CompiledAircraft, script: Script, commands: dict[str, float]) -> list[float]:
    """Return where the compiled aircraft is after that second, in inertial axes [ft]."""
    x, at = aircraft.first[:, None].copy(), aircraft.slots
    start = np.array(START)[:, None]
    place(x, *start[:3], *np.split(start[3:], 3))
    for name, number in script.settings:
        x[aircraft.slot(name)] = number
    run_initial(aircraft, x, DT)
    aircraft.start(x, aircraft.tables, 0, 1, 1, 0.0, DT)
    for name, value in commands.items():
        for each in (name, *(f"{name}[{k}]" for k in range(1, aircraft.n_engines))):
            if each in at:
                x[at[each]] = value
    aircraft.advance(x, aircraft.tables, 0, 1, STEPS, DT, DT)
    return [float(each) for each in x[7:10, 0]]
