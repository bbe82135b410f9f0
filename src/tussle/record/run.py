"""A recorded run, as frames."""

from __future__ import annotations

import json
from functools import cached_property
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pyarrow as pa

from tussle.errors import MissingExtraError, ParameterError, RecordError, listed, nearest_name
from tussle.record.schema import (
    EVENTS,
    EVENTS_FILE,
    FILES,
    FORMAT,
    MISSION_FILE,
    RUN_FILE,
    SUMMARY_FILE,
    TRAJECTORY,
    TRAJECTORY_FILE,
)
from tussle.record.stream import read_stream

FRAMES = ("pandas", "polars")


class Run:
    """A run directory, whole or cut.

    Args:
        path: The directory.
        frames: "pandas", "polars", or "" for the first of them that is installed.

    Attributes:
        info: What `run.json` says; empty without it.
        notes: What is missing, one line each; empty for a complete run.
    """

    def __init__(self, path: Path, frames: str) -> None:
        self.path = path
        self._frames = frames
        self.info: dict[str, Any] = {}
        self.notes: list[str] = []
        self._read_info()
        self.trajectory_table = self._read_stream(TRAJECTORY_FILE, TRAJECTORY)
        self.events_table = self._read_stream(EVENTS_FILE, EVENTS)

    def _read_info(self) -> None:
        path = self.path / RUN_FILE
        if not path.exists():
            self.notes.append(
                f"{RUN_FILE} is not there: the run goes on, or was cut short; the tables hold what had been written"
            )
            return
        try:
            info = json.loads(path.read_text(encoding="utf-8"))
        except ValueError as error:
            self.notes.append(f"{RUN_FILE} cannot be read: {error}")
            return
        if info.get("format") != FORMAT:
            raise RecordError(
                f"{path}: the run directory has format {info.get('format')!r}; this tussle reads format {FORMAT}"
            )
        self.info = info
        if info["interrupted"]:
            self.notes.append(f"the run was interrupted: {info['interrupted']}")

    def _read_stream(self, name: str, schema: pa.Schema) -> pa.Table:
        path = self.path / name
        table, note = read_stream(path, schema)
        said = self.info.get("files", {}).get(name)
        if (
            not note
            and said is not None
            and (path.stat().st_size, table.num_rows) != (said["bytes"], said["rows"])
        ):
            note = f"{name} has {table.num_rows} rows, {said['rows']} were written"
        if note:
            self.notes.append(note)
        return table

    @property
    def is_complete(self) -> bool:
        """All that was to be played has been, and all of it is here."""
        return bool(self.info.get("is_complete")) and not self.notes

    @cached_property
    def trajectory(self) -> Any:
        """States: one row per entity and recorded step, as a frame."""
        return self._frame(self.trajectory_table)

    @cached_property
    def events(self) -> Any:
        """Births, deaths, captures, collisions and ends, as a frame."""
        return self._frame(self.events_table)

    @cached_property
    def summary(self) -> Any:
        """One row per world and team, as a frame.

        Raises:
            RecordError: The run has none, since it did not come to its end.
        """
        path = self.path / SUMMARY_FILE
        if not path.exists():
            raise RecordError(f"{path} is not there: {'; '.join(self.notes) or 'it has been removed'}")
        return self._package().read_csv(path)

    @property
    def mission(self) -> str | None:
        """Text of the mission file with all its values; None for a mission built in Python."""
        path = self.path / MISSION_FILE
        return path.read_text(encoding="utf-8") if path.exists() else None

    def _package(self) -> Any:
        name = self._frames or next((f for f in FRAMES if find_spec(f)), "")
        if not name or find_spec(name) is None:
            raise MissingExtraError(
                f"frames need {name or 'pandas or polars'}, which is not installed: pip install 'tussle[frames]' brings pandas; "
                "`trajectory_table` and `events_table` are Arrow tables and need neither"
            )
        return import_module(name)

    def _frame(self, table: pa.Table) -> Any:
        package = self._package()
        return table.to_pandas() if package.__name__ == "pandas" else package.from_arrow(table)

    def __repr__(self) -> str:
        state = "complete" if self.is_complete else f"incomplete: {'; '.join(self.notes)}"
        return f"<Run {str(self.path)!r}: {self.trajectory_table.num_rows} states, {state}>"


def load_run(path: str | Path, frames: str = "") -> Run:
    """Load a run directory; a run that goes on or was killed gives what had been written.

    Args:
        path: The directory.
        frames: "pandas" or "polars"; by default the first of them that is installed.

    Raises:
        RecordError: It is no run directory.
        ParameterError: `frames` names something else.
    """
    if frames not in ("", *FRAMES):
        raise ParameterError(
            f"frames = {frames!r} is not allowed{nearest_name(frames, FRAMES)}; {listed(FRAMES)}"
        )
    place = Path(path)
    if not any((place / name).exists() for name in FILES):
        raise RecordError(
            f"{place}: no run has been recorded there; {'it is a file' if place.is_file() else listed(FILES)}"
        )
    return Run(place, frames)
