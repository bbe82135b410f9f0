"""The static scene of a mission, and what it is made of."""

from tussle.world.scene import *
from tussle.world.scene import __all__  # noqa: F401 - a name of this module too
