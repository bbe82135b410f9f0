"""Plugins that ship, by name: `from tussle.stock import Boids`."""

from tussle.plugins.stock import __dir__, __getattr__, examples, load, manifest

__all__ = ["__dir__", "__getattr__", "examples", "load", "manifest"]
__path__: list[str] = []  # former modules are found by tussle.former_names
