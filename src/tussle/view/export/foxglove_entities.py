"""Who takes part in a run and what happens, as messages to Foxglove."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from tussle.event_texts import event_text
from tussle.view.export import foxglove_schemas as schemas
from tussle.view.export.foxglove_scene import Json, entity, stamp, text, triangles
from tussle.view.frame import Frame
from tussle.view.recording import Recording
from tussle.view.shapes import MODELS
from tussle.view.style import Colour

Put = Callable[[str, float, Any], None]
"""Adds a message: topic, time [s], message."""
Clock = Callable[[float], int]
"""A simulated time [s] on the file's clock [ns]."""
WHOLE_EVERY = 1.0
"""Simulated seconds after which all entities are told again, where some were born since: a reader that jumps sees the last message of
each topic only."""
LEVELS = {"birth": schemas.DEBUG, "capture": schemas.WARNING, "collision": schemas.WARNING}
"""Levels of events in the log; the others are information."""


class SceneEntities:
    """Who is there: names, and the entities of `/models` and `/labels`, each told with how long it will be there."""

    def __init__(self, recording: Recording, kept: np.ndarray, put: Put, ns: Clock, scale: float) -> None:
        self._recording, self._put, self._ns, self._scale = recording, put, ns, scale
        self.names: dict[int, str] = {}
        self.quoted: dict[int, str] = {}
        self._gone = self._find_ends(kept)
        self._meshes: dict[tuple[str, float, Colour], Json] = {}
        self._told: set[int] = set()
        self._is_whole, self._last_whole = True, -math.inf

    def _find_ends(self, kept: np.ndarray) -> dict[int, float]:
        """Time of the first kept moment at which somebody is there no more [s]; of nobody who stays until the last."""
        gone: dict[int, float] = {}
        before = np.zeros(0, np.int32)
        for i in kept:
            frame = self._recording.frame(int(i))
            for who in np.setdiff1d(before, frame.id, assume_unique=True).tolist():
                gone[who] = frame.t
            before = frame.id
        return gone

    def meet(self, frame: Frame) -> None:
        """Give those names who have none yet: block/id."""
        for who, block in zip(frame.id.tolist(), frame.block.tolist(), strict=True):
            if who not in self.names:
                self.names[who] = f"{self._recording.blocks[block]}/{who}"
                self.quoted[who] = json.dumps(self.names[who])

    def name(self, who: int) -> str:
        """Of somebody who may not have been seen."""
        return self.names.get(who, str(who))

    def tell(self, frame: Frame) -> None:
        """Tell of those who are new, or of all, see WHOLE_EVERY."""
        new = [row for row, who in enumerate(frame.id.tolist()) if who not in self._told]
        self._told.update(frame.id[new].tolist())
        self._is_whole = self._is_whole and not new
        if not self._is_whole and frame.t - self._last_whole >= WHOLE_EVERY:
            new, self._is_whole, self._last_whole = list(range(len(frame))), True, frame.t
        if not new:
            return
        ns = self._ns(frame.t)
        models, labels = zip(*(self._entities(frame, row, ns) for row in new), strict=True)
        self._put("/models", frame.t, {"deletions": [], "entities": models})
        self._put("/labels", frame.t, {"deletions": [], "entities": labels})

    def _entities(self, frame: Frame, row: int, ns: int) -> tuple[Json, Json]:
        style, who, block = self._recording.style, int(frame.id[row]), int(frame.block[row])
        rgb, length = style.block_colour(block), self._scale * style.scale(block)
        # It ends just before the moment at which it is gone.
        lifetime = self._ns(self._gone[who]) - ns - 1 if who in self._gone else 0
        name, team = self.names[who], int(frame.team[row])
        notes = [("id", str(who)), ("block", self._recording.blocks[block]), ("team", str(team))]
        words = text(str(who), rgb, (0.0, 0.0, 0.7 * length))
        return (
            entity(name, name, ns, lifetime, notes, triangles=[self._mesh(style.model(block), length, rgb)]),
            entity(name, name, ns, lifetime, texts=[words]),
        )

    def _mesh(self, model: str, length: float, rgb: Colour) -> Json:
        key = (model, length, rgb)
        if key not in self._meshes:
            self._meshes[key] = triangles(MODELS[model].placed(length), rgb)
        return self._meshes[key]


class Log:
    """The events, told when their time has come."""

    def __init__(self, recording: Recording, put: Put, ns: Clock, entities: SceneEntities) -> None:
        self._waiting = list(reversed(recording.events))
        self._put, self._ns, self._entities = put, ns, entities
        self._blocks = {h.id: h.text for h in recording.events if h.kind == "birth"}

    def until(self, t: float) -> None:
        """Tell of all events up to a time [s]."""
        while self._waiting and self._waiting[-1].t <= t:
            event = self._waiting.pop()
            line = {
                "timestamp": stamp(self._ns(event.t)),
                "level": LEVELS.get(event.kind, schemas.INFO),
                "message": event_text(event.kind, self._name(event.id), self._name(event.other), event.text),
                "name": event.kind,
                "file": "",
                "line": 0,
            }
            self._put("/events", event.t, line)

    def _name(self, who: int) -> str:
        if not who:
            return ""
        return f"{self._blocks[who]}/{who}" if who in self._blocks else self._entities.name(who)
