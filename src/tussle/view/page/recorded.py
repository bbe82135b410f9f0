"""A recorded game for the page: a document, and named blobs that are made on request."""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from dataclasses import asdict
from functools import cached_property
from typing import Any

import numpy as np

from tussle.declare import displays
from tussle.documents import POSITIVE, Maybe, check_argument, is_count
from tussle.errors import ViewError
from tussle.folders import real_path
from tussle.mission import Mission
from tussle.view.page.chunks import ANGLE_ERROR, FULL_HEALTH, UNIT, pack, position_error, step_of
from tussle.view.page.compare import Comparison
from tussle.view.page.document import event_rows, game_document, scenery_blobs
from tussle.view.page.drawing import drawing_message
from tussle.view.page.formatting import mission_facts
from tussle.view.page.packing import ints, message, reals
from tussle.view.page.recorded_curves import column_changes, quantities_of, run_changes
from tussle.view.recording import Recording

FILE_STATES, FILE_FRAMES = 150_000, 32
"""States of a chunk in a file, about, and its least frames: with fewer the first states of its tracks weigh too much."""
SERVED_STATES, SERVED_FRAMES = 20_000, 4
"""Largest numbers of states and frames in a chunk: work of some hundredths of a second for both ends, so that seeking is not felt."""
MAX_FRAMES = 1024
"""Frames of a chunk: with more a page has to read too much before it shows anything."""
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
        check_argument("period", period, Maybe(POSITIVE))
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
    def n_entities(self) -> list[int]:
        """Number of entities over each whole run."""
        return [
            len({*run.frame(0).id.tolist(), *(event.id for event in run.events if event.kind == "birth")})
            for run, _, _ in self._runs
        ]

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
            (
                "Entities",
                f"{' and '.join(f'{n:,}' for n in self.n_entities)}, in {int(self.counts.sum()):,} states",
            ),
        ]
        if isinstance(game, Comparison):
            more |= {"runs": comparison_data(game), "shift": game.shift.tolist(), "signs": game.signs}
            more |= {"differing": game.differing}
        return {
            **game_document(game, self._mission, self._viewer, self._title),
            "source": "embedded" if self._is_file else "range",
            "facts": facts,
            "quantities": [] if self._is_file else list(self._quantities.items()),
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
            "columns": [
                {
                    "name": column.name,
                    "kind": column.dtype.__name__,
                    "fields": list(column.fields),
                    "units": list(column.units),
                    "doc": column.doc,
                }
                for column in game.columns.values()
            ],
            "alarms": [each for run, _, shift in self._runs for each in alarm_data(run, shift)],
            **more,
        }

    def _curves(self) -> bytes:
        """Entities left and born, captures, scores and results, of each run over time."""
        parts = (run_changes(*run) for run in self._runs)
        return compact_json([each.document() for changes in parts for each in changes]).encode()

    @property
    def names(self) -> list[str]:
        """Names of all blobs."""
        chunks = (f"chunk-{i}" for i in range(len(self.chunks)))
        return [
            "times",
            "events",
            "curves",
            *self._scenery,
            *chunks,
            *(f"columns-{i}" for i in range(self._n_column_blobs)),
            *(f"shapes-{i}" for i in range(self._n_shape_blobs)),
        ]

    @property
    def _n_column_blobs(self) -> int:
        return len(self.chunks) if self._game.columns else 0

    @property
    def _n_shape_blobs(self) -> int:
        return -(-len(self.kept) // SHAPE_FRAMES) if self._game.has_shapes else 0

    def blob(self, name: str) -> bytes | None:
        """Return a blob by its name, or None."""
        if name == "times":
            return reals(self._game.t[self.kept])
        if name == "events":
            return compact_json(event_rows(self._game.events)).encode()
        if name == "curves":
            return self._curves()
        if name in self._scenery:
            return self._scenery[name]
        kind, _, number = name.partition("-")
        if kind == "column" and not self._is_file:
            return self._column(*number.partition("-")[::2])
        n_blobs = {
            "chunk": len(self.chunks),
            "columns": self._n_column_blobs,
            "shapes": self._n_shape_blobs,
        }.get(kind, 0)
        if not is_count(number) or int(number) >= n_blobs:
            return None
        if kind == "shapes":
            return self._shapes(int(number) * SHAPE_FRAMES)
        first, last = self.chunks[int(number)]
        kept = self.kept[first : last + 1].tolist()
        if kind == "columns":
            return self._columns(kept)
        return pack(first, [self._game.frame(i) for i in kept], self.step, self._leap)

    def _columns(self, numbers: Sequence[int]) -> bytes:
        """Columns of plugins in some frames.

        `ints` of the entities of each frame, and of all ids, frame after frame; then for each component of each column the `reals` of these
        entities, NaN where one does not have the column.
        """
        ids = [self._game.frame(i).id for i in numbers]
        parts = [ints(np.array([len(each) for each in ids])), ints(np.concatenate(ids))]
        for name in self._game.columns:
            values: np.ma.MaskedArray[Any, Any] = np.ma.vstack([self._game.values(i, name) for i in numbers])
            parts += [reals(component) for component in np.ma.filled(values.astype(float), np.nan).T]
        return b"".join(parts)

    @property
    def _runs(self) -> list[tuple[Recording, int, int]]:
        """Each run, and what is added to the numbers of its teams and of its entities."""
        game = self._game
        if isinstance(game, Comparison):
            return [(game.a, 0, 0), (game.b, game.team_shift, game.id_shift)]
        return [(game, 0, 0)]

    @cached_property
    def _quantities(self) -> dict[str, str]:
        """Columns of the entities of any of the runs, and their units."""
        return {name: unit for run, _, _ in self._runs for name, unit in quantities_of(run).items()}

    def _column(self, who: str, column: str) -> bytes | None:
        """Changes of a column of an entity, in each run that has it."""
        if not is_count(who) or column not in self._quantities:
            return None
        runs = [run for run in self._runs if column in quantities_of(run[0])]
        changes = [column_changes(run, int(who), column, id_shift) for run, _, id_shift in runs]
        return compact_json([each.document() for each in changes if each.t]).encode()

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


def frames_to_write(recording: Recording, period: float | None) -> np.ndarray:
    """Return the numbers of the frames that an export writes, see `kept_frames`.

    Raises:
        ParameterError: The period is not allowed.
        ViewError: The run holds no states.
    """
    check_argument("period", period, Maybe(POSITIVE))
    kept = kept_frames(recording.t, period)
    if not len(kept):
        raise ViewError(f"{recording.path}: the run holds no states, so there is nothing to write")
    return kept


def chunk_bounds(counts: np.ndarray, n_states: int, least_frames: int) -> list[tuple[int, int]]:
    """Return first and last frame of chunks of about n_states states. Each chunk starts with the last frame of the previous one.

    Args:
        counts: States of each frame, (F,), F > 0.
        n_states: States of a chunk.
        least_frames: Frames that it has at least, at most being `MAX_FRAMES`.
    """
    total, last = np.cumsum(counts), len(counts) - 1
    bounds: list[tuple[int, int]] = []
    first = 0
    while first < last or not bounds:
        full = int(np.searchsorted(total, total[first] - counts[first] + n_states))
        end = min(max(full, first + max(least_frames, 2) - 1), first + MAX_FRAMES - 1, last)
        bounds.append((first, end))
        first = end
    return bounds


def opening(game: Recording | Comparison) -> dict[str, Any]:
    """Return the time at which a page begins, and what it says first: of two runs, where they differ."""
    if isinstance(game, Recording) or game.difference is None:
        return {"begins": float(game.t[0]), "lead": "" if isinstance(game, Recording) else game.lead}
    return {"begins": game.difference.t, "lead": game.lead}


def comparison_data(game: Comparison) -> list[dict[str, Any]]:
    """Return name, directory, teams and what their numbers have been raised by, of each of two runs."""
    return [
        {
            "name": name,
            "title": real_path(run.path).name,
            "teams": [team + shift for team in run.teams],
            "teamShift": shift,
        }
        for name, run, shift in (("A", game.a, 0), ("B", game.b, game.team_shift))
    ]


def alarm_data(run: Recording, id_shift: int) -> list[dict[str, Any]]:
    """Return what each specification came to in a run; `id` is that of its curve."""
    return [] if run.alarms is None else [{**asdict(each), "id": id_shift} for each in run.alarms.courses]


def game_facts(game: Recording | Comparison) -> list[tuple[str, str]]:
    """Return names and values of the facts panel."""
    if isinstance(game, Comparison):
        both = (("A", game.a), ("B", game.b))
        settings = [(path, f"A {a}, B {b}") for path, a, b in game.differing]
        return settings + [(f"{name}: {key}", value) for name, run in both for key, value in game_facts(run)]
    info, t = game.run.info, game.t
    names = {str(team): name for team, name in game.teams.items()}
    worlds = info.get("worlds", [])
    facts = [("Run", real_path(game.path).name)]
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
                        f"{names.get(str(team)) or f'team {team}'}: {displays.number(float(score))}"
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
