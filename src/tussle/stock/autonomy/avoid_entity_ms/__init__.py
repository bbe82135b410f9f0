"""AvoidEntityMS: a behaviour that avoids other entities."""

from tussle.stock.autonomy.avoid_entity_ms.plugin import AvoidEntityMS

__all__ = ["AvoidEntityMS"]
