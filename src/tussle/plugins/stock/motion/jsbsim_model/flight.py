"""An aircraft in JSBSim."""

from __future__ import annotations

import math
import os
import re
import tempfile
from array import array
from collections import deque
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple, Self

from tussle import documents
from tussle.declare import units
from tussle.errors import MissingFileError, ParameterError, nearest_name
from tussle.world.geodesy import SEMI_MAJOR, Origin

FOOT = float(units.FOOT)  # [m]
STATE = (
    "position/lat-geod-rad", "position/long-gc-rad", "position/geod-alt-ft",
    "attitude/phi-rad", "attitude/theta-rad", "attitude/psi-rad",
    "velocities/v-north-fps", "velocities/v-east-fps", "velocities/v-down-fps",
    "velocities/p-rad_sec", "velocities/q-rad_sec", "velocities/r-rad_sec",
)  # fmt: skip
PLACE = (
    "ic/lat-geod-rad", "ic/long-gc-rad", "ic/h-sl-ft", "ic/phi-rad", "ic/theta-rad", "ic/psi-true-rad",
)  # fmt: skip
MOTION = "ic/vn-fps", "ic/ve-fps", "ic/vd-fps", "ic/p-rad_sec", "ic/q-rad_sec", "ic/r-rad_sec"
THROTTLES = "fcs/throttle-cmd-norm"
"""Stands for the throttles of all engines."""
WIND = "atmosphere/wind-north-fps", "atmosphere/wind-east-fps", "atmosphere/wind-down-fps"
USE = re.compile(r"""<use\s[^>]{0,500}?\baircraft\s*=\s*["']([^"'<>]{1,200})["']""")
"""The tag of a script that names its aircraft."""
NOT_FINITE = "JSBSim: the state is not finite"
"""Begin of the error of an aircraft whose state is NaN or infinite."""
TRIMS = {"none": -1, "longitudinal": 0, "full": 1, "ground": 2}
Placing = tuple[Sequence[float], Origin]
"""Arguments of `JSBSimFlight.place`."""
SavedFlight = tuple["Aircraft", float, list[tuple[Placing, "array[float]"]]]
"""Record of a flight, as `JSBSimFlight.save` returns it."""


class Aircraft(NamedTuple):
    """Aircraft to load, and its start.

    Attributes:
        root: Folder of aircraft, engine, systems and scripts; empty for that of the package.
        aircraft: Name of the aircraft, or empty.
        script: File name of the script, or empty.
        trim: A key of TRIMS.
        flightgear: Address, port and protocol of a FlightGear that shows the aircraft, if any.
        commanded: Properties that are set before each step; THROTTLES stands for the throttles of all engines.
        needed: Properties that the aircraft must have.
        is_historic: Fly as in SCRIMMAGE: over a sphere, with engines that the script starts, and commands that are set in each step.
        throttle_from: Time before which throttles stay closed [s].
        ground_of_origin: The ground has the altitude of the origin; otherwise that of the script, by default the sea's.
    """

    root: str
    aircraft: str
    script: str
    trim: str
    flightgear: tuple[str, int, str] | None
    commanded: tuple[str, ...]
    needed: tuple[str, ...]
    is_historic: bool = False
    throttle_from: float = 0.0
    ground_of_origin: bool = True


STANDING = 1.0
"""Speed of a propeller that stands [1/min], as JSBSim has it; a wind turns it."""


class PropellerNodes(NamedTuple):
    """A propeller of an aircraft.

    Attributes:
        rpm: Returns its speed [1/min].
        set_sense: Sets the sense of its rotation, a factor of its torque.
        sense: Its sense, 1 or -1.
    """

    rpm: Callable[[], float]
    set_sense: Callable[[float], None]
    sense: float


class JSBSimFlight:
    """An aircraft of JSBSim and the record of its flight. JSBSim cannot save its state, but a replay of the flight is bit-identical.

    Args:
        aircraft: Aircraft to load.
        dt: Length of a step [s].

    Raises:
        ParameterError: JSBSim is not installed, or cannot load the aircraft.
    """

    def __init__(self, aircraft: Aircraft, dt: float) -> None:
        self.aircraft, self.dt, self.is_placed = aircraft, dt, False
        self.fdm = load(aircraft, dt)
        n_engines = self.fdm.get_propulsion().get_num_engines()
        throttles = tuple(f"{THROTTLES}[{i}]" for i in range(n_engines))
        self.time = 0.0
        nodes = self.fdm.get_property_manager().get_node
        # Through its node, a property is read and written in a tenth of the time of `fdm[name]`.
        self.throttles = [nodes(name, True).set_double_value for name in throttles]
        self.write = [
            (nodes(each, True).set_double_value, k)
            for k, name in enumerate(aircraft.commanded)
            for each in (throttles if name == THROTTLES else (name,))
        ]
        self.read = [nodes(name, True).get_double_value for name in STATE]
        self.propellers = [
            PropellerNodes(rpm.get_double_value, sense.set_double_value, sense.get_double_value())
            for i in range(n_engines)
            if (rpm := nodes(f"propulsion/engine[{i}]/propeller-rpm", False))
            and (sense := nodes(f"propulsion/engine[{i}]/propeller-sense", False))
        ]
        self.history: list[tuple[Placing, array[float]]] = []

    def place(self, values: Sequence[float], origin: Origin) -> None:
        """Set the state.

        Args:
            values: Values of the properties PLACE, MOTION and WIND, of which NaN stands for that of the script; the time of the world [s];
                the number of steps that follow at once.
            origin: Origin of the world frame.

        Raises:
            ParameterError: The aircraft cannot be trimmed.
        """
        self.history.append(((values, origin), array("d")))
        state, wind, (self.time, n_steps) = values[:12], values[12:15], values[15:]
        fdm, start = self.fdm, self.aircraft
        if start.ground_of_origin:
            fdm["ic/terrain-elevation-ft"] = origin.altitude / FOOT
        for name, value in zip(PLACE + MOTION, state, strict=True):
            if not math.isnan(value):
                fdm[name] = value
        fdm.run_ic()
        for name, value in zip(WIND, wind, strict=True):
            fdm[name] = value
        if not self.is_placed:
            self.is_placed = True
            if not start.is_historic or start.trim != "none":
                fdm["propulsion/set-running"] = -1
            if start.trim != "none":
                self._trim()
        for _ in range(int(n_steps)):
            self._step()

    def _trim(self) -> None:
        import jsbsim

        try:
            self.fdm.do_trim(TRIMS[self.aircraft.trim])
        except jsbsim.TrimFailureError as error:
            name = self.fdm.get_model_name()
            raise ParameterError(
                f"trim = {self.aircraft.trim!r}: JSBSim cannot trim {name} at this altitude and speed: {str(error).strip()}"
            ) from None

    def fly(self, values: Sequence[float], n_steps: int) -> None:
        """Set the commands and make some steps."""
        self.history[-1][1].extend((*values, n_steps))
        for step in range(n_steps):
            if step == 0 or self.aircraft.is_historic:
                self._command(values)
            self._step()
            self.time += self.dt

    def _command(self, values: Sequence[float]) -> None:
        for write, k in self.write:
            write(values[k])
        if self.time < self.aircraft.throttle_from:
            for write in self.throttles:
                write(0.0)

    def _step(self) -> None:
        """Make one step.

        A propeller that stands has no torque in it: JSBSim divides by its speed, so that one that begins to turn would have a thousand
        times the torque of full power.
        """
        standing = [propeller for propeller in self.propellers if propeller.rpm() < STANDING]
        for propeller in standing:
            propeller.set_sense(0.0)
        self.fdm.run()
        for propeller in standing:
            propeller.set_sense(propeller.sense)

    def finite_state(self) -> list[float]:
        """Values of the properties STATE.

        Raises:
            ParameterError: One is not finite: the aircraft tumbles, or its model has no answer there.
        """
        values = [read() for read in self.read]
        if not all(map(math.isfinite, values)):
            named = ", ".join(
                f"{n} = {v:g}" for n, v in zip(STATE, values, strict=True) if not math.isfinite(v)
            )
            raise ParameterError(
                f"{NOT_FINITE} of {self.fdm.get_model_name()} after {self.fdm.get_sim_time():g} s: {named}"
            )
        return values

    def save(self) -> SavedFlight:
        """Return the record of the flight."""
        return self.aircraft, self.dt, self.history

    @classmethod
    def replay(cls, saved: SavedFlight) -> Self:
        """Load the aircraft and repeat its flight.

        Raises:
            ParameterError: JSBSim is not installed, or cannot load the aircraft.
        """
        aircraft, dt, history = saved
        flight = cls(aircraft, dt)
        width = len(aircraft.commanded) + 1
        for placing, flown in history:
            flight.place(*placing)
            for k in range(0, len(flown), width):
                *values, n_steps = flown[k : k + width]
                flight.fly(values, int(n_steps))
        return flight


def is_packaged(name: str) -> bool:
    """Return whether JSBSim's package has a file; True without the package, since nothing is known of it."""
    try:
        import jsbsim
    except ImportError:
        return True
    return Path(jsbsim.get_default_root_dir(), name).is_file()


def root_of(file: Path, name: str) -> Path:
    """Return the folder below which JSBSim reads a script or an aircraft of this name.

    Raises:
        MissingFileError: The file is in another folder, or a script uses an aircraft that is not there.
    """
    parts = Path(name).parts
    root = file.parents[len(parts) - 1]
    if file.parts[-len(parts) :] != parts:
        raise MissingFileError(f"{file} is not in a folder {Path(*parts[:-1])}, where JSBSim reads it")
    used = USE.search(documents.read_text(file, ParameterError))
    if used is not None and not (root / "aircraft" / used[1] / f"{used[1]}.xml").is_file():
        raise MissingFileError(f"{file} uses the aircraft {used[1]!r}, which is not in {root / 'aircraft'}")
    return root


def load(aircraft: Aircraft, dt: float) -> Any:
    """Return an executive of JSBSim with the aircraft, without outputs except for FlightGear.

    Raises:
        ParameterError: JSBSim is not installed, or the aircraft cannot be loaded or lacks a needed property.
    """
    try:
        import jsbsim
    except ImportError:
        raise ParameterError("JSBSim is not installed: pip install 'tussle[jsbsim]'") from None
    root = Path(aircraft.root or jsbsim.get_default_root_dir())
    key, name, folder = (
        ("script_name", aircraft.script, "scripts")
        if aircraft.script
        else ("aircraft", aircraft.aircraft, "aircraft")
    )
    file = root / folder / name / f"{name}.xml" if folder == "aircraft" else root / folder / name
    if not file.is_file():
        names = sorted(p.name for p in (root / folder).glob("*" if folder == "aircraft" else "*.xml"))
        raise ParameterError(
            f"{key} = {name!r}: {root / folder} has no such file{nearest_name(name, names)}; jsbsim_root names the folder with "
            "aircraft, engine, systems and scripts"
        )
    log = messages()
    log.lines.clear()
    fdm = jsbsim.FGFDMExec(str(root))
    fdm.set_debug_level(0)
    if aircraft.is_historic:
        _make_spherical(fdm)
    fdm.set_dt(dt)
    try:
        is_loaded = fdm.load_script(f"scripts/{name}", dt, "") if aircraft.script else fdm.load_model(name)
    except (OSError, RuntimeError) as error:
        log.lines.append(str(error))
        is_loaded = False
    if not is_loaded:
        raise ParameterError(
            f"{key} = {name!r}: JSBSim cannot load {file}: {' '.join(' '.join(log.lines).split())}"
        )
    for each in aircraft.needed:
        if "No matches" in fdm.query_property_catalog(each):
            raise ParameterError(
                f"{key} = {name!r}: {fdm.get_model_name()} has no property {each}, which JSBSimModel sets; "
                "take an aircraft with such an autopilot, or JSBSimControl"
            )
    # Aircraft and scripts may declare output files; none are written, because the user did not request them.
    n_outputs = 0
    while fdm.set_output_filename(n_outputs, os.devnull):
        n_outputs += 1
    fdm.disable_output()
    fdm.disable_input()
    if aircraft.flightgear:
        _show(fdm, aircraft.flightgear, dt)
    return fdm


def _make_spherical(fdm: Any) -> None:
    """Replace the ellipsoid by a sphere of its equatorial radius, over which the aircraft of SCRIMMAGE's recordings fly."""
    axes = "".join(f'<{name}_axis unit="M">{SEMI_MAJOR}</{name}_axis>' for name in ("semimajor", "semiminor"))
    with tempfile.NamedTemporaryFile("w", suffix=".xml") as file:
        file.write(f'<planet name="sphere">{axes}</planet>')
        file.flush()
        if not fdm.load_planet(file.name, False):
            raise ParameterError(
                "JSBSim does not take a spherical planet; SCRIMMAGE's laws need JSBSim 1.2 or newer"
            )


def _show(fdm: Any, flightgear: tuple[str, int, str], dt: float) -> None:
    """Send the states to a FlightGear, 30 times a second."""
    address, port, protocol = flightgear
    rate = min(30.0, 1.0 / dt)
    text = f'<output name="{address}" type="FLIGHTGEAR" port="{port}" protocol="{protocol.lower()}" rate="{rate:g}"/>'
    with tempfile.NamedTemporaryFile("w", suffix=".xml") as file:
        file.write(text)
        file.flush()
        if not fdm.set_output_directive(file.name):
            raise ParameterError(
                f"flightgear_ip = {address!r}, port {port}: JSBSim cannot open the connection"
            )
    fdm.enable_output()


@cache
def messages() -> Any:
    """The log of JSBSim in this process; it keeps errors and prints nothing."""
    import jsbsim

    class Log(jsbsim.FGLogger):
        def __init__(self) -> None:
            super().__init__()
            self.lines: deque[str] = deque(maxlen=50)
            self.level = jsbsim.LogLevel.DEBUG

        def set_level(self, level: Any) -> None:
            self.level = level

        def message(self, text: str) -> None:
            if self.level >= jsbsim.LogLevel.ERROR:
                self.lines.append(text)

        def file_location(self, file: str, line: int) -> None: ...

        def format(self, hint: Any) -> None: ...

        def flush(self) -> None: ...

    log = Log()
    jsbsim.set_logger(log)
    return log
