"""DIS: entities are shared with other simulators by IEEE 1278.1."""

from tussle.plugins.stock.interaction.dis.plugin import DIS

__all__ = ["DIS"]
