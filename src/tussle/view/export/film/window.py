"""Drawing without a display: which of the ways to do it this machine has."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from tussle.errors import MissingExtraError, ViewError

CHOICE = "VTK_DEFAULT_OPENGL_WINDOW"
"""Variable by which VTK is told what to draw into; a user's own value is kept."""
OSMESA, EGL = "vtkOSOpenGLRenderWindow", "vtkEGLRenderWindow"
LIBRARIES = {
    OSMESA: ("libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so"),
    EGL: ("libEGL.so.1", "libEGL.so"),
}


def find_window() -> str:
    """Name of VTK's class for a window that needs no display.

    A graphics card draws through EGL. Without one Mesa draws on the processor: OSMesa directly, else through EGL.

    Raises:
        ViewError: There is neither.
    """
    has_card = any(Path("/dev").glob("nvidia[0-9]*")) or any(Path("/dev/dri").glob("renderD*"))
    for name in (EGL, OSMESA) if has_card else (OSMESA, EGL):
        if any(is_there(library) for library in LIBRARIES[name]):
            return name
    raise ViewError(
        "pictures need OSMesa or EGL to be drawn without a display, and neither is installed: "
        "apt-get install libosmesa6, or libegl1 with a graphics card's driver"
    )


def is_there(library: str) -> bool:
    """Whether a shared library can be loaded."""
    with suppress(OSError):
        ctypes.CDLL(library)
        return True
    return False


@contextmanager
def drawing_window() -> Iterator[None]:
    """Windows that VTK makes inside need no display.

    Raises:
        MissingExtraError: PyVista is not installed.
        ViewError: Nothing can draw without a display.
    """
    try:
        import pyvista  # noqa: F401 (whether it is there is asked before anything is changed)
    except ImportError as error:
        raise MissingExtraError(
            "films and pictures need pyvista, which is not installed: pip install 'tussle[view]'"
        ) from error
    before = os.environ.get(CHOICE)
    if before is None:
        os.environ[CHOICE] = find_window()
    try:
        yield
    finally:
        if before is None:
            os.environ.pop(CHOICE, None)
