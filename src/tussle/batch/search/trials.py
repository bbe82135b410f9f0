"""Trials of a search: what was tried, what came of it, and the table of them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pyarrow as pa

from tussle.batch.variables import Choice, Value, Variable, key_of
from tussle.errors import ParameterError
from tussle.mission.codecs import written

FACTS = pa.schema(
    [
        ("trial", pa.int64()),
        ("round", pa.int32()),
        ("objective", pa.float64()),
        ("low", pa.float64()),
        ("high", pa.float64()),
        ("n_failed", pa.int32()),
        ("state", pa.string()),
        ("error", pa.string()),
        ("by_seed", pa.list_(pa.float64())),
    ]
)
"""Columns of all tables of trials; the variables stand behind the first two."""
MOST_TRIALS = 10_000
"""Samplers look at all trials before each round, and the table of them is written after each."""
N_KEYS = 2
COMPLETE, FAILED = "complete", "failed"


@dataclass(frozen=True)
class Trial:
    """One set of values, played with all seeds.

    Attributes:
        number: Its place among the trials.
        round: Trials of a round were proposed together, each without knowing the others.
        values: What was tried, by name.
        objective: Mean of the quantity over the seeds; NaN where a run failed.
        low: Lower end of the interval of the mean; NaN for a single run.
        high: Its upper end.
        n_failed: Runs that failed, or gave no number.
        error: What failed first, "" for nothing.
        by_seed: The quantity in the run of each seed, NaN where it failed; none where the values cannot be played at all.
    """

    number: int
    round: int
    values: Mapping[str, Value]
    objective: float
    low: float
    high: float
    n_failed: int
    error: str
    by_seed: tuple[float, ...]

    @property
    def is_complete(self) -> bool:
        """No run failed."""
        return not self.error

    @property
    def key(self) -> tuple[Any, ...]:
        """The same for trials of the same values."""
        return key_of_values(self.values)


def key_of_values(values: Mapping[str, Value]) -> tuple[Any, ...]:
    """The same for the same values."""
    return tuple((name, key_of(value)) for name, value in sorted(values.items()))


def column_name(variable: Variable) -> str:
    """Column of a variable; one that is called as a fact of a trial stands as "varied NAME"."""
    return f"varied {variable.name}" if variable.name in FACTS.names else variable.name


def column_type(variable: Variable) -> pa.DataType:
    """Whole numbers, real numbers, or else texts.

    Raises:
        ParameterError: Two choices would be the same text.
    """
    if not isinstance(variable, Choice):
        return pa.int64() if variable.is_int else pa.float64()
    if all(isinstance(v, int) and not isinstance(v, bool) for v in variable.values):
        return pa.int64()
    if all(isinstance(v, int | float) and not isinstance(v, bool) for v in variable.values):
        return pa.float64()
    texts = [written(v) for v in variable.values]
    for first, text in zip(variable.values, texts, strict=True):
        if texts.count(text) > 1:
            second = variable.values[len(texts) - 1 - texts[::-1].index(text)]
            raise ParameterError(
                f"{variable.name}: the choices {first!r} and {second!r} are written alike; keep one of them"
            )
    return pa.string()


def trials_table(trials: Sequence[Trial], variables: Sequence[Variable]) -> pa.Table:
    """One row per trial; what is not known is null."""
    facts: dict[str, list[Any]] = {
        "trial": [t.number for t in trials],
        "round": [t.round for t in trials],
        "objective": [_or_null(t.objective) for t in trials],
        "low": [_or_null(t.low) for t in trials],
        "high": [_or_null(t.high) for t in trials],
        "n_failed": [t.n_failed for t in trials],
        "state": [COMPLETE if t.is_complete else FAILED for t in trials],
        "error": [t.error or None for t in trials],
        "by_seed": [[_or_null(v) for v in t.by_seed] for t in trials],
    }
    columns = {name: pa.array(facts[name], FACTS.field(name).type) for name in FACTS.names}
    varied = {}
    for variable in variables:
        kind = column_type(variable)
        values = [t.values[variable.name] for t in trials]
        varied[column_name(variable)] = pa.array(
            [written(v) for v in values] if kind == pa.string() else values, kind
        )
    keys = {name: columns.pop(name) for name in FACTS.names[:N_KEYS]}
    return pa.table(keys | varied | columns)


def trials_of(table: pa.Table, variables: Sequence[Variable]) -> list[Trial]:
    """The trials of a table.

    Raises:
        KeyError: It is no table of trials of these variables.
    """
    varied = {v.name: list(_decoded(table[column_name(v)].to_pylist(), v)) for v in variables}
    return [
        Trial(
            row["trial"], row["round"], {name: values[i] for name, values in varied.items()},
            _or_nan(row["objective"]), _or_nan(row["low"]), _or_nan(row["high"]), row["n_failed"], row["error"] or "",
            tuple(_or_nan(v) for v in row["by_seed"]),
        )
        for i, row in enumerate(table.select(FACTS.names).to_pylist())
    ]  # fmt: skip


def _decoded(cells: Iterable[Any], variable: Variable) -> Iterable[Value]:
    """Cells of a column as the values that they were."""
    if not isinstance(variable, Choice):
        return cells
    is_text = column_type(variable) == pa.string()
    values = {written(v) if is_text else v: v for v in variable.values}
    return [values[cell] for cell in cells]


def _or_null(number: float) -> float | None:
    return None if math.isnan(number) else number


def _or_nan(number: float | None) -> float:
    return math.nan if number is None else number
