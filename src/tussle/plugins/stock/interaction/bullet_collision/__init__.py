"""BulletCollision: contact forces between bodies, and between bodies and the scene."""

from tussle.plugins.stock.interaction.bullet_collision.plugin import BulletCollision

__all__ = ["BulletCollision"]
