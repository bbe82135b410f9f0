"""A torpedo-shaped underwater vehicle."""

from __future__ import annotations

from typing import Any

from tussle.api import InertiaParam, Input, MassProperties, MotionBody, Param, PositiveParam, RigidBodyModel
from tussle.numeric import clip
from tussle.numeric.rigid_body import add, cross, scale, state_rates, to_body, to_world
from tussle.plugins.stock.motion.uuv_6dof import kernels

FORWARD, REVERSE = 3.6936, 2.0  # largest thrust [N]; forwards it balances the drag at 1.51 m/s
PROPELLER_MOMENT = -0.543  # of the propeller at the largest thrust [N m] (Prestero 2001, section 4.6)
FIN_MAX = 0.2373648  # largest angle of the fins [rad]
DIAMETER = 0.191  # of the hull [m] (Prestero 2001, table 2.1)


class UUV6DOF(RigidBodyModel):
    """The REMUS underwater vehicle: rigid body with added mass, damping, body and fin lift, propeller, weight and buoyancy.

    Prestero 2001, "Verification of a six-degree of freedom simulation model for the REMUS autonomous underwater vehicle", section 4.5,
    with its coefficients (appendix C). At full throttle it runs at about 1.5 m/s, banked by 5.3 degrees by the propeller. throttle,
    elevator and rudder are clamped to [-1, 1]; no throttle is no thrust. A positive elevator lowers the nose, a positive rudder turns
    left. Above `surface_height` less half of the hull's diameter buoyancy falls linearly to zero, so that the vehicle floats.

    Differences from SCRIMMAGE: there the forces of inertia of the rigid body were missing, added mass acted twice, the velocity
    of the body followed another equation than its position, no throttle gave thrust, damping in roll was a hundredth of Prestero's, and
    the surface was a wall.
    """

    grade = "portable"

    gravity_magnitude = Param(9.81, unit="m/s^2", ge=0.0, doc="Acceleration of gravity.")
    surface_height = Param(0.0, unit="m", doc="Height of the surface of the water.")
    inertia_matrix = InertiaParam(
        (0.177, 0.0, 0.0, 0.0, 3.45, 0.0, 0.0, 0.0, 3.45), doc="Inertia tensor about the origin."
    )
    mass = PositiveParam(30.479102956, unit="kg", doc="Mass.")
    buoyancy = Param(306.0, unit="N", ge=0.0, doc="Buoyancy under water.")
    c_b = Param((0.0, 0.0, 0.0), fields="x y z", unit="m", doc="Center of buoyancy; forward, right, down.")
    c_g = Param(
        (0.0, 0.0, 0.0196),
        fields="x y z",
        unit="m",
        ge=-0.1,
        le=0.1,
        doc="Center of gravity; forward, right, down.",
    )
    Xuu = Param(-1.62, unit="kg/m", le=0.0, doc="Axial drag.")
    Yvv = Param(-131.0, unit="kg/m", le=0.0, doc="Side drag.")
    Zww = Param(-131.0, unit="kg/m", le=0.0, doc="Vertical drag.")
    Mww = Param(3.18, unit="kg", doc="Pitch moment of vertical drag.")
    Yrr = Param(0.632, unit="kg*m/rad^2", doc="Side force by yaw rate.")
    Mqq = Param(-9.4, unit="kg*m^2/rad^2", le=0.0, doc="Damping in pitch.")
    throttle = Input(doc="Thrust in [-1, 1] of the largest.")
    elevator = Input(doc="Stern planes in [-1, 1], nose down positive.")
    rudder = Input(doc="Rudder in [-1, 1], left positive.")

    @staticmethod
    def derivative(
        rigid_body: Any,
        throttle: float,
        elevator: float,
        rudder: float,
        force: Any,
        torque: Any,
        gravity_magnitude: float,
        surface_height: float,
        inertia_matrix: Any,
        mass: float,
        buoyancy: float,
        c_b: Any,
        c_g: Any,
        Xuu: float,  # noqa: N803
        Yvv: float,  # noqa: N803
        Zww: float,  # noqa: N803
        Mww: float,  # noqa: N803
        Yrr: float,  # noqa: N803
        Mqq: float,  # noqa: N803
    ) -> Any:
        """State equation; in axes forward, right, down, the second and third components have the other sign."""
        power = min(max(throttle, -1.0), 1.0)
        planes, turned = FIN_MAX * min(max(elevator, -1.0), 1.0), FIN_MAX * min(max(rudder, -1.0), 1.0)
        vx, vy, vz = to_body(rigid_body, (rigid_body[3], rigid_body[4], rigid_body[5]))
        velocity, omega = (vx, -vy, -vz), (rigid_body[10], -rigid_body[11], -rigid_body[12])
        wet = min(max(0.5 + (surface_height - rigid_body[2]) / DIAMETER, 0.0), 1.0)
        up_x, up_y, up_z = to_body(rigid_body, (0.0, 0.0, 1.0))
        up = up_x, -up_y, -up_z
        weight, lift = scale(-mass * gravity_magnitude, up), scale(wet * buoyancy, up)
        ex, ey, ez = to_body(rigid_body, force)
        tx, ty, tz = to_body(rigid_body, torque)
        applied = power * (FORWARD if power > 0.0 else REVERSE) + ex, -ey, -ez
        driven = PROPELLER_MOMENT * power + tx, -ty, -tz
        drag = Xuu, Yvv, Zww, Mww, Yrr, Mqq
        flow, flow_moment = kernels.hydrodynamic_loads(velocity, omega, (planes, turned), drag)
        inertial, inertial_moment = kernels.inertial_loads(velocity, omega, mass, c_g, inertia_matrix)
        hydrostatic = add(cross(c_g, weight), cross(c_b, lift))
        total = add(add(add(flow, inertial), add(weight, lift)), applied)
        moment = add(add(flow_moment, inertial_moment), add(hydrostatic, driven))
        (a, b, c), (p, q, r) = kernels.accelerations(total, moment, mass, c_g, inertia_matrix)
        turning = cross(omega, velocity)
        moved = to_world(rigid_body, (a + turning[0], -b - turning[1], -c - turning[2]))
        return state_rates(rigid_body, moved, (p, -q, -r))

    def mass_properties(self, body: MotionBody) -> MassProperties:
        """Mass, inertia, and the weight in water: less the buoyancy, as in `derivative`."""
        found = super().mass_properties(body)
        wet = clip(0.5 + (self.surface_height - body.pos[2]) / DIAMETER, 0.0, 1.0)
        return found._replace(weight=found.weight - wet * self.buoyancy)
