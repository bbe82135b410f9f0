"""SceneCollision: removes entities that touch walls, buildings, hills or the ground."""

from tussle.plugins.stock.interaction.scene_collision.plugin import SceneCollision

__all__ = ["SceneCollision"]
