"""Multirotor: a rigid body with rotors."""

from tussle.stock.motion.multirotor.plugin import Multirotor

__all__ = ["Multirotor"]
