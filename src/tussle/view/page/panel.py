"""The panel that all who watch share: the numbers, what is shown, and what is said to the game."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from tussle.view.frame import Frame
from tussle.view.live import Live
from tussle.view.page import words
from tussle.view.page.clock import TimePanel
from tussle.view.page.display import Display
from tussle.view.page.failures import Safe
from tussle.view.page.keys import help_table
from tussle.view.page.source import Source
from tussle.view.page.visitor import Visitor

NUMBERS_ORDER, SHOW_ORDER, REACH_ORDER, GAME_ORDER, KEYS_ORDER = 0.0, 20.0, 21.0, 30.0, 40.0
LARGEST_SEED = 2**31 - 1
"""That the page takes; the command line takes larger ones."""
LONGEST = 1e9
"""Of any length [m] and time [s] that is shown."""
CUSTOM_KEY = ";"
"""The key that is kept for the plugins, as in SCRIMMAGE."""


class Panel:
    """All controls but those of a browser's own camera.

    Args:
        gui: The server's panel.
        source: The game.
        display: What is shown.
        visitor: Gives the visitor by the number of its client.
        safe: Makes callbacks whose errors are told.
    """

    def __init__(
        self,
        gui: Any,
        source: Source,
        display: Display,
        visitor: Callable[[int], Visitor | None],
        safe: Safe,
    ) -> None:
        self._gui, self._source, self._display = gui, source, display
        self._visitor, self._safe = visitor, safe
        self._numbers = gui.add_html("", order=NUMBERS_ORDER)
        self.time = TimePanel(gui, source, safe)
        self.switches: dict[str, Any] = {}
        self._show_folder()
        self._reach_folder()
        if isinstance(source, Live):
            self._game_folder(source)
        with gui.add_folder("Keys", order=KEYS_ORDER, expand_by_default=False):
            gui.add_markdown(help_table(isinstance(source, Live)))

    def show(self, frame: Frame, pushed: float, notes: Sequence[str] = ()) -> None:
        """The numbers at a moment.

        Args:
            frame: The moment.
            pushed: Frames that were sent in the last second.
            notes: What the user should know, beside what the game says itself.
        """
        self._numbers.content = words.numbers_html(self._source, frame, pushed, notes)
        self.time.show(frame)

    # -- what is shown ------------------------------------------------------------------------------------------------------------

    def _show_folder(self) -> None:
        with self._gui.add_folder("Show", order=SHOW_ORDER):
            self._switch("has_labels", "Names")
            self._switch("has_trails", "Trails")
            self._switch("is_wireframe", "Edges only")
            self._switch("has_drawn", "Plugins' shapes")
            self.model_scale = self._factor("model_scale", "Models")
            self.label_scale = self._factor("label_scale", "Names' size")
            self._length("trail_time", "Trails [s]")

    def _reach_folder(self) -> None:
        with self._gui.add_folder("Reach", order=REACH_ORDER, expand_by_default=False):
            self._switch("has_rings", "Rings")
            self._length("ring_radius", "Radius [m]")
            self._switch("has_cones", "Cones")
            self._length("cone_range", "Range [m]")
            angle = self._gui.add_slider(
                "Angle [°]",
                5.0,
                360.0,
                5.0,
                min(360.0, max(5.0, 5.0 * round(math.degrees(self._display.cone_angle) / 5))),
            )
            self._switch("has_links", "Links")
            self._length("link_range", "Up to [m]")

        def told_angle(_: Any) -> None:
            self._display.cone_angle = math.radians(angle.value)

        angle.on_update(self._safe(told_angle))

    def _switch(self, attribute: str, label: str) -> None:
        box = self.switches[attribute] = self._gui.add_checkbox(label, getattr(self._display, attribute))

        def told_box(_: Any) -> None:
            self._set(attribute, box.value)

        box.on_update(self._safe(told_box))

    def _factor(self, attribute: str, label: str) -> Any:
        slider = self._gui.add_slider(label, 0.1, 10.0, 0.1, getattr(self._display, attribute))

        def told_slider(_: Any) -> None:
            self._set(attribute, slider.value)

        slider.on_update(self._safe(told_slider))

        return slider

    def _length(self, attribute: str, label: str) -> None:
        value = float(f"{getattr(self._display, attribute):.3g}")
        field = self._gui.add_number(label, value, min=0.0, max=LONGEST, step=1.0)

        def told_field(_: Any) -> None:
            self._set(attribute, float(field.value))

        field.on_update(self._safe(told_field))

    def _set(self, attribute: str, value: Any) -> None:
        setattr(self._display, attribute, value)
        self._display.version += 1

    # -- what is said to the game ---------------------------------------------------------------------------------------------------

    def _game_folder(self, live: Live) -> None:
        with self._gui.add_folder("Game", order=GAME_ORDER, expand_by_default=False):
            pick = self._gui.add_button("Pick a point", hint="Plugins are told where on the ground you click")
            key = self._gui.add_button(f"Press {CUSTOM_KEY}", hint="The key that is kept for plugins")
            seed = self._gui.add_number("Seed", min(live.seed, LARGEST_SEED), min=0, max=LARGEST_SEED, step=1)
            anew = self._gui.add_button("Begin anew", hint="With this seed")

        def told_pick(event: Any) -> None:
            visitor = self._visitor(event.client_id)
            if visitor is not None:
                visitor.pick_point()

        pick.on_click(self._safe(told_pick))

        def told_key(_: Any) -> None:
            live.publish_key(CUSTOM_KEY)

        key.on_click(self._safe(told_key))

        def told_anew(_: Any) -> None:
            live.reset(int(seed.value))

        anew.on_click(self._safe(told_anew))
