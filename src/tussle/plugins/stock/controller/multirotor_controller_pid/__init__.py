"""Velocity and heading loops for Multirotor."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from tussle.api import Controller, GroupView, Input, Output, Param, State
from tussle.errors import ParameterError
from tussle.numeric import total
from tussle.plugins.stock.controller.multirotor_controller_pid import kernels

GAINS = "kp ki kd band"
MAX_ROTORS = 8
LOOPS = " ".join(
    f"{loop}_{k}" for loop in ("x", "y", "z", "p", "q", "yaw") for k in ("integral", "error", "has_error")
)
MIXER = " ".join(f"{load}_{i}" for i in range(MAX_ROTORS) for load in ("thrust", "roll", "pitch", "yaw"))
MIN_PIVOT = 1e-9


def mixer_of(rotors: Any) -> list[list[float]]:
    """Thrusts of rotors [direction x y z roll pitch yaw] by loads: G^T (G G^T)^-1, the solution of G T = loads of least square sum.

    The loads are total thrust, moments about x and y, and moment about z over the torque per thrust; a tilt of rotors is ignored.

    Raises:
        ParameterError: The rotors cannot give every load.
    """
    rows = [[1.0, y, -x, direction] for direction, x, y, *_ in rotors]
    n = range(4)
    system = [[total(row[i] * row[j] for row in rows) for j in n] + [float(i == j) for j in n] for i in n]
    for i in n:
        pivot = max(range(i, 4), key=lambda k: abs(system[k][i]))
        system[i], system[pivot] = system[pivot], system[i]
        if abs(system[i][i]) < MIN_PIVOT:
            raise ParameterError(
                f"MultirotorControllerPID: {len(rows)} rotors at {[row[1:3] for row in rows]} cannot give every thrust, roll, pitch and "
                "yaw moment; it takes at least four rotors, not in a line, that turn in both directions"
            )
        system[i] = [value / system[i][i] for value in system[i]]
        for k in n:
            if k != i:
                system[k] = [a - system[k][i] * b for a, b in zip(system[k], system[i], strict=True)]
    return [[total(row[k] * system[k][4 + j] for k in n) for j in n] for row in rows]


class MultirotorControllerPID(Controller):
    """Flies a Multirotor to a velocity and a heading, by the speeds of its rotors.

    The velocity error commands an acceleration; the thrust is turned to the force that it needs, with a tilt of at most 35 degrees; the
    angle between them commands body rates, which are followed with a time constant of 0.05 s. Mass, inertia, rotors and coefficients are
    those of the motion model. Without writers of the inputs the vehicle hovers and faces East. The integral of a loop is zero while its
    error exceeds `band`.

    In SCRIMMAGE it is a stub that sets the hover speed and is not connected to the motion model.

    Raises:
        ParameterError: The rotors cannot give every thrust and moment.
    """

    grade = "portable"
    needed_services = ("airframe",)

    yaw_pid = Param(
        (0.2, 0.01, 0.001, math.radians(9.0)), fields=GAINS, unit="1/s 1/s^2 1 rad", text_unit="1/s 1/s^2 1 deg",
        doc="Heading to turn rate.",
    )  # fmt: skip
    vel_pid = Param(
        (1.0, 0.1, 0.0, 1.0), fields=GAINS, unit="1/s 1/s^2 1 m/s", doc="Velocity to acceleration."
    )
    angle_pid = Param((1.0, 0.1, 0.0, 1.0), fields=GAINS, unit="1/s 1/s^2 1 rad", doc="Tilt to body rates.")
    velocity = Input(
        "velocity_x velocity_y velocity_z", unit="m/s", optional=True, doc="Desired velocity, world frame."
    )
    desired_heading = Input(unit="rad", optional=True, doc="Desired heading, counter-clockwise from East.")
    motors = Output(
        " ".join(f"motor_{i}" for i in range(MAX_ROTORS)),
        unit="rad/s",
        doc="Speeds of the rotors; 0 beyond the last one.",
    )
    loops = State(LOOPS, doc="Integral, last error, and 1 after the first call, of each loop.")
    mixer = State(MIXER, doc="Thrust of each rotor by total thrust and moments.")

    def spawn(self, g: GroupView, rows: np.ndarray) -> None:
        """Distribute loads to the rotors of the motion model."""
        mixer = np.array(mixer_of(g.call("airframe")["rotor_config"])).ravel()
        self.mixer[: len(mixer), rows] = mixer[:, None]

    def step(self, g: GroupView) -> None:
        """Write the speeds of the rotors."""
        frame = g.call("airframe")
        n_rotors = len(frame["rotor_config"])
        own = tuple(frame[name] for name in ("gravity_magnitude", "mass", "inertia_matrix", "c_T", "c_Q"))
        body = (*g.components("vel"), *g.components("quat"), *g.components("omega"))
        gains = self.vel_pid, self.angle_pid, self.yaw_pid
        motors = self.motors[:n_rotors]
        kernels.fly(
            (self.velocity, self.desired_heading), body, gains, own, self.mixer, self.loops, motors, g.dt
        )
