"""MultirotorControllerOmega: drives the rotors of a Multirotor directly."""

from tussle.plugins.stock.controller.multirotor_controller_omega.plugin import MultirotorControllerOmega

__all__ = ["MultirotorControllerOmega"]
