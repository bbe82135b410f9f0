"""RLSimpleSensor: what RLSimple observes."""

from tussle.stock.sensor.rl_simple_sensor.plugin import RLSimpleSensor

__all__ = ["RLSimpleSensor"]
