"""AvoidEntityMS: a behaviour that avoids other entities."""

from tussle.plugins.stock.autonomy.avoid_entity_ms.plugin import AvoidEntityMS

__all__ = ["AvoidEntityMS"]
