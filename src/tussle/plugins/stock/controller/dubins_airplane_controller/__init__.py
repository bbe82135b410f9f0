"""DubinsAirplaneController: flies a Dubins airplane to a heading, an altitude and a speed."""

from tussle.plugins.stock.controller.dubins_airplane_controller.plugin import DubinsAirplaneController

__all__ = ["DubinsAirplaneController"]
