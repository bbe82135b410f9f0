"""A rigid body moved by thrust and torques."""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.api import (
    HistoricAttributes,
    InertiaParam,
    Input,
    MassProperties,
    MotionBody,
    Param,
    RigidBodyModel,
)
from tussle.numeric.rigid_body import add, cross, scale, solve, state_rates, times, to_body, to_world

ALIGNMENT_TIME = 0.2
"""Time constant [s] with which sideslip decays and the speed is held within its limits."""


class RigidBody6DOF(RigidBodyModel):
    """A rigid body without weight that flies where its nose points, driven by thrust and by torques about its axes.

    I w' = T - w x I w (Euler); u' = thrust / mass along the body x axis, reduced near min_velocity and max_velocity so that the speed
    does not pass them; velocity along the body y and z axes decays with a time constant of 0.2 s, as if by lift and side force.
    The mass is that of the block. External forces and torques act on it.

    Differences from SCRIMMAGE: there the rates were overwritten by 0.001 rad/s before each step, so that the model could not
    be steered, and the velocity of the body was never written.
    """

    grade = "portable"
    historic_attributes = HistoricAttributes(unread=("max_roll", "max_pitch"))

    min_velocity = Param(0.0, unit="m/s", ge=0.0, doc="Lowest speed along the body x axis.")
    max_velocity = Param(40.0, unit="m/s", ge=0.0, doc="Highest speed along the body x axis.")
    inertia_matrix = InertiaParam((1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0), doc="Inertia tensor.")
    thrust = Input(doc="Force along the body x axis [N].")
    elevator = Input(doc="Torque about the body y axis [N m], nose down positive.")
    aileron = Input(doc="Torque about the body x axis [N m], right wing down positive.")
    rudder = Input(doc="Torque about the body z axis [N m], left positive.")

    def check_values(self) -> None:
        """Check that no lower limit is above its upper one."""
        self.check_order("min_velocity", "max_velocity")

    @staticmethod
    def derivative(
        rigid_body: Any,
        thrust: float,
        elevator: float,
        aileron: float,
        rudder: float,
        force: Any,
        torque: Any,
        mass: float,
        min_velocity: float,
        max_velocity: float,
        inertia_matrix: Any,
    ) -> Any:
        """State equation."""
        velocity = rigid_body[3], rigid_body[4], rigid_body[5]
        omega = rigid_body[10], rigid_body[11], rigid_body[12]
        u, v, w = to_body(rigid_body, velocity)
        push = min(
            max(thrust / mass, (min_velocity - u) / ALIGNMENT_TIME), (max_velocity - u) / ALIGNMENT_TIME
        )
        relative = to_world(rigid_body, (push, -v / ALIGNMENT_TIME, -w / ALIGNMENT_TIME))
        turning = cross(to_world(rigid_body, omega), velocity)
        acceleration = add(add(relative, turning), scale(1.0 / mass, force))
        moments = add((aileron, elevator, rudder), to_body(rigid_body, torque))
        gyroscopic = cross(times(inertia_matrix, omega), omega)
        return state_rates(rigid_body, acceleration, solve(inertia_matrix, add(moments, gyroscopic)))

    def mass_properties(self, body: MotionBody) -> MassProperties:
        """Mass and inertia; there is no weight."""
        return super().mass_properties(body)._replace(weight=np.zeros(body.n))
