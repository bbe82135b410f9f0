"""A rigid body with rotors."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from tussle.api import GroupView, InertiaParam, Input, Param, PositiveParam, RigidBodyModel, service
from tussle.errors import ParameterError
from tussle.numeric.quaternion import quat_from_euler, quat_rotate
from tussle.numeric.rigid_body import add, cross, newton_euler, scale, to_body, to_world

MAX_ROTORS = 8
PLUS = ((-1.0, 0.0, -0.175), (-1.0, 0.0, 0.175), (1.0, 0.175, 0.0), (1.0, -0.175, 0.0))


class RotorsParam(Param):
    """A list of rotors; in a text the direction is CW or CCW, seen from above.

    Raises:
        ParameterError: There is no rotor, there are more than eight, or a direction is neither 1 nor -1.
    """

    def read(self, text: str, from_geodetic: Callable[..., Any] | None = None) -> Any:
        """Parse a text such as "[CCW 0 -0.2 0 0 0 0] [CW 0.2 0 0 0 0 0]"."""
        return super().read(text.replace("CCW", "-1").replace("CW", "1"), from_geodetic)

    def convert(self, value: Any, where: str = "", from_geodetic: Callable[..., Any] | None = None) -> Any:
        """Check and convert rotors."""
        rotors = super().convert(value, where, from_geodetic)
        if not 1 <= len(rotors) <= MAX_ROTORS or any(abs(rotor[0]) != 1.0 for rotor in rotors):
            text = f"1 to {MAX_ROTORS} rows [CW or CCW x y z roll pitch yaw]"
            raise ParameterError(f"{self._place(where)} = {value!r} is not allowed; it takes {text}")
        return rotors


class Multirotor(RigidBodyModel):
    """A multirotor: m v' = R sum(T_i) - c_D |v| v / 2 - m g, I w' = sum(r_i x T_i + d_i c_Q w_i^2 n_i) - w x I w.

    Rotor i at r_i turns at motor_i = w_i, clamped to [omega_min, omega_max]. Its thrust T_i = c_T w_i^2 n_i is along its axis n_i, the
    body z axis turned by its roll, pitch and yaw; d_i is 1 for a rotor that turns clockwise seen from above (its torque turns the body
    to the left), else -1. Bouabdallah 2007, "Design and control of quadrotors with application to autonomous flying", chapter 2,
    without hub forces. At most eight rotors.

    Differences from SCRIMMAGE: a rotor at omega_min has thrust; height and tilt of rotors are used; body velocity and world
    velocity are one state, which starts at the velocity of the entity; weight, drag and gyroscopic moment are those of each stage of
    the integration, not of the start of the step; external forces are forces, not the test of a contact with the ground.
    """

    grade = "portable"

    gravity_magnitude = Param(9.81, unit="m/s^2", ge=0.0, doc="Acceleration of gravity.")
    mass = PositiveParam(1.5, unit="kg", doc="Mass.")
    inertia_matrix = InertiaParam(
        (0.0122, 0.0, 0.0, 0.0, 0.0122, 0.0, 0.0, 0.0, 0.0244), doc="Inertia tensor."
    )
    c_D = Param(0.058, unit="kg/m", ge=0.0, doc="Drag coefficient: the drag is c_D |v| v / 2.")  # noqa: N815
    c_T = PositiveParam(5.45e-6, unit="kg m", doc="Thrust of a rotor over the square of its speed.")  # noqa: N815
    c_Q = PositiveParam(2.284e-7, unit="kg m^2", doc="Torque of a rotor over the square of its speed.")  # noqa: N815
    omega_max = Param(1200.0, unit="rad/s", ge=0.0, doc="Highest speed of a rotor.")
    omega_min = Param(346.41, unit="rad/s", ge=0.0, doc="Lowest speed of a rotor.")
    rotor_config = RotorsParam(
        tuple((*rotor, 0.0, 0.0, 0.0, 0.0) for rotor in PLUS),
        fields="direction x y z roll pitch yaw",
        unit="1 m m m rad rad rad",
        text_unit="1 m m m deg deg deg",
        ragged=True,
        structural=True,
        doc="Direction (CW or CCW), position and attitude of each rotor, body frame.",
    )
    motor_0 = Input(unit="rad/s", doc="Speed of the first rotor.")
    motor_1 = Input(unit="rad/s", doc="Speed of the second rotor.")
    motor_2 = Input(unit="rad/s", doc="Speed of the third rotor.")
    motor_3 = Input(unit="rad/s", doc="Speed of the fourth rotor.")
    motor_4 = Input(unit="rad/s", doc="Speed of the fifth rotor.")
    motor_5 = Input(unit="rad/s", doc="Speed of the sixth rotor.")
    motor_6 = Input(unit="rad/s", doc="Speed of the seventh rotor.")
    motor_7 = Input(unit="rad/s", doc="Speed of the eighth rotor.")

    def check_values(self) -> None:
        """Check that no lower limit is above its upper one."""
        self.check_order("omega_min", "omega_max")

    @staticmethod
    def derivative(
        rigid_body: Any,
        force: Any,
        torque: Any,
        gravity_magnitude: float,
        mass: float,
        inertia_matrix: Any,
        c_D: float,  # noqa: N803
        c_T: float,  # noqa: N803
        c_Q: float,  # noqa: N803
        omega_max: float,
        omega_min: float,
        rotor_config: Any,
        motor_0: float,
        motor_1: float = 0.0,
        motor_2: float = 0.0,
        motor_3: float = 0.0,
        motor_4: float = 0.0,
        motor_5: float = 0.0,
        motor_6: float = 0.0,
        motor_7: float = 0.0,
    ) -> Any:
        """State equation."""
        motors = motor_0, motor_1, motor_2, motor_3, motor_4, motor_5, motor_6, motor_7
        lift, moment = (0.0, 0.0, 0.0), to_body(rigid_body, torque)
        for i in range(len(rotor_config)):
            turning, x, y, z, roll, pitch, yaw = rotor_config[i]
            w, a, b, c = quat_from_euler(roll, pitch, yaw)
            axis = quat_rotate(w, a, b, c, 0.0, 0.0, 1.0)
            speed = min(max(motors[i], omega_min), omega_max)
            thrust = scale(c_T * speed * speed, axis)
            lift = add(lift, thrust)
            moment = add(moment, add(cross((x, y, z), thrust), scale(turning * c_Q * speed * speed, axis)))
        vx, vy, vz = rigid_body[3], rigid_body[4], rigid_body[5]
        drag = scale(-0.5 * c_D * math.sqrt(vx * vx + vy * vy + vz * vz), (vx, vy, vz))
        total = add(add(to_world(rigid_body, lift), drag), force)
        return newton_euler(rigid_body, total, moment, mass, inertia_matrix, gravity_magnitude)

    def active_inputs(self) -> list[str]:
        """Return one input per rotor."""
        return [f"motor_{i}" for i in range(len(self.rotor_config))]

    @service
    def airframe(self, g: GroupView) -> dict[str, np.ndarray]:
        """Return gravity, mass, inertia, rotor coefficients and limits of each row, (n,) or (9, n), for controllers of this model.

        `rotor_config` is (rotors, 7).
        """
        names = "gravity_magnitude", "mass", "inertia_matrix", "c_T", "c_Q", "omega_max", "omega_min"
        return {**{name: getattr(self, name) for name in names}, "rotor_config": np.array(self.rotor_config)}
