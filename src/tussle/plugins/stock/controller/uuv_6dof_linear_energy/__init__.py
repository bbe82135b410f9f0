"""UUV6DOFLinearEnergy: a battery discharged by the throttle."""

from tussle.plugins.stock.controller.uuv_6dof_linear_energy.plugin import UUV6DOFLinearEnergy

__all__ = ["UUV6DOFLinearEnergy"]
