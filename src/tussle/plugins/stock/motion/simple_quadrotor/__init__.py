"""SimpleQuadrotor: a quadrotor reduced to accelerations along its own axes and a turn."""

from tussle.plugins.stock.motion.simple_quadrotor.plugin import SimpleQuadrotor

__all__ = ["SimpleQuadrotor"]
