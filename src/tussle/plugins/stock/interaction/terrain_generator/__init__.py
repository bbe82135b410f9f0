"""TerrainGenerator: random hills."""

from tussle.plugins.stock.interaction.terrain_generator.plugin import TerrainGenerator

__all__ = ["TerrainGenerator"]
