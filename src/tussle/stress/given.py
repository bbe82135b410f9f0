"""Games for tests of Hypothesis: it draws their seeds and values, and shrinks those that fail."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tussle.arguments import checked, explained
from tussle.engine.simulation import Simulation
from tussle.errors import MissingExtraError
from tussle.mission import Mission
from tussle.stress.games import StressGame
from tussle.stress.specification import Function
from tussle.stress.study import Stress

MAX_SEED = 2**32 - 1
"""Of the seeds that Hypothesis draws; short ones are easier to read."""


@dataclass(frozen=True)
class GivenGame:
    """A game that has been played for a test.

    Attributes:
        seed: Its seed.
        values: Values that were drawn, by path.
        robustness: How far it is from breaking the specification, in the unit of what is compared; negative for a failure.
        study: The study that it belongs to.
    """

    seed: int
    values: Mapping[str, Any]
    robustness: float
    study: Stress = field(repr=False)

    def mission_file(self) -> str:
        """A mission file that plays the game again."""
        return self.study.failing_mission(StressGame(self.seed))


@explained
@checked("specification")
def given_games(
    mission: str | Path | Mission,
    specification: str | Function,
    *,
    vary: Mapping[str, Any] | None = None,
    settings: Mapping[str, Any] | None = None,
    **options: Any,
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Return `hypothesis.given` for a test whose last argument is a `GivenGame`.

    Args:
        mission: A mission file, the name of one that ships, or a `Mission`.
        specification: What must hold, as for `Stress`.
        vary: Strategies of Hypothesis for values of the mission, by path, as "prey.count".
        settings: Values that are set in all games.
        options: Further arguments of `Stress`.

    Raises:
        MissingExtraError: Hypothesis is not installed.
        ParameterError: The specification is none, or names what the mission does not have.
    """
    try:
        from hypothesis import given
        from hypothesis import strategies as st
    except ImportError as error:
        raise MissingExtraError(
            f"given_games needs hypothesis, which cannot be imported ({error}); pip install 'tussle[property]' installs it"
        ) from None
    fixed = dict(settings or {})
    Stress(mission, specification, settings=fixed, **options)  # a mistake is told when the test is defined

    def play(seed: int, values: Mapping[str, Any]) -> GivenGame:
        study = Stress(mission, specification, first_seed=seed, settings=fixed | dict(values), **options)
        with Simulation(study.mission, seed, on_error="raise") as sim:
            monitor = study.watching(sim)
            sim.run()
            return GivenGame(seed, dict(values), float(monitor.robustness()[0]), study)

    return given(st.builds(play, st.integers(0, MAX_SEED), st.fixed_dictionaries(dict(vary or {}))))
