"""Entities that meet are gone."""

from tussle.stock.interaction.simple_collision.plugin import SimpleCollision

__all__ = ["SimpleCollision"]
