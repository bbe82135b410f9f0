"""Control3D: an autonomy that is controlled from the viewer."""

from tussle.plugins.stock.autonomy.control_3d.plugin import Control3D

__all__ = ["Control3D"]
