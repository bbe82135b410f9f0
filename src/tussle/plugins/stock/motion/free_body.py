"""A rigid body in free fall."""

from __future__ import annotations

from typing import Any

from tussle.api import InertiaParam, Param, RigidBodyModel
from tussle.numeric.paths import GRAVITY
from tussle.numeric.rigid_body import newton_euler, to_body


class FreeBody(RigidBodyModel):
    """A rigid body with weight that tumbles freely: m v' = F - m g, I w' = T - w x I w (Newton, Euler).

    F and T are external, such as those of contacts. The default inertia is that of a solid sphere of 1 kg and 1 m, 2/5 m r^2; a box
    has m (b^2 + c^2) / 12 about an axis at right angles to its edges b and c.
    """

    grade = "portable"

    gravity_magnitude = Param(GRAVITY, unit="m/s^2", ge=0.0, doc="Acceleration of gravity.")
    inertia_matrix = InertiaParam((0.4, 0.0, 0.0, 0.0, 0.4, 0.0, 0.0, 0.0, 0.4), doc="Inertia tensor.")

    @staticmethod
    def derivative(
        rigid_body: Any, force: Any, torque: Any, mass: float, gravity_magnitude: float, inertia_matrix: Any
    ) -> Any:
        """State equation."""
        moment = to_body(rigid_body, torque)
        return newton_euler(rigid_body, force, moment, mass, inertia_matrix, gravity_magnitude)
