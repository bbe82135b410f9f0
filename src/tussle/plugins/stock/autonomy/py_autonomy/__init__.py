"""PyAutonomy: runs classes of SCRIMMAGE's Python interface."""

from tussle.plugins.stock.autonomy.py_autonomy.plugin import PyAutonomy, adapted

__all__ = ["PyAutonomy", "adapted"]
