"""Plugins with SCRIMMAGE's laws, by name: `from tussle.historic import SimpleAircraft`."""

from tussle.plugins.historic import __dir__, __getattr__, load, manifest

__all__ = ["__dir__", "__getattr__", "load", "manifest"]
__path__: list[str] = []  # former modules are found by tussle.former_names
