"""FieldOfView: a camera that lists the entities in view."""

from tussle.plugins.stock.sensor.field_of_view.plugin import FieldOfView

__all__ = ["FieldOfView"]
