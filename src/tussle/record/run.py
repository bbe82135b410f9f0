"""Loading of recorded runs."""

from __future__ import annotations

import io
from functools import cached_property
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.csv

from tussle.arguments import explained
from tussle.declare.displays import MAX_LINE, counted, line, listing, page, shortened, table
from tussle.documents import DAMAGED, MAX_BYTES, read_text
from tussle.errors import MissingExtraError, ParameterError, RecordError, listed, nearest_name
from tussle.mission.limits import Limits
from tussle.record.arrow_file import read_batches
from tussle.record.plugin_columns import PluginColumn, plugin_columns
from tussle.record.run_file import crc_of_file
from tussle.record.schema import (
    EVENTS,
    EVENTS_FILE,
    EVENTS_RULES,
    FILES,
    INPUTS,
    INPUTS_FILE,
    INPUTS_RULES,
    LINKS,
    LINKS_FILE,
    LINKS_RULES,
    MISSION_FILE,
    RESULTS,
    RESULTS_FILE,
    RESULTS_RULES,
    RUN,
    RUN_FILE,
    SHAPES,
    SHAPES_FILE,
    SHAPES_RULES,
    SUMMARY_FILE,
    TRAJECTORY,
    TRAJECTORY_FILE,
    TRAJECTORY_RULES,
)
from tussle.record.table_values import Rules

FRAMES = ("pandas", "polars")
SUMMARY = pyarrow.csv.ConvertOptions(
    column_types={
        "world": pa.int32(),
        "seed": pa.uint64(),
        "team": pa.int32(),
        "end": pa.string(),
        "t": pa.float64(),
    }
)
"""Columns of `summary.csv` that do not depend on the mission."""


class Run:
    """A run directory, complete or not.

    Args:
        path: The directory.
        frames: "pandas", "polars", or "" for the first of them that is installed.
        is_mapped: States stay in their file until they are used, and no value of theirs is checked.

    Attributes:
        info: Content of `run.json`; empty if it is missing.
        notes: What is missing, one line each; empty for a complete run.
    """

    def __init__(self, path: Path, frames: str, *, is_mapped: bool = False) -> None:
        self.path = path
        self._frames = frames
        self.info: dict[str, Any] = {}
        self.notes: list[str] = []
        self._read_info()
        self.trajectory_table = self._read_table(TRAJECTORY_FILE, TRAJECTORY, TRAJECTORY_RULES, is_mapped)
        self.events_table = self._read_table(EVENTS_FILE, EVENTS, EVENTS_RULES, False)
        self.shapes_table = self._read_if_written(SHAPES_FILE, SHAPES, SHAPES_RULES, is_mapped)
        self.results_table = self._read_if_written(RESULTS_FILE, RESULTS, RESULTS_RULES, False)
        self.inputs_table = self._read_if_written(INPUTS_FILE, INPUTS, INPUTS_RULES, False)
        self.links_table = self._read_if_written(LINKS_FILE, LINKS, LINKS_RULES, False)

    def _read_if_written(self, name: str, schema: pa.Schema, rules: Rules, is_mapped: bool) -> pa.Table:
        """The table of a file that only some runs have; empty if this one has none."""
        is_written = (self.path / name).exists() or name in self.info.get("files", {})
        return self._read_table(name, schema, rules, is_mapped) if is_written else schema.empty_table()

    def _read_info(self) -> None:
        path = self.path / RUN_FILE
        if not path.exists():
            self.notes.append(
                f"{RUN_FILE} is missing: the run is still going on or was killed; the tables hold what was written"
            )
            return
        try:
            self.info = RUN.read(path)
        except RecordError as error:
            if RUN.is_damaged(path):
                self.notes.append(f"{RUN_FILE} {DAMAGED}; the tables are read as those of an incomplete run")
                return
            raise RecordError(
                f"{error}; if the file is removed, the tables are read as those of an incomplete run"
            ) from None
        if self.info["interrupted"]:
            self.notes.append(f"the run was interrupted: {self.info['interrupted']}")

    def _read_table(self, name: str, schema: pa.Schema, rules: Rules, is_mapped: bool) -> pa.Table:
        path, notes = self.path / name, list[str]()
        batches = read_batches(path, notes, RecordError, schema, rules, is_mapped=is_mapped, damage=notes)
        complete = list(batches)
        table = pa.Table.from_batches(complete, complete[0].schema if complete else schema)
        written = self.info.get("files", {}).get(name)
        if not notes and written is not None:
            found = {"bytes": path.stat().st_size, "rows": table.num_rows}
            notes = [
                f"{name} has {n:,} {unit}, but {written[unit]:,} were written"
                for unit, n in found.items()
                if n != written[unit]
            ]
        self.notes += notes
        return table

    @property
    def mission_notes(self) -> list[str]:
        """Notes about the mission file, as they were when it was played: what was ignored, and differences from SCRIMMAGE."""
        return list(self.info.get("mission_notes") or ())

    @property
    def is_complete(self) -> bool:
        """True if the run was played to its end and no part of it is missing."""
        return bool(self.info.get("is_complete")) and not self.notes

    @cached_property
    def trajectory(self) -> Any:
        """States: one row per entity and recorded step, as a frame. Whole numbers and truths of plugins have types that can be missing."""
        return frame_of(self.trajectory_table, self._frames, can_miss=True)

    @cached_property
    def columns(self) -> dict[str, PluginColumn]:
        """Columns of plugins that were recorded with the states, by name."""
        return plugin_columns(self.trajectory_table.schema)

    @cached_property
    def events(self) -> Any:
        """Births, deaths, captures, collisions and ends, as a frame."""
        return self._frame(self.events_table)

    @cached_property
    def results(self) -> Any:
        """Scores and results, one row for each change, as a frame; empty unless they were recorded."""
        return self._frame(self.results_table)

    @cached_property
    def inputs(self) -> Any:
        """Messages and columns that came from outside, as a frame."""
        return self._frame(self.inputs_table)

    @cached_property
    def links(self) -> Any:
        """Messages by network, sender, receiver and outcome, as a frame; written when the recorder is closed."""
        return self._frame(self.links_table)

    @cached_property
    def summary_table(self) -> pa.Table:
        """One row per world and team.

        Raises:
            RecordError: The summary cannot be read, or is missing because the run was not closed.
        """
        path = self.path / SUMMARY_FILE
        if not path.exists():
            raise RecordError(f"{path} is missing: {'; '.join(self.notes) or 'it was removed'}")
        text = self._text(path)
        try:
            table = pyarrow.csv.read_csv(io.BytesIO(text.encode()), convert_options=SUMMARY)
        except pa.ArrowException as error:
            raise RecordError(f"{path}: cannot be read: {error}") from None
        if lacking := [name for name in SUMMARY.column_types if name not in table.column_names]:
            raise RecordError(f"{path}: column {lacking[0]!r} is missing; {listed(table.column_names)}")
        return table

    @cached_property
    def summary(self) -> Any:
        """One row per world and team, as a frame.

        Raises:
            RecordError: See `summary_table`.
        """
        return self._frame(self.summary_table)

    @property
    def mission(self) -> str | None:
        """Text of the mission file with all its values; None if a mission file cannot hold it."""
        path = self.path / MISSION_FILE
        return self._text(path, Limits.large().text) if path.exists() else None

    def _text(self, path: Path, most: int = MAX_BYTES) -> str:
        """The text of a file.

        Raises:
            RecordError: It cannot be read, or is damaged.
        """
        text = read_text(path, RecordError, most)
        written = (self.info.get("checksums") or {}).get(path.name)
        if written is not None and crc_of_file(path) != written:
            raise RecordError(f"{path}: is damaged: its checksum is not that in {RUN_FILE}")
        return text

    def _frame(self, table: pa.Table) -> Any:
        return frame_of(table, self._frames)

    def __repr__(self) -> str:
        return line("Run", repr(str(self.path)), *self._facts())

    def _facts(self) -> tuple[str, ...]:
        name = self.info.get("mission", {}).get("name") or ""
        seeds = [world["seed"] for world in self.info.get("worlds", ())]
        ends = listing([world["end"] or "interrupted" for world in self.info.get("worlds", ())])
        state = (
            "complete" if self.is_complete else f"incomplete: {shortened('; '.join(self.notes), MAX_LINE)}"
        )
        return (
            name, f"seed {seeds[0]}" if len(seeds) == 1 else f"seeds {listing(seeds)}" if seeds else "",
            counted(self.trajectory_table.num_rows, "state"), f"ended by {ends}" if ends else "", state,
        )  # fmt: skip

    def view(self, world: int = 0, *, height: int = 520) -> Any:
        """Return an interactive 3D view for a notebook, with a time line; see `tussle.view.notebook`.

        Args:
            world: Number of the world that is shown.
            height: Height of the view [pixels].

        Raises:
            MissingExtraError: The run is too large for a cell, and anywidget is not installed.
            ParameterError: The height is not allowed.
            RecordError: The run does not have the world.
            ViewError: The run holds no states.
        """
        # By name: views are above recordings.
        recording = import_module("tussle.view.recording").Recording(self.path, world)
        return import_module("tussle.view.notebook").view_run(recording, height)

    def _repr_html_(self) -> str:
        worlds = self.info.get("worlds", ())
        rows = (
            (w["seed"], w["end"], w["t"], team, n, w["scores"].get(team, ""))
            for w in worlds
            for team, n in w["alive"].items()
        )
        return page(
            f"Run {self.path}", self._facts(), table(("seed", "end", "t [s]", "team", "left", "score"), rows)
        )


@explained
def load_run(path: str | Path, frames: str = "", *, is_mapped: bool = False) -> Run:
    """Load a run directory. Of a run that is still going on or was killed, load what was written.

    Args:
        path: The directory.
        frames: "pandas" or "polars"; by default the first of them that is installed.
        is_mapped: States stay in their file until they are used, and no value of theirs is checked.

    Raises:
        RecordError: It is not a run directory.
        ParameterError: `frames` is neither of these.
    """
    check_frames(frames)
    return Run(run_directory(path), frames, is_mapped=is_mapped)


def check_frames(package: str) -> None:
    """Check the name of a package of frames; "" is the first of them that is installed.

    Raises:
        ParameterError: It is neither "pandas" nor "polars".
    """
    if package not in ("", *FRAMES):
        raise ParameterError(
            f"frames = {package!r} is not allowed{nearest_name(package, FRAMES)}; {listed(FRAMES)}"
        )


def frame_of(table: pa.Table, package: str, *, can_miss: bool = False) -> Any:
    """A table as a frame of a package that `check_frames` allows.

    Args:
        table: The table.
        package: The package; "" is the first of them that is installed.
        can_miss: Whether columns of 64-bit integers and of truths get pandas' types with missing values; otherwise such columns become
            real numbers, or objects, if values are missing.

    Raises:
        MissingExtraError: The package is not installed.
    """
    name = package or next((f for f in FRAMES if find_spec(f)), "")
    if not name or find_spec(name) is None:
        raise MissingExtraError(
            f"frames need {name or 'pandas or polars'}, which is not installed: pip install 'tussle[frames]' installs pandas; "
            "Arrow tables need neither"
        )
    if name != "pandas":
        return import_module(name).from_arrow(table)
    pandas = import_module(name)
    types = {pa.int64(): pandas.Int64Dtype(), pa.bool_(): pandas.BooleanDtype()} if can_miss else {}
    return table.to_pandas(types_mapper=types.get)


def run_directory(path: str | Path) -> Path:
    """The path of a run directory.

    Raises:
        RecordError: It is not a run directory.
    """
    place = Path(path)
    if not any((place / name).exists() for name in FILES):
        reason = (
            "the path does not exist"
            if not place.exists()
            else "it is a file"
            if place.is_file()
            else f"it has none of {', '.join(FILES)}"
        )
        raise RecordError(f"{place}: it is not a run directory; {reason}")
    return place
