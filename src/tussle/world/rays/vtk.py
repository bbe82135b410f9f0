"""Legacy VTK poly data: points, polygons and triangle strips, as text or binary. Everything else in the file is left out.

VTK File Formats, The VTK User's Guide (2010), "Simple legacy formats".
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from tussle.errors import ParameterError, clipped, listed
from tussle.world.rays.surfaces import MAX_FACES

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
