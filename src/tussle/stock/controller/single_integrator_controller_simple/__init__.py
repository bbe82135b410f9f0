"""SingleIntegratorControllerSimple: passes a desired velocity through."""

from tussle.stock.controller.single_integrator_controller_simple.plugin import (
    SingleIntegratorControllerSimple,
)

__all__ = ["SingleIntegratorControllerSimple"]
