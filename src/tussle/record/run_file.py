"""The last files of a run directory: `summary.csv`, then `run.json`, whose presence means that all other files are written."""

from __future__ import annotations

import csv
import datetime as dt
import io
import math
import os
import platform
import sys
import time
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from tussle.checksums import as_digits, crc_of_part
from tussle.documents import json_text, size_of
from tussle.errors import RecordError
from tussle.record.schema import FORMAT, RUN_FILE, SUMMARY_FILE
from tussle.record.stream import Stream

PACKAGES = ("tussle", "numpy", "numba", "pyarrow")


class Timings:
    """Wall and CPU time since the beginning of the recording."""

    def __init__(self) -> None:
        self.began = dt.datetime.now(dt.UTC)
        self._wall, self._cpu = time.perf_counter(), time.process_time()

    def so_far(self) -> dict[str, Any]:
        """Date of the beginning, and wall and CPU time since then [s]."""
        return {
            "began": self.began.isoformat(timespec="seconds"),
            "wall_s": round(time.perf_counter() - self._wall, 6),
            "cpu_s": round(time.process_time() - self._cpu, 6),
        }


def versions() -> dict[str, str]:
    """Versions of Python and of the packages that a result may depend on."""
    return {"python": platform.python_version()} | {name: version(name) for name in PACKAGES}


@cache
def version(name: str) -> str:
    """Version of a package, "unknown" without one."""
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:  # run from a source tree that was never installed
        return str(getattr(sys.modules.get(name), "__version__", "unknown"))


def write(
    directory: Path,
    sim: Any,
    timings: Timings,
    streams: Sequence[Stream],
    others: Iterable[str],
    about: Mapping[str, Any],
) -> None:
    """Write both files.

    Args:
        directory: The run directory.
        sim: The simulation, see `recorder.Recorded`.
        timings: Of the recording.
        streams: Files whose sizes are listed in `run.json`.
        others: Names of further files, whose checksums are listed there.
        about: Further values of `run.json`; "interrupted" is the reason why the run is incomplete, or "".

    Raises:
        RecordError: They cannot be written.
    """
    mission = sim.mission
    results = sim.result()
    info: dict[str, Any] = {
        "format": FORMAT,
        "is_complete": not about["interrupted"],
        **about,
        "mission": mission_entry(mission),
        "grade": sim.grade,
        "laws": mission.compat or "tussle",
        "versions": versions(),
        "platform": platform.platform(),
        "command": sys.argv,
        "timings": timings.so_far(),
        "steps": sum(r.steps for r in results),
        "worlds": [_world(r) for r in results],
        "files": {s.path.name: {"bytes": s.size, "rows": s.rows} for s in streams},
    }
    try:
        put_whole(directory / SUMMARY_FILE, _summary(results))
        info["checksums"] = {name: crc_of_file(directory / name) for name in sorted({SUMMARY_FILE, *others})}
        put_whole(directory / RUN_FILE, json_text(plain(info)))
    except OSError as error:
        raise RecordError(
            f"{directory}: the end of the run cannot be written: {os.strerror(error.errno or 0)}"
        ) from error


def crc_of_file(path: Path) -> str:
    """CRC-32 of a file, as `run.json` and `batch.json` list it.

    Raises:
        OSError: It cannot be read, or is not a regular file.
    """
    size = size_of(path)
    with path.open("rb") as file:
        return as_digits(crc_of_part(file, 0, 0, size)).decode()


def put_whole(path: Path, text: str) -> None:
    """Write a file atomically: it is there completely or not at all."""
    draft = path.with_name(path.name + ".part")
    try:
        draft.unlink(missing_ok=True)  # never write through a link
        draft.write_text(text, encoding="utf-8")
        draft.replace(path)
    except OSError:
        draft.unlink(missing_ok=True)
        raise


def mission_entry(mission: Any) -> dict[str, Any]:
    """The entry of `run.json` that describes a mission."""
    names = ("name", "dt", "start", "end", "motion_multiplier", "update", "end_conditions")
    return {name: getattr(mission, name) for name in names} | {
        "blocks": [
            {
                "name": b.name,
                "team": b.team,
                "count": b.count,
                "rate": b.rate,
                "plugins": [repr(p) for p in b.plugins],
            }
            for b in mission.blocks
        ],
        "networks": [network.instance_name for network in mission.networks],
        "world_plugins": [repr(p) for p in mission.world_plugins],
    }


def _world(result: Any) -> dict[str, Any]:
    return {
        "world": result.world,
        "seed": result.seed,
        "end": result.end,
        "steps": result.steps,
        "t": result.t,
        "alive": result.alive,
        "born": result.born,
        "waited": result.waited,
        "scores": result.scores,
        "winner": result.winner,
        "metrics": result.metrics,
        "state_hash": result.state_hash,
        "error": None if result.error is None else str(result.error),
    }


def _summary(results: Sequence[Any]) -> str:
    """One line per world and team; a metric of the whole world is repeated for each of its teams."""
    columns = {(plugin, name): None for r in results for plugin, found in r.metrics.items() for name in found}
    out = io.StringIO()
    lines = csv.writer(out, lineterminator="\n")
    head = ["world", "seed", "team", "score", "alive", "end", "steps", "t"]
    lines.writerow([*head, *(f"{plugin}.{name}" for plugin, name in columns)])
    for r in results:
        for team in r.alive:
            row = [r.world, r.seed, team, r.scores.get(team, ""), r.alive[team], r.end, r.steps, r.t]
            for plugin, name in columns:
                value = r.metrics.get(plugin, {}).get(name, "")
                row.append(value.get(team, "") if isinstance(value, dict) else value)
            lines.writerow(row)
    return out.getvalue()


def plain(value: Any) -> Any:
    """Convert a value to JSON types; inf and nan become strings, as does anything else that JSON lacks."""
    if isinstance(value, Mapping):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple, set, np.ndarray)):
        return [plain(v) for v in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return value if value is None or isinstance(value, (bool, int, float, str)) else str(value)
