"""Direct control of the rotors of a Multirotor."""

from __future__ import annotations

import numpy as np

from tussle.api import Controller, GroupView, Input, Output, Param

MAX_ROTORS = 8
ROTORS = range(MAX_ROTORS)


class MultirotorControllerOmega(Controller):
    """Passes the speeds omega_0, omega_1, ... or pulse widths pwm_0, pwm_1, ... to the rotors of a Multirotor.

    A pulse width in [pwm_min, pwm_max] gives linearly a speed in [omega_min, omega_max] of the motion model.

    In SCRIMMAGE it takes them from a state object of the autonomy, and is not connected to the motion model.
    """

    grade = "portable"
    needed_services = ("airframe",)

    pwm_min = Param(1000.0, doc="Pulse width of omega_min [us].")
    pwm_max = Param(2000.0, doc="Pulse width of omega_max [us].")
    command = Param("pwm", choices=("pwm", "omega"), doc="Quantity that is commanded.")
    for _i in ROTORS:
        vars()[f"pwm_{_i}"] = Input(optional=_i > 0, doc=f"Pulse width of rotor {_i} [us].")
        vars()[f"omega_{_i}"] = Input(unit="rad/s", optional=_i > 0, doc=f"Speed of rotor {_i}.")
    motors = Output(" ".join(f"motor_{i}" for i in ROTORS), unit="rad/s", doc="Speeds of the rotors.")

    def check_values(self) -> None:
        """Check the range of pulse widths."""
        self.check_range("pwm_min", "pwm_max")

    def active_inputs(self) -> list[str]:
        """Return the pulse widths or the speeds."""
        return [f"{self.command}_{i}" for i in ROTORS]

    def step(self, g: GroupView) -> None:
        """Write the speeds of the rotors."""
        given = np.array([getattr(self, name) for name in self.active_inputs()])
        if self.command == "pwm":
            frame = g.call("airframe")
            share = (given - self.pwm_min) / (self.pwm_max - self.pwm_min)
            given = frame["omega_min"] + share * (frame["omega_max"] - frame["omega_min"])
        self.motors[:] = given
