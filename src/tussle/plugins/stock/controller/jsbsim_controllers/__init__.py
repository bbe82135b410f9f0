"""Controllers of aircraft in JSBSim."""

from tussle.plugins.stock.controller.jsbsim_controllers.plugin import (
    JSBSimControlControllerHeadingPID,
    JSBSimModelControllerDirect,
    JSBSimModelControllerHeadingPID,
)

__all__ = [
    "JSBSimControlControllerHeadingPID",
    "JSBSimModelControllerDirect",
    "JSBSimModelControllerHeadingPID",
]
