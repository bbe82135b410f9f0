"""Conformance checks for tests of plugin authors: `check_plugin(MyPlugin)` checks a plugin against the contract."""

from tussle.testing.check import check_plugin

__all__ = ["check_plugin"]
