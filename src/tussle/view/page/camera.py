"""The camera of one who watches: free, following an entity, or behind it."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from tussle.view.frame import Frame
from tussle.view.scenery import Scenery

MODES = ("free", "follow", "behind")
FIELD_OF_VIEW = math.radians(50.0)
"""Vertical; the usual one of a photograph's lens."""
FITTING = 0.62
"""Distance from which the whole is seen, of its diagonal over the sine of half the field of view: it is never as high as wide."""
USUAL_LENGTHS = 12.0
"""Distance to the followed entity at first, in lengths of a model."""
HEIGHT = 0.35
"""Of the camera behind an entity above it, of the distance."""
NOTICED = 0.02
"""Who turns the view changes it by more than this; what differs less is a late echo of the camera's own moves."""
ECHO = 0.7
"""How long after a command the browser may still tell of the view before it [s]."""
MOST_UNDOS = 50
NEAREST, FARTHEST = 1e-6, 1e3
"""From what is followed, in sizes of the scene."""


@dataclass(frozen=True)
class View:
    """Where a camera is and where it looks.

    Attributes:
        position: [m], (3,).
        target: Point that it looks at [m], (3,).
        mode: One of `MODES`.
    """

    position: np.ndarray
    target: np.ndarray
    mode: str = "free"


def whole_view(scenery: Scenery) -> View:
    """From the southwest, all of the scene in sight."""
    middle = 0.5 * (scenery.low + scenery.high)
    distance = FITTING * scenery.size / math.sin(0.5 * FIELD_OF_VIEW)
    direction = np.array([-0.55, -0.72, 0.45])
    return View(middle + distance * direction / np.linalg.norm(direction), middle)


def view_from_above(scenery: Scenery) -> View:
    """From straight above, north at the top."""
    middle = 0.5 * (scenery.low + scenery.high)
    distance = 1.1 * FITTING * scenery.size / math.sin(0.5 * FIELD_OF_VIEW)
    # A hair to the south: from exactly above, north could be anywhere.
    return View(middle + np.array([0.0, -1e-3 * distance, distance]), middle)


@dataclass(frozen=True)
class Opening:
    """How one who comes sees the game at first.

    Attributes:
        view: Where the camera is and looks.
        mode: One of `MODES`.
        follow: Id of the entity that is chosen; None for nobody.
        notes: What the mission asks for and does not get, one line each.
    """

    view: View
    mode: str = "free"
    follow: int | None = None
    notes: tuple[str, ...] = ()


def opening(scenery: Scenery, said: Mapping[str, Any] | None) -> Opening:
    """As the mission's `<camera>` says; what it leaves out, or says wrongly, is as usual.

    Args:
        scenery: What stands still.
        said: The attributes of the tag; None without one.
    """
    said, notes = said or {}, []
    usual = whole_view(scenery)

    def vector(name: str, default: np.ndarray) -> np.ndarray:
        try:
            found = np.array([float(part) for part in str(said[name]).replace(",", " ").split()])
        except ValueError:
            found = np.zeros(0)
        if found.shape == (3,) and np.isfinite(found).all():
            return found
        notes.append(f"camera {name} {said[name]!r} is not x, y, z in m; it is left out")
        return default

    target = vector("focal_point", usual.target) if "focal_point" in said else usual.target
    position = vector("pos", usual.position) if "pos" in said else usual.position
    if np.array_equal(target, position):
        target = position + np.array([1.0, 0.0, 0.0])
    mode = {"follow": "follow", "offset": "behind", "free": "free"}.get(str(said.get("mode", "free")).lower())
    if mode is None:
        notes.append(f"camera mode {said['mode']!r} is none of free, follow, offset; it is free")
    follow = str(said.get("follow_id", ""))
    if follow and not follow.isdigit():
        notes.append(f"camera follow_id {follow!r} is no id; nobody is followed")
    return Opening(
        View(position, target), mode or "free", int(follow) if follow.isdigit() else None, tuple(notes)
    )


class Camera:
    """Moves the camera of one browser. What its user does to the view with the mouse stays: only the rest is moved.

    Args:
        client: viser's handle of the browser.
        scenery: What stands still.
        length: Length of a model [m].

    Attributes:
        mode: One of `MODES`.
    """

    def __init__(self, client: Any, scenery: Scenery, length: float) -> None:
        self._client, self._scenery = client, scenery
        self.mode = "free"
        self._distance = USUAL_LENGTHS * length
        self._offset: np.ndarray | None = None
        self._echoes_until = 0.0
        self._undo: list[View] = []
        # Commands come from viser's threads, and frames from the one that pushes: neither may overtake half of the other.
        self._lock = threading.RLock()

    # -- commands -----------------------------------------------------------------------------------------------------------------

    def set_mode(self, mode: str) -> None:
        """Another mode."""
        with self._lock:
            if mode != self.mode:
                self._keep()
                self.mode, self._offset = mode, None

    def show_whole(self) -> None:
        """See all of the scene, freely."""
        with self._lock:
            self._keep()
            self.mode = "free"
            self._go(whole_view(self._scenery))

    def show_from_above(self) -> None:
        """See all of the scene from above, freely."""
        with self._lock:
            self._keep()
            self.mode = "free"
            self._go(view_from_above(self._scenery))

    def zoom(self, factor: float) -> None:
        """Nearer to what is followed, or farther."""
        with self._lock:
            size = self._scenery.size
            self._distance = min(max(self._distance * factor, NEAREST * size), FARTHEST * size)
            if self.mode == "free":
                self._keep()
                view = self._view()
                self._go(View(view.target + factor * (view.position - view.target), view.target))
            elif self._offset is not None:
                self._offset = self._offset * factor
                target = self._view().target
                self._go(View(target + self._offset, target))
                self._echoes_until = time.monotonic() + ECHO

    def undo(self) -> None:
        """Back to where it was before the last command."""
        with self._lock:
            if self._undo:
                view = self._undo.pop()
                self.mode, self._offset = view.mode, None
                if view.mode == "follow":
                    self._offset = view.position - view.target
                self._go(view)

    # -- each frame ---------------------------------------------------------------------------------------------------------------

    def follow(self, frame: Frame, who: int | None) -> None:
        """Move with an entity, where the mode says so and it is there."""
        with self._lock:
            row = -1 if who is None else frame.row_of(who)
            if self.mode == "free" or row < 0:
                return
            target = frame.pos[row]
            if self.mode == "behind":
                w, x, y, z = frame.quat[row]
                yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
                back = np.array([-math.cos(yaw), -math.sin(yaw), HEIGHT])
                self._go(View(target + self._distance * back, target))
                return
            seen = self._view()
            offset = seen.position - seen.target
            if self._offset is None:
                norm = float(np.linalg.norm(offset)) or 1.0
                self._offset = offset * (self._distance / norm)
                self._echoes_until = time.monotonic() + ECHO
            elif self._is_turned(offset):
                self._offset = offset
            self._go(View(target + self._offset, target))

    def _is_turned(self, offset: np.ndarray) -> bool:
        """Whether the browser's user has turned the view, or come nearer."""
        assert self._offset is not None
        change = np.linalg.norm(offset - self._offset)
        return bool(change > NOTICED * np.linalg.norm(self._offset) and time.monotonic() > self._echoes_until)

    # -- the browser --------------------------------------------------------------------------------------------------------------

    def _view(self) -> View:
        camera = self._client.camera
        return View(np.array(camera.position), np.array(camera.look_at), self.mode)

    def _keep(self) -> None:
        self._undo = [*self._undo[1 - MOST_UNDOS :], self._view()]

    def _go(self, view: View) -> None:
        camera = self._client.camera
        with self._client.atomic():
            camera.position = view.position
            camera.look_at = view.target
