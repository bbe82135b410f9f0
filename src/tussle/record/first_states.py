"""First states of the entities of a recorded run, for starting another run from them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from tussle.documents import size_of
from tussle.errors import ParameterError, RecordError, listed
from tussle.mission.spec import MAX_COORDINATE
from tussle.record.arrow_file import read_batches
from tussle.record.parquet_file import MARGIN, MAX_EXPANSION, ParquetTable
from tussle.record.schema import TRAJECTORY, TRAJECTORY_FILE
from tussle.tables import check_columns, check_one_state, read_csv, whole_numbers

TIME = ("t", "time")
POS, QUAT, VEL = ("x", "y", "z"), ("qw", "qx", "qy", "qz"), ("vx", "vy", "vz")
NEEDED = ("id", *POS, *QUAT, *VEL)
READ = {*TIME, *NEEDED, "world", "team", "block"}
SUFFIXES = (".arrow", ".parquet", ".csv", ".csv.gz")


@dataclass(frozen=True)
class FirstStates:
    """Birth times and first states of entities, ordered by (t, id).

    Attributes:
        t: Time of birth [s], (m,).
        id: Entity ids, unique, (m,).
        pos: Position [m], (3, m), world frame.
        quat: Attitude, body to world, (4, m).
        vel: Ground velocity [m/s], (3, m), world frame.
        team: Team numbers, (m,); None if the table has no such column.
        block: Block names; None if the table has no such column.
        source: File name, for messages.
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
                raise ParameterError(f"{self.source}: {name} has shape {values.shape}; expected {shape}")
            wrong = ~np.isfinite(np.atleast_2d(values)).all(axis=0)
            if wrong.any():
                raise ParameterError(f"{self.source}: {name} of entity {self.id[wrong][0]} is not finite")
        far = (np.abs(self.pos) > MAX_COORDINATE).any(axis=0)
        if far.any():
            raise ParameterError(
                f"{self.source}: pos of entity {self.id[far][0]} is not within +-{MAX_COORDINATE:g} m"
            )
        length = np.sqrt((self.quat**2).sum(axis=0))
        wrong = np.abs(length - 1.0) > 1e-6  # a text table rounds, but less than this
        if wrong.any():
            raise ParameterError(
                f"{self.source}: the quaternion of entity {self.id[wrong][0]} has length {length[wrong][0]:g}, not 1"
            )
        if len(np.unique(self.id)) < m or (m and self.id.min() < 1):
            raise ParameterError(f"{self.source}: ids must be unique integers >= 1")

    def __len__(self) -> int:
        return len(self.id)


def read_table(path: str | Path, *, world: int = 0) -> FirstStates:
    """Read the first row of each entity in a recorded table.

    The table has columns id, x y z [m], qw qx qy qz, vx vy vz [m/s] and t (or time) [s]; team, block and world are optional.

    Args:
        path: A run directory, or a file: Arrow stream, Parquet, CSV or gzipped CSV.
        world: Number of the world in its stack.

    Raises:
        RecordError: The file cannot be read, lacks a column, or has two first states of an entity.
        ParameterError: A state is not finite, a position is too far away, a quaternion is not of length 1, or an id is not allowed.
    """
    place = Path(path)
    place = place / TRAJECTORY_FILE if place.is_dir() else place
    table = _read(place)
    time = next((name for name in TIME if name in table.column_names), None)
    _check_columns(place, table.column_names)
    if "world" in table.column_names:
        table = table.filter(pa.array(_numbers(place, table, "world") == world))
    if not table.num_rows:
        raise RecordError(
            f"{place}: there are no rows{f' of world {world}' if 'world' in table.column_names else ''}"
        )
    assert time is not None
    t, ids = _numbers(place, table, time), _whole(place, table, "id")
    columns = {name: _numbers(place, table, name) for name in (*POS, *QUAT, *VEL)}
    order = np.lexsort((t, ids))
    _, first, number = np.unique(ids[order], return_index=True, return_inverse=True)
    early = order[t[order] == t[order[first]][number]]  # all rows of each entity at its first time
    at_first = np.stack([values[early] for values in columns.values()])
    check_one_state(str(place), ids[early], t[early], at_first, RecordError)
    rows = order[first]
    rows = rows[np.lexsort((ids[rows], t[rows]))]

    def take(*names: str) -> np.ndarray:
        return np.array([columns[name][rows] for name in names])

    team = _whole(place, table, "team")[rows] if "team" in table.column_names else None
    block = tuple(table["block"].take(rows).to_pylist()) if "block" in table.column_names else None
    if block is not None and not all(isinstance(name, str) for name in block):
        raise RecordError(f"{place}: column 'block' must hold names")
    return FirstStates(t[rows], ids[rows], take(*POS), take(*QUAT), take(*VEL), team, block, str(place))


def _numbers(place: Path, table: pa.Table, name: str) -> np.ndarray:
    try:
        return np.asarray(table[name].to_numpy(), float)
    except (ValueError, TypeError):
        raise RecordError(f"{place}: column {name!r} must hold numbers") from None


def _whole(place: Path, table: pa.Table, name: str) -> np.ndarray:
    return whole_numbers(str(place), name, _numbers(place, table, name), RecordError)


def _check_columns(place: Path, names: list[str]) -> None:
    time = [] if any(name in names for name in TIME) else ["t"]
    check_columns(str(place), names, (*NEEDED, *time), RecordError)


def _read(place: Path) -> pa.Table:
    name = place.name.lower()
    if not name.endswith(SUFFIXES):
        raise RecordError(
            f"{place}: a table to start from must be a run directory or a file ending in {', '.join(SUFFIXES)}"
        )
    if not place.exists():
        raise RecordError(f"{place}: there is no such file")
    try:
        if name.endswith(".arrow"):  # a truncated table may hold all first states
            batches = list(read_batches(place, [], RecordError))
            return _columns(place, pa.Table.from_batches(batches, None if batches else TRAJECTORY))
        if name.endswith(".parquet"):
            return ParquetTable(place, pa.schema([]), RecordError, READ).read()
        most = MARGIN + MAX_EXPANSION * size_of(place)
        return _columns(
            place,
            read_csv(
                str(place), _decompressed(place, most) if name.endswith(".gz") else str(place), RecordError
            ),
        )
    except (pa.ArrowException, OSError, ValueError) as error:
        raise RecordError(f"{place}: cannot be read: {error}") from error


def _decompressed(place: Path, most: int) -> pa.Buffer:
    """The decompressed content of a file.

    Raises:
        OSError: It is larger than `most` bytes.
    """
    parts: list[bytes] = []
    with pa.input_stream(str(place)) as file:
        while sum(map(len, parts)) <= most and (part := file.read(MARGIN)):
            parts.append(part)
    if sum(map(len, parts)) > most:
        raise OSError(f"its decompressed size exceeds the limit of {most:,} bytes")
    return pa.py_buffer(b"".join(parts))


def _columns(place: Path, table: Any) -> pa.Table:
    if len(set(table.column_names)) < table.num_columns:
        raise ValueError(f"two columns have the same name; {listed(table.column_names)}")
    _check_columns(place, table.column_names)
    return table.select([name for name in table.column_names if name in READ])
