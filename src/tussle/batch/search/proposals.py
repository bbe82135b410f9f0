"""Proposes the next values to try, with Optuna's samplers.

A round is a function of the seed and of the rounds before, so a search that was killed goes on as it would have.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from inspect import signature
from typing import TYPE_CHECKING, Any

import numpy as np

from tussle.batch.search.trials import (
    Point,
    Trial,
    distribution,
    frozen,
    has_constraints_of_trials,
    parameter_of,
    value_of,
)
from tussle.batch.variables import Choice, Variable
from tussle.errors import MissingExtraError, ParameterError, listed, nearest_name

if TYPE_CHECKING:
    import optuna

SAMPLERS = ("tpe", "cmaes", "random")
MIN_FOR_IMPORTANCE = 20
"""Complete trials for importances."""
BEST = 0.25
"""Part of the trials that importances compare with all of them; of 20, the tenth that is usual would be two."""


class Proposer:
    """Proposes the values of trials, round by round.

    Args:
        variables: What varies.
        sampler: One of `SAMPLERS`.
        seed: Of what it draws.
        per_round: Trials of a round.
        is_minimized: Smaller objectives are better.
        n_constraints: Constraints of each trial.

    Raises:
        ParameterError: There is no such sampler, or it cannot search these variables.
        MissingExtraError: Optuna or cmaes is not installed.
    """

    def __init__(
        self,
        variables: Sequence[Variable],
        sampler: str,
        seed: int,
        per_round: int,
        is_minimized: bool,
        n_constraints: int = 0,
    ) -> None:
        if sampler not in SAMPLERS:
            raise ParameterError(
                f"sampler = {sampler!r} is not allowed{nearest_name(str(sampler), SAMPLERS)}; {listed(SAMPLERS)}"
            )
        choices = [v.name for v in variables if isinstance(v, Choice)]
        if sampler == "cmaes" and choices:
            raise ParameterError(f"cmaes searches ranges, and {choices[0]} is a choice; tpe searches both")
        if sampler == "cmaes" and n_constraints:
            raise ParameterError("cmaes knows no constraints; tpe does")
        require_optuna(with_cmaes=sampler == "cmaes")
        import optuna

        self._is_constrained = bool(n_constraints)
        self._variables, self._seed, self._per_round = tuple(variables), seed, per_round
        self._kind = sampler
        self._space = {v.name: distribution(v) for v in variables}
        self._storage = optuna.storages.InMemoryStorage()
        with quiet():
            self._study = new_study(is_minimized, self._storage)

    def learn(self, trials: Sequence[Trial]) -> None:
        """Add finished trials."""
        import optuna

        with quiet():
            if self._kind != "cmaes":
                self._study.add_trials([frozen(trial, self._variables) for trial in trials])
                return
            for trial in trials:  # CMA-ES keeps its state in the trials that it was asked for
                parameters = {v.name: parameter_of(v, trial.values[v.name]) for v in self._variables}
                self._study.enqueue_trial(parameters)
                asked = self._ask(self._study, trial.number)
                failed = None if trial.is_complete else optuna.trial.TrialState.FAIL
                self._study.tell(asked, trial.objective if trial.is_complete else None, state=failed)

    def propose(self) -> list[Point]:
        """Return the values of the next round. The result is the same until `learn` is called."""
        import optuna

        with quiet():
            scratch = optuna.storages.InMemoryStorage()
            name = self._study.study_name
            optuna.copy_study(from_study_name=name, from_storage=self._storage, to_storage=scratch)
            study = optuna.load_study(study_name=name, storage=scratch)
            first = len(study.get_trials(deepcopy=False))
            asked = [self._ask(study, first + i).params for i in range(self._per_round)]
        return [{v.name: value_of(v, found[v.name]) for v in self._variables} for found in asked]

    def _ask(self, study: optuna.Study, number: int) -> optuna.Trial:
        """Ask for a trial, with a sampler that draws from a seed of this trial's own."""
        import optuna

        (seed,) = np.random.SeedSequence((self._seed, number)).generate_state(1).tolist()
        if self._kind == "random":
            study.sampler = optuna.samplers.RandomSampler(seed)
        elif self._kind == "cmaes":
            # Whole rounds, and no fewer than the literature asks for: Hansen, arXiv:1604.00772, equation 48.
            fewest = 4 + int(3.0 * float(np.log(len(self._space))))
            size = -(-fewest // self._per_round) * self._per_round
            study.sampler = optuna.samplers.CmaEsSampler(seed=seed, popsize=size)
        else:
            is_told = self._is_constrained and not has_constraints_of_trials()
            more: Any = {"constraints_func": _constraints_before_5} if is_told else {}
            study.sampler = optuna.samplers.TPESampler(
                seed=seed, multivariate=True, constant_liar=True, **more
            )
        return study.ask(self._space)


def _constraints_before_5(trial: optuna.trial.FrozenTrial) -> Sequence[float]:
    return list(trial.system_attrs["constraints"])


def importances(
    trials: Sequence[Trial], variables: Sequence[Variable], is_minimized: bool
) -> dict[str, float]:
    """Variable -> how much being among the best quarter of the trials depends on it, the greatest first; the sum is 1.

    PED-ANOVA (Watanabe, Bansal and Hutter, IJCAI 2023). Empty for few trials, one variable, or equal objectives.

    Raises:
        MissingExtraError: Optuna is not installed.
    """
    complete = [t for t in trials if t.is_complete]
    if len(complete) < MIN_FOR_IMPORTANCE or len(variables) < 2:
        return {}
    if len({t.objective for t in complete}) == 1:
        return {}
    require_optuna()
    import optuna

    with quiet():
        study = new_study(is_minimized)
        study.add_trials([frozen(trial, variables) for trial in complete])
        made: Any = optuna.importance.PedAnovaImportanceEvaluator
        is_older = "baseline_quantile" in signature(made).parameters  # the name before Optuna 5
        evaluator = made(**{"baseline_quantile" if is_older else "target_quantile": BEST})
        return optuna.importance.get_param_importances(study, evaluator=evaluator)


def new_study(is_minimized: bool, storage: Any = None) -> optuna.Study:
    """Return an empty Optuna study."""
    import optuna

    return optuna.create_study(
        storage=storage, direction="minimize" if is_minimized else "maximize", study_name="tussle"
    )


def require_optuna(*, with_cmaes: bool = False) -> None:
    """Import Optuna, and what its CMA-ES needs.

    Raises:
        MissingExtraError: One of them is not installed.
    """
    try:
        import optuna  # noqa: F401

        if with_cmaes:
            import cmaes  # type: ignore[import-untyped]  # noqa: F401
    except ImportError as error:
        raise MissingExtraError(
            f"optimisation needs {error.name}, which cannot be imported ({error}); pip install 'tussle[batch]' brings it"
        ) from None


@contextmanager
def quiet() -> Iterator[None]:
    """Silence Optuna's log and warnings inside."""
    import optuna

    before = optuna.logging.get_verbosity()
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
            yield
    finally:
        optuna.logging.set_verbosity(before)
