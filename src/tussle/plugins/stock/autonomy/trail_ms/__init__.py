"""TrailMS: a behaviour that follows an entity."""

from tussle.plugins.stock.autonomy.trail_ms.plugin import TrailMS

__all__ = ["TrailMS"]
