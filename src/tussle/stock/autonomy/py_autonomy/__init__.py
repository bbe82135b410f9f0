"""PyAutonomy: runs classes of SCRIMMAGE's Python interface."""

from tussle.stock.autonomy.py_autonomy.plugin import PREFIX, PyAutonomy, adapted, is_python_autonomy

__all__ = ["PREFIX", "PyAutonomy", "adapted", "is_python_autonomy"]
