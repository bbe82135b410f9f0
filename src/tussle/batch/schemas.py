"""The schema of `batch.json`, and the columns of the tables and bounds of their values."""

from __future__ import annotations

from typing import Any

import pyarrow as pa

from tussle.batch.plan import MAX_RUNS
from tussle.batch.varied import variable_of
from tussle.documents import Checked, Colour, Document, Either, Inside, Map, Maybe, Real, Team, Whole, problem
from tussle.errors import BatchError, ParameterError, listed, nearest_name
from tussle.record.table_values import COUNT, INT32, NUMBER, TEXT, Bounds, Rules

FORMAT = 1
SEED = Whole(0, 2**64 - 1)
OPTIONS = {"strict": Maybe(bool), "allow_large": Maybe(bool), "search": Maybe([str]), "compat": Maybe(str)}
FILE = {
    "file": Inside,
    "settings": Map(str),
    "ends_by_time": bool,
    "plugin_files": [Inside],
    "options": OPTIONS,
    "notes": Maybe([str]),
}
RANGE = {
    "low": Real(),
    "high": Real(),
    "is_int": bool,
    "is_log": bool,
    "levels": Maybe(Whole()),
    "unit": str,
    "is_text": bool,
}
CHOICE = {"values": [Either((bool, str, Real()), "a text, a number, or true or false")], "is_text": bool}


def _against_mission(mission: dict[str, Any], where: str) -> str:
    """The problem of the entry `mission`, "" for none."""
    if mission["made_in"] == "python":
        return ""
    if violation := problem(mission, FILE, where):
        return violation
    for name in mission["options"]:
        if name not in OPTIONS:
            return (
                f"{where}.options.{name:.80} is not allowed{nearest_name(name, OPTIONS)}; {listed(OPTIONS)}"
            )
    return ""


def _against_variable(variable: dict[str, Any], where: str) -> str:
    if violation := problem(variable, RANGE if variable["kind"] == "range" else CHOICE, where):
        return violation
    try:
        variable_of(variable)
    except ParameterError as error:
        return f"{where}: {error}"
    return ""


def _against_counts(batch: dict[str, Any], _: str) -> str:
    """The problem of counts that do not agree, "" for none."""
    n_runs = batch["n_points"] * batch["n_seeds"]
    if batch["n_runs"] != n_runs:
        return f"n_runs = {batch['n_runs']} is not allowed; n_points and n_seeds make {n_runs}"
    if (batch.get("n_seeds_kept") or 0) > batch["n_seeds"]:
        return f"n_seeds_kept = {batch['n_seeds_kept']} is not allowed; there are {batch['n_seeds']} seeds"
    return ""


VARIABLE = Checked({"kind": ("range", "choice"), "name": str}, _against_variable)

BATCH = Document(
    "the batch",
    FORMAT,
    Checked(
        {
            "name": str,
            "mission": Checked({"made_in": ("file", "python")}, _against_mission),
            "variables": [VARIABLE],
            "n_points": Whole(1, MAX_RUNS),
            "n_seeds": Whole(1, MAX_RUNS),
            "first_seed": SEED,
            "independent": bool,
            "n_runs": Whole(1, MAX_RUNS),
            "is_complete": bool,
            "teams": Map(str, Team),
            "colours": Maybe(Map(Colour, Team)),
            "n_seeds_kept": Maybe(Whole()),
            "fingerprint": Maybe(str),
            "code": Maybe(Map(str)),
            "tussle": str,
            "sample": str,
            "sample_seed": Whole(0, 10**80),
            "dt": Real(5e-324),
            "start": Real(),
            "end": Real(is_any=True),
            "until": Maybe(str),
            "stopped_by": Maybe(str),
            "target": Maybe(str),
            "over": Maybe(str),
            "is_partial": Maybe(bool),
            "command": [str],
            "versions": Map(str),
            "timings": {"wall_s": Real(0.0), "cpu_s": Real(0.0)},
        },
        _against_counts,
    ),
    BatchError,
)
"""Schema of `batch.json`."""

GROUP, CHANCE = LATER = ("group", "chance")
"""Columns of runs that former versions did not write: which points share a structure, and what depends on the seed."""
PLAYED_BY_CHANCE = 2
"""Value of `chance` where plugins draw; it is 1 where births alone do, else 0."""
RUN = Bounds(0, MAX_RUNS - 1)
RULES: Rules = {
    "run": RUN, "point": RUN, "seed": Bounds(0, 2**64 - 1), "team": Bounds(-(2**31), INT32, may_miss=True), "metric": TEXT,
    "end": TEXT, "t": NUMBER, "steps": COUNT, "state_hash": TEXT,
    GROUP: RUN, CHANCE: Bounds(0, PLAYED_BY_CHANCE), "cpu_s": Bounds(0.0), "host": TEXT, "alive": COUNT,
}  # fmt: skip
"""Bounds of the columns of a batch's tables."""

BATCH_FILE, DESIGN_FILE = "batch.json", "design.parquet"
RESULTS_FILE, ALIVE_FILE = "results.parquet", "alive.parquet"
PARTS = "parts"
"""Folder of the files of finished runs that are not in the tables yet."""

_METRIC = pa.struct([("team", pa.int32()), ("metric", pa.string()), ("value", pa.float64())])
_ALIVE = pa.struct([("team", pa.int32()), ("t", pa.float64()), ("alive", pa.int32())])

PLAYED = pa.schema(
    [
        ("run", pa.int64()),
        ("end", pa.string()),
        ("t", pa.float64()),
        ("steps", pa.int32()),
        ("winner", pa.int32()),
        ("state_hash", pa.string()),
        (GROUP, pa.int32()),
        (CHANCE, pa.uint8()),
        ("error", pa.string()),
        ("cpu_s", pa.float64()),
        ("host", pa.string()),
        ("metrics", pa.list_(_METRIC)),
        ("alive", pa.list_(_ALIVE)),
    ]
)
"""One row per finished run, as it is appended."""

OF_RUN = ("end", "t", "steps", "winner", "state_hash", GROUP, CHANCE, "error", "cpu_s", "host")

RESULTS = pa.schema(
    [
        ("run", pa.int64()),
        ("point", pa.int32()),
        ("seed", pa.uint64()),
        ("team", pa.int32()),
        ("metric", pa.string()),
        ("value", pa.float64()),
        *((name, PLAYED.field(name).type) for name in OF_RUN),
    ]
)
"""One row per run, team and metric, sorted by these; metrics of the world come before those of teams."""

ALIVE = pa.schema([("run", pa.int64()), ("team", pa.int32()), ("t", pa.float64()), ("alive", pa.int32())])
"""One row for each change of the number of a team's entities, from the start of the run to its end."""

DESIGN = pa.schema([("run", pa.int64()), ("point", pa.int32()), ("seed", pa.uint64())])
"""One row per planned run; a column for each variable follows."""

TABLES = {DESIGN_FILE: DESIGN, RESULTS_FILE: RESULTS, ALIVE_FILE: ALIVE}
"""Files of a complete batch, and their columns."""
