"""Tables in CSV that other programs wrote."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np

from tussle.errors import TussleError, clipped, listed, nearest_name

SEPARATORS = {";": "';'", "\t": "tabs", "|": "'|'"}
"""What other programs write between values, and its name."""


def read_csv(where: str, source: Any, error: type[TussleError]) -> Any:
    """Read a table of PyArrow; spaces around the names of columns are left out.

    Args:
        where: Its file, for messages.
        source: Its path as text, or its content in a buffer of PyArrow.
        error: The error that is raised.

    Raises:
        TussleError: As `error`: the file cannot be read as a table, or two columns have the same name.
    """
    import pyarrow as pa
    from pyarrow import csv

    head = ""
    try:
        with pa.input_stream(source, compression=None) as file:
            head = file.read(4096).decode("utf-8", "replace").partition("\n")[0]
        table = csv.read_csv(source if isinstance(source, str) else pa.BufferReader(source))
    except (pa.ArrowException, OSError, ValueError) as reason:
        _check_separator(where, head, error)
        said = getattr(reason, "strerror", None) or " ".join(str(reason).split())
        raise error(f"{where}: cannot be read: {clipped(said, 200)}") from reason
    _check_separator(where, head, error)
    names = [name.strip() for name in table.column_names]
    if len(set(names)) < len(names):
        raise error(f"{where}: cannot be read: two columns have the same name; {listed(names)}")
    return table.rename_columns(names)


def _check_separator(where: str, head: str, error: type[TussleError]) -> None:
    found = next((name for mark, name in SEPARATORS.items() if mark in head and "," not in head), None)
    if found:
        raise error(
            f"{where}: its values are separated by {found}; it takes commas between values, and points in numbers, as in 1.5,2"
        )


def check_columns(
    where: str, names: Collection[str], needed: Collection[str], error: type[TussleError]
) -> None:
    """Check that a table has all columns that are needed.

    Raises:
        TussleError: As `error`: one is missing.
    """
    missing = next((name for name in needed if name not in names), None)
    if missing:
        raise error(f"{where}: column {missing!r} is missing{nearest_name(missing, names)}; {listed(names)}")


def whole_numbers(where: str, name: str, values: np.ndarray, error: type[TussleError]) -> np.ndarray:
    """The values of a column as integers of 64 bits.

    Raises:
        TussleError: As `error`: one is no whole number, or too large.
    """
    wrong = ~((np.abs(values) < 2**31) & (np.floor(values) == values))  # true for NaN too
    if wrong.any():
        raise error(
            f"{where}: column {name!r} must hold integers between -2^31 and 2^31, not {values[wrong][0]:g}"
        )
    return values.astype(np.int64)


def check_one_state(
    where: str, ids: np.ndarray, t: np.ndarray, values: np.ndarray, error: type[TussleError]
) -> None:
    """Check that no entity has two different states at one time.

    Args:
        where: The file, for messages.
        ids: Entities of rows in order of entity and time, (n,).
        t: Their times [s], (n,).
        values: Their states, (k, n).
        error: The error that is raised.

    Raises:
        TussleError: As `error`: one has.
    """
    is_same = (ids[1:] == ids[:-1]) & (t[1:] == t[:-1])
    wrong = np.flatnonzero(is_same & (values[:, 1:] != values[:, :-1]).any(axis=0))
    if len(wrong):
        i = wrong[0]
        raise error(f"{where}: entity {ids[i]} has two states at t = {t[i]:g} s; it takes one")
