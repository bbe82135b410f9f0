"""MOOSAutonomy: a helm of MOOS-IvP steers a vehicle."""

from tussle.plugins.stock.autonomy.moos.plugin import MOOSAutonomy

__all__ = ["MOOSAutonomy"]
