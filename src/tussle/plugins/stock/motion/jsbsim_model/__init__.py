"""JSBSimModel and JSBSimControl: aircraft flown by JSBSim."""

from tussle.plugins.stock.motion.jsbsim_model.plugin import JSBSimControl, JSBSimModel

__all__ = ["JSBSimControl", "JSBSimModel"]
