"""Export of tracks and of the mission's geometry by latitude and longitude: GeoJSON, KML, CZML."""

from tussle.view.export.geographic.write import DEFAULT_EPOCH, GeographicExport, write_geographic

__all__ = ["DEFAULT_EPOCH", "GeographicExport", "write_geographic"]
