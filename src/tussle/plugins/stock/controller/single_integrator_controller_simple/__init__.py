"""SingleIntegratorControllerSimple: passes a desired velocity through."""

from tussle.plugins.stock.controller.single_integrator_controller_simple.plugin import (
    SingleIntegratorControllerSimple,
)

__all__ = ["SingleIntegratorControllerSimple"]
