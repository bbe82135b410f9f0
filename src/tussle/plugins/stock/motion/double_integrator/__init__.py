"""DoubleIntegrator: a point mass that follows an acceleration command."""

from tussle.plugins.stock.motion.double_integrator.plugin import DoubleIntegrator

__all__ = ["DoubleIntegrator"]
