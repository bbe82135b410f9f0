"""Multirotor: a rigid body with rotors."""

from tussle.plugins.stock.motion.multirotor.plugin import Multirotor

__all__ = ["Multirotor"]
