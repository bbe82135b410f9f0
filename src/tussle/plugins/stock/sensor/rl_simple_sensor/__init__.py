"""RLSimpleSensor: observations for RLSimple."""

from tussle.plugins.stock.sensor.rl_simple_sensor.plugin import RLSimpleSensor

__all__ = ["RLSimpleSensor"]
