"""Viewing of recorded runs and of running simulations.

Modules are loaded when a name is used; pages and films need the packages of the extra `tussle[view]`.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tussle.view.frame import Event, Frame, frame_of
    from tussle.view.ground_map import GroundMap
    from tussle.view.link import OperatorLink
    from tussle.view.live import Live
    from tussle.view.recording import Recording
    from tussle.view.scenery import Scenery, scenery_of
    from tussle.view.shapes import MODELS, Mesh
    from tussle.view.style import Style

__all__ = [
    "MODELS",
    "Event",
    "Frame",
    "GroundMap",
    "Live",
    "Mesh",
    "OperatorLink",
    "Recording",
    "Scenery",
    "Style",
    "frame_of",
    "scenery_of",
]

_LAZY = {
    "MODELS": "shapes",
    "Frame": "frame",
    "Event": "frame",
    "GroundMap": "ground_map",
    "Live": "live",
    "OperatorLink": "link",
    "Style": "style",
    "Mesh": "shapes",
    "Recording": "recording",
    "Scenery": "scenery",
    "frame_of": "frame",
    "scenery_of": "scenery",
}


def __getattr__(name: str) -> Any:
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_LAZY[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
