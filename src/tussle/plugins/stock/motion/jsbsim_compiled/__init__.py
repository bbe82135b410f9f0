"""Aircraft of JSBSim's format, compiled to kernels."""

from tussle.plugins.stock.motion.jsbsim_compiled.plugin import JSBSimCompiled

__all__ = ["JSBSimCompiled"]
