"""A run as an MCAP file, which Foxglove opens.

Open the file in Foxglove and add:

* a 3D panel, whose fixed frame is `world` (East North Up): `/models` draws each entity in its team's colour and lets it move with its
  transform in `/tf`; `/scene` draws bases and boundaries; `/labels` writes ids beside the entities when it is switched on. Choose
  an entity's frame, such as `prey/17`, as display frame to fly with it;
* a Log panel for `/events`: births are debug messages, deaths and the end information, captures and collisions warnings;
* a Plot panel with `/teams.alive.team_1` and so on: how many are left.

The file's clock is the simulated time: t = 12.5 s is 1970-01-01 00:00:12.5 UTC.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any, Self

import numpy as np

from tussle.errors import MissingExtraError, ParameterError, ViewError
from tussle.view.export import foxglove_schemas as schemas
from tussle.view.export.film.survey import crowd_of
from tussle.view.export.foxglove_entities import Log, SceneEntities
from tussle.view.export.foxglove_scene import WORLD, as_json, stamp, standing
from tussle.view.export.whole_file import whole_file
from tussle.view.frame import Frame
from tussle.view.page.recorded import kept_frames
from tussle.view.recording import Recording

CHUNK = 1 << 20
"""Bytes that are compressed together; a reader that jumps reads as much."""
SPACING = 0.5
"""Length of a model as a share of the usual distance between neighbours, where it would be too small to be seen."""
N_SPACINGS = 20
"""Moments at which that distance is looked at."""
TOPICS = {
    "/tf": schemas.FRAME_TRANSFORMS,
    "/models": schemas.SCENE_UPDATE,
    "/labels": schemas.SCENE_UPDATE,
    "/scene": schemas.SCENE_UPDATE,
    "/events": schemas.LOG,
}


@dataclass
class McapReport:
    """What was written.

    Attributes:
        path: The file.
        n_frames: Moments in it.
        n_messages: Messages of each topic.
        notes: What the user should know, one line each.
    """

    path: Path
    n_frames: int = 0
    n_messages: dict[str, int] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def write_mcap(
    recording: Recording,
    path: str | Path,
    *,
    period: float | None = None,
    scale: float = 1.0,
    show: Callable[[int, int], None] | None = None,
) -> McapReport:
    """Write a run as an MCAP file of JSON messages, compressed with Zstandard; of one that was cut short, what there is.

    Args:
        recording: The run.
        path: The file, replaced where it is there.
        period: Time between moments that are kept [s]; None keeps all. Events are all kept.
        scale: Factor by which models are larger than they would be, which is so that they can be seen.
        show: Told after each moment how many are written, and of how many.

    Raises:
        ParameterError: The period or the scale is not allowed.
        ViewError: There is nothing to write, or the file cannot be written.
        MissingExtraError: The package mcap is not installed.
    """
    for name, value in (("period", period), ("scale", scale)):
        if value is not None and not 0.0 < value < math.inf:
            raise ParameterError(f"{name} = {value!r} is not allowed; it takes a number > 0")
    kept = kept_frames(recording.t, period)
    if not len(kept):
        raise ViewError(f"{recording.path}: the run holds no states, so there is nothing to write")
    report = McapReport(Path(path))
    with (
        whole_file(Path(path)) as part,
        part.open("wb") as file,
        Messages(file, recording, report) as messages,
    ):
        entities = SceneEntities(recording, kept, messages.put, messages.ns, scale * usual_scale(recording))
        first = float(recording.t[0])
        messages.put("/scene", first, {"deletions": [], "entities": standing(recording, messages.ns(first))})
        log = Log(recording, messages.put, messages.ns, entities)
        for n, i in enumerate(kept, 1):
            frame = recording.frame(int(i))
            entities.meet(frame)
            log.until(frame.t)
            entities.tell(frame)
            messages.put_transforms(frame, entities)
            messages.put_teams(frame)
            if show is not None:
                show(n, len(kept))
        log.until(math.inf)
        report.n_frames = len(kept)
    return report


def usual_scale(recording: Recording) -> float:
    """Factor by which models are larger than life so that they can be told from afar; 1 where they are near each other."""
    spacings = [
        crowd_of(recording.frame(int(i)))[0]
        for i in np.unique(np.linspace(0, recording.n_frames - 1, N_SPACINGS).round())
    ]
    known = [s for s in spacings if math.isfinite(s)]
    longest = max((recording.style.scale(b) for b in range(len(recording.blocks))), default=1.0)
    return max(1.0, SPACING * float(np.median(known)) / longest) if known else 1.0


class Messages:
    """The file that is open, with its topics."""

    def __init__(self, file: Any, recording: Recording, report: McapReport) -> None:
        try:
            from mcap.writer import CompressionType, Writer
        except ImportError as error:
            raise MissingExtraError(
                "MCAP files need mcap, which is not installed: pip install 'tussle[view]'"
            ) from error
        self._writer = Writer(file, chunk_size=CHUNK, compression=CompressionType.ZSTD)
        self._writer.start(profile="", library=f"tussle {version('tussle')}")
        self._report = report
        self._run = recording.path
        self._channels: dict[str, int] = {}
        self._keys = {team: f"team_{team}" for team in recording.teams}
        # The clock of the file counts from 0 upward.
        self._shift = max(0, -math.floor(float(recording.t[0])))
        if self._shift:
            report.notes.append(
                f"t = 0 is {self._shift} s after the beginning of the file's clock, which knows no earlier times"
            )
        self._add_topics(recording)

    def _add_topics(self, recording: Recording) -> None:
        known: dict[str, int] = {}
        names = {f"team_{team}": names for team, names in recording.teams.items()}
        for topic, schema in {**TOPICS, "/teams": schemas.teams_schema(self._keys.values())}.items():
            title = schema["title"]
            if title not in known:
                known[title] = self._writer.register_schema(title, "jsonschema", as_json(schema))
            about = names if topic == "/teams" else {}
            self._channels[topic] = self._writer.register_channel(topic, "json", known[title], about)
            self._report.n_messages[topic] = 0
        worlds = recording.run.info.get("worlds", [])
        seed = str(worlds[recording.world]["seed"]) if recording.world < len(worlds) else ""
        about = {"mission": recording.name, "world": str(recording.world), "seed": seed}
        self._writer.add_metadata("run", about)

    def ns(self, t: float) -> int:
        """A simulated time [s] on the file's clock [ns].

        Raises:
            ViewError: It does not fit there.
        """
        ns = (t + self._shift) * 1e9
        if not 0.0 <= ns < 2.0**63:
            raise ViewError(f"{self._run}: {t:g} s is not a time of this file format, which takes 292 years")
        return round(ns)

    def put(self, topic: str, t: float, message: Any) -> None:
        """Add a message of a time [s]; times do not go back."""
        self._put(topic, self.ns(t), as_json(message))

    def _put(self, topic: str, ns: int, data: bytes) -> None:
        n = self._report.n_messages[topic]
        self._writer.add_message(self._channels[topic], ns, data, ns, n)
        self._report.n_messages[topic] = n + 1

    def put_transforms(self, frame: Frame, entities: SceneEntities) -> None:
        """Add where all entities are; put together by hand, for there are millions of them."""
        ns = self.ns(frame.t)
        when = as_json(stamp(ns)).decode()
        parts = [
            f'{{"timestamp":{when},"parent_frame_id":"{WORLD}","child_frame_id":{entities.quoted[who]},'
            f'"translation":{{"x":{x:.4f},"y":{y:.4f},"z":{z:.4f}}},'
            f'"rotation":{{"x":{qx:.6f},"y":{qy:.6f},"z":{qz:.6f},"w":{qw:.6f}}}}}'
            for who, (x, y, z), (qw, qx, qy, qz) in zip(
                frame.id.tolist(), frame.pos.tolist(), frame.quat.tolist(), strict=True
            )
        ]
        self._put("/tf", ns, f'{{"transforms":[{",".join(parts)}]}}'.encode())

    def put_teams(self, frame: Frame) -> None:
        """Add how many are left."""
        alive = {key: int((frame.team == team).sum()) for team, key in self._keys.items()}
        self.put("/teams", frame.t, {"timestamp": stamp(self.ns(frame.t)), "t": frame.t, "alive": alive})

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is None:
            self._writer.finish()  # type: ignore[no-untyped-call]
