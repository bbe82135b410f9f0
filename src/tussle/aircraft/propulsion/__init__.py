"""Engines, thrusters and tanks of aircraft."""

from tussle.aircraft.propulsion.kernels import RUNTIME
from tussle.aircraft.propulsion.model import Propulsion, read_propulsion

__all__ = ["RUNTIME", "Propulsion", "read_propulsion"]
