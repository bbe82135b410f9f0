"""One browser that watches: its camera, whom it has chosen, and its own part of the panel."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from tussle.view.frame import Frame
from tussle.view.live import Live
from tussle.view.page import words
from tussle.view.page.camera import FARTHEST, MODES, Camera
from tussle.view.page.display import Display
from tussle.view.page.failures import Safe
from tussle.view.page.source import Source

CAMERA_ORDER, ENTITY_ORDER = 10.0, 11.0
"""Places in the panel, between the clock and what is shown."""
NOBODY = 0
"""No entity has this id."""
NEARER = 0.8
LARGEST_ID = 2**31 - 1
REFUSAL_PERIOD = 1.0
"""Least time between two words about refused values [s]."""


class Visitor:
    """A browser that watches.

    Args:
        client: viser's handle of it.
        source: The game.
        display: What is shown.
        name: What to call the entity in a row of a frame.
        safe: Makes callbacks whose errors are told.

    Attributes:
        camera: Its camera.
        chosen: Id of the entity whose state it reads and that its camera follows; None for nobody.
    """

    def __init__(
        self, client: Any, source: Source, display: Display, name: Callable[[Frame, int], str], safe: Safe
    ) -> None:
        self._client, self._source, self._name, self._safe = client, source, name, safe
        self.gui = client.gui
        self.camera = Camera(client, source.scenery, display.size)
        self.chosen: int | None = None
        self._called = ""
        self._shown = ""
        self._stop_picking: Callable[[], None] | None = None
        self._help: Any = None
        self._refused_at = -REFUSAL_PERIOD
        client.camera.max_orbit_distance = FARTHEST * source.scenery.size
        self._build(self.gui)

    def _build(self, gui: Any) -> None:
        with gui.add_folder("Camera", order=CAMERA_ORDER):
            self._mode = gui.add_dropdown("Mode", MODES, initial_value="free", hint="A changes it")
            self._follow = gui.add_number(
                "Entity", NOBODY, min=0, max=LARGEST_ID, step=1, hint="Id of whom to follow; ← → change it"
            )
            moves = gui.add_button_group("View", ("Whole", "Above", "Undo"))
        with gui.add_folder("Entity", order=ENTITY_ORDER):
            self._about = gui.add_html(words.nobody_html())

        def told_mode(event: Any) -> None:
            if event.client is not None:
                self.set_mode(self._mode.value)

        self._mode.on_update(self._safe(told_mode))

        def told_follow(event: Any) -> None:
            if event.client is not None:
                self.choose(int(self._follow.value) or None)

        self._follow.on_update(self._safe(told_follow))

        def told_moves(_: Any) -> None:
            {"Whole": self.see_whole, "Above": self.see_from_above, "Undo": self.undo_view}[moves.value]()

        moves.on_click(self._safe(told_moves))

    # -- camera -------------------------------------------------------------------------------------------------------------------

    def set_mode(self, mode: str) -> None:
        """Another mode of the camera; one that follows takes somebody to follow where nobody is chosen."""
        if mode != "free" and self.chosen is None:
            self.choose_next(1)
        self.camera.set_mode(mode)
        self._mode.value = self.camera.mode

    def cycle_mode(self) -> None:
        """The next mode of the camera."""
        self.set_mode(MODES[(MODES.index(self.camera.mode) + 1) % len(MODES)])

    def zoom(self, is_nearer: bool) -> None:
        """Nearer, or farther."""
        self.camera.zoom(NEARER if is_nearer else 1.0 / NEARER)

    def see_whole(self) -> None:
        """See all of the scene."""
        self.camera.show_whole()
        self._mode.value = self.camera.mode

    def see_from_above(self) -> None:
        """See all of the scene from above."""
        self.camera.show_from_above()
        self._mode.value = self.camera.mode

    def undo_view(self) -> None:
        """Back to where the camera was."""
        self.camera.undo()
        self._mode.value = self.camera.mode

    # -- the chosen entity --------------------------------------------------------------------------------------------------------

    def choose(self, who: int | None) -> None:
        """Read of this entity, and follow it where the camera follows."""
        self.chosen = who
        self._follow.value = NOBODY if who is None else who
        self.show(self._source.frame())

    def choose_next(self, direction: int) -> None:
        """The entity with the next larger id, or with -1 the next smaller one, around the ends."""
        ids = self._source.frame().id
        if not len(ids):
            return
        if self.chosen is None:
            place = 0 if direction > 0 else len(ids) - 1
        else:
            place = int(np.searchsorted(ids, self.chosen, side="right" if direction > 0 else "left"))
            place -= direction < 0
        self.choose(int(ids[place % len(ids)]))

    def show(self, frame: Frame) -> None:
        """Write what is known of the chosen entity."""
        html = words.nobody_html()
        if self.chosen is not None:
            row = frame.row_of(self.chosen)
            if row >= 0:
                self._called = self._name(frame, row)
            state = self._source.entity(self.chosen)
            if state is not None:
                html = words.entity_html(state, self._called or str(self.chosen))
            elif row < 0:
                html = words.gone_html(self._called or f"Entity {self.chosen}")
            else:  # it is being looked up
                return
        if html != self._shown:
            self._about.content = self._shown = html

    # -- a point of the world -----------------------------------------------------------------------------------------------------

    def pick_point(self) -> None:
        """The next click on the ground is told to the plugins; a second call takes it back."""
        source, scene = self._source, self._client.scene
        if self._stop_picking is not None:
            self._stop_picking()
            return
        if not isinstance(source, Live):
            return

        def told(event: Any) -> None:
            stop()
            point = on_ground(event.ray_origin, event.ray_direction, source.scenery.ground)
            if point is None or np.abs(point).max() > FARTHEST * source.scenery.size:
                self._tell("No point", "There is no ground there.")
                return
            source.publish_click(point)
            east, north, up = point
            self._tell(
                "Point picked", f"The plugins are told of x = {east:.1f}, y = {north:.1f}, z = {up:.1f} m."
            )

        def stop() -> None:
            self._stop_picking = None
            scene.remove_click_callback(picked)

        picked = self._safe(told)
        scene.on_click()(picked)
        self._stop_picking = stop
        self._tell("Pick a point", "Click on the ground. Plugins are told of it in the next step.")

    def read_help(self, table: str) -> None:
        """Show the keys in a window of its own."""
        gui = self.gui
        if self._help is not None:
            self._help.close()
        modal = self._help = gui.add_modal("Keys")
        with modal:
            gui.add_markdown(table)
            close = gui.add_button("Close")

        def told_close(_: Any) -> None:
            modal.close()
            self._help = None

        close.on_click(self._safe(told_close))

    def refuse(self, label: str, reason: str) -> None:
        """Say that a value was not taken; of many in a row, the first."""
        now = time.monotonic()
        if now - self._refused_at >= REFUSAL_PERIOD:
            self._refused_at = now
            self._tell(label, reason)

    def _tell(self, title: str, text: str) -> None:
        self._client.add_notification(title, text, auto_close_seconds=4.0)


def on_ground(origin: tuple[float, ...], direction: tuple[float, ...], height: float) -> np.ndarray | None:
    """Where a ray meets the plane at a height [m], (3,); None where it does not."""
    start, along = np.asarray(origin, float), np.asarray(direction, float)
    if along[2] == 0.0:
        return None
    distance = (height - start[2]) / along[2]
    return start + distance * along if distance > 0.0 else None
