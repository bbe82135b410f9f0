"""JSBSimModel and JSBSimControl as in SCRIMMAGE."""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.numeric import clip
from tussle.numeric.quaternion import quat_from_euler, quat_to_pitch, quat_to_roll, quat_to_yaw
from tussle.plugins.stock.motion import jsbsim_model
from tussle.plugins.stock.motion.jsbsim_model.flight import THROTTLES
from tussle.plugins.stock.motion.jsbsim_model.plugin import JSBSimAircraft
from tussle.world.geodesy import Origin

METRE, KNOT = 3.28084, 0.5144444
"""SCRIMMAGE's metre [ft] and knot [m/s]."""
DECIMALS = 6
"""Number of decimals of degrees and metres in positions that are given to JSBSim."""


class SphericalEarth(JSBSimAircraft):
    """Flight over a sphere, whose latitudes are taken for those of the ellipsoid; abstract.

    Axes north, east, down at the aircraft are those at the origin. Places are rounded to 1e-6 degrees. An aircraft makes its first step
    when it is born, with engines that its script starts.
    """

    is_historic = True

    def stand_in(self, is_moving: bool) -> tuple[str, dict[str, Any], str]:
        """Return none: compiled aircraft fly over the ellipsoid."""
        return "", {}, ""

    def start_values(self, body: Any, rows: np.ndarray) -> np.ndarray:
        """Return the states of some rows as the properties PLACE and MOTION, (12, m)."""
        latitude, longitude, altitude = self.flight[rows[0]].origin.to_geodetic(body.pos[:, rows])
        place = [np.radians(np.round(np.degrees(angle), DECIMALS)) for angle in (latitude, longitude)]
        quat, (east, north, up) = body.quat[:, rows], body.vel[:, rows]
        compass = np.radians(_turned(np.round(np.degrees(quat_to_yaw(quat)), DECIMALS)))
        angles = quat_to_roll(quat), -quat_to_pitch(quat), compass
        forward, left, above = self.rigid_body[10:, rows]
        height, velocity = METRE * np.round(altitude, DECIMALS), METRE * np.stack([north, east, -up])
        return np.stack([*place, height, *angles, *velocity, forward, -left, -above])

    def place(self, body: Any, rows: np.ndarray, start: np.ndarray, n_steps: int | np.ndarray = 0) -> None:
        """Place the aircraft of some rows, and show where their first steps have led them."""
        super().place(body, rows, start, n_steps)
        body.pos[:, rows], body.vel[:, rows], body.quat[:, rows], body.omega[:, rows] = np.split(
            self.rigid_body[:, rows], (3, 6, 10)
        )

    def rigid_states(self, read: np.ndarray, origin: Origin) -> np.ndarray:
        """Return position, velocity, attitude and body rates, (13, m), from values of the properties STATE, (m, 12)."""
        latitude, longitude, height, roll, pitch, heading, north, east, down, forward, right, below = read.T
        velocity = np.stack([east, north, -down]) / METRE
        quat = quat_from_euler(roll, -pitch, np.radians(_turned(np.degrees(heading))))
        place = origin.from_geodetic(np.stack([latitude, longitude, height / METRE]))
        return np.concatenate([place, velocity, quat, [forward, -right, -below]])


class JSBSimModel(SphericalEarth, jsbsim_model.JSBSimModel):
    """JSBSimModel over a sphere. Its attitude besides the heading, its velocity and the height of the ground are those of its script.

    The ground is at sea level if the script says nothing else, so that aircraft fly below the origin. An entity that is born with a
    velocity starts with it, with its own attitude, and without the step at the birth: so a recorded run is begun again.
    """

    ground_of_origin = False

    def spawn(self, body: Any, rows: np.ndarray) -> None:
        """Place the aircraft of some rows."""
        start, is_still = self.start_values(body, rows), ~body.vel[:, rows].any(axis=0)
        start[3:5, is_still] = start[6:, is_still] = np.nan
        self.place(body, rows, start, is_still)

    def commands(self, u: np.ndarray) -> np.ndarray:
        """Return bank [rad], altitude [ft], and airspeed [knot]."""
        roll, height, speed = u
        origin = next(flight.origin for flight in self.flight if flight is not None)
        place = origin.to_geodetic(np.stack([*self.rigid_body[:2], height]))
        return np.stack([roll, METRE * place[2], speed / KNOT])


class JSBSimControl(SphericalEarth, jsbsim_model.JSBSimControl):
    """JSBSimControl over a sphere, whose throttle, that of the first engine, is closed until 0.05 s.

    An aircraft that is born without a velocity has none.
    """

    commanded = (f"{THROTTLES}[0]", *jsbsim_model.JSBSimControl.commanded[1:])
    throttle_from = 0.05

    def spawn(self, body: Any, rows: np.ndarray) -> None:
        """Place the aircraft of some rows, which then make a step."""
        self.place(body, rows, self.start_values(body, rows), 1)

    def commands(self, u: np.ndarray) -> np.ndarray:
        """Return the inputs, within their limits."""
        return np.asarray(clip(u, -1.0, 1.0))


def _turned(angle: np.ndarray) -> np.ndarray:
    """A compass heading of an angle counter-clockwise from East, and back [deg], in [0, 360)."""
    return np.asarray(np.mod(90.0 - angle, 360.0))


__all__ = ["JSBSimControl", "JSBSimModel"]
