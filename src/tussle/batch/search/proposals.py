"""Which values are tried next: drawn at random, by Optuna's tree-structured Parzen estimator, or by CMA-ES.

What is proposed for a round is a function of the seed, the number of the round, and the trials before: nothing else is remembered. So a
search that was killed goes on as it would have.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from inspect import signature
from typing import TYPE_CHECKING, Any

import numpy as np

from tussle.batch.search.search_space import Axis
from tussle.batch.search.trials import Trial
from tussle.batch.variables import Choice, Range, Value, Variable
from tussle.errors import MissingExtraError, ParameterError, listed, nearest_name

if TYPE_CHECKING:
    import optuna

SAMPLERS = ("tpe", "cmaes", "random")
SIGMA = 0.3
"""First step of CMA-ES, as a part of the range (Hansen, The CMA Evolution Strategy: A Tutorial, arXiv:1604.00772, figure 6)."""
FEWEST_FOR_IMPORTANCE = 20
"""Complete trials for importances."""
BEST = 0.25
"""Part of the trials that importances compare with all of them; of 20, the tenth that is usual would be two."""


@dataclass(frozen=True)
class Proposer:
    """Proposes the values of trials.

    Attributes:
        variables: What varies.
        sampler: Which of `SAMPLERS`.
        seed: Of what it draws.
        per_round: Trials of a round.
        is_minimized: Smaller objectives are better.

    Raises:
        ParameterError: There is no such sampler, or it cannot search these variables.
        MissingExtraError: Optuna or cmaes is not installed.
    """

    variables: tuple[Variable, ...]
    sampler: str
    seed: int
    per_round: int
    is_minimized: bool

    def __post_init__(self) -> None:
        if self.sampler not in SAMPLERS:
            raise ParameterError(
                f"sampler = {self.sampler!r} is not allowed{nearest_name(str(self.sampler), SAMPLERS)}; {listed(SAMPLERS)}"
            )
        choices = [v.name for v in self.variables if isinstance(v, Choice)]
        if self.sampler == "cmaes" and choices:
            raise ParameterError(f"cmaes searches ranges, and {choices[0]} is a choice; tpe searches both")
        for v in self.variables:
            if isinstance(v, Range) and not math.isfinite(v.high - v.low):
                raise ParameterError(
                    f"{v.name}: from {v.low:g} to {v.high:g} is too far for a search; narrow the range"
                )
        for package in ("optuna", "cmaes") if self.sampler == "cmaes" else ("optuna",):
            try:
                import_module(package)
            except ImportError as error:
                raise MissingExtraError(
                    f"optimisation needs {package}, which cannot be imported ({error}); pip install 'tussle[batch]' brings it"
                ) from None

    def propose(self, number: int, n: int, past: Sequence[Trial]) -> list[dict[str, Value]]:
        """The values of a round.

        Args:
            number: The round.
            n: Trials that are wanted.
            past: All trials of the rounds before.
        """
        (seed,) = np.random.SeedSequence((self.seed, number)).generate_state(1).tolist()
        axes = [Axis(v) for v in self.variables]
        if self.sampler == "cmaes":
            return self._by_cmaes(axes, seed, n, past)
        import optuna

        with _quiet():
            sampler = (
                optuna.samplers.RandomSampler(seed)
                if self.sampler == "random"
                else optuna.samplers.TPESampler(seed=seed, multivariate=True, constant_liar=True)
            )
            study = self._study(past, sampler)
            space = {axis.name: axis.distribution() for axis in axes}
            asked = [study.ask(space).params for _ in range(n)]
        return [{axis.name: axis.value(params[axis.name]) for axis in axes} for params in asked]

    def _study(self, past: Sequence[Trial], sampler: Any = None) -> optuna.Study:
        """The trials before as Optuna has them."""
        import optuna

        axes = [Axis(v) for v in self.variables]
        space = {axis.name: axis.distribution() for axis in axes}
        study = optuna.create_study(
            sampler=sampler, direction="minimize" if self.is_minimized else "maximize"
        )
        study.add_trials(
            optuna.trial.create_trial(
                state=optuna.trial.TrialState.COMPLETE if t.is_complete else optuna.trial.TrialState.FAIL,
                value=t.objective if t.is_complete else None,
                params={axis.name: _plain(axis, t.values[axis.name]) for axis in axes},
                distributions=space,
            )
            for t in past
        )
        return study

    def _by_cmaes(
        self, axes: Sequence[Axis], seed: int, n: int, past: Sequence[Trial]
    ) -> list[dict[str, Value]]:
        """By CMA-ES, told all whole generations again; Optuna's own wastes the trials of a round that its generation has no room for."""
        import cmaes  # type: ignore[import-untyped]

        size = generation_size(len(axes), self.per_round)
        optimizer = cmaes.CMA(
            mean=np.full(len(axes), 0.5),
            sigma=SIGMA,
            bounds=np.tile([0.0, 1.0], (len(axes), 1)),
            seed=seed,
            population_size=size,
        )
        for first in range(0, len(past) - size + 1, size):
            generation = past[first : first + size]
            costs = [t.objective if self.is_minimized else -t.objective for t in generation if t.is_complete]
            if not costs:
                continue
            told = []
            for trial in generation:
                place = np.array([axis.share(trial.values[axis.name]) for axis in axes])
                cost = trial.objective if self.is_minimized else -trial.objective
                # CMA-ES looks at the order only, and where there is a tie the first comes first.
                told.append((place, cost if trial.is_complete else max(costs)))
            optimizer.tell(told)
        asked = [optimizer.ask().tolist() for _ in range(n)]
        return [
            {axis.name: axis.at_share(share) for axis, share in zip(axes, shares, strict=True)}
            for shares in asked
        ]

    def importances(self, trials: Sequence[Trial]) -> dict[str, float]:
        """Variable -> how much being among the best quarter of the trials depends on it, the greatest first; the sum is 1.

        PED-ANOVA (Watanabe, Bansal and Hutter, IJCAI 2023). Nothing where there are few trials, one variable, or nothing to explain.
        """
        complete = [t for t in trials if t.is_complete]
        if len(complete) < FEWEST_FOR_IMPORTANCE or len(self.variables) < 2:
            return {}
        if len({t.objective for t in complete}) == 1:
            return {}
        import optuna

        with _quiet():
            made: Any = optuna.importance.PedAnovaImportanceEvaluator
            is_older = "baseline_quantile" in signature(made).parameters  # the name before Optuna 5
            evaluator = made(**{"baseline_quantile" if is_older else "target_quantile": BEST})
            return optuna.importance.get_param_importances(self._study(complete), evaluator=evaluator)


def generation_size(n_axes: int, per_round: int) -> int:
    """Trials of a generation of CMA-ES: whole rounds, and no fewer than the literature asks for (Hansen, equation 48)."""
    fewest = 4 + int(3.0 * float(np.log(n_axes)))
    return -(-fewest // per_round) * per_round


def _plain(axis: Axis, value: Value) -> float:
    """A position as Optuna has it: whole where it is one of some."""
    position = axis.position(value)
    is_whole = bool(axis.values) or isinstance(value, int)
    return int(position) if is_whole else position


@contextmanager
def _quiet() -> Iterator[None]:
    """While open, Optuna says nothing of what it does; whoever uses it beside has it as before."""
    import optuna

    before = optuna.logging.get_verbosity()
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    try:
        with warnings.catch_warnings():
            # Of arguments that are no experiment any more in its later versions.
            warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
            yield
    finally:
        optuna.logging.set_verbosity(before)
