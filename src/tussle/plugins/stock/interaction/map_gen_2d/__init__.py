"""MapGen2D: walls from an image."""

from tussle.plugins.stock.interaction.map_gen_2d.plugin import MapGen2D

__all__ = ["MapGen2D"]
