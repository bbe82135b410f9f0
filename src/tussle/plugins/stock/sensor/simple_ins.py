"""Inertial navigation that drifts without satellite navigation."""

from __future__ import annotations

import numpy as np

from tussle.api import GroupView, Output, Param, Sensor, State, Subscribe, service
from tussle.declare.messages import GPSStatus
from tussle.numeric.quaternion import quat_conjugate, quat_from_euler, quat_multiply

PAIR = "mean sd"
SURFACE_TIMES = np.array([15.0, 30.0, 45.0, 60.0])
"""Times from which the wait for a correction is drawn [s]."""
ROUGH = 60.0
"""Further time to wait in a sea state above 1 [s]."""


class SimpleINS(Sensor):
    """Dead reckoning by an inertial navigation system, as the entity's belief.

    The position error is a random walk: on each axis it grows, per second, by a normal number with the mean and the standard deviation of
    `pos_noise`, times the acceleration along this axis in m/s^2 (a factor of at most 1). After a GPS of the entity has had a fix for the
    surface time, error and variance are reset; the surface time is drawn when the fix is lost. Velocity and attitude have independent noise
    at each call, the attitude about the body's x, then y, then z axis. `ins_cep` is the radius of the circle around the belief that holds
    the position with a probability of 50 %, from the standard deviations of the horizontal error, 1 m after a correction; the approximation
    is within 1.5 %.

    SCRIMMAGE added the noise in each step, whatever its length; took the change of velocity over 0.01 s for the acceleration;
    and grew the variance by the absolute value of noise that was not that of the error.
    """

    grade = "portable"

    pos_noise_0 = Param((0.0, 5.0), fields=PAIR, unit="m", doc="Growth of the error of x in a second.")
    pos_noise_1 = Param((0.0, 5.0), fields=PAIR, unit="m", doc="Growth of the error of y.")
    pos_noise_2 = Param((0.0, 1.0), fields=PAIR, unit="m", doc="Growth of the error of z.")
    vel_noise_0 = Param((0.0, 5.0), fields=PAIR, unit="m/s", doc="Error of the velocity's x.")
    vel_noise_1 = Param((0.0, 5.0), fields=PAIR, unit="m/s", doc="Error of the velocity's y.")
    vel_noise_2 = Param((0.0, 1.0), fields=PAIR, unit="m/s", doc="Error of the velocity's z.")
    orient_noise_0 = Param((0.0, 5.0), fields=PAIR, unit="rad", doc="Rotation error about the body's x axis.")
    orient_noise_1 = Param((0.0, 5.0), fields=PAIR, unit="rad", doc="Rotation error about the body's y axis.")
    orient_noise_2 = Param((0.0, 1.0), fields=PAIR, unit="rad", doc="Rotation error about the body's z axis.")
    sea_state_gps = Param(5.0, ge=0.0, doc="Sea state; above 1 the wait for a correction is 60 s longer.")
    error = State("x y z", unit="m", doc="Position error.")
    variance = State("x y", default=1.0, unit="m^2", doc="Variance of the horizontal position error.")
    last_vel = State("x y z", unit="m/s", doc="Velocity at the last call.")
    has_fix = State(dtype=bool, doc="Whether GPS had a fix when it was last received.")
    waited = State(unit="s", doc="Time since the fix was regained.")
    surface_time = State(unit="s", doc="Time with a fix before a correction.")
    status = Subscribe(GPSStatus, network="LocalNetwork")
    belief_pos = Output("belief_pos_x belief_pos_y belief_pos_z", unit="m", doc="Believed position.")
    belief_vel = Output("belief_vel_x belief_vel_y belief_vel_z", unit="m/s", doc="Believed velocity.")
    belief_quat = Output(
        "belief_quat_w belief_quat_x belief_quat_y belief_quat_z", doc="Believed attitude, body to world."
    )
    ins_cep = Output(unit="m", doc="Circular error probable of the position.")

    def spawn(self, g: GroupView, rows: np.ndarray) -> None:
        self.last_vel[:, rows] = g.vel[:, rows]

    @service
    def velocity_noise(self, g: GroupView) -> np.ndarray:
        """Return the standard deviations of the errors of the velocity [m/s], (3, n), world frame, for plugins that pass it on."""
        return np.stack([self.vel_noise_0[1], self.vel_noise_1[1], self.vel_noise_2[1]])

    def step(self, g: GroupView) -> None:
        """Update the belief of all rows."""
        self._correct(g)
        self._drift(g)
        self.last_vel[:] = g.vel
        self.belief_pos[:] = g.pos + self.error
        mean, sd = np.stack([self.vel_noise_0, self.vel_noise_1, self.vel_noise_2], axis=1)
        self.belief_vel[:] = g.vel + mean + sd * g.normal("vel", 3)
        mean, sd = np.stack([self.orient_noise_0, self.orient_noise_1, self.orient_noise_2], axis=1)
        roll, pitch, yaw = mean + sd * g.normal("orient", 3)
        # Rx Ry Rz is the inverse of Rz(-) Ry(-) Rx(-), which quat_from_euler computes.
        turn = quat_conjugate(quat_from_euler(-roll, -pitch, -yaw))
        self.belief_quat[:] = quat_multiply(g.quat, turn)
        small, large = np.sqrt(np.sort(self.variance, axis=0))
        ratio = small / large
        self.ins_cep[:] = large * np.where(ratio < 0.5, 0.67 + 0.8 * ratio * ratio, 0.59 * (1.0 + ratio))

    def _drift(self, g: GroupView) -> None:
        """Let the position error and its variance grow."""
        accel = np.minimum(1.0, np.abs(g.vel - self.last_vel) / g.dt)
        mean, sd = np.stack([self.pos_noise_0, self.pos_noise_1, self.pos_noise_2], axis=1)
        root = np.sqrt(g.dt)
        self.error[:] += accel * (mean * g.dt + sd * root * g.normal("pos", 3))
        self.variance[:] += (accel * sd * root)[:2] ** 2

    def _correct(self, g: GroupView) -> None:
        """Reset the error of entities whose GPS has had a fix for the surface time."""
        rows, messages = self.status.latest()
        self.has_fix[rows] = messages.has_fix
        wait = SURFACE_TIMES[(4.0 * g.uniform("surface")).astype(np.int64)]
        wait += np.where(self.sea_state_gps > 1.0, ROUGH, 0.0)
        self.waited[:] = np.where(self.has_fix, self.waited + g.dt, 0.0)
        self.surface_time[:] = np.where(self.has_fix, self.surface_time, wait)
        is_corrected = self.has_fix & (self.waited > self.surface_time)
        self.error[:, is_corrected] = 0.0
        self.variance[:, is_corrected] = 1.0
