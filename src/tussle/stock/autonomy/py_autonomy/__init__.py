"""PyAutonomy: runs classes of SCRIMMAGE's Python interface."""

from tussle.stock.autonomy.py_autonomy.plugin import PyAutonomy, adapted

__all__ = ["PyAutonomy", "adapted"]
