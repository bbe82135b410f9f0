"""Map files of SCRIMMAGE: the image of a map, its resolution and its origin."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree as ET

from tussle import documents
from tussle.declare import units
from tussle.declare.texts import shown, truth
from tussle.errors import MissingFileError, ParameterError, listed, nearest_name

NUMBERS = {
    "resolution": 1.0, "wall_bottom_z": 0.0, "wall_height": 5.0, "occupied_thresh": 0.65, "x_origin": 0.0, "y_origin": 0.0,
    "z_origin": 0.0,
}  # fmt: skip
"""Numbers of a map file, with their defaults."""
TAGS = (*NUMBERS, "filename", "enable_map_boundary", "wall_color")
ABOVE_WHITE = 256


def read_map_file(path: Path) -> dict[str, str]:
    """Return the attributes of MapGen2D that stand for a map file.

    Raises:
        ParameterError: It cannot be read, or has a tag or value that is not allowed.
        MissingFileError: Its image is not beside it.
    """
    text = documents.read_text(path, ParameterError)
    if "<!DOCTYPE" in text:
        raise ParameterError(f"{path}: a DOCTYPE is not allowed")
    try:
        root = ET.fromstring(text)  # noqa: S314 - without a DOCTYPE there are no entities
    except ET.ParseError as error:
        raise ParameterError(f"{path}: it is not well-formed XML: {error}") from None
    given = {}
    for tag in root:
        if tag.tag not in TAGS:
            raise ParameterError(
                f"{path}: a map has no {shown(tag.tag)}{nearest_name(tag.tag, TAGS)}; {listed(TAGS)}"
            )
        given[tag.tag] = (tag.text or "").strip()
    if not given.get("filename"):
        raise ParameterError(f"{path}: the map has no <filename>, which names its image")
    image = path.parent / given["filename"]
    if not image.is_file():
        raise MissingFileError(f"{path}: its image {shown(given['filename'])} is not beside it")
    try:
        number = {name: units.parse(given.get(name, str(default)), "") for name, default in NUMBERS.items()}
        has_boundary = truth(given.get("enable_map_boundary", "false"))
    except ParameterError as error:
        raise ParameterError(f"{path}: {error}") from None
    threshold = 255.0 * int(number["occupied_thresh"])
    corner = number["x_origin"], number["y_origin"], number["z_origin"] + number["wall_bottom_z"]
    return {
        "map": str(image),
        "resolution": repr(number["resolution"]),
        "corner": ", ".join(map(repr, corner)),
        "height": repr(number["wall_height"]),
        "threshold": str(int(min(max(threshold + 1.0, 0.0), ABOVE_WHITE))),
        "boundary": str(has_boundary).lower(),
    }
