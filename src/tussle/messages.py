"""Messages between plugins, and what they are made of."""

from tussle.declare.messages import *
from tussle.declare.messages import WAYPOINT_MODES, __all__  # noqa: F401 - names of this module too
