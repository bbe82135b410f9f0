"""SingleIntegratorControllerWaypoint: flies a single integrator to a point."""

from tussle.plugins.stock.controller.single_integrator_controller_waypoint.plugin import (
    SingleIntegratorControllerWaypoint,
)

__all__ = ["SingleIntegratorControllerWaypoint"]
