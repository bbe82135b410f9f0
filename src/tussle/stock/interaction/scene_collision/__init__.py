"""SceneCollision: removes entities that touch walls, buildings, hills or the ground."""

from tussle.stock.interaction.scene_collision.plugin import SceneCollision

__all__ = ["SceneCollision"]
