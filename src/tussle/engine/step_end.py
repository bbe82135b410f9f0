"""The end of a step: states checked, the dead removed, clocks advanced, worlds ended."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from tussle.api import kernels
from tussle.engine import access, failure

if TYPE_CHECKING:
    from tussle.engine.simulation import Simulation


class StepEnd:
    """The last call of a simulation's step.

    Attributes:
        has_failures: A plugin has failed since the last look.
    """

    def __init__(self, sim: Simulation) -> None:
        self.sim = sim
        self.has_failures = False
        self._steps = sim.mission.steps
        self._has_changed = True
        self._checked: tuple[Any, ...] | None = None

    def rows_changed(self) -> None:
        """The table has been repacked or restored."""
        self._checked = None
        self._has_changed = True

    def run(self) -> None:
        """Check all states, remove who is gone, advance the clocks, end worlds."""
        self._check_states()
        clock = self.sim.context.clock
        if self.sim.n_running == self.sim.n_worlds:
            clock.step += 1
        else:
            clock.step += self.sim.running
        if self.sim.world_view.deaths or self.has_failures:
            self.take_out_dead()
        if clock.common >= 0:
            clock.common += 1
        if self._has_changed or clock.common < 0 or clock.common >= self._steps:
            self._end_worlds()

    def _check_states(self) -> None:
        if self._checked is None:
            b = self.sim.population.bodies
            self._checked = (b.pos, b.quat, b.health, np.empty(b.n, bool))
        if kernels.check(*self._checked):
            bodies, faulty = self.sim.population.bodies, self._checked[-1]
            for row in np.flatnonzero(faulty):
                world = int(bodies.world[row])
                if not self.sim.failed[world]:
                    group = next(g for g in self.sim.population.groups if g.first <= row < g.last)
                    self.sim.record_failure(
                        world,
                        failure.not_finite(group, bodies, int(row), int(self.sim.context.clock.step[world])),
                    )
            self.sim.world_view.kill(~faulty & ~(bodies.health > 0.0), "health")

    def take_out_dead(self) -> None:
        """Remove who is dead, and all of the worlds in which a plugin has failed."""
        view, bodies = self.sim.world_view, self.sim.population.bodies
        if not view.deaths and not self.has_failures:
            return
        ended = self.sim.failed & self.sim.running
        self.has_failures = False
        gone = np.zeros(bodies.n, bool)
        for rows, _ in view.deaths:
            gone[rows] = True
        if self.sim.events and view.deaths:
            self.sim.events.deaths(view.deaths, np.maximum(self.sim.context.clock.step - 1, 0))
        view.deaths = []
        for world in np.flatnonzero(ended):
            self._end(int(world), "error")
            gone |= bodies.world == world
        self.sim.repack(gone, None)

    def _end_worlds(self) -> None:
        mission, clock = self.sim.mission, self.sim.context.clock
        conditions = mission.end_conditions
        over: dict[int, str] = {}
        if "time" in conditions:
            for world in np.flatnonzero(self.sim.running & (clock.step >= self._steps)):
                over[int(world)] = "time"
        # Who is there has changed since the last look: births count too, since the last one may decide
        if self._has_changed:
            self._has_changed = False
            for number, reason in self._lost_teams():
                over.setdefault(number, reason)
        if over:
            self._end_and_park(over)

    def _lost_teams(self) -> Iterable[tuple[int, str]]:
        conditions = self.sim.mission.end_conditions
        if "none" in conditions or not {"one_team", "all_dead"} & set(conditions):
            return
        bodies = self.sim.population.bodies
        number = np.searchsorted(self.sim.context.teams, bodies.team)
        n_teams = len(self.sim.context.teams) + 1
        counts = np.bincount(bodies.world * n_teams + number, minlength=self.sim.n_worlds * n_teams).reshape(
            self.sim.n_worlds, n_teams
        )
        left = (counts > 0).sum(axis=1)
        for world in np.flatnonzero(self.sim.running & (left <= 1)):
            if not self.sim.births.is_over(int(world)):
                continue
            if left[world] == 0:
                yield int(world), "all_dead"
            elif "one_team" in conditions and len(self.sim.context.teams) > 1:
                yield int(world), "one_team"

    def _end_and_park(self, over: Mapping[int, str]) -> None:
        bodies = self.sim.population.bodies
        for world, reason in over.items():
            self._end(world, reason)
        if self.sim.n_running:
            self.sim.repack(np.isin(bodies.world, list(over)), None)
            mask = np.zeros(self.sim.n_worlds, bool)
            mask[list(over)] = True
            self.sim.mail.drop_worlds(mask)
        else:
            self.sim.population.close_handles()

    def _end(self, world: int, reason: str) -> None:
        result = access.world_result(self.sim, world, reason)
        previous = self.sim.results[world]
        if previous is not None:
            result.error = previous.error
        self.sim.results[world] = result
        self.sim.parked[world] = access.park(self.sim, world)
        self.sim.running[world] = False
        self.sim.n_running = int(self.sim.running.sum())
        if self.sim.events:
            self.sim.events.end(world, reason)
