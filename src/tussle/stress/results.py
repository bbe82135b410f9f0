"""Files of a study's result: `result.json`, failing games as missions, the nearest passing game, and recordings of both."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from tussle.batch.store import reported
from tussle.batch.trust import remember
from tussle.documents import json_text
from tussle.engine.simulation import Simulation
from tussle.mission import Mission, PluginFile
from tussle.record import Recorder
from tussle.record.run_file import plain, put_whole
from tussle.stress.games import Played, StressGame
from tussle.stress.recorded import columns_read
from tussle.stress.specification import Specification
from tussle.stress.why import Why

RESULT_FILE, FAILURES = "result.json", "failures"
MAX_FAILURES = 10
"""Failing games that are written as missions."""

MAX_STATES = 2_000_000
"""States of a game that are recorded, about 200 MB; of more, those of every other step, every third, …"""

MissionFile = Callable[[StressGame], str]
"""Returns the mission file that plays a game."""
Record = Callable[[StressGame, Path], None]
"""Plays a game again, and records it into a directory."""


def write_result(
    path: Path, failures: Sequence[Played], result: Mapping[str, Any], mission_file: MissionFile
) -> dict[str, Any]:
    """Write a result, and the worst failures as missions; returns what `result.json` holds.

    Args:
        path: The directory.
        failures: Failing games, the worst first.
        result: What else was found.
        mission_file: Makes the files.
    """
    folder, listed = path / FAILURES, []
    with reported(path):
        for number, each in enumerate(failures[:MAX_FAILURES]):
            folder.mkdir(exist_ok=True)
            put_whole(folder / f"{number}.xml", mission_file(each.game))
            listed.append(
                {
                    "file": f"{FAILURES}/{number}.xml",
                    "robustness": each.verdict.robustness,
                    "values": dict(each.game.values),
                    "state_hash": each.state_hash,
                }
            )
        whole = {**result, "failures": listed}
        put_whole(path / RESULT_FILE, json_text(dict(plain(whole))))
    return whole


def write_why(
    path: Path, result: Mapping[str, Any], why: Why, mission_file: MissionFile, record: Record
) -> None:
    """Add to a result why one of its failures happened, write the nearest passing game beside it, and record both."""
    names = [each["file"] for each in result["failures"] if each["state_hash"] == why.failed.state_hash]
    if not names:
        return
    entry = {"file": names[0], **why.entry()}
    with reported(path):
        if why.saved is not None:
            entry["saved"] = saved_file(names[0])
            put_whole(path / entry["saved"], mission_file(why.saved.game))
            record(why.saved.game, path / entry["saved"].removesuffix(".xml"))
        record(why.failed.game, path / names[0].removesuffix(".xml"))
        put_whole(path / RESULT_FILE, json_text(dict(plain({**result, "why": entry}))))


def record_game(
    mission: Mission,
    seed: int,
    specification: Specification,
    plugin_files: Sequence[PluginFile],
    directory: Path,
) -> None:
    """Record a game, with the columns that a specification reads; what a directory of this name held before is removed.

    Raises:
        RecordError: It cannot be written.
    """
    n_states = mission.steps * sum(block.count for block in mission.blocks)
    period = -(-n_states // MAX_STATES) * mission.dt if n_states > MAX_STATES else None
    if plugin_files:
        remember(plugin_files)
    shutil.rmtree(directory, ignore_errors=True)
    with (
        Simulation(mission, seed) as sim,
        Recorder(
            sim,
            directory,
            period=period,
            columns=columns_read(specification, mission),
            results=True,
            plugin_files=plugin_files,
        ),
    ):
        sim.run()


def saved_file(name: str) -> str:
    """The file of the nearest passing game beside that of a failing one."""
    return f"{name.removesuffix('.xml')}-saved.xml"
