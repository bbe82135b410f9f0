"""A recorded game for the page: a document, and named blobs that are made on request."""

from __future__ import annotations

import json
import math
import struct
from typing import Any

import numpy as np

from tussle import displays
from tussle.errors import ParameterError, ViewError
from tussle.mission import Mission
from tussle.view.page.chunks import ANGLE_ERROR, FULL_HEALTH, UNIT, pack, position_error, step_of
from tussle.view.page.compare import Comparison
from tussle.view.page.document import event_rows, game_document, scenery_blobs
from tussle.view.page.drawing import drawing_message
from tussle.view.page.facts import mission_facts
from tussle.view.page.packing import message, reals
from tussle.view.recording import Recording

FILE_STATES, FILE_FRAMES = 150_000, 32
"""States of a chunk in a file, about, and its least frames: with fewer the first states of its tracks weigh too much."""
SERVED_STATES, SERVED_FRAMES = 20_000, 4
"""Of a chunk that is served: some hundredths of a second of work for both ends, so that a jump in time is not felt."""
MOST_FRAMES = 1024
"""Frames of a chunk: with more a page has to read too much before it shows anything."""
CURVE_POINTS = 240
"""Moments at which entities are counted for the curves of the teams."""
SHAPE_FRAMES = 64
"""Frames whose shapes are read at once."""
LEAP_OF_EXTENT = 0.25
"""Share of the diagonal of all positions above which a move counts as a jump: across a closed world it is 0.57 or more."""


class RecordedData:
    """The data of one or two recorded runs for the page.

    Args:
        game: The run; of one that was cut short, what there is.
        is_file: For a file that is whole by itself; otherwise for a page that asks for one chunk after another.
        period: Time between frames that are kept [s]; None keeps all.
        title: Heading of the page; None is the game's name.
        mission: What was played; None is the run's own mission.
        viewer: What the mission file says for the viewer; None is what the run's own mission says.

    Attributes:
        kept: Numbers of the frames that are kept, (F,).
        chunks: First and last frame of each chunk, counted in `kept`. The last frame of a chunk is the first of the next.

    Raises:
        ParameterError: The period is not allowed.
        ViewError: There is nothing to show.
    """

    def __init__(
        self,
        game: Recording | Comparison,
        *,
        is_file: bool,
        period: float | None = None,
        title: str | None = None,
        mission: Mission | None = None,
        viewer: dict[str, Any] | None = None,
    ) -> None:
        if period is not None and not 0.0 < period < math.inf:
            raise ParameterError(f"period = {period!r} is not allowed; it takes a number of seconds > 0")
        self._game, self._period, self._is_file = game, period, is_file
        self.kept = kept_frames(game.t, period)
        if not len(self.kept):
            raise ViewError(
                f"{game.path}: nothing was recorded: the run holds no states, so there is nothing to play"
            )
        n_states, n_frames = (FILE_STATES, FILE_FRAMES) if is_file else (SERVED_STATES, SERVED_FRAMES)
        self.counts = game.counts[self.kept]
        self.chunks = chunk_bounds(self.counts, n_states, n_frames)
        low, high = game.extent
        self._leap = LEAP_OF_EXTENT * float(np.linalg.norm(high - low))
        smallest = min((game.style.scale(i) for i in range(len(game.blocks))), default=1.0)
        self.step = step_of(low, high, smallest)
        self._title, self._mission = title, mission or game.mission
        self._viewer = game.viewer if viewer is None else viewer
        self._scenery = scenery_blobs(game.scenery)

    @property
    def n_entities(self) -> int:
        """Number of entities over the whole run."""
        first = set(self._game.frame(0).id.tolist())
        return len(first | {event.id for event in self._game.events if event.kind == "birth"})

    def document(self, **more: Any) -> dict[str, Any]:
        """Return the document.

        Args:
            **more: Further entries, such as the time at which it begins.
        """
        game = self._game
        facts = game_facts(game)
        facts += [
            (
                "Frames",
                f"{len(self.kept):,}"
                + (f" of {len(game.t):,}, one every {self._period:g} s" if self._period else ""),
            ),
            ("Entities", f"{self.n_entities:,}, in {int(self.counts.sum()):,} states"),
        ]
        return {
            **game_document(game, self._mission, self._viewer, self._title),
            "source": "embedded" if self._is_file else "range",
            "facts": facts,
            "idShift": game.id_shift,
            "isComplete": game.is_complete,
            "nFrames": len(self.kept),
            "nStates": int(self.counts.sum()),
            "nEntities": self.n_entities,
            "mostAtOnce": int(self.counts.max()),
            "attitudeUnit": UNIT,
            "healthSteps": FULL_HEALTH,
            "positionError": position_error(self.step),
            "angleError": ANGLE_ERROR,
            "chunks": self.chunks,
            "shapeFrames": SHAPE_FRAMES if game.has_shapes else 0,
            "curves": self._curves(),
            **more,
        }

    def _curves(self) -> dict[str, Any]:
        """Entities of each team over time."""
        places = np.unique(np.linspace(0, len(self.kept) - 1, CURVE_POINTS).round().astype(np.int64))
        teams = list(self._game.teams)
        rows = [self._game.frame(int(self.kept[i])).team for i in places]
        return {
            "t": self._game.t[self.kept[places]].tolist(),
            "n": [[int((row == team).sum()) for row in rows] for team in teams],
        }

    @property
    def names(self) -> list[str]:
        """Names of all blobs."""
        chunks = (f"chunk-{i}" for i in range(len(self.chunks)))
        return [
            "times",
            "events",
            *self._scenery,
            *chunks,
            *(f"shapes-{i}" for i in range(self._n_shape_blobs)),
        ]

    @property
    def _n_shape_blobs(self) -> int:
        return -(-len(self.kept) // SHAPE_FRAMES) if self._game.has_shapes else 0

    def blob(self, name: str) -> bytes | None:
        """Return a blob by its name, or None."""
        if name == "times":
            return reals(self._game.t[self.kept])
        if name == "events":
            return compact_json(event_rows(self._game.events)).encode()
        if name in self._scenery:
            return self._scenery[name]
        kind, _, number = name.partition("-")
        n_blobs = {"chunk": len(self.chunks), "shapes": self._n_shape_blobs}.get(kind, 0)
        if not number.isdecimal() or len(number) > 9 or int(number) >= n_blobs:
            return None
        if kind == "shapes":
            return self._shapes(int(number) * SHAPE_FRAMES)
        first, last = self.chunks[int(number)]
        frames = [self._game.frame(int(i)) for i in self.kept[first : last + 1]]
        return pack(first, frames, self.step, self._leap)

    def _shapes(self, first: int) -> bytes:
        """Shapes of `SHAPE_FRAMES` frames: frame and length of each message, then the message; of equal ones only the first."""
        parts, before = list[bytes](), b""
        for number in range(first, min(first + SHAPE_FRAMES, len(self.kept))):
            header, data, notes = drawing_message(self._game.shapes(int(self.kept[number])))
            drawn = message(header | {"notes": notes}, data)
            if drawn != before:
                parts += [struct.pack("<2I", number, len(drawn)), drawn]
            before = drawn
        return b"".join(parts)


def kept_frames(t: np.ndarray, period: float | None) -> np.ndarray:
    """Return the numbers of the frames to show: the first of each period, and the last.

    Args:
        t: Times of all frames [s], (T,), ascending.
        period: [s]; None keeps all.
    """
    if period is None or not len(t):
        return np.arange(len(t))
    number = np.floor((t - t[0]) / max(period, 1e-9 * float(t[-1] - t[0])) + 1e-6)
    is_kept = np.diff(number, prepend=-1.0) > 0.0
    is_kept[-1] = True
    return np.flatnonzero(is_kept)


def chunk_bounds(counts: np.ndarray, n_states: int, least_frames: int) -> list[tuple[int, int]]:
    """Return first and last frame of chunks of about n_states states. Each chunk starts with the last frame of the previous one.

    Args:
        counts: States of each frame, (F,), F > 0.
        n_states: States of a chunk.
        least_frames: Frames that it has at least, at most being `MOST_FRAMES`.
    """
    total, last = np.cumsum(counts), len(counts) - 1
    bounds: list[tuple[int, int]] = []
    first = 0
    while first < last or not bounds:
        full = int(np.searchsorted(total, total[first] - counts[first] + n_states))
        end = min(max(full, first + max(least_frames, 2) - 1), first + MOST_FRAMES - 1, last)
        bounds.append((first, end))
        first = end
    return bounds


def game_facts(game: Recording | Comparison) -> list[tuple[str, str]]:
    """Return names and values of the facts panel."""
    if isinstance(game, Comparison):
        both = (("A", game.a), ("B", game.b))
        return [(f"{name}: {key}", value) for name, run in both for key, value in game_facts(run)]
    info, t = game.run.info, game.t
    named = lambda team: game.teams.get(int(team)) or f"team {team}"  # noqa: E731
    worlds = info.get("worlds", [])
    facts = [("Run", game.path.resolve().name)]
    if game.world < len(worlds):
        world = worlds[game.world]
        facts.append(("Seed", str(world["seed"])))
        if len(worlds) > 1:
            facts.append(("World", f"{game.world} of {len(worlds)}"))
        if world["scores"]:
            facts.append(
                (
                    "Score",
                    ", ".join(
                        f"{named(team)}: {displays.number(float(score))}"
                        for team, score in world["scores"].items()
                    ),
                )
            )
    facts.append(("Time", f"{t[0]:g} s to {t[-1]:g} s"))
    if info:
        facts += mission_facts(info["mission"], game.teams)
        facts.append(("Played by", f"tussle {info.get('versions', {}).get('tussle', '')}".strip()))
    return facts


def compact_json(data: object) -> str:
    """Encode as JSON without whitespace.

    Raises:
        ValueError: A number is not finite.
    """
    return json.dumps(data, separators=(",", ":"), allow_nan=False)
