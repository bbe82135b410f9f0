"""Tags of the scene: <terrain>, <ground>, <wall>, <building>."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from tussle.declare.texts import shown
from tussle.errors import MissionError, TussleError, listed, nearest_name
from tussle.folders import real_path
from tussle.mission import codecs
from tussle.mission.data_files import DataFiles
from tussle.mission.limits import Limits
from tussle.mission.node import Budget, Node, parse
from tussle.mission.problems import Problems
from tussle.mission.source import read_text
from tussle.world.geodesy import Origin, utm
from tussle.world.rays.files import MESHES, SUFFIXES, bytes_of, read_surface, read_texture
from tussle.world.rays.mesh_parts import read_parts
from tussle.world.scene import Cuboid, FlatGround, HeightField, Prism, TriangleMesh, Volume

SCENE_TAGS = ("terrain", "ground", "wall", "building")
MAX_WALLS = 20_000
MAPS = (".png", ".jpg", ".jpeg", ".tif", ".tiff")
"""Ends of the names of maps."""
TERRAIN = {"position": "m", "scale": "", "cell": "m", "height": "m", "texture": ""}
WALL = {"center": "m", "lengths": "m", "rpy": "rad"}
BUILDING = {"corners": "m", "low": "m", "high": "m"}


class SceneReader:
    """Reads the tags of the scene.

    Args:
        root: The mission's root tag.
        folders: Folders that are searched for files of surfaces: the mission's own first.
        origin: Origin of the world frame.
        problems: Receives errors and notes.
    """

    def __init__(self, root: Node, folders: Sequence[Path], origin: Origin, problems: Problems) -> None:
        self.root, self.folders, self.origin, self.problems = root, list(folders), origin, problems
        self.data = DataFiles(self.folders[0], self.folders[1:])
        self.files: list[Path] = []

    def parts(self) -> dict[str, Any]:
        """Return ground, walls, terrain and meshes, as arguments of `Scene`."""
        grounds = self._each("ground", (), lambda node, _: FlatGround(codecs.number(node.text, "m")))
        walls: list[Volume] = [*self._each("wall", WALL, _wall), *self._each("building", BUILDING, _building)]
        if len(walls) > MAX_WALLS:
            self.problems.error(
                self.root.place, f"there are {len(walls):,} walls and buildings; the limit is {MAX_WALLS:,}"
            )
        surfaces = self._each("terrain", TERRAIN, self._surface)
        fields = [each for each in surfaces if isinstance(each, HeightField)]
        if len(fields) > 1:
            self.problems.error(
                self.root.place, "there are several <terrain> with a height field; a mission has at most one"
            )
        meshes = tuple(each for each in surfaces if isinstance(each, TriangleMesh))
        return {
            "ground": grounds[-1] if grounds else None,
            "walls": tuple(walls),
            "terrain": fields[0] if fields else None,
            "meshes": meshes,
        }

    def map_file(self) -> tuple[Path, str] | None:
        """Return the picture of the last <map>, and its bounds as text; None without one. That there is no such file is noted."""
        found = self._each("map", ("bounds",), self._map)
        return found[-1] if found else None

    def _map(self, node: Node, given: dict[str, str]) -> tuple[Path, str] | None:
        name = node.text.strip()
        if not name.lower().endswith(MAPS):
            raise MissionError(
                f"{shown(name)} is no picture; it takes {', '.join(MAPS)}, and --map takes tiles, too"
            )
        path = self._find(name)
        if path is None:
            self.problems.note(node.place, f"<map>: there is no {shown(name)}, so there is no map")
            return None
        bytes_of(path)
        self.files.append(path)
        return path, given.get("bounds", "")

    def mesh_lengths(self, name: str) -> tuple[float, ...]:
        """Lengths of the bounds of a mesh file [m], (3,), for the box of an entity.

        Raises:
            MissionError: There is no such file in the mission's folders.
            ParameterError: It cannot be read, or holds no mesh.
        """
        path = self._find(name)
        surface = None if path is None else read_surface(path)
        if path is None or not isinstance(surface, TriangleMesh):
            raise MissionError(
                f"{shown(name)} is no mesh beside the mission; it takes a file of {', '.join(MESHES)}"
            )
        self.files.append(path)
        return tuple((surface.vertices.max(axis=0) - surface.vertices.min(axis=0)).tolist())

    def files_by_name(self) -> dict[str, Path]:
        """Return the files that were read, by their paths from the folder in which they are."""
        found = {}
        for file in map(Path.absolute, self.files):
            folder = next(
                (f.absolute() for f in self.folders if file.is_relative_to(f.absolute())), file.parent
            )
            found[str(file.relative_to(folder))] = file
        return found

    def _each(self, tag: str, attributes: Any, make: Callable[[Node, dict[str, str]], Any]) -> list[Any]:
        """Make an object of each tag with this name. Errors are reported with their places."""
        found = []
        for node in self.root.find_all(tag):
            for name in node.attributes:
                if name not in attributes:
                    self.problems.unknown(node.where(name), f"attribute of <{tag}>", name, attributes)
            try:
                made = make(node, dict(node.attributes))
            except TussleError as error:
                self.problems.error(node.place, f"<{tag}>: {error}")
                continue
            if made is not None:
                found.append(made)
        return found

    def _surface(self, node: Node, given: dict[str, str]) -> HeightField | TriangleMesh | None:
        name = node.text.strip()
        if not name:
            return None
        path = self._find(name)
        if path is None:
            self.problems.note(
                node.place,
                f"<terrain>: there is no {shown(name)} beside the mission or in a folder of data (--data-path), so the mission has no "
                f"terrain; it takes a file of {', '.join(SUFFIXES)} or a terrain .xml",
            )
            return None
        numbers: dict[str, Any] = {
            key: codecs.number(given[key], TERRAIN[key])
            for key in ("scale", "cell", "height")
            if key in given
        }
        if "position" in given:
            numbers["position"] = _numbers(given["position"], 3, "position", "m")
        self.files.append(path)
        if path.suffix.lower() == ".xml":
            surface, inner, texture = read_terrain_xml(path, self._inside, self.origin, numbers)
            self.files.append(inner)
        else:
            surface, texture = read_surface(path, **numbers), None
            if isinstance(surface, TriangleMesh) and "texture" not in given:
                surface = self._coloured(node, surface, path, numbers)
        surface = replace(surface, tag=(("", name), *given.items()))
        if "texture" in given:
            texture = self._find(given["texture"]) or path.parent / given["texture"]
        return surface if texture is None else self._textured(node, surface, texture)

    def _coloured(self, node: Node, mesh: TriangleMesh, path: Path, numbers: dict[str, Any]) -> TriangleMesh:
        """Return a mesh with the colours and textures of its file."""
        place = {key: numbers[key] for key in ("scale", "position") if key in numbers}
        parts, files, missing = read_parts(path, self._inside, **place)
        self.files += files
        for name in missing:
            self.problems.note(
                node.place,
                f"<terrain>: {shown(path.name)} names {shown(name)}, which is not there or is no .mtl, .png, .jpg or .tif",
            )
        return replace(mesh, parts=parts)

    def _textured(
        self, node: Node, surface: HeightField | TriangleMesh, texture: Path
    ) -> HeightField | TriangleMesh:
        """Return a surface with an image over it; without one that does not exist, which is noted."""
        self._inside(texture)
        if not texture.exists():
            self.problems.note(
                node.place, f"<terrain>: there is no {shown(texture.name)}, so the terrain has no texture"
            )
            return surface
        self.files.append(texture)
        return surface.draped(read_texture(texture))

    def _find(self, name: str) -> Path | None:
        """Return the file with this name in one of the folders, first beside the mission; None if there is none.

        Raises:
            MissionError: The file lies outside the folders.
        """
        for candidate in (name, f"{name}.xml"):
            try:
                # The copy of a run directory counts, also where the command runs in the folder of what was copied.
                beside = (self.data.beside / candidate).absolute()
                path = beside if beside.is_file() else self.data.find(candidate)
            except (OSError, ValueError):  # a MissingFileError, or no name of a file
                continue
            self._inside(path)
            return path
        return None

    def _inside(self, path: Path) -> None:
        """Check that a path, links followed, is inside a folder of the mission.

        Raises:
            MissionError: It is not.
        """
        if not any(real_path(path).is_relative_to(real_path(folder)) for folder in self.folders):
            raise MissionError(f"{path}: only files in the mission's folder or below it are read")


def _wall(_: Node, given: dict[str, str]) -> Cuboid:
    values: dict[str, Any] = {
        key: _numbers(text, 3, key, WALL[key]) for key, text in given.items() if key in WALL
    }
    return Cuboid(**values)


def _building(_: Node, given: dict[str, str]) -> Prism:
    corners = [
        _numbers(text, 2, "corners", "m")
        for text in given.get("corners", "").replace("]", "[").split("[")
        if text.strip(" ,")
    ]
    low, high = (
        codecs.number(given.get(name, default), "m") for name, default in (("low", "0"), ("high", "10"))
    )
    return Prism(tuple(corners), low, high)


def _numbers(text: str, n: int, name: str, unit: str) -> tuple[float, ...]:
    """Parse n numbers separated by commas or by blanks; bare angles are in degrees.

    Raises:
        MissionError: There are not n numbers.
    """
    words = text.split(",") if "," in text else text.split()
    if len(words) != n:
        raise MissionError(f"{name} = {shown(text)} has {len(words)} numbers; it takes {n}")
    return tuple(codecs.number(word, unit, "deg" if unit == "rad" else "") for word in words)


TAGS = (
    "polydata", "texture", "system", "hemisphere", "zone", "origin_offset_x", "origin_offset_y", "origin_offset_z", "extrusion",
    "extrusion_property", "enable_grid",
)  # fmt: skip
OFFSETS = ("origin_offset_x", "origin_offset_y", "origin_offset_z")


def read_terrain_xml(
    path: Path, check: Callable[[Path], None], origin: Origin, numbers: dict[str, Any]
) -> tuple[HeightField | TriangleMesh, Path, Path | None]:
    """Read the surface that a terrain XML names. Its extrusion is left out.

    Poly data are shifted by the UTM coordinates of the mission's origin, if the file has a <zone>, and by its offsets.

    Args:
        path: The XML file.
        check: Raises an error for a path that may not be read.
        origin: Origin of the world frame.
        numbers: Further arguments of `read_surface`.

    Returns:
        The surface, its file, and that of its texture, which may not exist.

    Raises:
        MissionError: The XML is damaged, or has a tag or value that is not allowed.
        ParameterError: The surface cannot be read.
    """
    budget = Budget(Limits())
    root, _ = parse(read_text(path, budget), str(path), budget)
    given = {}
    for node in root.children:
        if node.tag not in TAGS:
            raise MissionError(
                f"{node.place}: a terrain has no {shown(node.tag)}{nearest_name(node.tag, TAGS)}; {listed(TAGS)}"
            )
        given[node.tag] = node.text.strip()
    if not given.get("polydata"):
        raise MissionError(f"{path}: the terrain has no <polydata>, which names its surface")
    inner = path.parent / given["polydata"]
    check(inner)
    x, y, z = (codecs.number(given.get(name) or "0", "m") for name in OFFSETS)
    if given.get("zone"):
        zone = codecs.integer(given["zone"], 1, 60)
        east, north = utm(
            origin.latitude, origin.longitude, zone, given.get("hemisphere", "north").lower().startswith("s")
        )
        x, y, z = x - east, y - north, z - origin.altitude
    a, b, c = numbers.get("position", (0.0, 0.0, 0.0))
    return (
        read_surface(inner, **numbers | {"position": (x + a, y + b, z + c)}),
        inner,
        (path.parent / given["texture"] if given.get("texture") else None),
    )
