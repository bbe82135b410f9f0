"""DoubleIntegratorControllerWaypoint: flies a double integrator to a point."""

from tussle.plugins.stock.controller.double_integrator_controller_waypoint.plugin import (
    DoubleIntegratorControllerWaypoint,
)

__all__ = ["DoubleIntegratorControllerWaypoint"]
