"""Colours and textures of meshes from files that trimesh reads, for pictures. The files are untrusted, and so are those that they name."""

from __future__ import annotations

import base64
import io
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from tussle.errors import ParameterError, TussleError, clipped
from tussle.world.rays.files import BY_TRIMESH, bytes_of, corners
from tussle.world.rays.surfaces import MeshPart
from tussle.world.rays.textures import decoded, reduced

MAX_IMAGES = 32
"""Images of a mesh."""
IMAGES = (".png", ".jpg", ".jpeg", ".tif", ".tiff")


def read_parts(
    path: Path,
    check: Callable[[Path], None],
    *,
    scale: float = 1.0,
    position: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> tuple[tuple[MeshPart, ...], list[Path], list[str]]:
    """Read the colours and textures of a mesh: one part for each image, and one for all that has none.

    Args:
        path: A file that `read_surface` has read.
        check: Raises an error for a path that may not be read.
        scale: Length of its unit [m].
        position: Where its origin is in the world [m].

    Returns:
        The parts, () for a mesh without colours; the files that it names, such as .mtl and images; names of others, or of
        those that do not exist.

    Raises:
        ParameterError: An image cannot be read or is too large, or the mesh has more than `MAX_IMAGES`.
        TussleError: It names a file that `check` refuses.
    """
    if path.suffix.lower() not in BY_TRIMESH:
        return (), [], []
    try:
        return _parts(path, check, scale, position)
    except TussleError:
        raise
    except Exception as error:  # readers of damaged data raise errors of many kinds
        raise ParameterError(
            f"{path}: its colours cannot be read: {type(error).__name__}: {clipped(str(error), 200)}"
        ) from error


def _parts(
    path: Path, check: Callable[[Path], None], scale: float, position: tuple[float, float, float]
) -> tuple[tuple[MeshPart, ...], list[Path], list[str]]:
    import trimesh

    data = bytes_of(path)
    if path.suffix.lower() in (".glb", ".gltf"):
        for image in _embedded(data):  # trimesh would decode them whatever their size
            decoded(str(path), image)
    beside: Any = _FilesBeside(path, check)
    scene: Any = trimesh.load_scene(
        io.BytesIO(data), file_type=path.suffix.lower()[1:], process=False, resolver=beside
    )
    if beside.error is not None:  # trimesh goes on without a file that it does not get
        raise beside.error
    pieces: dict[int, list[MeshPart]] = {}
    images: dict[int, np.ndarray] = {}
    is_coloured = False
    for node in scene.graph.nodes_geometry:
        matrix, name = scene.graph[node]
        mesh = scene.geometry[name]
        image = _image(mesh.visual)
        key = id(image) if image is not None else 0
        if key and key not in images:
            if len(images) == MAX_IMAGES:
                raise ParameterError(f"{path}: the mesh has more than {MAX_IMAGES} images")
            images[key] = reduced(str(path), image)
        vertices = trimesh.transform_points(corners(mesh.vertices), matrix) * scale + np.array(position)
        piece, has_colours = _piece(mesh, vertices, bool(key))
        pieces.setdefault(key, []).append(piece)
        is_coloured = is_coloured or has_colours
    if not is_coloured:
        return (), beside.files, beside.missing
    return (
        tuple(_joined(found, images.get(key)) for key, found in pieces.items()),
        beside.files,
        beside.missing,
    )


class _FilesBeside:
    """Gives trimesh the files that a mesh names, which must be in the mission's folder; it takes the place of trimesh's resolvers.

    Attributes:
        files: The files that were read.
        missing: Names of files that do not exist.
        error: The first error; trimesh drops those that are raised.
    """

    def __init__(self, path: Path, check: Callable[[Path], None]) -> None:
        self._folder, self._check = path.parent, check
        self.files: list[Path] = []
        self.missing: list[str] = []
        self.error: TussleError | None = None

    def get(self, name: str) -> bytes:
        """Content of a file beside the mesh.

        Raises:
            FileNotFoundError: It does not exist.
            TussleError: It may not be read, or is no image although its name says so.
        """
        path = self._folder / name.strip()
        try:
            self._check(path)
            if path.suffix.lower() not in (".mtl", *IMAGES) or not path.exists():
                self.missing.append(name)
                raise FileNotFoundError(name)
            data = bytes_of(path)
            if path.suffix.lower() in IMAGES:
                decoded(str(path), data)
        except (TussleError, ValueError) as error:
            self.error = self.error or (
                error if isinstance(error, TussleError) else ParameterError(f"{path}: {error}")
            )
            raise
        self.files.append(path)
        return data

    __getitem__ = get


def _embedded(data: bytes) -> Iterator[bytes]:
    """The images in a glTF file: Khronos Group, glTF 2.0 Specification (2021), sections 3.6 and 4.4."""
    n = int.from_bytes(data[12:16], "little")
    content = json.loads(data[20 : 20 + n] if data[:4] == b"glTF" else data)

    def inline(each: Any) -> bytes:
        uri = str(each.get("uri", ""))
        return base64.b64decode(uri.partition(",")[2]) if uri.startswith("data:") else b""

    for image in content.get("images", ())[: MAX_IMAGES + 1]:
        if "bufferView" in image:
            view = content["bufferViews"][image["bufferView"]]
            buffer = content["buffers"][view["buffer"]]
            held = inline(buffer) if "uri" in buffer else data[28 + n :]
            start = view.get("byteOffset", 0)
            yield held[start : start + view["byteLength"]]
        elif found := inline(image):
            yield found


def _image(visual: Any) -> Any:
    """The image of a mesh; None without one, or without places in it."""
    if visual.kind != "texture" or visual.uv is None:
        return None
    material = visual.material
    image = getattr(material, "baseColorTexture", None) or getattr(material, "image", None)
    # Where a file has places in an image, and none, trimesh makes one of 2 x 2 pixels.
    return None if image is not None and image.format is None and image.size == (2, 2) else image


def _piece(mesh: Any, vertices: np.ndarray, has_image: bool) -> tuple[MeshPart, bool]:
    """A mesh in its colours, and whether it has any."""
    visual, faces = mesh.visual, np.asarray(mesh.faces)
    plain = np.full((len(vertices), 3), 255, np.uint8)
    if has_image:
        factor = getattr(visual.material, "baseColorFactor", None)
        tint = plain if factor is None else np.broadcast_to(np.asarray(factor, np.uint8)[:3], plain.shape)
        return MeshPart(vertices, faces, tint, np.asarray(visual.uv, float)), True
    if visual.kind == "face":
        colours = np.repeat(np.asarray(visual.face_colors)[:, :3], 3, axis=0)
        return MeshPart(
            vertices[faces].reshape(-1, 3), np.arange(3 * len(faces)).reshape(-1, 3), colours
        ), True
    if visual.kind == "vertex":
        return MeshPart(vertices, faces, np.asarray(visual.vertex_colors)[:, :3]), True
    from trimesh.visual.color import DEFAULT_COLOR

    colour = visual.material.main_color if visual.kind == "texture" else DEFAULT_COLOR
    is_plain = np.array_equal(colour, DEFAULT_COLOR)
    return MeshPart(
        vertices, faces, np.broadcast_to(np.asarray(colour, np.uint8)[:3], plain.shape)
    ), not is_plain


def _joined(pieces: list[MeshPart], image: np.ndarray | None) -> MeshPart:
    """Parts that have the same image, or none, as one."""
    first = np.cumsum([0, *(len(piece.vertices) for piece in pieces)])
    return MeshPart(
        np.concatenate([piece.vertices for piece in pieces]),
        np.concatenate([piece.faces + start for piece, start in zip(pieces, first[:-1], strict=True)]),
        np.concatenate([piece.colours for piece in pieces]),
        None if image is None else np.concatenate([np.asarray(piece.uv) for piece in pieces]),
        image,
    )
