"""A run as a file for the Rerun viewer.

`rerun run.rrd` opens it. On the timeline `t`, which is the simulated time, it holds:

* `world/BLOCK/ID`: the model of each entity in its team's colour and its pose, from its birth to its removal;
* `scenery/...`: bases, boundaries, terrain;
* `teams/N`: entities left by team; `columns/BLOCK/ID/PLUGIN/NAME`: columns of plugins that were recorded, with their components;
* `events`: births, deaths, captures, collisions and the end in words.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tussle.documents import POSITIVE, check_argument
from tussle.errors import MissingExtraError
from tussle.record.event_texts import event_text
from tussle.view.export.foxglove_scene import GROUND, MAX_HEIGHTS, NO_TEAM
from tussle.view.export.mcap_file import default_scale
from tussle.view.export.whole_file import whole_file
from tussle.view.page.recorded import frames_to_write
from tussle.view.recording import Recording
from tussle.view.shapes import MODELS, Mesh
from tussle.world.rays.surfaces import MeshPart

if TYPE_CHECKING:
    import rerun as rr

FRAMES_AT_ONCE = 256
"""Frames whose states are sent as one column for each entity."""
LEVELS = {"birth": "DEBUG", "capture": "WARN", "collision": "WARN"}
"""Level of each kind of event that is not INFO."""


@dataclass
class RerunReport:
    """A file that was written.

    Attributes:
        path: The file.
        n_frames: Frames in it.
        n_entities: Entities in it.
    """

    path: Path
    n_frames: int
    n_entities: int


def write_rerun(
    recording: Recording,
    path: str | Path,
    *,
    period: float | None = None,
    scale: float = 1.0,
    show: Callable[[int, int], None] | None = None,
) -> RerunReport:
    """Write a run, complete or not, as a recording of Rerun.

    Args:
        recording: The run.
        path: The file; an existing one is replaced.
        period: Time between frames that are written [s]; None writes all. Events are all written.
        scale: Factor by which models are enlarged beyond the default, with which they can be seen.
        show: Called with the numbers of frames written and to write.

    Raises:
        ParameterError: The period or the scale is not allowed.
        ViewError: There is nothing to write, or the file cannot be written.
        MissingExtraError: The package rerun-sdk is not installed.
    """
    check_argument("scale", scale, POSITIVE)
    kept = frames_to_write(recording, period)
    try:
        import rerun as rr
    except ImportError as error:
        raise MissingExtraError(
            "Rerun's files need rerun-sdk, which is not installed: pip install 'tussle[rerun]'"
        ) from error
    stream = rr.RecordingStream("tussle")
    writer = _Writer(recording, stream, scale * default_scale(recording))
    # Rerun's own files wait for ever where the disk is full; what is read in parts is no valid file.
    encoded = stream.binary_stream()
    with whole_file(Path(path)) as part, part.open("wb") as file:
        stream.send_blueprint(_layout(recording))
        writer.put_scenery()
        writer.put_events()
        for begin in range(0, len(kept), FRAMES_AT_ONCE):
            chunk = kept[begin : begin + FRAMES_AT_ONCE]
            writer.put_frames(chunk)
            if show is not None:
                show(begin + len(chunk), len(kept))
        file.write(encoded.read() or b"")
    return RerunReport(Path(path), len(kept), len(writer.seen))


def _layout(recording: Recording) -> Any:
    """What the viewer shows at first: the world from the south, the teams below it, and the events."""
    import rerun.blueprint as rrb

    low, high = recording.scenery.low, recording.scenery.high
    center, size = (low + high) / 2.0, float(np.linalg.norm(high - low))
    eye = rrb.EyeControls3D(
        position=center + size * np.array((0.0, -0.6, 0.4)), look_target=center, eye_up=(0, 0, 1)
    )
    below = rrb.Horizontal(rrb.TimeSeriesView(origin="teams"), rrb.TextLogView(origin="events"))
    return rrb.Blueprint(
        rrb.Vertical(rrb.Spatial3DView(origin="/", name="world", eye_controls=eye), below, row_shares=[3, 1]),
        collapse_panels=True,
    )


class _Writer:
    """Writer of an open recording of Rerun."""

    def __init__(self, recording: Recording, stream: rr.RecordingStream, scale: float) -> None:
        self._recording, self._stream, self._scale = recording, stream, scale
        self._blocks = {event.id: event.text for event in recording.events if event.kind == "birth"}
        self._alive = np.zeros(0, np.int32)
        self._named: set[tuple[int, str]] = set()
        self.seen: set[int] = set()

    def put_scenery(self) -> None:
        """Add bases, boundaries and terrain, which are there at all times, and the colours of teams."""
        import rerun as rr

        recording, style, scenery = self._recording, self._recording.style, self._recording.scenery
        self._put("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP)
        for team, blocks in recording.teams.items():
            line = rr.SeriesLines(names=f"{team}: {blocks}", colors=[style.colour(team)])
            self._put(["teams", str(team)], line)
        for i, base in enumerate(scenery.bases, 1):
            sphere = rr.Ellipsoids3D(
                centers=[base.position], half_sizes=[[base.radius] * 3], fill_mode="solid",
                colors=[(*style.colour(base.team), round(90 * base.opacity))],
            )  # fmt: skip
            self._put(["scenery", f"base {i}"], sphere)
        for region in scenery.boundaries:
            colour = style.colour(region.team) if region.team else NO_TEAM
            where = ["scenery", region.name]
            self._put([*where, "outline"], rr.LineStrips3D(region.outline, colors=[colour]))
            plain = _surface(region.mesh, (*colour, 76 if region.is_wall else 15))
            self._put_parts(where, [_coloured(part) for part in region.parts] or [plain])
        if scenery.terrain is not None:
            part = scenery.terrain.part(MAX_HEIGHTS)
            plain = _surface(scenery.terrain.mesh(MAX_HEIGHTS), (*GROUND, 255))
            self._put_parts(["scenery", "terrain"], [_coloured(part) if part else plain])

    def put_frames(self, kept: np.ndarray) -> None:
        """Add states, columns of plugins and counts of teams of frames, and who comes and goes."""
        import rerun as rr

        frames = [self._recording.frame(int(i)) for i in kept]
        t = np.array([frame.t for frame in frames])
        for frame in frames:
            self._stream.set_time("t", duration=frame.t)
            for who in np.setdiff1d(self._alive, frame.id).tolist():
                self._stream.log(self._path("world", who), rr.Clear(recursive=True))
            for row in np.flatnonzero(~np.isin(frame.id, self._alive)).tolist():
                self._put_model(int(frame.id[row]), int(frame.block[row]))
            self._alive = frame.id.copy()
        ids = np.concatenate([frame.id for frame in frames])
        of = np.repeat(np.arange(len(frames)), [len(frame) for frame in frames])
        pos, quat = (np.concatenate([getattr(frame, name) for frame in frames]) for name in ("pos", "quat"))
        # By entity, and within each in the order of time.
        order = np.argsort(ids, kind="stable")
        who_there, starts = np.unique(ids[order], return_index=True)
        rows = dict(zip(who_there.tolist(), np.split(order, starts[1:]), strict=True))
        for team in self._recording.teams:
            self._send_numbers(["teams", str(team)], t, [(frame.team == team).sum() for frame in frames])
        for who, own in rows.items():
            poses = rr.Transform3D.columns(translation=pos[own], quaternion=quat[own][:, [1, 2, 3, 0]])
            self._send(self._path("world", who), t[of[own]], poses)
        for column in self._recording.columns.values():
            found = [self._recording.values(int(i), column.name) for i in kept]
            values = np.concatenate([each.data for each in found])
            has = ~np.concatenate([np.ma.getmaskarray(each)[:, 0] for each in found])
            for who, own in rows.items():
                there = own[has[own]]
                if not len(there):
                    continue
                where = ["columns", *self._names(who), *column.name.split(".")]
                if (who, column.name) not in self._named:
                    self._named.add((who, column.name))
                    self._put(where, rr.SeriesLines(names=column.parts))
                self._send_numbers(where, t[of[there]], values[there])

    def put_events(self) -> None:
        """Add all events in words."""
        import rerun as rr

        for event in self._recording.events:
            self._stream.set_time("t", duration=event.t)
            who, other = ("/".join(self._names(who)) if who else "" for who in (event.id, event.other))
            text = event_text(event.kind, who, other, event.text)
            self._stream.log("events", rr.TextLog(text, level=LEVELS.get(event.kind, "INFO")))

    def _put_model(self, who: int, block: int) -> None:
        style = self._recording.style
        scale = 1.0 if style.is_true_box(block) else self._scale
        x, y, z = style.lengths(block)
        mesh = MODELS[style.model(block)].placed((scale * x, scale * y, scale * z))
        self._stream.log(self._path("world", who), _surface(mesh, (*style.block_colour(block), 255)))
        self.seen.add(who)

    def _put_parts(self, where: list[str], parts: Iterable[rr.Mesh3D]) -> None:
        for i, part in enumerate(parts):
            self._put([*where, f"surface {i}"], part)

    def _put(self, where: str | list[str], what: Any) -> None:
        self._stream.log(where, what, static=True)

    def _send(self, path: str, t: np.ndarray, columns: Any) -> None:
        import rerun as rr

        self._stream.send_columns(path, [rr.TimeColumn("t", duration=t)], columns)

    def _send_numbers(self, where: list[str], t: np.ndarray, values: Any) -> None:
        import rerun as rr

        columns = rr.Scalars.columns(scalars=np.asarray(values, float))
        self._send(rr.new_entity_path(where), t, columns)

    def _names(self, who: int) -> list[str]:
        """Block and id of an entity."""
        return [self._blocks[who], str(who)] if who in self._blocks else [str(who)]

    def _path(self, first: str, who: int) -> str:
        import rerun as rr

        return str(rr.new_entity_path([first, *self._names(who)]))


def _surface(mesh: Mesh, colour: tuple[int, ...]) -> rr.Mesh3D:
    """A surface in one colour: red, green, blue, opacity."""
    import rerun as rr

    corners = mesh.vertices[mesh.faces.ravel()]  # each face with its own, so that edges are sharp
    return rr.Mesh3D(vertex_positions=corners, vertex_normals=_normals(corners), albedo_factor=colour)


def _coloured(part: MeshPart) -> rr.Mesh3D:
    """A surface in the colours of its corners, or with its image."""
    import rerun as rr

    look: dict[str, Any] = {"vertex_colors": part.corner_colours().astype(np.uint8)}
    if part.image is not None and part.uv is not None:
        # Images begin at the upper left, texture coordinates at the lower one.
        look = {"albedo_texture": np.asarray(part.image), "vertex_texcoords": part.uv * (1, -1) + (0, 1)}
    return rr.Mesh3D(vertex_positions=part.vertices, triangle_indices=part.faces, **look)


def _normals(corners: np.ndarray) -> np.ndarray:
    """Normal of the face of each corner (3 k, 3), of faces (k, 3, 3) in their order."""
    a, b, c = np.moveaxis(corners.reshape(-1, 3, 3), 1, 0)
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.repeat(normals / np.where(lengths > 0.0, lengths, math.inf), 3, axis=0)
