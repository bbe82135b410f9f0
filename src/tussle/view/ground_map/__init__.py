"""Maps from files, which pictures show on the ground: each pixel where it belongs in the frame of the mission."""

from tussle.view.ground_map.map_file import GroundMap, read_bounds

__all__ = ["GroundMap", "read_bounds"]
