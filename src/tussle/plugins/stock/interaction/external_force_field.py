"""Forces and moments of the air on all entities."""

from __future__ import annotations

import numpy as np

from tussle.api import Interaction, Param, State, WorldView
from tussle.numeric import cos, sin
from tussle.numeric.dryden import at_start, gust, low_altitude, passed
from tussle.numeric.quaternion import quat_rotate

TAU = 6.283185307179586


class ExternalForceField(Interaction):
    """Pushes all entities with a force that is constant, changes at random, or follows from Dryden gusts, and turns them near the ground.

    The values of `force_type` are:

    * constant: `constant_force`.
    * variable: one force for all entities of a world, redrawn after random times.
    * dryden: `drag` times the gust velocity of each entity, with the spectra of MIL-F-8785C (1980) section 3.7.3. Intensity and length
      scales follow from the height, clamped to 10 to 1000 ft, and from the wind at 20 ft. An entity flies through the gusts at its speed
      relative to the wind.

    Between two heights moments about the body axes act, amplitude times sin(2 pi t / period). Motion models without forces ignore
    all of this.
    """

    grade = "portable"

    force_type = Param("constant", choices=("constant", "variable", "dryden"), doc="Kind of force.")
    constant_force = Param((1.0, 0.0, 0.0), fields="x y z", unit="N", doc="Force, world frame.")
    force_change_period = Param(
        (1.0, 0.1), fields="mean sd", unit="s", doc="Time between changes of the force."
    )
    variable_force_0 = Param(
        (0.0, 5.0), fields="mean sd", unit="N", doc="East component of the variable force."
    )
    variable_force_1 = Param((0.0, 5.0), fields="mean sd", unit="N", doc="North component.")
    variable_force_2 = Param((0.0, 1.0), fields="mean sd", unit="N", doc="Upward component.")
    wind_speed = Param(
        7.7, unit="m/s", ge=0.0, doc="Mean wind at 20 ft (6.1 m); 7.7 m/s is light turbulence."
    )
    wind_heading = Param(0.0, unit="rad", text_unit="deg", doc="Direction to which the wind blows.")
    drag = Param(1.0, unit="N s/m", ge=0.0, doc="Force per gust velocity.")
    moment_enable_min_z = Param(-10.0, unit="m", doc="Least height at which moments act.")
    moment_enable_max_z = Param(0.5, unit="m", doc="Largest height at which moments act.")
    moment_roll_period = Param(1.0, unit="s", gt=0.0)
    moment_roll_amplitude = Param(0.0, unit="N m", doc="Moment about the body x axis.")
    moment_pitch_period = Param(1.0, unit="s", gt=0.0)
    moment_pitch_amplitude = Param(0.0, unit="N m", doc="Moment about the body y axis, nose down positive.")
    moment_yaw_period = Param(1.0, unit="s", gt=0.0)
    moment_yaw_amplitude = Param(0.0, unit="N m", doc="Moment about the body z axis.")
    force = State("x y z", unit="N", per="world", doc="Current variable force.")
    changes_at = State(unit="s", default=-np.inf, per="world", doc="Time at which it changes.")
    filters = State("u v1 v2 w1 w2", per="entity", doc="States of the gust filters, of unit variance.")
    is_known = State(dtype=bool, per="entity", doc="Whether the filters have begun.")

    def check_values(self) -> None:
        """Check that no lower limit is above its upper one."""
        self.check_order("moment_enable_min_z", "moment_enable_max_z")

    def step(self, w: WorldView) -> None:
        if self.force_type == "constant":
            w.bodies.force[:] += self.constant_force[:, w.world]
        elif self.force_type == "variable":
            self._change(w)
            w.bodies.force[:] += self.force[:, w.world]
        else:
            w.bodies.force[:] += self.drag[w.world] * self._gusts(w)
        if (
            self.moment_roll_amplitude + self.moment_pitch_amplitude + self.moment_yaw_amplitude != 0.0
        ).any():
            self._turn(w)

    def _change(self, w: WorldView) -> None:
        due = np.flatnonzero(w.t + 1e-6 * w.dt >= self.changes_at)
        draw = w.normal("change", 4)[:, due]
        spread = (self.variable_force_0, self.variable_force_1, self.variable_force_2)
        for i, (mean, sd) in enumerate(spread):
            self.force[i, due] = mean[due] + sd[due] * draw[i]
        mean, sd = self.force_change_period[:, due]
        self.changes_at[due] = w.t[due] + np.maximum(0.0, mean + sd * draw[3])

    def _gusts(self, w: WorldView) -> np.ndarray:
        """Advance the filters, and return the gust velocity [m/s], (3, n), world frame."""
        wind, (c, s) = self.wind_speed[w.world], (cos(self.wind_heading), sin(self.wind_heading))
        c, s = c[w.world], s[w.world]
        x, y, z = w.vel - np.array([wind * c, wind * s, np.zeros(w.n)])
        path = w.dt * np.sqrt(x * x + y * y + z * z)
        scale_uv, scale_w, sd_uv, sd_w = low_altitude(w.pos[2], wind)
        draw = w.normal_by("gust", w.world, w.id, np.zeros(w.n, np.int64), 5)
        self.filters[:] = np.where(
            self.is_known, passed(self.filters, path / scale_uv, path / scale_w, draw), at_start(draw)
        )
        self.is_known[:] = True
        along, across, up = gust(self.filters) * np.array([sd_uv, sd_uv, sd_w])
        return np.array([c * along - s * across, s * along + c * across, up])

    def _turn(self, w: WorldView) -> None:
        z, world = w.pos[2], w.world
        acts = (z >= self.moment_enable_min_z[world]) & (z <= self.moment_enable_max_z[world])
        amplitudes = (self.moment_roll_amplitude, self.moment_pitch_amplitude, self.moment_yaw_amplitude)
        periods = (self.moment_roll_period, self.moment_pitch_period, self.moment_yaw_period)
        moment = np.array([a * sin(TAU * w.t / p) for a, p in zip(amplitudes, periods, strict=True)])
        rows = np.flatnonzero(acts)
        w.bodies.torque[:, rows] += quat_rotate(w.quat[:, rows], moment[:, world[rows]])
