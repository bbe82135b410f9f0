"""Messages between plugins, and what they are made of."""

from tussle.declare.messages import *
from tussle.declare.messages import __all__  # noqa: F401 - a name of this module too
