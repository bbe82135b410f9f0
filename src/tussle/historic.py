"""Plugins with SCRIMMAGE's laws, by name: `from tussle.historic import SimpleAircraft`."""

from tussle.plugins.historic import __dir__ as __dir__
from tussle.plugins.historic import __getattr__ as __getattr__
from tussle.plugins.historic import load as load
from tussle.plugins.historic import manifest as manifest

__path__: list[str] = []  # former modules are found by tussle.former_names
