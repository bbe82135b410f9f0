"""SingleIntegrator: a point that moves with the commanded velocity."""

from tussle.plugins.stock.motion.single_integrator.plugin import SingleIntegrator

__all__ = ["SingleIntegrator"]
