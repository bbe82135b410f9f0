"""FlightGearMultiplayer: FlightGear shows the entities as aircraft of other players."""

from tussle.plugins.stock.autonomy.flight_gear_multiplayer.plugin import FlightGearMultiplayer

__all__ = ["FlightGearMultiplayer"]
