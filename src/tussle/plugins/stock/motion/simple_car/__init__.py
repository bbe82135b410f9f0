"""SimpleCar: a car that follows a speed and a steering angle."""

from tussle.plugins.stock.motion.simple_car.plugin import SimpleCar

__all__ = ["SimpleCar"]
