"""Sensors with the laws of SCRIMMAGE."""

from __future__ import annotations

import numpy as np

from tussle.api import GroupView, HistoricAttributes, Param, Publish, Subscribe
from tussle.declare.messages import GPSStatus
from tussle.plugins.stock.sensor import gps, los_sensor, ray_trace, rigid_body_6dof_state_sensor, simple_ins


class GPS(gps.GPS):
    """GPS that sends its measurements to all entities, uses only the last boundary, and measures without a fix too.

    The boundary is known from the end of the first step on. Ids without a boundary are ignored.
    """

    status = Publish(GPSStatus, network="GlobalNetwork")

    def named_regions(self) -> tuple[float, ...]:
        """Return none: an id without a boundary is no error."""
        return ()

    def step(self, g: GroupView) -> None:
        denied = super().named_regions()
        self.coordinates[:] = g.scene.origin.to_geodetic(g.pos)
        has_fix = np.ones(g.n, bool)
        if g.context.regions and g.context.regions[-1].boundary in denied:
            has_fix &= ~g.context.regions[-1].shape.contains(g.pos) | (g.step_count == 0)
        self.gps_fix[:], self.gps_time[:] = has_fix, g.t
        self.status.publish(np.arange(g.n), geodetic=self.coordinates, has_fix=has_fix, t=self.gps_time)


class LOSSensor(los_sensor.LOSSensor):
    """The range is `oor_return`, 150 m, also where the ground is nearer than `min_range`, and that to the scene by default.

    Without `min_range` and `max_range` both are 1 m. SCRIMMAGE's file of the plugin spells `use_flat_earth` with another
    underscore, so its value there has no effect.
    """

    historic_attributes = HistoricAttributes(
        unread=("use_flat_earth_", *los_sensor.LOSSensor.historic_attributes.unread)
    )

    min_range = Param(1.0, unit="m", ge=0.0, doc="Smallest range.")
    max_range = Param(1.0, unit="m", ge=0.0, doc="Largest range.")
    oor_return = Param(150.0, unit="m", doc="Range that is reported out of range.")
    use_flat_earth = Param(
        False, structural=True, doc="See the plane z = 0 only; otherwise ground and walls of the scene."
    )
    tells_near = False


class RayTrace(ray_trace.RayTrace):
    """The range of a ray that is not in range is `max_range`, whatever the reason, and the ray ends there."""

    def _near_end(self, rows: np.ndarray) -> np.ndarray:
        return np.asarray(self.max_range[rows])

    def _scan(self, g: GroupView, rows: np.ndarray, pattern: np.ndarray) -> np.ndarray:
        scan = super()._scan(g, rows, pattern)
        scan[3] = np.where(scan[4] > 0.0, scan[3], np.repeat(self.max_range[rows], pattern.shape[1]))
        return scan


class RigidBody6DOFStateSensor(rigid_body_6dof_state_sensor.RigidBody6DOFStateSensor):
    """RigidBody6DOFStateSensor that ignores its noise."""

    def step(self, g: GroupView) -> None:
        super().step(g)
        self.measured_pos[:] = g.pos


ASSUMED_DT = 0.01  # [s]


class SimpleINS(simple_ins.SimpleINS):
    """SimpleINS whose error grows by the noise of a second in each step, and that uses the GPS of every entity.

    The acceleration is the change of the velocity over 0.01 s, whatever the step. The variance grows by the absolute value of another
    draw of the noise.
    """

    status = Subscribe(GPSStatus, network="GlobalNetwork")

    def _drift(self, g: GroupView) -> None:
        accel = np.minimum(1.0, np.abs(g.vel - self.last_vel) / ASSUMED_DT)
        mean, sd = np.stack([self.pos_noise_0, self.pos_noise_1, self.pos_noise_2], axis=1)
        self.error[:] += accel * (mean + sd * g.normal("pos", 3))
        self.variance[:] += np.abs(mean + sd * g.normal("variance", 3))[:2]
