"""What the values of a table may be, column by column."""

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
    """What a number of a column may be.

    Attributes:
        least: Smallest.
        most: Largest.
        may_miss: It may be null, or not a number.
    """

    least: float = -sys.float_info.max
    most: float = sys.float_info.max
    may_miss: bool = False


NUMBER = Bounds()
COUNT = Bounds(0, INT32)
TEXT = None
"""A text that is there."""

Rules = Mapping[str, Bounds | None]
"""Column -> what its values may be. Columns without a rule are not looked at."""


def check_values(
    columns: Iterable[tuple[str, pa.ChunkedArray | pa.Array]],
    rules: Rules,
    path: Path | str,
    error: type[TussleError],
) -> None:
    """See that the values of some columns are allowed.

    Raises:
        TussleError: As `error`: one is not; the message names file, column and row.
    """
    for name, column in columns:
        if name not in rules or pa.types.is_nested(column.type):
            continue
        rule = rules[name]
        if column.null_count and not (rule and rule.may_miss):
            raise error(
                f"{path}: column {name!r} lacks a value in row {pc.index(pc.is_null(column), value=True)}"
            )
        if rule is None or column.null_count == len(column):
            continue
        if not rule.may_miss and pa.types.is_floating(column.type) and pc.any(pc.is_nan(column)).as_py():
            raise error(f"{path}: column {name!r} holds something that is no number")
        for value in pc.min_max(column).values():
            if not rule.least <= value.as_py() <= rule.most and not math.isnan(value.as_py()):
                raise error(
                    f"{path}: {name} = {value} in row {pc.index(column, value)} is not allowed; "
                    f"it takes {rule.least:.10g} to {rule.most:.10g}"
                )
