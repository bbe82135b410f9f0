"""Surfaces from files, which are untrusted: sizes in a file's header are checked before memory is allocated."""

from __future__ import annotations

import io
import json
import re
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from tussle.documents import read_bytes
from tussle.errors import MissingExtraError, ParameterError, clipped, listed, nearest_name
from tussle.world.rays.grids import read_ascii_grid, read_image
from tussle.world.rays.surfaces import MAX_FACES, HeightField, TriangleMesh
from tussle.world.rays.textures import decoded

MAX_BYTES = 64_000_000
IMAGES = (".png", ".tif", ".tiff")
BY_TRIMESH = (".obj", ".ply", ".stl", ".glb", ".gltf", ".off")
MESHES = (".vtk", *BY_TRIMESH)
SUFFIXES = (".asc", *IMAGES, *MESHES)
ELEMENT = re.compile(rb"^element\s+\w+\s+(\d+)", re.MULTILINE)


def read_surface(
    path: Path | str, *, cell: float | None = None, height: float | None = None, scale: float = 1.0,
    position: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> HeightField | TriangleMesh:  # fmt: skip
    """Read a height field or a mesh from a file.

    Args:
        path: An ASCII grid (.asc), an image (.png, .tif; needs Pillow), legacy VTK poly data (.vtk), or a mesh that trimesh reads (.obj,
            .ply, .stl, .glb, .gltf, .off).
        cell: Of an image: width of a pixel [m]; a GeoTIFF in metres has its own.
        height: Of an image: height of white above black [m]; not needed for a TIFF of heights.
        scale: Of a mesh: length of its unit [m].
        position: Where the file's origin is in the world [m]; of an image, its south-western pixel.

    Raises:
        MissingExtraError: The package that reads the format is not installed.
        ParameterError: The file cannot be read, is too large, or holds something else.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise ParameterError(
            f"{path}: {suffix!r} is no format of surfaces{nearest_name(suffix, SUFFIXES)}; {listed(SUFFIXES)}"
        )
    if not (0.0 < scale < np.inf and np.isfinite(position).all()):
        raise ParameterError(
            f"{path}: scale = {scale!r} at {position!r} is not allowed; it takes a scale > 0 and finite numbers"
        )
    data = bytes_of(path)
    try:
        if suffix == ".asc":
            found: HeightField | TriangleMesh = read_ascii_grid(path, data)
        elif suffix in IMAGES:
            found = read_image(path, data, cell, height)
        else:
            vertices, faces = read_vtk(data) if suffix == ".vtk" else _by_trimesh(path, data)
            found = TriangleMesh(vertices * scale + np.array(position), faces)
    except ParameterError as error:
        raise ParameterError(str(error) if str(error).startswith(str(path)) else f"{path}: {error}") from None
    if isinstance(found, HeightField):
        x, y, z = position
        return HeightField(found.height + z, found.west + x, found.south + y, found.cell)
    return found


def read_texture(path: Path | str) -> np.ndarray:
    """Read an image (.png, .jpg, .tif) that is draped over a surface: red, green, blue, (height, width, 3), uint8.

    Raises:
        MissingExtraError: Pillow is not installed.
        ParameterError: The file cannot be read, is too large, or is no image.
    """
    return decoded(str(path), bytes_of(Path(path)), is_photo=True)


def bytes_of(path: Path) -> bytes:
    """Content of a regular file of at most `MAX_BYTES`.

    Raises:
        ParameterError: It is no such file.
    """
    return read_bytes(path, ParameterError, MAX_BYTES)


def corners(vertices: Any) -> np.ndarray:
    """Vertices of a mesh as they come from the reader of another package, (n, 3).

    Raises:
        ParameterError: They are something else.
    """
    found = np.asarray(vertices, float)
    if found.ndim != 2 or found.shape[1] != 3:
        raise ParameterError(
            f"its vertices have shape {found.shape}; a mesh takes (n, 3), which is x, y and z of each"
        )
    return found


def _announced(suffix: str, data: bytes) -> int:
    """The largest number of elements that a file announces, for which a reader may take memory at once."""
    if suffix == ".ply":
        return max((int(n) for n in ELEMENT.findall(data[: data.find(b"end_header")])), default=0)
    if suffix in (".glb", ".gltf"):
        text = data
        if data[:4] == b"glTF":
            text = data[20 : 20 + int.from_bytes(data[12:16], "little")]
        content = json.loads(text)
        counts = [each.get("count", 0) for each in content.get("accessors", ())]
        # Instances of one mesh count each time.
        return int(
            max(
                [
                    *counts,
                    sum(counts)
                    * max(1, len(content.get("nodes", ())) // max(1, len(content.get("meshes", (0,))))),
                ]
            )
        )
    if suffix == ".stl" and data[:5] != b"solid":
        return int.from_bytes(data[80:84], "little")
    return 0


def _outside(suffix: str, data: bytes) -> str:
    """The buffer of a .gltf file that lies in another file; "" if there is none."""
    buffers = json.loads(data).get("buffers", ()) if suffix == ".gltf" else ()
    named = (str(each["uri"]) for each in buffers if "uri" in each)
    return next((f"buffer {clipped(uri)!r}" for uri in named if not uri.startswith("data:")), "")


def _by_trimesh(path: Path, data: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (n, 3) and faces (m, 3)."""
    try:
        import trimesh
    except ImportError:
        raise MissingExtraError(f"{path}: meshes need trimesh: pip install 'tussle[scene]'") from None
    suffix = path.suffix.lower()
    try:
        if outside := _outside(suffix, data):
            raise ParameterError(
                f"{path}: its {outside} lies in another file; save it in one file, as .glb, or as .gltf with embedded buffers"
            )
        if _announced(suffix, data) > 3 * MAX_FACES:
            raise ParameterError(f"{path}: the mesh announces more than {MAX_FACES:,} triangles")
        # Without a path and a resolver, the file cannot make trimesh read other files.
        made: Any = trimesh.load(
            io.BytesIO(data), file_type=suffix[1:], force="mesh", process=False, skip_materials=True
        )
        return corners(made.vertices), np.asarray(made.faces)
    except ParameterError:
        raise
    except Exception as error:
        raise ParameterError(
            f"{path}: it cannot be read as {suffix}: {type(error).__name__}: {clipped(str(error), 200)}"
        ) from error


TYPES = {"float": ">f4", "double": ">f8", "int": ">i4", "long": ">i8", "vtktypeint64": ">i8"}
CELLS = ("POLYGONS", "TRIANGLE_STRIPS")
SKIPPED = ("VERTICES", "LINES")
ENDS = ("POINT_DATA", "CELL_DATA")


class _Reader:
    """Takes lines and arrays from the file's content."""

    def __init__(self, data: bytes) -> None:
        self.data, self.at, self.is_binary = data, 0, False

    def line(self) -> list[str]:
        """Words of the next line that is not empty; none at the end."""
        while self.at < len(self.data):
            end = self.data.find(b"\n", self.at)
            end = len(self.data) if end < 0 else end
            words = self.data[self.at : end].decode("latin-1").split()
            self.at = end + 1
            if words:
                return words
        return []

    def array(self, n: int, kind: str) -> np.ndarray:
        """The next n numbers."""
        if not 0 <= n <= 12 * MAX_FACES:
            raise ParameterError(f"an array of {n:,} numbers is not allowed; at most {12 * MAX_FACES:,} are")
        dtype = np.dtype(TYPES[kind])
        if self.is_binary:
            end = self.at + n * dtype.itemsize
            if end > len(self.data):
                raise ParameterError(f"the file ends within {n:,} numbers")
            found = np.frombuffer(self.data, dtype, n, self.at)
            self.at = end
            return found.astype(float if dtype.kind == "f" else np.int64)
        words: list[str] = []
        while len(words) < n:
            line = self.line()
            if not line:
                raise ParameterError(f"the file ends within {n:,} numbers")
            words += line
        if len(words) > n:
            raise ParameterError(f"a list of {n:,} numbers has {len(words):,} at the end of its line")
        return np.array(words, float if dtype.kind == "f" else np.int64)


def read_vtk(data: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (n, 3) and faces (m, 3) of legacy poly data.

    Raises:
        ParameterError: It is something else, or damaged.
    """
    reader = _Reader(data)
    if not data.startswith(b"# vtk DataFile"):
        raise ParameterError("it is no legacy VTK file, whose first line is '# vtk DataFile Version ...'")
    reader.line()
    reader.at = data.find(b"\n", reader.at) + 1  # the title, which may be empty
    reader.is_binary = reader.line()[:1] == ["BINARY"]
    vertices, faces = np.zeros((0, 3)), [np.zeros((0, 3), np.int64)]
    try:
        if reader.line() != ["DATASET", "POLYDATA"]:
            raise ParameterError("the data set is not POLYDATA")
        while (words := reader.line()) and words[0] not in ENDS:
            if words[0] == "POINTS":
                vertices = reader.array(3 * int(words[1]), words[2].lower()).reshape(-1, 3)
            elif words[0] in (*CELLS, *SKIPPED):
                start, corners = _cells(reader, int(words[1]), int(words[2]))
                if words[0] in CELLS:
                    faces.append(_triangles(start, corners, words[0]))
            elif words[0] not in ("METADATA", "INFORMATION", "NAME", "DATA"):
                raise ParameterError(
                    f"the part {clipped(words[0])!r} is not known; {listed(('POINTS', *CELLS, *SKIPPED))}"
                )
    except (ValueError, IndexError, KeyError, OverflowError) as error:
        if isinstance(error, ParameterError):
            raise
        raise ParameterError(f"the VTK file is damaged near byte {reader.at}: {error!r}") from None
    return vertices, np.concatenate(faces)


def _cells(reader: _Reader, n: int, size: int) -> tuple[np.ndarray, np.ndarray]:
    """First corner of each cell and the end, and all corners; in the layout of version 5, or of the versions before."""
    at = reader.at
    words = reader.line()
    if words[:1] == ["OFFSETS"]:
        offsets = reader.array(n, words[1].lower())
        return offsets, reader.array(size, reader.line()[1].lower())
    reader.at = at
    numbers = reader.array(size, "int")
    keep, start, k = np.ones(size, bool), [0], 0
    for _ in range(n):
        count = int(numbers[k])
        if not 0 < count < size - k:
            raise ParameterError(
                f"a cell of {count} corners is not allowed; there are {size - k - 1} more numbers"
            )
        keep[k] = False
        start.append(start[-1] + count)
        k += count + 1
    keep[k:] = False
    return np.array(start), numbers[keep]


def _triangles(start: np.ndarray, corners: np.ndarray, kind: str) -> np.ndarray:
    """Fans of polygons, or the triangles of strips, (m, 3)."""
    found: list[tuple[int, int, int]] = []
    for first, end in pairwise(start.tolist()):
        found += [
            (corners[first] if kind == "POLYGONS" else corners[k - 1], corners[k], corners[k + 1])
            for k in range(first + 1, end - 1)
        ]
    return np.array(found, np.int64).reshape(-1, 3)
