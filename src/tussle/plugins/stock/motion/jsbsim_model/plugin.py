"""Aircraft flown by JSBSim."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from tussle.api import Handle, HistoricAttributes, Input, MotionBody, Param, RigidBodyModel
from tussle.declare import units
from tussle.errors import MissingFileError, ParameterError, SnapshotError, listed, nearest_name
from tussle.numeric import clip
from tussle.numeric.quaternion import (
    quat_conjugate,
    quat_multiply,
    quat_rotate_inverse,
    quat_to_pitch,
    quat_to_roll,
    quat_to_yaw,
)
from tussle.plugins.stock.motion.jsbsim_model import kernels
from tussle.plugins.stock.motion.jsbsim_model.compared import unlike_compiled
from tussle.plugins.stock.motion.jsbsim_model.fleet import Fleet, Flown
from tussle.plugins.stock.motion.jsbsim_model.flight import (
    FOOT,
    NOT_FINITE,
    THROTTLES,
    TRIMS,
    Aircraft,
    SavedFlight,
    is_packaged,
    root_of,
)
from tussle.plugins.stock.motion.jsbsim_model.processes import LOST, FleetProcesses, n_cores
from tussle.world.geodesy import ECCENTRICITY_SQUARED, SEMI_MAJOR, SEMI_MINOR, Origin

ONLY_HERE = "trim", "wind", "on_failure", "processes", "flightgear_output_enable"
"""Parameters whose other values than the default keep an aircraft from flying compiled."""
KNOT = float(units.NAUTICAL_MILE / 3600)  # [m/s]
FORWARD_RIGHT_DOWN = np.array([[0.0], [1.0], [0.0], [0.0]])
"""Rotation between body axes forward, left, up and forward, right, down."""
MAX_START_RATE = 20.0
"""Angular rate of an aircraft in its first second about an axis that is told [rad/s]: three turns a second."""
MIRRORED = np.array([[1.0], [-1.0], [-1.0]])
"""Signs that convert axes forward, right, down to forward, left, up, and back."""


class TrimParam(Param):
    """Name of a trim of JSBSim. It has no `choices`, because the conformance kit would try all, and its aircraft cannot be trimmed."""

    def convert(self, value: Any, where: str = "", from_geodetic: Callable[..., Any] | None = None) -> Any:
        """Check the name.

        Raises:
            ParameterError: JSBSim has no such trim.
        """
        name = super().convert(value, where, from_geodetic)
        if name not in TRIMS:
            raise ParameterError(
                f"{self._place(where)} = {name!r} is not allowed{nearest_name(name, TRIMS)}; {listed(TRIMS)}"
            )
        return name


class FlightHandle:
    """The handle of an entity: an aircraft of a fleet.

    Attributes:
        fleet: The aircraft of all entities.
        number: Number in the fleet.
        origin: Origin of the world frame.
        failure: Error that ended the flight, or empty.
    """

    def __init__(self, fleet: Fleet | FleetProcesses, origin: Origin) -> None:
        self.fleet, self.origin, self.number, self.failure = fleet, origin, next(fleet.numbers), ""


class JSBSimAircraft(RigidBodyModel):
    """An aircraft of JSBSim (J. S. Berndt 2004, "JSBSim: an open source flight dynamics model in C++"); abstract.

    JSBSim makes one step per substep of the mission; 1/120 s is usual. Its Earth is the ellipsoid WGS 84, which the scene's origin
    touches; the ground is level with the origin.
    """

    grade = "machine"
    historic_attributes = HistoricAttributes(unread=("use_pitch",))
    needed_properties: ClassVar[tuple[str, ...]] = ()
    commanded: ClassVar[tuple[str, ...]] = ()
    is_historic: ClassVar[bool] = False
    throttle_from: ClassVar[float] = 0.0
    ground_of_origin: ClassVar[bool] = True

    script_name = Param(
        doc="File below `scripts` that names an aircraft, its start and its events.", default=""
    )
    aircraft = Param("", doc="Folder below `aircraft`, in place of a script.")
    jsbsim_root = Param(
        "", doc="Folder of aircraft, engine, systems and scripts; empty for those of the package."
    )
    trim = TrimParam(
        "none", doc="Trim at the start: none, longitudinal, full, or ground for one that stands there."
    )
    wind = Param((0.0, 0.0, 0.0), fields="east north up", unit="m/s", doc="Velocity of the air, world frame.")
    flightgear_output_enable = Param(False, structural=True, doc="Send the states to a FlightGear.")
    flightgear_ip = Param("localhost", doc="Its address.")
    flightgear_port = Param(5600, structural=True, ge=1, le=65535, doc="Its port.")
    flightgear_protocol = Param("UDP", choices=["UDP", "TCP"], doc="Protocol.")
    on_failure = Param(
        "end",
        choices=["end", "remove"],
        doc="What becomes of an aircraft whose state is no longer finite: its world ends with an error, or it alone is removed.",
    )
    processes = Param(
        1,
        structural=True,
        ge=0,
        le=256,
        doc="Processes that fly the aircraft; 1 is that of the simulation, 0 is one for each core. Results do not depend on it.",
    )
    compiled = Param(
        True,
        structural=True,
        doc="In mission files: fly as JSBSimCompiled where that gives the flight of JSBSim, in a fiftieth of the time.",
    )
    flight = Handle(doc="The aircraft in JSBSim.")

    @classmethod
    def with_files(cls, given: Mapping[str, str], find: Callable[[str], Path]) -> dict[str, str]:
        """Return the folder that has the script in `scripts`, or the aircraft in `aircraft`; none if the package has it.

        Raises:
            MissingFileError: The script, the aircraft, or the aircraft of the script is missing.
        """
        script, aircraft = given.get("script_name", ""), given.get("aircraft", "")
        if given.get("jsbsim_root") or not (script or aircraft):
            return {}
        name = f"scripts/{script}" if script else f"aircraft/{aircraft}/{aircraft}.xml"
        try:
            root = root_of(find(name), name)
        except MissingFileError:
            if is_packaged(name):
                return {}
            raise
        return {"jsbsim_root": str(root)}

    def stand_in(self, is_moving: bool) -> tuple[str, dict[str, Any], str]:
        """Return JSBSimCompiled, if it takes the aircraft and flies a second of it as JSBSim does."""
        own = self.values
        if not own["compiled"] or bool(own["script_name"]) == bool(own["aircraft"]):
            return "", {}, ""
        is_autopilot = bool(self.needed_properties)
        taken = own["jsbsim_root"], own["aircraft"], own["script_name"]
        changed = [name for name in ONLY_HERE if own[name] != type(self).params()[name].default]
        if changed:
            why = f"only JSBSim itself has {changed[0]} = {own[changed[0]]!r}"
        elif not is_moving:
            why = "only JSBSim itself starts entities without a velocity, by the script; give them a <speed>"
        else:
            why = unlike_compiled(*taken, self.commanded, is_autopilot)
        if why:
            return "", {}, f"is flown by JSBSim and not compiled, fifty times as fast: {why}"
        values = dict(zip(("jsbsim_root", "aircraft", "script_name"), taken, strict=True))
        return "JSBSimCompiled", values | {"commands": "autopilot" if is_autopilot else "surfaces"}, ""

    def open_one(self, row: Any) -> FlightHandle:
        """Load the aircraft; `spawn` reports its errors.

        Raises:
            ParameterError: Not one of script_name and aircraft is given.
        """
        own = row.plugin.values
        if bool(own["script_name"]) == bool(own["aircraft"]):
            raise ParameterError(f"{type(self).__name__} takes script_name or aircraft, one of them")
        flightgear = own["flightgear_ip"], own["flightgear_port"], own["flightgear_protocol"]
        loaded = Aircraft(
            own["jsbsim_root"], own["aircraft"], own["script_name"], own["trim"],
            flightgear if own["flightgear_output_enable"] else None, self.commanded, self.needed_properties,
            self.is_historic, self.throttle_from, self.ground_of_origin,
        )  # fmt: skip
        flight = FlightHandle(self._fleet(row), row.scene.origin)
        flight.fleet.open(flight.number, loaded, row.dt)
        return flight

    def save_one(self, flight: FlightHandle) -> SavedFlight:
        """Return the record of the flight.

        Raises:
            SnapshotError: The aircraft has failed.
        """
        saved = flight.fleet.save(flight.number)
        if not saved:
            raise SnapshotError(f"an aircraft of {type(self).__name__} has failed, or {LOST}")
        return saved

    def load_one(self, row: Any, saved: SavedFlight) -> FlightHandle:
        """Repeat the flight."""
        flight = FlightHandle(self._fleet(row), row.scene.origin)
        flight.fleet.load(flight.number, saved)
        return flight

    def close_one(self, flight: FlightHandle) -> None:
        """Release the aircraft."""
        flight.fleet.close(flight.number)

    def _fleet(self, row: Any) -> Fleet | FleetProcesses:
        n = row.plugin.values["processes"] or n_cores()
        fleet: Fleet | FleetProcesses = row.shared(
            ("JSBSim", n), lambda: Fleet() if n == 1 else FleetProcesses(n)
        )
        return fleet

    def from_body(self, body: MotionBody, rows: np.ndarray) -> None:
        """Place aircraft that were moved; newborn ones are loaded later."""
        super().from_body(body, rows)
        rows = np.array([row for row in rows if self.flight[row] is not None], np.int64)
        if len(rows):
            self.place(body, rows, self.start_values(body, rows))

    def spawn(self, body: Any, rows: np.ndarray) -> None:
        """Place the aircraft of some rows. Without a velocity at its birth, an aircraft has that of its script."""
        values = self.start_values(body, rows)
        values[6:, ~body.vel[:, rows].any(axis=0)] = np.nan
        self.place(body, rows, values)

    def start_values(self, body: Any, rows: np.ndarray) -> np.ndarray:
        """Return the states of some rows as the properties PLACE and MOTION, (12, m)."""
        origin = self.flight[rows[0]].origin
        latitude, longitude, altitude = origin.to_geodetic(body.pos[:, rows])
        frames = local_frames(origin, latitude, longitude)
        attitude = quat_multiply(
            quat_conjugate(frames), quat_multiply(body.quat[:, rows], FORWARD_RIGHT_DOWN)
        )
        angles = quat_to_roll(attitude), quat_to_pitch(attitude), quat_to_yaw(attitude)
        velocity = quat_rotate_inverse(frames, body.vel[:, rows]) / FOOT
        place = np.stack([latitude, longitude, above_sea_level(latitude, altitude) / FOOT, *angles])
        return np.concatenate([place, velocity, MIRRORED * self.rigid_body[10:, rows]])

    def place(self, body: Any, rows: np.ndarray, start: np.ndarray, n_steps: int | np.ndarray = 0) -> None:
        """Place the aircraft of some rows, (12, m) as in `start_values` or NaN for the script's, and let them make n_steps steps."""
        origin = self.flight[rows[0]].origin
        latitude, longitude, _ = origin.to_geodetic(body.pos[:, rows])
        wind = quat_rotate_inverse(local_frames(origin, latitude, longitude), self.wind[:, rows]) / FOOT
        steps = np.broadcast_to(n_steps, len(rows))
        values = np.concatenate([start, wind, [body.t[rows], steps]]).T
        self._apply(rows, lambda fleet, numbers: fleet.place(numbers, values, origin))
        self._report(body)

    @property
    def advance(self) -> Any:
        """The function that makes steps of all aircraft."""
        return self.fly

    def fly(self, x: np.ndarray, u: np.ndarray, p: np.ndarray, dt: float, substeps: int) -> None:
        """Make `substeps` steps of all aircraft with the inputs (k, n); x is the state of all rows."""
        rows = np.array([row for row, flight in enumerate(self.flight) if flight is not None], np.int64)
        if len(rows):
            commands = self.commands(u).T[rows]
            self._apply(rows, lambda fleet, numbers: fleet.fly(numbers, commands, substeps))

    def to_body(self, body: MotionBody) -> None:
        """Write the states, and end the worlds of aircraft that have failed."""
        super().to_body(body)
        self._warn_of_tumbling(body)
        self._report(body)

    def commands(self, u: np.ndarray) -> np.ndarray:
        """Return the values of the properties `commanded`, (m, n), from the inputs, (k, n); by default these."""
        return u

    def _apply(self, rows: np.ndarray, act: Callable[[Fleet | FleetProcesses, list[int]], Flown]) -> None:
        """Let act(fleet, numbers) move some aircraft, and set their states. Those that have failed keep theirs."""
        flights = [self.flight[row] for row in rows]
        read, failed = act(flights[0].fleet, [flight.number for flight in flights])
        if failed:
            for flight in flights:
                flight.failure = failed.get(flight.number, "")
            is_sound = np.array([not flight.failure for flight in flights])
            read, rows = read[is_sound], rows[is_sound]
        self.rigid_body[:, rows] = self.rigid_states(read, flights[0].origin)

    def rigid_states(self, read: np.ndarray, origin: Origin) -> np.ndarray:
        """Return position, velocity, attitude and body rates, (13, m), from values of the properties STATE, (m, 12)."""
        moving = np.empty((10, len(read)))
        kernels.to_rigid_bodies(read, (origin.latitude, origin.longitude), FOOT, moving)
        place = origin.from_geodetic(np.stack([read[:, 0], read[:, 1], FOOT * read[:, 2]]))
        return np.concatenate([place, moving])

    def _warn_of_tumbling(self, body: MotionBody) -> None:
        """Warn, once, of an aircraft that turns faster in its first second than aircraft do: its data or its start are wrong."""
        rates = self.rigid_body[10:13]
        if "_has_warned" in self.__dict__ or not (np.abs(rates) > MAX_START_RATE).any():
            return
        steps = body.step_count - body.born
        fast = np.flatnonzero(
            (np.abs(rates).max(axis=0) > MAX_START_RATE) & (steps * body.context.clock.dt < 1.0)
        )
        if len(fast):
            self.__dict__["_has_warned"] = True
            row = int(fast[0])
            rate, t = math.degrees(np.abs(rates[:, row]).max()), body.context.clock.at(1.0)[body.world[row]]
            warnings.warn(
                f"{self.instance_name}: {body.who(row)} turns at {rate:.4g} deg/s at t = {t:g} s: it tumbles; look at its speed, attitude "
                "and trim at the start, and at its engines",
                RuntimeWarning,
                stacklevel=2,
            )

    def _report(self, body: Any) -> None:
        """End the worlds of aircraft that have failed, or remove these."""
        for row, flight in enumerate(self.flight):
            if flight is not None and flight.failure:
                if self.on_failure == "remove" and flight.failure.startswith(NOT_FINITE):
                    body.remove(row)
                else:
                    body.fail(row, flight.failure)


def local_frames(origin: Origin, latitude: np.ndarray, longitude: np.ndarray) -> np.ndarray:
    """Quaternions that turn vectors north, east, down at geodetic places (m,) [rad] to the world frame, (4, m)."""
    frames = np.empty((4, len(latitude)))
    kernels.local_frames(latitude, longitude, (origin.latitude, origin.longitude), frames)
    return frames


def above_sea_level(latitude: np.ndarray, altitude: np.ndarray) -> np.ndarray:
    """JSBSim's altitude [m]: radius less that of the ellipsoid at the same geocentric latitude.

    latitude: geodetic [rad], (n,); altitude: above the ellipsoid [m], (n,).
    """
    sine, cosine = np.sin(latitude), np.cos(latitude)
    normal = SEMI_MAJOR / np.sqrt(1.0 - ECCENTRICITY_SQUARED * sine * sine)
    across, along = (normal + altitude) * cosine, ((1.0 - ECCENTRICITY_SQUARED) * normal + altitude) * sine
    radius = np.hypot(across, along)
    surface = SEMI_MAJOR * SEMI_MINOR * radius / np.hypot(SEMI_MINOR * across, SEMI_MAJOR * along)
    return np.asarray(radius - surface)


class JSBSimControl(JSBSimAircraft):
    """An aircraft of JSBSim, flown by its surfaces: commands in [-1, 1], the throttle of all engines in [0, 1].

    Positive elevator lowers the nose, positive aileron the right wing; positive rudder turns the nose to the left in most aircraft.

    Differences from SCRIMMAGE: an aircraft can be named without a script and trimmed; engines run and the throttle counts from the
    start on (there, after 0.05 s); the entity has not flown when it is born; the Earth is an ellipsoid.

    Raises:
        ParameterError: JSBSim is not installed, or cannot load or trim the aircraft.
    """

    historic_attributes = HistoricAttributes(
        unread=tuple(f"{axis}_{gain}" for axis in ("roll", "pitch", "yaw") for gain in ("kp", "ki", "kd"))
    )
    commanded = (THROTTLES, "fcs/elevator-cmd-norm", "fcs/aileron-cmd-norm", "fcs/rudder-cmd-norm")
    throttle = Input(doc="Throttle.")
    elevator = Input(doc="Elevator, nose down positive.")
    aileron = Input(doc="Aileron, right wing down positive.")
    rudder = Input(doc="Rudder.")

    def commands(self, u: np.ndarray) -> np.ndarray:
        """Return the inputs, within their limits."""
        return np.stack([clip(u[0], 0.0, 1.0), *clip(u[1:], -1.0, 1.0)])


class JSBSimModel(JSBSimAircraft):
    """An aircraft of JSBSim under its own autopilot, which holds bank, altitude and airspeed.

    It sets the properties ap/bank_setpoint [rad], ap/altitude_setpoint [ft] and ap/airspeed_setpoint [knot]; the script switches the
    autopilot on. None of the aircraft of the package has a bank setpoint: `jsbsim_root` names the folder with yours.

    Differences from SCRIMMAGE: the Earth is an ellipsoid, positions are not rounded, engines run at the start, the entity has not
    flown a step when it is born, and it starts with its own attitude, and with its own velocity, if it has one.

    Raises:
        ParameterError: JSBSim is not installed, or cannot load the aircraft, or the aircraft has no such autopilot.
    """

    needed_properties = ("ap/bank_setpoint", "ap/altitude_setpoint", "ap/airspeed_setpoint")
    commanded = needed_properties
    desired_roll = Input(unit="rad", doc="Desired bank, right wing down.")
    desired_altitude = Input(unit="m", doc="Desired height above the origin's tangent plane.")
    desired_speed = Input(unit="m/s", doc="Desired airspeed.")

    def commands(self, u: np.ndarray) -> np.ndarray:
        """Return bank [rad], altitude above the ellipsoid [ft], and airspeed [knot]."""
        roll, height, speed = u
        origin = next(flight.origin for flight in self.flight if flight is not None)
        place = origin.to_geodetic(np.stack([*self.rigid_body[:2], height]))
        return np.stack([roll, place[2] / FOOT, speed / KNOT])
