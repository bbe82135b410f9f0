"""TerrainGenerator: random hills."""

from tussle.stock.interaction.terrain_generator.plugin import TerrainGenerator

__all__ = ["TerrainGenerator"]
