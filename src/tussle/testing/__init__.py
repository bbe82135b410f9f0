"""For an author's own tests: `check_plugin(MyPlugin)` holds a plugin to the contract."""

from tussle.testing.check import check_plugin

__all__ = ["check_plugin"]
