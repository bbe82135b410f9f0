"""Files of a study's result: `result.json`, failing games as missions, and the nearest passing game."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from tussle.batch.store import reported
from tussle.documents import json_text
from tussle.record.run_file import plain, put_whole
from tussle.stress.games import Played, StressGame
from tussle.stress.why import Why

RESULT_FILE, FAILURES = "result.json", "failures"
MAX_FAILURES = 10
"""Failing games that are written as missions."""

MissionFile = Callable[[StressGame], str]
"""Returns the mission file that plays a game."""


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


def write_why(path: Path, result: Mapping[str, Any], why: Why, mission_file: MissionFile) -> None:
    """Add to a result why one of its failures happened, and write the nearest passing game beside it."""
    names = [each["file"] for each in result["failures"] if each["state_hash"] == why.failed.state_hash]
    if not names:
        return
    entry = {"file": names[0], **why.entry()}
    with reported(path):
        if why.saved is not None:
            entry["saved"] = saved_file(names[0])
            put_whole(path / entry["saved"], mission_file(why.saved.game))
        put_whole(path / RESULT_FILE, json_text(dict(plain({**result, "why": entry}))))


def saved_file(name: str) -> str:
    """The file of the nearest passing game beside that of a failing one."""
    return f"{name.removesuffix('.xml')}-saved.xml"
