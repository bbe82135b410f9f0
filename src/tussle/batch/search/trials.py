"""Trials of a search, and their form in Optuna."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from inspect import signature
from typing import TYPE_CHECKING, Any

import pyarrow as pa

from tussle.batch.variables import Choice, Range, Value, Variable, key_of
from tussle.errors import ParameterError
from tussle.mission.codecs import written

if TYPE_CHECKING:
    from optuna.distributions import BaseDistribution
    from optuna.trial import FrozenTrial

FACTS = pa.schema(
    [
        ("trial", pa.int64()), ("round", pa.int32()), ("objective", pa.float64()), ("low", pa.float64()), ("high", pa.float64()),
        ("n_failed", pa.int32()), ("state", pa.string()), ("error", pa.string()), ("by_seed", pa.list_(pa.float64())),
        ("violations", pa.list_(pa.float64())),
    ]
)  # fmt: skip
"""Columns of every table of trials; the variables stand behind the first two."""
N_KEYS = 2
MAX_TRIALS = 10_000
"""Samplers look at all trials before each round."""
DIGITS = 6
"""Significant digits of a range's width in proposed values: finer than any game shows, and few enough to type."""

Point = Mapping[str, Value]


@dataclass(frozen=True)
class Trial:
    """One set of values, played with all seeds.

    Attributes:
        number: Its place among the trials.
        round: Trials of one round were proposed together.
        values: What was tried, by name.
        objective: Mean of the quantity over the seeds; NaN where a run failed.
        low: Lower end of the interval of the mean; NaN for a single run.
        high: Its upper end.
        n_failed: Runs that failed, or gave no number.
        error: The first failure, "" for none.
        by_seed: The quantity in the run of each seed, NaN where it failed; empty where the values cannot be played at all.
        violations: By how much the mean over the seeds violates each constraint; <= 0 where it keeps it, NaN where a run failed.
    """

    number: int
    round: int
    values: Point
    objective: float
    low: float
    high: float
    n_failed: int
    error: str
    by_seed: tuple[float, ...]
    violations: tuple[float, ...] = ()

    @property
    def is_feasible(self) -> bool:
        """No run failed, and all constraints are kept."""
        return self.is_complete and all(violation <= 0.0 for violation in self.violations)

    @property
    def is_complete(self) -> bool:
        """No run failed."""
        return not self.error

    @property
    def key(self) -> tuple[Any, ...]:
        """Equal for trials of equal values."""
        return key_of_values(self.values)


def key_of_values(values: Point) -> tuple[Any, ...]:
    """Equal for equal values."""
    return tuple((name, key_of(value)) for name, value in sorted(values.items()))


# -- in Optuna ------------------------------------------------------------------------------------------------------------


def distribution(variable: Variable) -> BaseDistribution:
    """The search space of a variable: choices by their texts, levels by their places, numbers as they are.

    Raises:
        ParameterError: Two choices have the same text, or the range is too wide for floating-point arithmetic.
    """
    from optuna.distributions import CategoricalDistribution, FloatDistribution, IntDistribution

    if isinstance(variable, Choice):
        return CategoricalDistribution(texts_of(variable))
    if not math.isfinite(variable.high - variable.low):
        raise ParameterError(
            f"{variable.name}: from {variable.low:g} to {variable.high:g} is too far for a search; narrow the range"
        )
    if variable.levels is not None:
        return IntDistribution(0, variable.levels - 1)
    if variable.is_int:
        return IntDistribution(int(variable.low), int(variable.high), log=variable.is_log)
    return FloatDistribution(variable.low, variable.high, log=variable.is_log)


def texts_of(variable: Choice) -> list[str]:
    """The choices as texts.

    Raises:
        ParameterError: Two of them are equal.
    """
    texts = [written(value) for value in variable.values]
    for i, text in enumerate(texts):
        if text in texts[:i]:
            first = variable.values[texts.index(text)]
            raise ParameterError(
                f"{variable.name}: the choices {first!r} and {variable.values[i]!r} are written alike; keep one of them"
            )
    return texts


def value_of(variable: Variable, parameter: Any) -> Value:
    """The value that a parameter of Optuna stands for; real numbers are rounded to digits that can be typed."""
    if isinstance(variable, Choice):
        value: Value = variable.values[texts_of(variable).index(parameter)]
        return value
    if variable.levels is not None:
        return variable.spread(variable.levels)[int(parameter)]
    if variable.is_int:
        return int(parameter)
    if variable.is_log:
        rounded = float(f"{parameter:.{DIGITS + 1}g}")
    else:
        rounded = round(float(parameter), DIGITS - 1 - Decimal(variable.high - variable.low).adjusted())
    return min(max(rounded, variable.low), variable.high)


def parameter_of(variable: Variable, value: Value) -> Any:
    """The parameter of Optuna that stands for a value."""
    if isinstance(variable, Choice):
        return written(value)
    return value if variable.levels is None else variable.spread(variable.levels).index(value)


def frozen(trial: Trial, variables: Sequence[Variable]) -> FrozenTrial:
    """A trial as Optuna keeps it; what Optuna does not know stands in its user attributes."""
    import optuna

    constrained: dict[str, Any] = {}
    if trial.is_complete and trial.violations:
        has_own = has_constraints_of_trials()
        named = {f"{i}": violation for i, violation in enumerate(trial.violations)}
        constrained = (
            {"constraints": named} if has_own else {"system_attrs": {"constraints": [*trial.violations]}}
        )
    return optuna.trial.create_trial(
        **constrained,
        state=optuna.trial.TrialState.COMPLETE if trial.is_complete else optuna.trial.TrialState.FAIL,
        value=trial.objective if trial.is_complete else None,
        params={v.name: parameter_of(v, trial.values[v.name]) for v in variables},
        distributions={v.name: distribution(v) for v in variables},
        user_attrs={
            "low": _or_none(trial.low), "high": _or_none(trial.high), "n_failed": trial.n_failed, "error": trial.error,
            "by_seed": [_or_none(v) for v in trial.by_seed], "violations": [_or_none(v) for v in trial.violations],
        },
    )  # fmt: skip


def has_constraints_of_trials() -> bool:
    """Return True if Optuna's trials carry constraints, from Optuna 5 on; before, samplers have a function of constraints."""
    import optuna

    return "constraints" in signature(optuna.trial.create_trial).parameters


def thawed(number: int, per_round: int, found: FrozenTrial, variables: Sequence[Variable]) -> Trial:
    """A trial that Optuna has kept.

    Raises:
        ValueError: Its parameters are not those of the variables.
    """
    import optuna

    space = {v.name: distribution(v) for v in variables}
    optuna.trial.create_trial(
        state=found.state, value=found.value, params=found.params, distributions=space
    )  # raises for parameters out of bounds
    attributes = found.user_attrs
    return Trial(
        number, number // per_round, {v.name: value_of(v, found.params[v.name]) for v in variables},
        _or_nan(found.value), _or_nan(attributes["low"]), _or_nan(attributes["high"]), attributes["n_failed"],
        attributes["error"], tuple(_or_nan(v) for v in attributes["by_seed"]),
        tuple(_or_nan(v) for v in attributes.get("violations") or ()),
    )  # fmt: skip


def _or_none(number: float) -> float | None:
    return None if math.isnan(number) else number


def _or_nan(number: float | None) -> float:
    return math.nan if number is None else float(number)


# -- as a table -----------------------------------------------------------------------------------------------------------


def trials_table(trials: Sequence[Trial], variables: Sequence[Variable]) -> pa.Table:
    """One row per trial: trial, round, the variables, then the other facts; what is not known is null.

    A variable with the name of a fact has the column "varied NAME".
    """
    columns = {f"varied {v.name}" if v.name in FACTS.names else v.name: v for v in variables}
    varied = pa.schema([(name, _type(v)) for name, v in columns.items()])
    rows = [
        {
            "trial": t.number, "round": t.round, **{name: _cell(v, t.values[v.name]) for name, v in columns.items()},
            "objective": _or_none(t.objective), "low": _or_none(t.low), "high": _or_none(t.high), "n_failed": t.n_failed,
            "state": "complete" if t.is_complete else "failed", "error": t.error or None, "by_seed": [_or_none(v) for v in t.by_seed],
            "violations": [_or_none(v) for v in t.violations],
        }
        for t in trials
    ]  # fmt: skip
    fields = list(FACTS)
    return pa.Table.from_pylist(rows, pa.schema([*fields[:N_KEYS], *varied, *fields[N_KEYS:]]))


def _type(variable: Variable) -> pa.DataType:
    """Return the column as integers, real numbers, or texts."""
    if isinstance(variable, Range):
        return pa.int64() if variable.is_int else pa.float64()
    kinds = {type(value) for value in variable.values}
    return pa.int64() if kinds == {int} else pa.float64() if kinds <= {int, float} else pa.string()


def _cell(variable: Variable, value: Value) -> Value:
    return written(value) if _type(variable) == pa.string() else value
