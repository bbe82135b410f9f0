"""The ground as the end of a flight, or as what carries a vehicle."""

from tussle.stock.interaction.ground_collision.plugin import GroundCollision

__all__ = ["GroundCollision"]
