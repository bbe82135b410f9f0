"""SimpleQuadrotorControllerLQR: flies a quadrotor to a point and a heading."""

from tussle.plugins.stock.controller.simple_quadrotor_controller_lqr.plugin import (
    SimpleQuadrotorControllerLQR,
)

__all__ = ["SimpleQuadrotorControllerLQR"]
