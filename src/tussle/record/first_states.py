"""First states of the entities of a recorded run, from which another run can start."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv

from tussle.documents import size_of
from tussle.errors import ParameterError, RecordError, listed
from tussle.record.arrow_file import read_batches
from tussle.record.parquet_file import MARGIN, MOST_EXPANSION, read_parquet
from tussle.record.schema import TRAJECTORY, TRAJECTORY_FILE

TIME = ("t", "time")
POS, QUAT, VEL = ("x", "y", "z"), ("qw", "qx", "qy", "qz"), ("vx", "vy", "vz")
NEEDED = ("id", *POS, *QUAT, *VEL)
READ = {*TIME, *NEEDED, "world", "team", "block"}
SUFFIXES = (".arrow", ".parquet", ".csv", ".csv.gz")


@dataclass(frozen=True)
class FirstStates:
    """Who enters a game when and where, ordered by (t, id).

    Attributes:
        t: Time of birth [s], (m,).
        id: (m,), unique.
        pos: [m], (3, m); quat (4, m); vel [m/s], (3, m); world frame.
        team: (m,); None where the table has no such column.
        block: Names; None where the table has no such column.
        source: Where it is from, for messages.
    """

    t: np.ndarray
    id: np.ndarray
    pos: np.ndarray
    quat: np.ndarray
    vel: np.ndarray
    team: np.ndarray | None = None
    block: tuple[str, ...] | None = None
    source: str = "start_from"

    def __post_init__(self) -> None:
        m = len(self.id)
        shapes = {"t": (m,), "pos": (3, m), "quat": (4, m), "vel": (3, m)}
        for name, shape in shapes.items():
            values = np.asarray(getattr(self, name), float)
            if values.shape != shape:
                raise ParameterError(f"{self.source}: {name} has shape {values.shape}; needed is {shape}")
            wrong = ~np.isfinite(np.atleast_2d(values)).all(axis=0)
            if wrong.any():
                raise ParameterError(f"{self.source}: {name} of entity {self.id[wrong][0]} is not finite")
        length = np.sqrt((self.quat**2).sum(axis=0))
        wrong = np.abs(length - 1.0) > 1e-6  # a table in plain text rounds, but not more than this
        if wrong.any():
            raise ParameterError(
                f"{self.source}: the quaternion of entity {self.id[wrong][0]} has length {length[wrong][0]:g}, not 1"
            )
        if len(np.unique(self.id)) < m or (m and self.id.min() < 1):
            raise ParameterError(f"{self.source}: ids are whole numbers >= 1, each once")

    def __len__(self) -> int:
        return len(self.id)


def read_table(path: str | Path, *, world: int = 0) -> FirstStates:
    """First row of each entity in a recorded table.

    The table has columns id, x y z [m], qw qx qy qz, vx vy vz [m/s] and t (or time) [s]; team, block and world where there are such.

    Args:
        path: A run directory, or a file: Arrow stream, Parquet, or CSV, compressed or not.
        world: Which world of a stack.

    Raises:
        RecordError: The file cannot be read, or lacks a column.
        ParameterError: Its states cannot be first states.
    """
    place = Path(path)
    place = place / TRAJECTORY_FILE if place.is_dir() else place
    table = _read(place)
    time = next((name for name in TIME if name in table.column_names), None)
    missing = [name for name in NEEDED if name not in table.column_names] + ([] if time else ["t"])
    if missing:
        raise RecordError(f"{place}: column {missing[0]!r} is missing; {listed(table.column_names)}")
    if "world" in table.column_names:
        table = table.filter(pa.array(_numbers(place, table, "world") == world))
    if not table.num_rows:
        raise RecordError(
            f"{place}: there are no rows{f' of world {world}' if 'world' in table.column_names else ''}"
        )
    assert time is not None
    t, ids = _numbers(place, table, time), _whole(place, table, "id")
    order = np.lexsort((ids, t))
    _, first = np.unique(ids[order], return_index=True)
    rows = order[np.sort(first)]

    def take(*names: str) -> np.ndarray:
        return np.array([_numbers(place, table, name)[rows] for name in names])

    team = _whole(place, table, "team")[rows] if "team" in table.column_names else None
    block = tuple(table["block"].take(rows).to_pylist()) if "block" in table.column_names else None
    if block is not None and not all(isinstance(name, str) for name in block):
        raise RecordError(f"{place}: column 'block' holds something other than names")
    return FirstStates(t[rows], ids[rows], take(*POS), take(*QUAT), take(*VEL), team, block, str(place))


def _numbers(place: Path, table: pa.Table, name: str) -> np.ndarray:
    try:
        return np.asarray(table[name].to_numpy(), float)
    except (ValueError, TypeError):
        raise RecordError(f"{place}: column {name!r} holds something other than numbers") from None


def _whole(place: Path, table: pa.Table, name: str) -> np.ndarray:
    numbers = _numbers(place, table, name)
    if not (np.abs(numbers) < 2**31).all():  # what is no number is not either
        raise RecordError(
            f"{place}: column {name!r} holds something other than whole numbers from -2^31 to 2^31"
        )
    return numbers.astype(np.int64)


def _read(place: Path) -> pa.Table:
    name = place.name.lower()
    if not name.endswith(SUFFIXES):
        raise RecordError(
            f"{place}: a table to start from is a run directory or ends in {', '.join(SUFFIXES)}"
        )
    if not place.exists():
        raise RecordError(f"{place}: there is no such file")
    try:
        if name.endswith(".arrow"):  # of a run that was cut, the first states may well be there
            batches = list(read_batches(place, [], RecordError))
            return _columns(pa.Table.from_batches(batches, None if batches else TRAJECTORY))
        if name.endswith(".parquet"):
            return read_parquet(place, pa.schema([]), RecordError, READ)
        most = MARGIN + MOST_EXPANSION * size_of(place)
        return _columns(pyarrow.csv.read_csv(_unpacked(place, most) if name.endswith(".gz") else place))
    except (pa.ArrowException, OSError, ValueError) as error:
        raise RecordError(f"{place}: cannot be read: {error}") from error


def _unpacked(place: Path, most: int) -> pa.BufferReader:
    """The text of a compressed file.

    Raises:
        OSError: It is longer than `most` bytes.
    """
    parts: list[bytes] = []
    with pa.input_stream(str(place)) as file:
        while sum(map(len, parts)) <= most and (part := file.read(MARGIN)):
            parts.append(part)
    if sum(map(len, parts)) > most:
        raise OSError(f"unpacked it takes more than {most:,} bytes")
    return pa.BufferReader(b"".join(parts))


def _columns(table: Any) -> pa.Table:
    if len(set(table.column_names)) < table.num_columns:
        raise ValueError(f"two columns have the same name; {listed(table.column_names)}")
    return table.select([name for name in table.column_names if name in READ])
