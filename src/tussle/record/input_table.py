"""The table of what came from outside while a game was played, `inputs.arrow`."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import pyarrow as pa

from tussle.errors import RecordError
from tussle.record.inputs import MESSAGE, ExternalInput
from tussle.record.run import load_run
from tussle.record.schema import INPUTS, INPUTS_FILE

MAX_SHOWN = 60
"""Characters of a damaged value in the words about it."""


def load_inputs(path: str | Path, world: int = 0) -> tuple[ExternalInput, ...]:
    """What came from outside into one world of a recorded run, in its order: messages, and columns that were set.

    Args:
        path: The run directory.
        world: Number of the world.

    Raises:
        RecordError: It is not a run directory, or inputs are damaged or missing.
    """
    run = load_run(path, is_mapped=True)
    damage = [note for note in run.notes if INPUTS_FILE in note]
    if run.info and damage:
        raise RecordError(f"{path}: {damage[0]}; the game cannot be played again as it was")
    return inputs_of(run.inputs_table, world)


def batch_of(inputs: Iterable[tuple[int, ExternalInput]], time_of: Callable[[int], float]) -> pa.RecordBatch:
    """Rows of `inputs.arrow`.

    Args:
        inputs: World and input, in their order.
        time_of: Step -> time at its beginning [s].
    """
    rows = list(inputs)
    columns = {
        "world": [world for world, _ in rows],
        "t": [time_of(each.step) for _, each in rows],
        **{
            name: [getattr(each, name) for _, each in rows]
            for name in ("step", "kind", "name", "network", "topic", "to", "by")
        },
        "values": [None if each.values is None else json.dumps(each.values) for _, each in rows],
    }
    arrays = [pa.array(columns[field.name], field.type) for field in INPUTS]
    return pa.RecordBatch.from_arrays(arrays, schema=INPUTS)


def inputs_of(table: pa.Table, world: int) -> tuple[ExternalInput, ...]:
    """What came from outside into one world of a recorded run, in its order.

    Raises:
        RecordError: A value is no JSON.
    """
    return tuple(
        ExternalInput(
            row["step"],
            row["kind"],
            row["name"],
            _read(row),
            row["network"],
            row["topic"],
            tuple(row.get("to") or ()),
            row.get("by") or "",
        )
        for row in table.to_pylist()
        if row["world"] == world
    )


def _read(row: dict[str, Any]) -> Any:
    if row["values"] is None:
        return None
    try:
        values = json.loads(row["values"])
    except (ValueError, RecursionError):
        values = None
    if not isinstance(values, dict if row["kind"] == MESSAGE else (list, int, float)):
        raise RecordError(
            f"inputs.arrow: the values of the {row['kind']} {row['name']} before step {row['step']} are damaged: "
            f"{row['values'][:MAX_SHOWN]}"
        )
    return values
