"""Columns of the recorded tables, and names of the files in a run directory."""

from __future__ import annotations

import pyarrow as pa

from tussle.documents import Document, Map, Maybe, Real, Team, Whole
from tussle.errors import RecordError
from tussle.record.table_values import COUNT, NUMBER, TEXT, Bounds, Rules

FORMAT = 1
"""Version of the run directory's format; the loader refuses others."""

TRAJECTORY_FILE = "trajectory.arrow"
EVENTS_FILE = "events.arrow"
SHAPES_FILE = "shapes.arrow"
RESULTS_FILE = "results.arrow"
LINKS_FILE = "links.arrow"
INPUTS_FILE = "inputs.arrow"
SUMMARY_FILE = "summary.csv"
MISSION_FILE = "mission.xml"
RUN_FILE = "run.json"
FILES = (
    TRAJECTORY_FILE,
    EVENTS_FILE,
    SHAPES_FILE,
    RESULTS_FILE,
    LINKS_FILE,
    INPUTS_FILE,
    SUMMARY_FILE,
    MISSION_FILE,
    RUN_FILE,
)

FLOAT_COLUMNS = ("x", "y", "z", "vx", "vy", "vz", "qw", "qx", "qy", "qz", "health")
"""Float columns in the order of the body table."""
INT_COLUMNS = ("world", "id", "team", "block")


def _field(name: str, kind: pa.DataType, doc: str) -> pa.Field:
    return pa.field(name, kind, nullable=False, metadata={"doc": doc})


_I, _F = pa.int32(), pa.float64()
_BLOCK = pa.dictionary(pa.int32(), pa.string())

TRAJECTORY = pa.schema(
    [
        _field("world", _I, "number of the world in its stack"),
        _field("t", _F, "time [s]"),
        _field("step", _I, "number of the step that begins with this state"),
        _field("id", _I, "entity, unique in its world"),
        _field("block", _BLOCK, "name of its block"),
        _field("team", _I, "team"),
        *(_field(c, _F, "position [m], East North Up") for c in ("x", "y", "z")),
        *(_field(c, _F, "attitude, body to world") for c in ("qw", "qx", "qy", "qz")),
        *(_field(c, _F, "ground velocity [m/s], East North Up") for c in ("vx", "vy", "vz")),
        _field("health", _F, "health; the entity is removed at 0"),
    ]
)
"""One row per entity and recorded step, ordered by step, world and id."""

EVENTS = pa.schema(
    [
        _field("world", _I, "number of the world in its stack"),
        _field("t", _F, "time of the beginning of the event's step; of a birth or an end, its own time [s]"),
        _field("step", _I, "that step"),
        _field("kind", pa.string(), "birth, death, capture, collision, flag or end"),
        _field(
            "id", _I, "entity that was born, died, captured or has a flag, or the smaller id of a collision"
        ),
        _field(
            "other",
            _I,
            "entity that was captured, captured or hit the dead one, or the larger id; 0 for none",
        ),
        _field(
            "text",
            pa.string(),
            "block of a birth, cause of a death, what happened to a flag, reason of an end",
        ),
    ]
)

SHAPES = pa.schema(
    [
        _field("world", _I, "number of the world in its stack"),
        _field("t", _F, "time of the beginning of the step in which it was drawn [s]"),
        _field("step", _I, "that step"),
        _field("kind", pa.string(), "points, cloud, line, vectors, sphere, box, cone, text or mesh"),
        _field("lifetime", _F, "how long it is seen [s]; 0 is until the next step"),
        _field("attributes", pa.string(), "what it was drawn with, as a JSON object"),
    ]
)
"""One row per shape that plugins drew, in the order of drawing."""

RESULTS = pa.schema(
    [
        _field("world", _I, "number of the world in its stack"),
        _field("t", _F, "time from which on it holds [s]"),
        _field("step", _I, "number of the step that begins then"),
        _field(
            "name", pa.string(), "score, or plugin and result, such as SimpleCaptureMetrics.NonTeamCapture"
        ),
        pa.field("team", _I, metadata={"doc": "team; null where it is of none"}),
        _field("value", _F, "its value until the next change"),
    ]
)
"""One row per change of a score or a result, ordered by step and world."""

LINKS = pa.schema(
    [
        _field("world", _I, "number of the world in its stack"),
        _field("network", pa.string(), "name of the network"),
        _field("sender", _I, "entity that sent"),
        _field("receiver", _I, "entity within its reach"),
        _field("outcome", pa.string(), "delivered, or why the messages were lost"),
        _field("messages", pa.int64(), "number of messages"),
    ]
)
"""One row per link and outcome that occurred, ordered by world, network, sender, receiver and outcome."""

INPUTS = pa.schema(
    [
        _field("world", _I, "number of the world in its stack"),
        _field("t", _F, "time at the beginning of the step [s]"),
        _field("step", _I, "number of the step before which it came"),
        _field("kind", pa.string(), "message or column"),
        _field("name", pa.string(), "type of the message, or path of the column"),
        _field("network", pa.string(), "network of the message; empty is the one that reaches everyone"),
        _field("topic", pa.string(), "topic of the message; empty is the name of its type"),
        pa.field(
            "to",
            pa.list_(_I),
            metadata={"doc": "ids of the entities that got the message; none is whoever the network reached"},
        ),
        pa.field("by", pa.string(), metadata={"doc": "who gave it; empty where nobody said so"}),
        pa.field(
            "values",
            pa.string(),
            metadata={
                "doc": "fields or values as JSON; null where a message held an object that JSON cannot hold"
            },
        ),
    ]
)
"""One row per message or column that came from outside, in the order in which they came."""

TRAJECTORY_RULES: Rules = (
    {"world": COUNT, "t": NUMBER, "step": COUNT, "id": COUNT, "block": TEXT}
    | dict.fromkeys(("x", "y", "z", "qw", "qx", "qy", "qz"), NUMBER)
)  # fmt: skip
EVENTS_RULES: Rules = {"world": COUNT, "t": NUMBER, "step": COUNT, "kind": TEXT, "id": COUNT, "other": COUNT}
SHAPES_RULES: Rules = {
    "world": COUNT, "t": NUMBER, "step": COUNT, "kind": TEXT, "lifetime": Bounds(0.0), "attributes": TEXT,
}  # fmt: skip
RESULTS_RULES: Rules = {"world": COUNT, "t": NUMBER, "step": COUNT, "name": TEXT}
INPUTS_RULES: Rules = {
    "world": COUNT, "t": NUMBER, "step": COUNT, "kind": TEXT, "name": TEXT, "network": TEXT, "topic": TEXT,
}  # fmt: skip
LINKS_RULES: Rules = {
    "world": COUNT, "network": TEXT, "sender": COUNT, "receiver": COUNT, "outcome": TEXT, "messages": COUNT,
}  # fmt: skip

_TEAMS = Map(Real(is_any=True), Team)
_WORLD = {
    "world": Whole(),
    "seed": Whole(most=2**64 - 1),
    "end": str,
    "steps": Whole(),
    "t": Real(),
    "alive": _TEAMS,
    "born": Maybe(Map(Whole(), Team)),
    "waited": Maybe(Whole()),
    "scores": _TEAMS,
    "winner": Maybe(Whole(-(2**31))),
    "state_hash": str,
    "error": Maybe(str),
}
RUN = Document(
    "the run directory",
    FORMAT,
    {
        "is_complete": bool,
        "interrupted": str,
        "period": Maybe(Real(5e-324)),
        "mission_notes": Maybe([str]),
        "mission": {
            "name": str,
            "dt": Real(5e-324),
            "start": Real(),
            "end": Maybe(Real(is_any=True)),
            "end_conditions": Maybe([str]),
            "blocks": [
                {
                    "name": str,
                    "team": Whole(-(2**31), 2**31 - 1),
                    "count": Maybe(Whole()),
                    "rate": Maybe(Real(is_any=True)),
                    "plugins": [str],
                }
            ],
            "networks": Maybe([str]),
            "world_plugins": Maybe([str]),
        },
        "worlds": [_WORLD],
        "versions": Map(str),
        "files": Map({"bytes": Whole(), "rows": Whole()}),
        "checksums": Maybe(Map(str)),
    },
    RecordError,
)
"""Schema of `run.json`."""
