"""Entities, scenery and events of a run as messages of Foxglove."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from tussle.record.event_texts import event_text
from tussle.view.frame import Event, Frame
from tussle.view.recording import Recording
from tussle.view.shapes import MODELS, Mesh
from tussle.view.style import Colour
from tussle.world.rays.surfaces import MeshPart

if TYPE_CHECKING:
    from foxglove import messages as fg

WORLD = "world"
"""Name of the fixed frame."""
NO_TEAM: Colour = (92, 104, 116)
"""Red, green, blue of boundaries that belong to no team."""
GROUND: Colour = (196, 200, 172)
"""Red, green, blue of terrain."""
AXES: tuple[Colour, ...] = ((200, 70, 60), (70, 150, 70), (70, 110, 200))
MAX_HEIGHTS = 20_000
"""Heights of terrain that are written."""
REPEAT_PERIOD = 1.0
"""Simulated time after a birth until all entities are written again [s]: a reader that jumps sees only the last message of each topic."""


def stamp(ns: int) -> fg.Timestamp:
    """A time [ns]."""
    from foxglove.messages import Timestamp

    return Timestamp(sec=ns // 1_000_000_000, nsec=ns % 1_000_000_000)


def entity(
    name: str, frame: str, ns: int, lifetime: int = 0, notes: Iterable[tuple[str, str]] = (), **parts: Any
) -> fg.SceneEntity:
    """An entity of a scene.

    Args:
        name: Its id in the topic.
        frame: The frame that it moves with.
        ns: Time from which it exists [ns].
        lifetime: How long it exists [ns]; 0 until the end.
        notes: Keys and values that are shown when it is selected.
        parts: Lists of its primitives, by kind.
    """
    from foxglove import messages as fg

    return fg.SceneEntity(
        timestamp=stamp(ns), frame_id=frame, id=name, frame_locked=True,
        lifetime=fg.Duration(sec=lifetime // 1_000_000_000, nsec=lifetime % 1_000_000_000),
        metadata=[fg.KeyValuePair(key=key, value=value) for key, value in notes], **parts,
    )  # fmt: skip


def colour(rgb: Colour, opacity: float = 1.0) -> fg.Color:
    """A colour, 0 to 1."""
    from foxglove.messages import Color

    r, g, b = (v / 255.0 for v in rgb)
    return Color(r=r, g=g, b=b, a=opacity)


def pose(at: Iterable[float] = (0.0, 0.0, 0.0)) -> fg.Pose:
    """A position without rotation."""
    from foxglove import messages as fg

    x, y, z = at
    return fg.Pose(position=fg.Vector3(x=x, y=y, z=z), orientation=fg.Quaternion(x=0.0, y=0.0, z=0.0, w=1.0))


def points(array: np.ndarray) -> list[fg.Point3]:
    """Points, (k, 3)."""
    from foxglove.messages import Point3

    return [Point3(x=x, y=y, z=z) for x, y, z in array.astype(float).tolist()]


def triangles(mesh: Mesh, rgb: Colour, opacity: float = 1.0) -> fg.TriangleListPrimitive:
    """A surface in one colour."""
    from foxglove.messages import TriangleListPrimitive

    return TriangleListPrimitive(
        pose=pose(), points=points(mesh.vertices), color=colour(rgb, opacity), indices=mesh.faces.ravel().tolist()
    )  # fmt: skip


def coloured_triangles(part: MeshPart) -> fg.TriangleListPrimitive:
    """A surface in the colours of its corners."""
    from foxglove.messages import Color, TriangleListPrimitive

    colours = [Color(r=r, g=g, b=b, a=1.0) for r, g, b in (part.corner_colours() / 255.0).tolist()]
    return TriangleListPrimitive(
        pose=pose(), points=points(part.vertices), colors=colours, indices=part.faces.ravel().tolist()
    )


def textured_model(part: MeshPart) -> fg.ModelPrimitive:
    """A surface with its image, as binary glTF."""
    from foxglove import messages as fg
    from PIL import Image
    from trimesh import Trimesh  # whoever has read an image has the packages of tussle[scene]
    from trimesh.visual.material import PBRMaterial
    from trimesh.visual.texture import TextureVisuals

    image = Image.fromarray(np.asarray(part.image))
    material = PBRMaterial(  # type: ignore[no-untyped-call]
        baseColorTexture=image, metallicFactor=0.0, roughnessFactor=1.0
    )
    visual = TextureVisuals(uv=part.uv, material=material)  # type: ignore[no-untyped-call]
    visual.vertex_attributes["color"] = np.pad(part.colours, [(0, 0), (0, 1)], constant_values=255)
    vertices = part.vertices[:, [0, 2, 1]] * (1.0, 1.0, -1.0)  # y is up in glTF
    data: Any = Trimesh(vertices, part.faces, visual=visual, process=False).export(file_type="glb")
    return fg.ModelPrimitive(
        pose=pose(), scale=fg.Vector3(x=1.0, y=1.0, z=1.0), media_type="model/gltf-binary", data=data
    )


def surfaces(parts: Iterable[MeshPart]) -> dict[str, Any]:
    """Primitives of parts of a mesh, by kind."""
    there = list(parts)
    return {
        "models": [textured_model(part) for part in there if part.image is not None],
        "triangles": [coloured_triangles(part) for part in there if part.image is None],
    }


def lines(ends: np.ndarray, rgb: Colour) -> fg.LinePrimitive:
    """Lines between ends (k, 2, 3) [m], two pixels wide."""
    from foxglove import messages as fg

    return fg.LinePrimitive(
        type=fg.LinePrimitiveLineType.LineList, pose=pose(), thickness=2.0, scale_invariant=True,
        points=points(ends.reshape(-1, 3)), color=colour(rgb),
    )  # fmt: skip


def text(words: str, rgb: Colour, at: Sequence[float]) -> fg.TextPrimitive:
    """A text that faces the reader."""
    from foxglove.messages import TextPrimitive

    return TextPrimitive(
        pose=pose(at), billboard=True, font_size=12.0, scale_invariant=True, color=colour(rgb), text=words
    )


def scenery_entities(recording: Recording, ns: int) -> list[fg.SceneEntity]:
    """Bases, boundaries, terrain and origin of a run."""
    from foxglove import messages as fg

    scenery, style = recording.scenery, recording.style
    found = [_origin(recording, ns)] if scenery.origin_length > 0.0 else []
    for i, base in enumerate(scenery.bases, 1):
        d = 2.0 * base.radius
        sphere = fg.SpherePrimitive(
            pose=pose(list(base.position)), size=fg.Vector3(x=d, y=d, z=d),
            color=colour(style.colour(base.team), 0.35 * base.opacity),
        )  # fmt: skip
        found.append(entity(f"base {i}", WORLD, ns, notes=[("team", str(base.team))], spheres=[sphere]))
    for region in scenery.boundaries:
        rgb = style.colour(region.team) if region.team else NO_TEAM
        shown = surfaces(region.parts)
        if not region.parts:
            shown["triangles"] = [triangles(region.mesh, rgb, 0.3 if region.is_wall else 0.06)]
        found.append(entity(region.name, WORLD, ns, lines=[lines(region.outline, rgb)], **shown))
    if scenery.terrain is not None:
        part = scenery.terrain.part(MAX_HEIGHTS)
        plain: dict[str, Any] = {"triangles": [triangles(scenery.terrain.mesh(MAX_HEIGHTS), GROUND)]}
        found.append(entity("terrain", WORLD, ns, **(surfaces([part]) if part else plain)))
    return found


def _origin(recording: Recording, ns: int) -> fg.SceneEntity:
    scenery = recording.scenery
    axes = scenery.origin_length * np.eye(3)
    parts = [lines(np.stack([np.zeros(3), axis])[None], rgb) for axis, rgb in zip(axes, AXES, strict=True)]
    place = scenery.origin
    notes = [
        ("latitude [deg]", f"{math.degrees(place.latitude):.9g}"),
        ("longitude [deg]", f"{math.degrees(place.longitude):.9g}"),
        ("altitude [m]", f"{place.altitude:g}"),
    ]
    return entity("origin", WORLD, ns, notes=notes, lines=parts)


class SceneEntities:
    """Names, models and labels of a run's entities.

    Args:
        recording: The run.
        kept: Numbers of the frames that are written.
        scale: Factor by which models are enlarged.
    """

    def __init__(self, recording: Recording, kept: np.ndarray, scale: float) -> None:
        self._recording, self._scale = recording, scale
        self._blocks = {event.id: event.text for event in recording.events if event.kind == "birth"}
        self._removed = self._find_removals(kept)
        self._mesh = cache(lambda model, lengths, rgb: triangles(MODELS[model].placed(lengths), rgb))
        self._written: set[int] = set()
        self._is_complete, self._last_complete = True, -math.inf

    def _find_removals(self, kept: np.ndarray) -> dict[int, float]:
        """Time of the first kept frame without each removed entity [s]."""
        removed: dict[int, float] = {}
        before = np.zeros(0, np.int32)
        for i in kept:
            frame = self._recording.frame(int(i))
            for who in np.setdiff1d(before, frame.id, assume_unique=True).tolist():
                removed[who] = frame.t
            before = frame.id
        return removed

    def names(self, frame: Frame) -> list[str]:
        """BLOCK/ID of each entity."""
        blocks = self._recording.blocks
        pairs = zip(frame.id.tolist(), frame.block.tolist(), strict=True)
        return [f"{blocks[block]}/{who}" for who, block in pairs]

    def new(self, frame: Frame, ns: Any) -> tuple[list[fg.SceneEntity], list[fg.SceneEntity]]:
        """Models and labels of new entities, or of all, see `REPEAT_PERIOD`; `ns` converts times."""
        rows = [row for row, who in enumerate(frame.id.tolist()) if who not in self._written]
        self._written.update(frame.id[rows].tolist())
        self._is_complete = self._is_complete and not rows
        if not self._is_complete and frame.t - self._last_complete >= REPEAT_PERIOD:
            rows, self._is_complete, self._last_complete = list(range(len(frame))), True, frame.t
        names, now = self.names(frame), ns(frame.t)
        models, labels = [], []
        for row in rows:
            style, who, block = self._recording.style, int(frame.id[row]), int(frame.block[row])
            scale = 1.0 if style.is_true_box(block) else self._scale
            rgb, (x, y, z) = style.block_colour(block), style.lengths(block)
            # It ends just before the time at which it does not exist any more.
            lifetime = ns(self._removed[who]) - now - 1 if who in self._removed else 0
            name = names[row]
            notes = {"id": who, "block": self._recording.blocks[block], "team": int(frame.team[row])}
            about = [(key, str(value)) for key, value in notes.items()]
            surface = self._mesh(style.model(block), (scale * x, scale * y, scale * z), rgb)
            models.append(entity(name, name, now, lifetime, about, triangles=[surface]))
            label = text(str(who), rgb, (0.0, 0.0, 0.7 * scale * z))
            labels.append(entity(name, name, now, lifetime, texts=[label]))
        return models, labels

    def log_line(self, event: Event, ns: int) -> fg.Log:
        """An event as a line of the log."""
        from foxglove.messages import Log, LogLevel

        levels = {"birth": LogLevel.Debug, "capture": LogLevel.Warning, "collision": LogLevel.Warning}
        level = levels.get(event.kind, LogLevel.Info)
        message = event_text(event.kind, self._name(event.id), self._name(event.other), event.text)
        return Log(timestamp=stamp(ns), level=level, message=message, name=event.kind)

    def _name(self, who: int) -> str:
        if not who:
            return ""
        return f"{self._blocks[who]}/{who}" if who in self._blocks else str(who)
