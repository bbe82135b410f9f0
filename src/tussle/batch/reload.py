"""A batch from its directory: its results, and any of its runs again."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow.compute as pc

from tussle.batch import store
from tussle.batch.points import values_text
from tussle.batch.results import Results
from tussle.errors import BatchError
from tussle.mission import Loaded, Mission, read_mission


def load_batch(path: str | Path) -> Results:
    """The results of a batch directory, complete or not.

    Raises:
        BatchError: There is no batch, or it cannot be read.
    """
    return Results(store.load(path))


@dataclass(frozen=True)
class PlannedRun:
    """One run of a batch, to be played again.

    Attributes:
        loaded: Its mission file, with the values of its point.
        mission: What is played.
        seed: Its seed.
        settings: All that was set in the file.
        state_hash: What it ended in; "" where it is not finished.
    """

    loaded: Loaded
    mission: Mission
    seed: int
    settings: dict[str, str]
    state_hash: str


def planned_run(path: str | Path, number: int) -> PlannedRun:
    """A run of a batch that was made from a mission file.

    Raises:
        BatchError: There is no such batch or run, or its mission was made in Python.
        MissionError: Its files can no longer be read.
    """
    results = load_batch(path)
    about: dict[str, Any] = results.info["mission"]
    if about["made_in"] != "file":
        raise BatchError(
            f"{path}: the mission of this batch was made in Python; there, `Batch(...).simulation({number})` is the game of this run"
        )
    if not 0 <= number < results.design.num_rows:
        raise BatchError(
            f"{path}: there is no run {number}; the batch has runs 0 to {results.design.num_rows - 1}"
        )
    folder = Path(path) / store.MISSION
    planned = results.design.slice(number, 1).to_pylist()[0]
    point = {v.name: planned[v.name] for v in results.variables}
    settings = {**about["settings"], **values_text(point, results.variables)}
    plugin_files = tuple(folder / store.PLUGINS / name for name in about["plugin_files"])
    loaded = read_mission(folder / about["file"], settings, plugin_files=plugin_files, **about["options"])
    mission = loaded.mission.ending_by_time() if about["ends_by_time"] else loaded.mission
    found = results.table.filter(pc.equal(results.table["run"], number))["state_hash"]
    return PlannedRun(loaded, mission, planned["seed"], settings, found[0].as_py() if len(found) else "")
