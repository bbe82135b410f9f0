"""The message types of Foxglove that a run is told in, as JSON schemas.

Names and fields are Foxglove's, which shows a message by the name of its type; of the parts of a scene, those are listed that a run
has. See Foxglove's message schemas: FrameTransforms, SceneUpdate, Log.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

Schema = dict[str, Any]

NUMBER: Schema = {"type": "number"}
STRING: Schema = {"type": "string"}
BOOLEAN: Schema = {"type": "boolean"}
COUNT: Schema = {"type": "integer", "minimum": 0}


def structure(title: str, **fields: Schema) -> Schema:
    """An object that has all of these fields."""
    return {"title": title, "type": "object", "properties": fields, "required": list(fields)}


def several(items: Schema) -> Schema:
    """A list of such."""
    return {"type": "array", "items": items}


_SECONDS = {"sec": COUNT, "nsec": {"type": "integer", "minimum": 0, "maximum": 999_999_999}}
TIME = structure("time", **_SECONDS)
DURATION = structure("duration", **_SECONDS)
VECTOR = structure("foxglove.Vector3", x=NUMBER, y=NUMBER, z=NUMBER)
POINT = structure("foxglove.Point3", x=NUMBER, y=NUMBER, z=NUMBER)
QUATERNION = structure("foxglove.Quaternion", x=NUMBER, y=NUMBER, z=NUMBER, w=NUMBER)
POSE = structure("foxglove.Pose", position=VECTOR, orientation=QUATERNION)
COLOUR = structure("foxglove.Color", r=NUMBER, g=NUMBER, b=NUMBER, a=NUMBER)

FRAME_TRANSFORMS = structure(
    "foxglove.FrameTransforms",
    transforms=several(
        structure(
            "foxglove.FrameTransform",
            timestamp=TIME,
            parent_frame_id=STRING,
            child_frame_id=STRING,
            translation=VECTOR,
            rotation=QUATERNION,
        )
    ),
)

_TRIANGLES = structure(
    "foxglove.TriangleListPrimitive",
    pose=POSE,
    points=several(POINT),
    color=COLOUR,
    colors=several(COLOUR),
    indices=several(COUNT),
)
_LINE = structure(
    "foxglove.LinePrimitive",
    type=COUNT,
    pose=POSE,
    thickness=NUMBER,
    scale_invariant=BOOLEAN,
    points=several(POINT),
    color=COLOUR,
    colors=several(COLOUR),
    indices=several(COUNT),
)
_SPHERE = structure("foxglove.SpherePrimitive", pose=POSE, size=VECTOR, color=COLOUR)
_TEXT = structure(
    "foxglove.TextPrimitive",
    pose=POSE,
    billboard=BOOLEAN,
    font_size=NUMBER,
    scale_invariant=BOOLEAN,
    color=COLOUR,
    text=STRING,
)
PRIMITIVES = ("arrows", "cubes", "spheres", "cylinders", "lines", "triangles", "texts", "models")
"""Lists that each entity of a scene has, most of them empty."""
_KINDS = {"spheres": _SPHERE, "lines": _LINE, "triangles": _TRIANGLES, "texts": _TEXT}

SCENE_UPDATE = structure(
    "foxglove.SceneUpdate",
    deletions=several(structure("foxglove.SceneEntityDeletion", timestamp=TIME, type=COUNT, id=STRING)),
    entities=several(
        structure(
            "foxglove.SceneEntity",
            timestamp=TIME,
            frame_id=STRING,
            id=STRING,
            lifetime=DURATION,
            frame_locked=BOOLEAN,
            metadata=several(structure("foxglove.KeyValuePair", key=STRING, value=STRING)),
            **{name: several(_KINDS.get(name, {"type": "object"})) for name in PRIMITIVES},
        )
    ),
)

LOG = structure(
    "foxglove.Log", timestamp=TIME, level=COUNT, message=STRING, name=STRING, file=STRING, line=COUNT
)
DEBUG, INFO, WARNING = 1, 2, 3
"""Levels of a log."""
LINE_LIST = 2
"""Type of a line primitive whose points are ends, two by two."""


def teams_schema(keys: Iterable[str]) -> Schema:
    """How many of each team are left, by the names of the teams' fields."""
    return structure(
        "tussle.Teams", timestamp=TIME, t=NUMBER, alive=structure("alive", **dict.fromkeys(keys, COUNT))
    )
