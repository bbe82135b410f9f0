"""PX4: a vehicle is flown by PX4's simulated flight controller."""

from tussle.plugins.stock.autonomy.px4.plugin import PX4

__all__ = ["PX4"]
