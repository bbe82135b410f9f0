"""The robustness of each game of a stack, from its signals at each step."""

from __future__ import annotations

import operator
from bisect import bisect_right
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from tussle.api.bodies import Bodies
from tussle.arguments import explained
from tussle.engine.simulation import Simulation
from tussle.mission import Mission
from tussle.stress.formulas import guided, records
from tussle.stress.signals import ChosenRows, Games, StepView
from tussle.stress.specification import Function, Specification, columns_of

ROOM = 256
"""Samples for which there is room at first."""


@explained
@dataclass(frozen=True)
class Verdict:
    """How far a game was from breaking its specification.

    Attributes:
        robustness: Distance from failure, in the unit of what is compared; negative for a failure.
        steps: Steps at which the score falls, ascending: what the robustness is at most, as known then, or with a guide `formulas.guided`.
        levels: What it falls to, descending; the last is the score of the game, negative for a failure.
    """

    robustness: float
    steps: list[int]
    levels: list[float]

    @property
    def has_failed(self) -> bool:
        """The specification is broken."""
        return self.robustness < 0.0

    @property
    def score(self) -> float:
        """How near the game came to a failure: its robustness, or with a guide that of `formulas.guided`."""
        return self.levels[-1]

    def first_below(self, level: float) -> int | None:
        """The first step at which the game is known to be nearer to failure than a level; None for never."""
        below = bisect_right(self.levels, -level, key=operator.neg)
        return self.steps[below] if below < len(self.steps) else None


@explained
class Monitor:
    """Reads the signals of a specification at the start of each step and at the end of each world of a simulation.

    A game is not changed by it. Also a `Watcher` of a batch.

    Args:
        specification: What must hold.
        sim: The simulation, before its first step.
        guide: A specification that games break on their way to a failure; None for the specification alone.
    """

    def __init__(
        self, specification: Specification, sim: Simulation, guide: Specification | None = None
    ) -> None:
        self.specification, self.sim, self.guide = specification, sim, guide
        signals = {} if guide is None else guide.signals
        self._signals = list((specification.signals | signals).values())
        self._samples = np.full((len(self._signals), ROOM, sim.n_worlds), np.nan)
        self._kept: dict[str, np.ndarray] = {}
        self._frame = self._view(sim.state.population.bodies)
        self._verdicts: dict[int, Verdict] = {}
        sim.observers.append(self._observe)

    def restart(self, worlds: Iterable[int]) -> None:
        """Forget what was seen of worlds that have been reset."""
        for world in worlds:
            self._verdicts.pop(int(world), None)

    def _observe(self, sim: Simulation) -> None:
        if not self._signals:
            return
        state, bodies = sim.state, sim.state.population.bodies
        clock = state.context.clock
        frame = self._frame
        if bodies.ints is not frame.rows.ints:
            frame = self._frame = self._view(bodies)
        if state.n_running == state.n_worlds and clock.common >= 0:
            self._grow(clock.common)
            for i, signal in enumerate(self._signals):
                self._samples[i, clock.common] = signal.evaluate(frame)
            return
        running = np.flatnonzero(state.running)
        steps = clock.step[running]
        self._grow(int(steps.max(initial=0)))
        for i, signal in enumerate(self._signals):
            self._samples[i, steps, running] = signal.evaluate(frame)[running]

    def _view(self, bodies: Bodies) -> StepView:
        games = Games(self.sim.n_worlds, self.sim.state.context.clock.step, self._kept)
        return StepView(self.sim, bodies, ChosenRows(bodies), games)

    def _grow(self, step: int) -> None:
        room = self._samples.shape[1]
        if step >= room:
            more = np.full((len(self._signals), max(room, step + 1 - room), self.sim.n_worlds), np.nan)
            self._samples = np.concatenate([self._samples, more], axis=1)

    def trace(self, world: int) -> dict[str, np.ndarray]:
        """Values of each signal at the start of each step of a world, and now, (n_samples,)."""
        sim, step = self.sim, int(self.sim.state.context.clock.step[world])
        self._grow(step)
        bodies: Bodies = sim.state.population.bodies
        if not sim.state.running[world] and world in sim.state.parked:
            bodies = sim.state.parked[world].bodies
        frame = self._view(bodies)
        for i, signal in enumerate(self._signals):
            self._samples[i, step, world] = signal.evaluate(frame)[world]
        return {str(s): self._samples[i, : step + 1, world].copy() for i, s in enumerate(self._signals)}

    def finish(self, world: int) -> Verdict:
        """The verdict on a world: final where it has ended, else on the game so far.

        Raises:
            ParameterError: A signal is not a number, or games have no such quantity.
        """
        if world not in self._verdicts:
            result = self.sim.state.results[world]
            is_over = not self.sim.state.running[world]
            if result is None or not is_over:
                result = self.sim.result(is_hashed=False)[world]
            signals, columns = self.trace(world), columns_of(result)
            score = known = self.specification.known(signals, columns)
            if self.guide is not None:
                score = guided(known, self.guide.known(signals, columns))
            steps, levels = records(score)
            if not len(steps):  # nothing is compared, as in windows after the end
                steps, levels = np.array([0]), np.array([np.inf])
            verdict = Verdict(float(known[-1]), steps.tolist(), levels.tolist())
            if not is_over:
                return verdict
            self._verdicts[world] = verdict
        return self._verdicts[world]

    # -- of a game that is watched, see `tussle.view.alarms.SpecificationMonitor` -----------------------------------------------------

    @property
    def text(self) -> str:
        """The specification."""
        return str(self.specification)

    @property
    def unit(self) -> str:
        """SI unit of the robustness."""
        return self.specification.unit

    def check(self) -> None:
        """Check that the game has what the specification names.

        Raises:
            ParameterError: There is no such quantity, or a signal cannot be computed.
        """
        self.specification.check(columns_of(self.sim.result(is_hashed=False)[0]))
        self.trace(0)

    def progress(self, world: int) -> tuple[np.ndarray, np.ndarray, float]:
        """What a game that goes on has shown so far.

        Steps that a rewound game plays again have the same samples, and those of another course replace them.

        Returns:
            What the robustness is at most, as known at the start of each step and now, (n_samples,); the robustness of each sample alone,
            (n_samples,), NaN where that is not known; and the robustness if the game ended now. Where it has ended, the last of the first.

        Raises:
            ParameterError: A signal is not a number.
        """
        spec, sim, signals = self.specification, self.sim, self.trace(world)
        is_over = not sim.state.running[world]
        columns = columns_of(sim.result(is_hashed=False)[world]) if spec.quantities else {}
        if signals:
            return spec.progress(signals, columns, is_over)
        n, ended = int(sim.state.context.clock.step[world]) + 1, float(spec.known(signals, columns)[-1])
        known = np.full(n, np.inf)  # quantities alone are known at the end
        known[-1] = ended if is_over else np.inf
        return known, np.full(n, np.nan), ended

    def robustness(self) -> np.ndarray:
        """Robustness of each world, (n_worlds,): of the whole game where it has ended, else of the game so far."""
        return np.array([self.finish(world).robustness for world in range(self.sim.n_worlds)])


@dataclass(frozen=True)
class Watching:
    """Makes the monitor of a simulation; pickles, for other processes.

    Attributes:
        given: The specification: a text, or a function that is to be positive.
        functions: Its signals that are functions.
        guide_text: What guides splitting beside it, as of `Monitor`; "" for nothing.
    """

    given: str | Function
    functions: Mapping[str, Function] = field(default_factory=dict)
    guide_text: str = ""

    def specification(self, mission: Mission) -> Specification:
        """The specification of a mission.

        Raises:
            ParameterError: It is none.
        """
        if isinstance(self.given, str):
            return Specification.parse(self.given, mission, self.functions)
        return Specification.of_function(self.given, mission)

    def guide(self, mission: Mission) -> Specification | None:
        """The guide of a mission.

        Raises:
            ParameterError: The text is no specification, or names what the mission does not have.
        """
        return Specification.parse(self.guide_text, mission, self.functions) if self.guide_text else None

    def __call__(self, sim: Simulation) -> Monitor:
        return Monitor(self.specification(sim.mission), sim, self.guide(sim.mission))
