"""FixedWing6DOF: an aircraft with linear aerodynamic derivatives, and the parameters of a second one."""

from tussle.plugins.stock.motion.fixed_wing_6dof.plugin import FixedWing6DOF, FixedWing6DOFRascal

__all__ = ["FixedWing6DOF", "FixedWing6DOFRascal"]
