"""SimpleCarControllerHeading: drives a car at a speed and a heading."""

from tussle.plugins.stock.controller.simple_car_controller_heading.plugin import SimpleCarControllerHeading

__all__ = ["SimpleCarControllerHeading"]
