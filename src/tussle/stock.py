"""Plugins that ship, by name: `from tussle.stock import Boids`."""

from tussle.plugins.stock import __dir__ as __dir__
from tussle.plugins.stock import __getattr__ as __getattr__
from tussle.plugins.stock import examples as examples
from tussle.plugins.stock import load as load
from tussle.plugins.stock import manifest as manifest

__path__: list[str] = []  # former modules are found by tussle.former_names
