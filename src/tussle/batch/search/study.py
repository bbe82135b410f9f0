"""The results of a search: its trials, the best of them, and its lead."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from tussle.arguments import explained
from tussle.batch.points import settings_of
from tussle.batch.search.proposals import importances
from tussle.batch.search.trials import Trial, trials_table
from tussle.batch.statistics import PairedComparison, paired_difference
from tussle.batch.target import Target
from tussle.batch.variables import Value, Variable
from tussle.mission.codecs import written


@explained
@dataclass(frozen=True)
class Study:
    """The trials of a search.

    Attributes:
        path: Its directory; None in memory.
        info: What `study.json` says.
        variables: What varied.
        trials: All trials, in order.
        notes: What the user should know, one line each.
    """

    path: Path | None
    info: Mapping[str, Any]
    variables: tuple[Variable, ...]
    trials: tuple[Trial, ...]
    notes: list[str] = field(default_factory=list)

    @property
    def is_minimized(self) -> bool:
        """Smaller objectives are better."""
        return bool(self.info["direction"] == "minimize")

    @property
    def objective(self) -> str:
        """The quantity whose mean is searched."""
        return str(self.info["objective"])

    @cached_property
    def ranking(self) -> list[Trial]:
        """Complete trials of different values that keep the constraints, the best first; of equal ones the earliest."""
        sign = 1.0 if self.is_minimized else -1.0
        ordered = sorted((t for t in self.trials if t.is_feasible), key=lambda t: sign * t.objective)
        first: dict[tuple[Any, ...], Trial] = {}
        for trial in ordered:
            first.setdefault(trial.key, trial)
        return list(first.values())

    @property
    def best(self) -> Trial | None:
        """The best trial that keeps the constraints; None if none does or all failed."""
        return best_of(self.trials, self.is_minimized)

    @cached_property
    def lead(self) -> PairedComparison | None:
        """The best trial minus the next one, seed by seed; None for less than two trials of different values.

        Where its interval holds zero, the two cannot be told apart. Both were picked for their objectives on these very seeds, so
        an interval without zero is weaker evidence than it seems.
        """
        if len(self.ranking) < 2:
            return None
        best, second = self.ranking[:2]
        return paired_difference(
            self.objective,
            (self.label(second.values), self.label(best.values)),
            np.array(second.by_seed),
            np.array(best.by_seed),
        )

    @property
    def is_clear(self) -> bool:
        """The interval of the lead is on the better side of zero."""
        if self.lead is None:
            return False
        return self.lead.high < 0.0 if self.is_minimized else self.lead.low > 0.0

    @property
    def improvements(self) -> list[Trial]:
        """The trials that were the best so far when they came."""
        found: list[Trial] = []
        for trial in self.trials:
            if trial.is_feasible and (not found or is_better(trial, found[-1], self.is_minimized)):
                found.append(trial)
        return found

    @property
    def table(self) -> pa.Table:
        """One row per trial: trial, round, each variable, objective, low, high, n_failed, state, error, by_seed, violations."""
        return trials_table(self.trials, self.variables)

    @cached_property
    def constraints(self) -> tuple[Target, ...]:
        """What the means over the games of a trial are to keep."""
        return tuple(map(Target.parse, self.info.get("constraints") or ()))

    @property
    def nearest(self) -> Trial | None:
        """The complete trial that violates the constraints least, in all; None where all failed."""
        complete = [t for t in self.trials if t.is_complete]
        return min(complete, key=lambda t: sum(max(v, 0.0) for v in t.violations), default=None)

    def constrained(self, trial: Trial) -> dict[str, float]:
        """Mean over the games of a trial, of each quantity that is constrained."""
        return {
            str(c.quantity): c.bound - v if c.is_lower else c.bound + v
            for c, v in zip(self.constraints, trial.violations, strict=True)
        }

    @property
    def n_points(self) -> int:
        """Different sets of values among the trials."""
        return len({t.key for t in self.trials})

    def importances(self) -> dict[str, float]:
        """Variable -> how much being among the best quarter of the trials depends on it (PED-ANOVA), the greatest first.

        Nothing for less than 20 complete trials, or for one variable.

        Raises:
            MissingExtraError: Optuna is not installed.
        """
        return importances(self.trials, self.variables, self.is_minimized)

    def settings(self, values: Mapping[str, Value]) -> dict[str, str]:
        """Values as texts for a mission file."""
        return {name: written(value) for name, value in settings_of(values, self.variables).items()}

    def label(self, values: Mapping[str, Value]) -> str:
        """Values on one line: "prey_speed=23.4 kt, tactic=keep"."""
        return ", ".join(f"{name}={text}" for name, text in self.settings(values).items())


def is_better(trial: Trial, than: Trial, is_minimized: bool) -> bool:
    """Return True if a complete trial has the better objective."""
    return trial.objective < than.objective if is_minimized else trial.objective > than.objective


def best_of(trials: Iterable[Trial], is_minimized: bool) -> Trial | None:
    """The best complete trial that keeps the constraints, the earliest of equal ones; None for none."""
    best: Trial | None = None
    for trial in trials:
        if trial.is_feasible and (best is None or is_better(trial, best, is_minimized)):
            best = trial
    return best
