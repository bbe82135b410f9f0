"""Makes the keys of the page do what their table says."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from tussle.view.live import Live
from tussle.view.page.failures import Safe
from tussle.view.page.keys import help_table, keys_of
from tussle.view.page.panel import CUSTOM_KEY, Panel
from tussle.view.page.source import Source
from tussle.view.page.visitor import Visitor

LARGER = 1.25
LEAST, MOST = 0.1, 10.0
"""Bounds of the sliders for sizes."""


class Keyboard:
    """The commands of the page by name, each with its keys.

    Args:
        gui: The server's panel.
        source: The game.
        panel: The controls that keys move too.
        visitor: Gives the visitor by the number of its client.
        safe: Makes callbacks whose errors are told.
    """

    def __init__(
        self,
        gui: Any,
        source: Source,
        panel: Panel,
        visitor: Callable[[int], Visitor | None],
        safe: Safe,
    ) -> None:
        self._source, self._panel, self._visitor, self._safe = source, panel, visitor, safe
        commands = {**self._of_time(), **self._of_display(), **self._of_visitors()}
        is_live = isinstance(source, Live)
        for key in keys_of(is_live):
            handle = gui.add_command(
                key.text, description=key.label, hotkey=key.key, modifier="shift" if key.with_shift else None
            )
            self._bind(handle, commands[key.does])

    def _bind(self, handle: Any, command: Callable[[Visitor], None]) -> None:
        def told_handle(event: Any) -> None:
            visitor = self._visitor(event.client_id)
            if visitor is not None:
                command(visitor)

        handle.on_trigger(self._safe(told_handle))

    def _of_time(self) -> dict[str, Callable[[Visitor], None]]:
        source, time = self._source, self._panel.time

        def fastest(_: Visitor) -> None:
            source.warp = 1.0 if math.isinf(source.warp) else None

        commands: dict[str, Callable[[Visitor], None]] = {
            "toggle": lambda _: source.toggle(),
            "step": lambda _: source.step(),
            "step_back": lambda _: source.step_back(),
            "slower": lambda _: source.slower(),
            "faster": lambda _: source.faster(),
            "fastest": fastest,
            "previous_event": lambda _: time.to_event(is_next=False),
            "next_event": lambda _: time.to_event(is_next=True),
        }
        if isinstance(source, Live):
            commands["custom_key"] = lambda _: source.publish_key(CUSTOM_KEY)
        return commands

    def _of_display(self) -> dict[str, Callable[[Visitor], None]]:
        panel, switches = self._panel, self._panel.switches

        def toggle(name: str) -> Callable[[Visitor], None]:
            def do(_: Visitor) -> None:
                switches[name].value = not switches[name].value

            return do

        def put(name: str, value: bool) -> Callable[[Visitor], None]:
            def do(_: Visitor) -> None:
                switches[name].value = value

            return do

        def size(slider: Any, factor: float) -> Callable[[Visitor], None]:
            def do(_: Visitor) -> None:
                wanted = 1.0 if not factor else slider.value * factor
                slider.value = min(max(wanted, LEAST), MOST)

            return do

        return {
            "labels": toggle("has_labels"),
            "trails": toggle("has_trails"),
            "links": toggle("has_links"),
            "wireframe": put("is_wireframe", True),
            "solid": put("is_wireframe", False),
            "models_larger": size(panel.model_scale, LARGER),
            "models_smaller": size(panel.model_scale, 1.0 / LARGER),
            "models_reset": size(panel.model_scale, 0.0),
            "labels_larger": size(panel.label_scale, LARGER),
            "labels_smaller": size(panel.label_scale, 1.0 / LARGER),
        }

    def _of_visitors(self) -> dict[str, Callable[[Visitor], None]]:
        is_live = isinstance(self._source, Live)
        return {
            "camera_mode": lambda visitor: visitor.cycle_mode(),
            "previous_entity": lambda visitor: visitor.choose_next(-1),
            "next_entity": lambda visitor: visitor.choose_next(1),
            "nearer": lambda visitor: visitor.zoom(is_nearer=True),
            "farther": lambda visitor: visitor.zoom(is_nearer=False),
            "reset_view": lambda visitor: visitor.see_whole(),
            "from_above": lambda visitor: visitor.see_from_above(),
            "undo_view": lambda visitor: visitor.undo_view(),
            "pick": lambda visitor: visitor.pick_point(),
            "help": lambda visitor: visitor.read_help(help_table(is_live)),
        }
