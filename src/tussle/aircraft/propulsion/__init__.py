"""Engines, thrusters and tanks of aircraft."""

from tussle.aircraft.propulsion.model import Propulsion, read_propulsion
from tussle.aircraft.propulsion.runtime import RUNTIME

__all__ = ["RUNTIME", "Propulsion", "read_propulsion"]
