"""A run as an MCAP file for Foxglove.

Open the file in Foxglove and add:

* a 3D panel, whose fixed frame is `world` (East North Up): `/models` draws each entity in its team's colour and moves it with its
  transform in `/tf`; `/scene` draws bases and boundaries; `/labels` writes ids beside the entities when it is switched on. With an
  entity's frame, such as `prey/17`, as display frame the camera moves with that entity;
* a Log panel for `/events`: births are debug messages, deaths and the end information, captures and collisions warnings;
* a Plot panel with `/teams.alive.team_1` and so on: entities left by team; of a run with columns of plugins, those of each entity,
  such as `/columns/prey/17.Boids.goal.x`.

The file's clock is the simulated time: t = 12.5 s is 1970-01-01 00:00:12.5 UTC.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tussle.documents import POSITIVE, check_argument
from tussle.errors import MissingExtraError, ViewError
from tussle.record.plugin_columns import PluginColumn
from tussle.view.export.film.prescan import crowd_of
from tussle.view.export.foxglove_scene import WORLD, SceneEntities, scenery_entities, stamp
from tussle.view.export.whole_file import whole_file
from tussle.view.frame import Frame
from tussle.view.page.recorded import frames_to_write
from tussle.view.recording import Recording

if TYPE_CHECKING:
    from foxglove import Context

CHUNK = 1 << 20
"""Size of a chunk that is compressed as one [B]; a reader that seeks reads one."""
SPACING = 0.5
"""Length of a model as a share of the median distance between neighbours, where it would be too small to be seen."""
N_SPACINGS = 20
"""Frames that are sampled for that distance."""
JSON_TYPES = {float: "number", int: "integer", bool: "boolean"}
MAX_TIME = 2.0**32
"""Times of the file format are less [s]: 136 years."""


@dataclass
class McapReport:
    """A file that was written.

    Attributes:
        path: The file.
        n_frames: Frames in it.
        n_messages: Messages of each topic.
        notes: What the user should know, one line each.
    """

    path: Path
    n_frames: int = 0
    n_messages: Counter[str] = field(default_factory=Counter)
    notes: list[str] = field(default_factory=list)


def write_mcap(
    recording: Recording,
    path: str | Path,
    *,
    period: float | None = None,
    scale: float = 1.0,
    show: Callable[[int, int], None] | None = None,
) -> McapReport:
    """Write a run, complete or not, as an MCAP file of Foxglove's messages, compressed with Zstandard.

    Args:
        recording: The run.
        path: The file; an existing one is replaced.
        period: Time between frames that are written [s]; None writes all. Events are all written.
        scale: Factor by which models are enlarged beyond the default, with which they can be seen.
        show: Called after each frame with the numbers of frames written and to write.

    Raises:
        ParameterError: The period or the scale is not allowed.
        ViewError: There is nothing to write, or the file cannot be written.
        MissingExtraError: The package foxglove-sdk is not installed.
    """
    check_argument("scale", scale, POSITIVE)
    kept = frames_to_write(recording, period)
    try:
        import foxglove
        from foxglove.mcap import MCAPWriteOptions
    except ImportError as error:
        raise MissingExtraError(
            "MCAP files need foxglove-sdk, which is not installed: pip install 'tussle[view]'"
        ) from error
    report = McapReport(Path(path))
    context = foxglove.Context()
    options = MCAPWriteOptions(chunk_size=CHUNK, compression_threads=0)
    with (
        whole_file(Path(path)) as part,
        _told_as_os_error(),
        foxglove.open_mcap(part, allow_overwrite=True, context=context, writer_options=options) as file,
    ):
        messages = _Messages(recording, report, context)
        file.write_metadata("run", messages.metadata())
        entities = SceneEntities(recording, kept, scale * default_scale(recording))
        messages.put_scenery()
        events = list(reversed(recording.events))

        def log_until(t: float) -> None:
            while events and events[-1].t <= t:
                event = events.pop()
                messages.put("/events", event.t, entities.log_line(event, messages.ns(event.t)))

        for n, i in enumerate(kept, 1):
            frame = recording.frame(int(i))
            log_until(frame.t)
            messages.put_frame(frame, entities)
            messages.put_columns(int(i), frame, entities.names(frame))
            if show is not None:
                show(n, len(kept))
        log_until(math.inf)
        report.n_frames = len(kept)
    return report


@contextmanager
def _told_as_os_error() -> Iterator[None]:
    """Raise errors of foxglove-sdk, which are those of writing, as errors of the system."""
    try:
        yield
    except RuntimeError as error:
        if not str(error).startswith("FoxgloveError"):
            raise
        raise OSError(str(error)) from error


def default_scale(recording: Recording) -> float:
    """Factor by which models are enlarged so that they can be seen from afar; 1 where they are near each other."""
    spacings = [
        crowd_of(recording.frame(int(i)))[0]
        for i in np.unique(np.linspace(0, recording.n_frames - 1, N_SPACINGS).round())
    ]
    known = [s for s in spacings if math.isfinite(s)]
    longest = max((recording.style.scale(b) for b in range(len(recording.blocks))), default=1.0)
    return max(1.0, SPACING * float(np.median(known)) / longest) if known else 1.0


class _Messages:
    """Writer of the topics of an open file."""

    def __init__(self, recording: Recording, report: McapReport, context: Context) -> None:
        from foxglove import Channel
        from foxglove.channels import FrameTransformsChannel, LogChannel, SceneUpdateChannel

        self._recording, self._report, self._context = recording, report, context
        self._keys = {team: f"team_{team}" for team in recording.teams}
        counts = {key: {"type": "integer"} for key in self._keys.values()}
        properties = {"t": {"type": "number"}, "alive": {"type": "object", "properties": counts}}
        schema = {"title": "tussle.Teams", "type": "object", "properties": properties}
        about = {self._keys[team]: names for team, names in recording.teams.items()}
        self._channels: dict[str, Any] = {
            "/tf": FrameTransformsChannel("/tf", context=context),
            **{
                topic: SceneUpdateChannel(topic, context=context)
                for topic in ("/models", "/labels", "/scene")
            },
            "/events": LogChannel("/events", context=context),
            "/teams": Channel("/teams", schema=schema, context=context, metadata=about),
        }
        # The clock of the file counts from 0 upward.
        self._shift = max(0, -math.floor(float(recording.t[0])))
        if self._shift:
            report.notes.append(
                f"t = 0 is {self._shift} s after the beginning of the file's clock, which knows no earlier times"
            )

    def metadata(self) -> dict[str, str]:
        """Mission, world and seed."""
        recording = self._recording
        worlds = recording.run.info.get("worlds", [])
        seed = str(worlds[recording.world]["seed"]) if recording.world < len(worlds) else ""
        return {"mission": recording.name, "world": str(recording.world), "seed": seed}

    def ns(self, t: float) -> int:
        """A simulated time [s] on the file's clock [ns].

        Raises:
            ViewError: It does not fit.
        """
        shifted = t + self._shift
        if not 0.0 <= shifted < MAX_TIME:
            raise ViewError(
                f"{self._recording.path}: {t:g} s is not a time of this file format, which takes 136 years"
            )
        return round(shifted * 1e9)

    def put(self, topic: str, t: float, message: Any) -> None:
        """Add a message of a time [s]."""
        self._channels[topic].log(message, log_time=self.ns(t))
        self._report.n_messages[topic] += 1

    def put_scenery(self) -> None:
        """Add bases, boundaries and terrain."""
        from foxglove.messages import SceneUpdate

        t = float(self._recording.t[0])
        self.put("/scene", t, SceneUpdate(entities=scenery_entities(self._recording, self.ns(t))))

    def put_frame(self, frame: Frame, entities: SceneEntities) -> None:
        """Add a frame: new models and labels, all transforms, entities left by team."""
        from foxglove import messages as fg

        for topic, found in zip(("/models", "/labels"), entities.new(frame, self.ns), strict=True):
            if found:
                self.put(topic, frame.t, fg.SceneUpdate(entities=found))
        when, states = (
            stamp(self.ns(frame.t)),
            (entities.names(frame), frame.pos.tolist(), frame.quat.tolist()),
        )
        transforms = [
            fg.FrameTransform(
                timestamp=when, parent_frame_id=WORLD, child_frame_id=name,
                translation=fg.Vector3(x=x, y=y, z=z), rotation=fg.Quaternion(x=qx, y=qy, z=qz, w=qw),
            )
            for name, (x, y, z), (qw, qx, qy, qz) in zip(*states, strict=True)
        ]  # fmt: skip
        self.put("/tf", frame.t, fg.FrameTransforms(transforms=transforms))
        alive = {key: int((frame.team == team).sum()) for team, key in self._keys.items()}
        self.put("/teams", frame.t, {"t": frame.t, "alive": alive})

    def put_columns(self, i: int, frame: Frame, names: Sequence[str]) -> None:
        """Add the columns of plugins in a frame: a message for each entity that has some, its numbers null where they are not finite."""
        from foxglove import Channel

        columns = self._recording.columns.values()
        found = [self._recording.values(i, column.name) for column in columns]
        values = [(~np.ma.getmaskarray(each)[:, 0], each.tolist()) for each in found]
        for row, name in enumerate(names):
            own = [
                (column, rows[row]) for column, (has, rows) in zip(columns, values, strict=True) if has[row]
            ]
            if not own:
                continue
            topic = f"/columns/{name}"
            if topic not in self._channels:
                schema = {"title": "tussle.Columns", **_schema_of(column for column, _ in own)}
                self._channels[topic] = Channel(topic, schema=schema, context=self._context)
            message: dict[str, Any] = {}
            for column, numbers in own:
                for part, number in zip(column.parts, numbers, strict=True):
                    *outer, last = part.split(".")
                    inner = message
                    for each in outer:
                        inner = inner.setdefault(each, {})
                    inner[last] = number if math.isfinite(number) else None
            self.put(topic, frame.t, message)


def _schema_of(columns: Iterable[PluginColumn]) -> dict[str, Any]:
    """JSON schema of the messages with columns of plugins: an object for each name before a dot."""
    found: dict[str, Any] = {"type": "object", "properties": {}}
    for column in columns:
        for part, unit in zip(column.parts, column.units, strict=True):
            *outer, last = part.split(".")
            inner = found["properties"]
            for each in outer:
                inner = inner.setdefault(each, {"type": "object", "properties": {}})["properties"]
            about = f"{column.doc} [{unit}]" if unit else column.doc
            inner[last] = {"type": JSON_TYPES[column.dtype], "description": about}
    return found
