"""Checks of the values of a table, by column."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

import pyarrow as pa
import pyarrow.compute as pc

from tussle.errors import TussleError

INT32 = 2**31 - 1


class Bounds(NamedTuple):
    """Bounds of the numbers in a column.

    Attributes:
        least: Smallest allowed value.
        most: Largest allowed value.
        may_miss: Whether null and NaN are allowed.
    """

    least: float = -sys.float_info.max
    most: float = sys.float_info.max
    may_miss: bool = False


NUMBER = Bounds()
COUNT = Bounds(0, INT32)
TEXT = None
"""Rule of a text column: no nulls."""

Rules = Mapping[str, Bounds | None]
"""Column -> rule for its values. Columns without a rule are not checked."""


def check_values(
    columns: Iterable[tuple[str, pa.ChunkedArray | pa.Array]],
    rules: Rules,
    path: Path | str,
    error: type[TussleError],
) -> None:
    """Check the values of columns.

    Raises:
        TussleError: As `error`: a value is not allowed; the message names file, column and row.
    """
    for name, column in columns:
        if name not in rules or pa.types.is_nested(column.type):
            continue
        rule = rules[name]
        if column.null_count and not (rule and rule.may_miss):
            raise error(f"{path}: column {name!r} is null in row {pc.index(pc.is_null(column), value=True)}")
        if rule is None or column.null_count == len(column):
            continue
        if not rule.may_miss and pa.types.is_floating(column.type) and pc.any(pc.is_nan(column)).as_py():
            raise error(f"{path}: column {name!r} holds NaN")
        for value in pc.min_max(column).values():
            if not rule.least <= value.as_py() <= rule.most and not math.isnan(value.as_py()):
                raise error(
                    f"{path}: {name} = {value} in row {pc.index(column, value)} is not allowed; "
                    f"it takes {rule.least:.10g} to {rule.most:.10g}"
                )
