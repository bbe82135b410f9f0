"""Aircraft of JSBSim's format, compiled to kernels."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from tussle.aircraft.compile import CompiledAircraft, compile_aircraft, save_source
from tussle.aircraft.files import package_root
from tussle.aircraft.initial import Script, place_by_quaternion, read_script, run_initial
from tussle.aircraft.node import AircraftError
from tussle.aircraft.trim import LinearModel, TrimPoint, level_flight, linearize, throttles_of, trim
from tussle.api import Input, MotionBody, Param, RigidBodyModel
from tussle.api.range_kernel import RangeKernel
from tussle.declare import units
from tussle.errors import ParameterError, listed, nearest_name
from tussle.numeric import cos, sin
from tussle.numeric.dryden import at_start
from tussle.numeric.quaternion import quat_conjugate, quat_multiply, quat_rotate, quat_rotate_inverse
from tussle.plugins.stock.motion.jsbsim_compiled import flightgear, flying
from tussle.plugins.stock.motion.jsbsim_compiled.flying import BODY, FOOT, SLOTS
from tussle.world.geodesy import Origin

KNOT = float(units.NAUTICAL_MILE / 3600)  # [m/s]
ROWS_PER_THREAD = 64
"""A step of an aircraft takes half a microsecond, starting a thread 50."""
SURFACES = "fcs/elevator-cmd-norm", "fcs/aileron-cmd-norm", "fcs/rudder-cmd-norm"
SETPOINTS = "ap/bank_setpoint", "ap/altitude_setpoint", "ap/airspeed_setpoint"
ALTITUDE = "position/geod-alt-ft"
WIND = "atmosphere/wind-north-fps", "atmosphere/wind-east-fps", "atmosphere/wind-down-fps"
GUST = "atmosphere/gust-north-fps", "atmosphere/gust-east-fps", "atmosphere/gust-down-fps"
GROUND = "position/terrain-elevation-asl-ft"
FORWARD_RIGHT_DOWN = np.array([[0.0], [1.0], [0.0], [0.0]])
"""Rotation between body axes forward, left, up and forward, right, down."""
TWO_TO_53 = 2.0**53
MIRRORED = np.array([[1.0], [-1.0], [-1.0]])


TRIMS = "none", "longitudinal", "full"


class SteadyFlightParam(Param):
    """Name of a trim. It has no `choices`, because the conformance kit would try all, and its aircraft cannot be trimmed."""

    def convert(self, value: Any, where: str = "", from_geodetic: Callable[..., Any] | None = None) -> Any:
        """Check the name.

        Raises:
            ParameterError: There is no such trim.
        """
        name = super().convert(value, where, from_geodetic)
        if name not in TRIMS:
            raise ParameterError(
                f"{self._place(where)} = {name!r} is not allowed{nearest_name(name, TRIMS)}; {listed(TRIMS)}"
            )
        return name


class Flown:
    """A compiled aircraft with the slots that the plugin sets and reads."""

    def __init__(
        self, aircraft: CompiledAircraft, settings: tuple[tuple[str, float], ...], is_autopilot: bool
    ) -> None:
        self.aircraft, self.settings = aircraft, settings
        self.is_autopilot = is_autopilot
        at = aircraft.slots
        self.throttles = throttles_of(aircraft)
        self.surfaces = [(k, at[name]) for k, name in enumerate(SURFACES) if name in at]
        if is_autopilot:
            self.setpoints = [aircraft.slot(name) for name in SETPOINTS]
        self.altitude = at[ALTITUDE]

    def commands(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the constants of `flying.flight`, floats and integers. Throttle and surfaces are clamped to their limits.

        An autopilot takes bank [rad], altitude above the ellipsoid [ft] and airspeed [knot].
        """
        infinite = np.inf
        if self.is_autopilot:
            roll, altitude, speed = self.setpoints
            found = [
                (0, roll, -1, 1.0, -infinite, infinite),
                (1, altitude, self.altitude, FOOT, -infinite, infinite),
                (2, speed, -1, KNOT, -infinite, infinite),
            ]
        else:
            found = [(0, slot, -1, 1.0, 0.0, 1.0) for slot in self.throttles]
            found += [(1 + k, slot, -1, 1.0, -1.0, 1.0) for k, slot in self.surfaces]
        tables = self.aircraft.tables
        numbers = np.concatenate([tables, *([unit, low, high] for *_, unit, low, high in found)])
        wholes = [self.aircraft.advance.address, len(found)]
        for k, (given, slot, base, *_) in enumerate(found):
            wholes += [given, slot, base, len(tables) + 3 * k]
        return numbers, np.array(wholes, np.int64)


@cache
def compiled(root: str, aircraft: str, script: str, is_autopilot: bool, is_shown: bool) -> Flown:
    """Return the aircraft of a plugin, compiled once per process.

    Raises:
        ParameterError: It cannot be read or compiled.
    """
    folder = Path(root) if root else None
    chosen = read_script(folder or package_root(), script) if script else Script(aircraft, ())
    keep = [ALTITUDE, *(name for name, _ in chosen.settings), *(SETPOINTS if is_autopilot else ())]
    try:
        made = compile_aircraft(folder, chosen.aircraft, keep, flightgear.PROPERTIES if is_shown else ())
    except AircraftError as error:
        raise ParameterError(
            f"JSBSimCompiled: {error}; --set motion=JSBSimControl flies it by JSBSim itself"
        ) from None
    return Flown(made, chosen.settings, is_autopilot)


class JSBSimCompiled(RigidBodyModel):
    """An aircraft of JSBSim's file format, compiled to one kernel for all its entities.

    Its equations, models and integrators are those of JSBSim (J. S. Berndt 2004, "JSBSim: an open source flight dynamics model in
    C++") in their order, so that flights equal JSBSim's; one step per substep of the mission, 1/120 s is usual. Parameters and inputs
    are those of JSBSimControl, and with commands="autopilot" those of JSBSimModel. Commands of surfaces are in [-1, 1], the throttle of
    all engines in [0, 1]. Engines run from the start. Parts that cannot be compiled are refused by name; JSBSimControl flies such aircraft.

    Gusts have the spectra of MIL-F-8785C (1980) section 3.7, along and across the flight through the air, and change in each substep.
    Below 1000 ft above the origin's tangent plane their scales and intensity follow from the height and the wind at 20 ft, above 2000 ft
    the scales are 1750 ft, and between they change linearly. Gusts do not turn the air.

    A FlightGear receives the packets that JSBSim would send, without temperatures of engines and angles of wheels; each aircraft
    sends its own, so let one have the address.

    `source()` writes the generated Python, which can be read, to the folder of compiled kernels, and returns its path:
    `python -c "from tussle.stock import JSBSimCompiled; print(JSBSimCompiled(aircraft='c172p').source().read_text())"` prints it;
    see [Six degrees of freedom](../six-degrees.md#generated-code).

    Raises:
        ParameterError: The aircraft cannot be read, or has something that is not compiled.
    """

    grade = "portable"
    script_name = Param(
        "", doc="File below `scripts` that names an aircraft and sets properties at the start."
    )
    aircraft = Param("", doc="Folder below `aircraft`, in place of a script.")
    jsbsim_root = Param(
        "", doc="Folder of aircraft, engine, systems and scripts; empty for those of the package jsbsim."
    )
    trim = SteadyFlightParam(
        "none",
        doc="Trim at the start: none; longitudinal, by pitch, throttle and elevator trim; or full, by bank and the other surfaces too.",
    )
    commands = Param(
        "surfaces",
        choices=["surfaces", "autopilot"],
        doc="Commands: control surfaces, or setpoints of the autopilot.",
    )
    wind = Param(
        (0.0, 0.0, 0.0), fields="east north up", unit="m/s", doc="Mean velocity of the air, world frame."
    )
    gusts = Param("none", choices=["none", "dryden"], doc="Gusts, drawn for each aircraft.")
    gust_wind_speed = Param(
        7.7,
        unit="m/s",
        ge=0.0,
        le=30.0,
        doc="Wind at 20 ft (6.1 m) that makes gusts below 2000 ft (610 m); 7.7 m/s is light turbulence.",
    )
    gust_deviation = Param(
        1.5,
        unit="m/s",
        ge=0.0,
        le=30.0,
        doc="Standard deviation of each component of gusts above 2000 ft (610 m).",
    )
    flightgear_output_enable = Param(
        False, structural=True, doc="Send the states to a FlightGear, by UDP, at most 30 times a second."
    )
    flightgear_ip = Param("localhost", doc="Its address.")
    flightgear_port = Param(5600, structural=True, ge=1, le=65535, doc="Its port.")
    throttle = Input(doc="Throttle.")
    elevator = Input(doc="Elevator, nose down positive.")
    aileron = Input(doc="Aileron, right wing down positive.")
    rudder = Input(doc="Rudder.")
    desired_roll = Input(unit="rad", doc="Desired bank, right wing down.")
    desired_altitude = Input(unit="m", doc="Desired height above the origin's tangent plane.")
    desired_speed = Input(unit="m/s", doc="Desired airspeed.")
    by_autopilot: ClassVar[tuple[str, ...]] = ("desired_roll", "desired_altitude", "desired_speed")

    @property
    def flown(self) -> Flown:
        """The compiled aircraft.

        Raises:
            ParameterError: Neither or both of aircraft and script_name are given, or it cannot be compiled.
        """
        own = self.values
        if bool(own["script_name"]) == bool(own["aircraft"]):
            raise ParameterError("JSBSimCompiled takes script_name or aircraft, one of them")
        return compiled(
            own["jsbsim_root"], own["aircraft"], own["script_name"], own["commands"] == "autopilot",
            own["flightgear_output_enable"],
        )  # fmt: skip

    def source(self) -> Path:
        """Write the generated Python of the aircraft's kernels to the cache folder, to be read; return its path."""
        return save_source(self.flown.aircraft)

    def steady_flight(self, speed: float, altitude: float) -> TrimPoint:
        """Return steady level flight at a speed [m/s] and an altitude [m], in calm air.

        Raises:
            ParameterError: Steady flight is impossible, or the aircraft cannot be compiled.
        """
        return level_flight(self.flown.aircraft, speed, altitude)

    def linearize(self, speed: float, altitude: float) -> LinearModel:
        """Return the matrices of the linear model of steady level flight, e.g. for a linear-quadratic regulator.

        Raises:
            ParameterError: As `steady_flight`.
        """
        return linearize(self.flown.aircraft, self.steady_flight(speed, altitude))

    def active_inputs(self) -> list[str]:
        """Return the inputs of the surfaces, or of the autopilot."""
        is_autopilot = self.values["commands"] == "autopilot"
        return [name for name in type(self).inputs() if (name in self.by_autopilot) == is_autopilot]

    def state_size(self, name: str) -> int:
        """Return the number of components: rigid body, world frame, all slots of the aircraft, and the state of gusts."""
        return SLOTS + len(self.flown.aircraft.slots) + (flying.GUSTS if self.is_gusty else 0)

    @property
    def is_gusty(self) -> bool:
        """True if there are gusts."""
        return bool(self.values["gusts"] == "dryden")

    def from_body(self, body: MotionBody, rows: np.ndarray) -> None:
        """Start the aircraft of some rows at their positions, with their velocities and rates, engines running."""
        flown, n = self.flown, len(rows)
        aircraft, origin = flown.aircraft, body.scene.origin
        frame, center = earth_frame(origin)
        x = np.repeat(aircraft.first[:, None], n, axis=1)
        latitude, longitude, _ = origin.to_geodetic(body.pos[:, rows])
        position = (quat_rotate(frame, body.pos[:, rows]) + np.array(center)[:, None]) / FOOT
        quat = quat_multiply(frame, quat_multiply(body.quat[:, rows], FORWARD_RIGHT_DOWN))
        velocity = quat_rotate(frame, body.vel[:, rows]) / FOOT
        rates = MIRRORED * quat_rotate_inverse(body.quat[:, rows], body.omega[:, rows])
        place_by_quaternion(x, position, quat, velocity, rates)
        at = aircraft.slots
        wind = (
            quat_rotate_inverse(local_frame(latitude, longitude), quat_rotate(frame, self.wind[:, rows]))
            / FOOT
        )
        for name, value in zip(WIND, wind, strict=True):
            x[at[name]] = value
        if GROUND in at:
            x[at[GROUND]] = origin.altitude / FOOT
        for name, number in flown.settings:
            x[aircraft.slot(name)] = number
        trimmed = self.values["trim"]
        if trimmed == "none":
            run_initial(aircraft, x, body.dt)
            aircraft.start(x, aircraft.tables, 0, n, 1, 0.0, body.dt)
        else:
            x = trim(aircraft, x, body.dt, full=trimmed == "full").state
            attitude = quat_multiply(quat_conjugate(frame), quat_multiply(x[:4], FORWARD_RIGHT_DOWN))
            body.quat[:, rows], body.omega[:, rows] = attitude, 0.0
        state = self.rigid_body
        state[BODY:SLOTS, rows] = np.concatenate([frame, np.array(center)[:, None]])
        state[SLOTS : SLOTS + len(x), rows] = x
        if self.is_gusty:
            filters = at_start(body.normal("gusts", 5)[:, rows])
            seeds = np.floor(TWO_TO_53 * body.uniform("seeds of gusts")[rows])
            own = [seeds, 0.0 * seeds, self.gust_wind_speed[rows], self.gust_deviation[rows]]
            state[SLOTS + len(x) :, rows] = np.concatenate([filters, own])
        super().from_body(body, rows)

    @property
    def kernel(self) -> RangeKernel:
        """The kernel that makes steps of all aircraft."""
        numbers, wholes = self.flown.commands()
        if not self.is_gusty:
            return RangeKernel(flying.flight(), numbers, wholes, ROWS_PER_THREAD)
        slots = self.flown.aircraft.slots
        places = [SLOTS + len(slots), *(SLOTS + slots[name] for name in (ALTITUDE, GROUND, *WIND, *GUST))]
        wholes = np.concatenate([wholes, np.array(places)])
        return RangeKernel(flying.gusty_flight(), numbers, wholes, ROWS_PER_THREAD)

    @property
    def range_kernel(self) -> RangeKernel | None:
        """The kernel, None if states are sent after steps."""
        return None if self.values["flightgear_output_enable"] else self.kernel

    @property
    def advance(self) -> Any:
        """The function that makes steps of all aircraft."""
        fly = self.kernel.advance
        if not self.values["flightgear_output_enable"]:
            return fly
        viewer = self.values["flightgear_ip"], self.values["flightgear_port"]
        aircraft = self.flown.aircraft

        def advance(x: np.ndarray, u: np.ndarray, p: np.ndarray, dt: float, substeps: int) -> None:
            """Make steps of all aircraft, and send their states."""
            fly(x, u, p, dt, substeps)
            flightgear.send(x[SLOTS:], aircraft.slots, aircraft.n_engines, dt, *viewer)

        return advance


def earth_frame(origin: Origin) -> tuple[np.ndarray, tuple[float, float, float]]:
    """Return the quaternion from the world frame to Earth-centred axes, (4, 1), and the origin in these axes [m]."""
    half = np.sqrt(0.5)
    local = local_frame(np.array([origin.latitude]), np.array([origin.longitude]))
    return quat_multiply(local, np.array([[0.0], [half], [half], [0.0]])), origin.earth_centred


def local_frame(latitude: np.ndarray, longitude: np.ndarray) -> np.ndarray:
    """Return quaternions from axes north, east, down at geodetic positions [rad], (n,), to Earth-centred axes, (4, n)."""
    zero, a, b = np.zeros_like(latitude), 0.5 * longitude, 0.5 * (-0.5 * np.pi - latitude)
    return np.asarray(
        quat_multiply(np.stack([cos(a), zero, zero, sin(a)]), np.stack([cos(b), zero, sin(b), zero]))
    )
