"""Reads and writes a batch directory: the plan, the results of finished runs, and the tables that are made of them."""

from __future__ import annotations

import contextlib
import os
import shutil
import warnings
from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import IO, Any

import numpy as np
import pyarrow as pa

from tussle.batch.consistency import check_design
from tussle.batch.finished_runs import FinishedRuns, check_rows, completed, row
from tussle.batch.run_table import RunColumns
from tussle.batch.schemas import (
    ALIVE,
    BATCH,
    BATCH_FILE,
    DESIGN,
    DESIGN_FILE,
    LATER,
    PARTS,
    PLAYED,
    RESULTS,
    TABLES,
)
from tussle.batch.tasks import Finished
from tussle.documents import is_count, json_text
from tussle.errors import BatchError, RecordError
from tussle.folders import lock, open_safely
from tussle.record.parquet_blocks import ParquetBlocks
from tussle.record.parquet_file import ParquetTable
from tussle.record.run_file import plain, put_whole
from tussle.record.stream import Stream

MAX_IN_PART = 2000
"""Runs in one file of parts: each is a record batch, which in memory takes ten times what the run takes in a table."""

RUNS, MISSION, PLUGINS, LOCK = "runs", "mission", "plugins", "lock"

IS_OWN = (BATCH_FILE, f"{BATCH_FILE}.part", LOCK)
"""Files that a directory may have before its batch has begun: a batch may have been killed then."""

MAX_HELD = 1 << 26
"""Size of tables [B] up to which those of a directory stay in memory; larger ones are read again by whoever asks for them."""


class StoredBatch:
    """The contents of a batch directory, or of a batch in memory.

    Args:
        path: The directory; None in memory.
        info: Contents of `batch.json`.
        design: One row per planned run.
        finished: Rows of `RESULTS` and `ALIVE` of the finished runs, some runs at a time, in any number of passes.
        notes: What is missing, one line each.

    Attributes:
        runs: One row per finished run: its keys, and how it ended.
        metrics: Name such as "score[2]" -> value for each run, (n_runs,); NaN where the run does not have it.
        teams: Numbers of the teams that have metrics, in order.
        notes: The lines.
    """

    def __init__(
        self, path: Path | None, info: dict[str, Any], design: pa.Table,
        finished: Iterable[tuple[pa.Table, pa.Table]], notes: list[str] | None = None,
    ) -> None:  # fmt: skip
        self.path, self.info, self.design = path, info, design
        self.notes = [] if notes is None else notes
        columns, held, size = RunColumns(len(design)), list[tuple[pa.Table, pa.Table]](), 0
        for some in finished:
            columns.add(some[0])
            size += sum(table.nbytes for table in some)
            if size <= MAX_HELD:
                held.append(some)
            else:
                held.clear()
        self._finished = finished if path is None else held if size <= MAX_HELD else None
        self.runs, self.metrics, self.teams = columns.runs, columns.metrics, columns.teams

    @cached_property
    def table(self) -> pa.Table:
        """`RESULTS` of the finished runs."""
        return self._rows(RESULTS, 0)

    @cached_property
    def alive(self) -> pa.Table:
        """`ALIVE` of the finished runs."""
        return self._rows(ALIVE, 1)

    def _rows(self, columns: pa.Schema, place: int) -> pa.Table:
        """One of the two tables, of the runs that were finished when the batch was read."""
        if self._finished is not None:
            held = [some[place] for some in self._finished]
            return pa.concat_tables([columns.empty_table(), *held]).combine_chunks()
        assert self.path is not None
        design = _read_design(self.path, read_info(self.path))  # the batch may have been gone on with since
        is_there = np.zeros(len(design), bool)
        is_there[self.runs["run"].to_numpy()] = True
        read = (some[place] for some in FinishedRuns(self.path, design, []))
        return pa.concat_tables(rows.filter(pa.array(is_there[rows["run"].to_numpy()])) for rows in read)


class MemoryStore:
    """Finished runs in memory."""

    def __init__(self) -> None:
        self._parts = [PLAYED.empty_table()]
        self._rows: list[pa.RecordBatch] = []

    def add(self, finished: Finished) -> None:
        """Append a finished run."""
        self._rows.append(row(finished))
        if len(self._rows) >= MAX_IN_PART:
            self._compact()

    def played(self) -> pa.Table:
        """All finished runs, in the order in which they ended."""
        self._compact()
        return pa.concat_tables(self._parts)

    def _compact(self) -> None:
        self._parts.append(pa.Table.from_batches(self._rows, PLAYED).combine_chunks())
        self._rows = []


class Store:
    """A batch directory that is open for writing, and locked for other processes.

    When `add` returns, the operating system has the run. Tables are written whole or not at all; a `batch.json` that says that the batch
    is complete is written last.

    Args:
        path: The directory; made where it does not exist.

    Attributes:
        was_killed: The process that played before was killed.

    Raises:
        BatchError: Another process plays this batch, or the directory holds something else.
        RecordError: It cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._stream: Stream | None = None
        with reported(path):
            path.mkdir(parents=True, exist_ok=True)
            if (path / BATCH_FILE).exists():
                read_info(path)
            elif foreign := [p.name for p in path.iterdir() if p.name not in IS_OWN]:
                raise BatchError(
                    f"{path}: holds something that is no batch ({min(foreign)}); choose another directory"
                )
        self._lock = locked(path, "playing this batch")
        with reported(path):
            self.was_killed = (path / LOCK).stat().st_size > 0
            self._lock.write(f"{os.getpid()}\n")
            self._lock.flush()

    @property
    def info(self) -> dict[str, Any] | None:
        """Contents of `batch.json`; None where there is none."""
        return read_info(self.path) if (self.path / BATCH_FILE).exists() else None

    def write_info(self, info: Mapping[str, Any]) -> None:
        """Write `batch.json`, as a whole."""
        with reported(self.path):
            put_whole(self.path / BATCH_FILE, json_text(plain(info)))

    def write_table(self, name: str, table: pa.Table) -> None:
        """Write a table, as a whole."""
        self.write_tables({name: table.schema}, [(table,)])

    def write_tables(self, files: Mapping[str, pa.Schema], rows: Iterable[tuple[pa.Table, ...]]) -> None:
        """Write tables some runs at a time; each appears as a whole, in this order, when all are written.

        Args:
            files: Name of each file -> its columns.
            rows: Further rows of each.
        """
        drafts = {self.path / name: self.path / f"{name}.part" for name in files}
        with reported(self.path):
            try:
                with contextlib.ExitStack() as opened:
                    for draft in drafts.values():
                        draft.unlink(missing_ok=True)  # not what a link leads to
                    writers = [
                        opened.enter_context(ParquetBlocks(draft, schema))
                        for draft, schema in zip(drafts.values(), files.values(), strict=True)
                    ]
                    for some in rows:
                        for writer, table in zip(writers, some, strict=True):
                            writer.add(table)
                for target, draft in drafts.items():
                    draft.replace(target)
            except OSError:
                for draft in drafts.values():
                    draft.unlink(missing_ok=True)
                raise

    def write_folder(self, name: str, files: Mapping[str, bytes]) -> None:
        """Write a folder, as a whole, unless it exists or would be empty.

        Args:
            name: Of the folder.
            files: Path in the folder -> content.
        """
        target, draft = self.path / name, self.path / f"{name}.part"
        if target.exists() or not files:
            return
        with reported(self.path):
            shutil.rmtree(draft, ignore_errors=True)
            draft.mkdir()
            for inner, content in files.items():
                file = draft / inner
                file.parent.mkdir(parents=True, exist_ok=True)
                file.write_bytes(content)
            draft.replace(target)

    def add(self, finished: Finished) -> None:
        """Append a finished run."""
        if self._stream is not None and self._stream.rows >= MAX_IN_PART:
            self.close_part()
        if self._stream is None:
            with reported(self.path):
                (self.path / PARTS).mkdir(exist_ok=True)
                taken = [int(p.stem) for p in (self.path / PARTS).glob("*.arrow") if is_count(p.stem)]
                self._stream = Stream(self.path / PARTS / f"{max(taken, default=0) + 1:04d}.arrow", PLAYED)
        self._stream.write(row(finished))

    def close_part(self) -> None:
        """Close the file of this process, if it has one."""
        if self._stream is not None:
            self._stream.close()
            self._stream = None

    def drop_parts(self) -> None:
        """Remove the files of finished runs that the tables hold."""
        with reported(self.path):
            for part in (self.path / PARTS).glob("*.arrow"):
                part.unlink()
            with contextlib.suppress(FileNotFoundError):
                (self.path / PARTS).rmdir()

    def close(self) -> None:
        """Unlock the directory."""
        try:
            self.close_part()
        finally:
            self._lock.truncate(0)
            self._lock.close()


def locked(path: Path, doing: str) -> IO[str]:
    """Lock a directory until the returned file is closed.

    Raises:
        BatchError: Another process holds it.
        RecordError: The file cannot be made, or is a link or no regular file.
    """
    with reported(path):
        file = os.fdopen(open_safely(path / LOCK, os.O_RDWR | os.O_CREAT, 0o666), "r+")
    try:
        lock(file, wait=False)
    except BlockingIOError:
        file.close()
        raise BatchError(f"{path}: another process is {doing}") from None
    except OSError as error:
        warnings.warn(
            f"{path}: this system has no locks ({error.strerror}); make sure that no other process is {doing}",
            RuntimeWarning,
            stacklevel=3,
        )
    return file


@contextlib.contextmanager
def reported(path: Path) -> Iterator[None]:
    """Turn errors of the operating system into record errors."""
    try:
        yield
    except OSError as error:
        reason = os.strerror(error.errno) if error.errno else str(error)
        raise RecordError(
            f"{error.filename or path}: cannot be written: {reason}; finished runs are kept"
        ) from error


def read_info(path: Path) -> dict[str, Any]:
    """Contents of `batch.json`.

    Raises:
        BatchError: There is no batch, or it cannot be read.
    """
    file = path / BATCH_FILE
    if not path.is_dir():
        raise BatchError(f"{path}: there is no such batch directory")
    if not file.exists():
        raise BatchError(f"{path}: this is no batch directory; it has no {BATCH_FILE}")
    return BATCH.read(file)


def read_table(path: Path, name: str, columns: pa.Schema, notes: list[str] | None = None) -> pa.Table | None:
    """A table of a batch directory, without its damaged parts; None where there is none.

    Args:
        path: The directory.
        name: Of the file.
        columns: Columns that it has at least.
        notes: Receives a line if it is damaged; None if that is an error.

    Raises:
        BatchError: It cannot be read, or is another table.
    """
    file = path / name
    if not file.exists():
        return None
    found = ParquetTable(file, columns, BatchError, notes=notes, optional=LATER).read()
    table = completed(found, columns)
    check_rows(table, file)
    return table


def _read_design(path: Path, info: Mapping[str, Any]) -> pa.Table:
    """The planned runs of a batch directory.

    Raises:
        BatchError: A file is missing, or cannot be read.
    """
    needed = TABLES if info["is_complete"] else (DESIGN_FILE,)
    lacking = [f"{name} is missing" for name in needed if not (path / name).exists()]
    design = read_table(path, DESIGN_FILE, DESIGN, lacking)
    if design is None or lacking:
        raise BatchError(
            f"{path}: {lacking[0]}; the command of the batch writes it again, and plays only runs that are lost"
        )
    check_design(design, info, path / DESIGN_FILE)
    return design


def load(path: str | Path) -> StoredBatch:
    """Read a batch directory, complete or not.

    Raises:
        BatchError: There is no batch, or it cannot be read.
    """
    path = Path(path)
    info = read_info(path)
    design = _read_design(path, info)
    notes: list[str] = []
    stored = StoredBatch(path, info, design, FinishedRuns(path, design, notes), notes)
    n = stored.runs.num_rows
    if not info["is_complete"]:
        notes.insert(0, f"the batch is not complete: {n} of {design.num_rows} runs are finished")
    elif notes:
        notes.append(
            f"{n} of {design.num_rows} runs are intact; the command of the batch plays the others again"
        )
    return stored


def damage(path: Path, info: dict[str, Any]) -> list[str]:
    """Describe what is damaged in the tables of a directory, or missing in that of a complete batch, one line each.

    Raises:
        BatchError: A table is another one.
    """
    notes: list[str] = []
    for name, columns in TABLES.items():
        if read_table(path, name, columns, notes) is None and info["is_complete"]:
            notes.append(f"{name} is missing")
    return notes
