"""The data of a simulation as one object; what a step, a reset or a snapshot does with it are functions in this package."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from tussle.api.bodies import Bodies
from tussle.api.clock import Clock
from tussle.api.context import Context
from tussle.api.world import WorldView
from tussle.engine.births import Births
from tussle.engine.events import Listeners
from tussle.engine.message_bus import MessageBus
from tussle.engine.params import Overrides
from tussle.engine.population import Population
from tussle.engine.result import WorldResult
from tussle.engine.start_from import RecordedBirths
from tussle.engine.table import Stored
from tussle.engine.world_bindings import WorldBinding
from tussle.errors import PluginError
from tussle.mission import Mission
from tussle.stock import advise_controllers

if TYPE_CHECKING:
    from tussle.record import FirstStates


@dataclass
class Parked:
    """The last rows of a world that has ended: its part of the body table and of each group's table.

    Attributes:
        bodies: Its rows.
        tables: Key of the group -> (rows in `bodies`, what its table held of them).
    """

    bodies: Bodies
    tables: dict[Any, tuple[np.ndarray, Stored]]


class SimulationState:
    """All data of a stack of worlds; at first they have no entities. Arguments and errors are those of `Simulation`.

    Attributes:
        mission: What is played.
        overrides: Parameters that differ from world to world.
        context: Clocks, random keys (the worlds' seeds), and what else all views share.
        births: Ids, and the births to come.
        mail: Topics: what was said, and what is on its way.
        population: The body table, and the groups with their columns.
        world_view: What world plugins are given; holds the deaths, moves and births that they ask for.
        events: Who is told of what happens.
        on_error: What an error of one world does: "raise" or "record".
        raises_when_all_fail: An error is raised all the same when no world is left.
        interactions: World plugins; likewise metrics, and networks by instance name.
        running: Which worlds have not ended, (n_worlds,).
        failed: Worlds in which a plugin has failed, (n_worlds,).
        results: Result of each world that has ended or failed.
        parked: World -> its last rows, for those that have ended.
        has_failures: A plugin has failed since the last look.
        has_changed: Who is there has changed since the last look at the end conditions.
        checked: Columns that are checked at the end of a step, and which rows are faulty, (n,).
        n_steps: Number of steps until the mission's end time.
        by_substep: The schedule takes each substep by itself, also where one kernel could do all: to look between them.
    """

    def __init__(
        self,
        mission: Mission,
        seeds: Sequence[int],
        params: Mapping[str, Any],
        threads: int,
        on_error: str | None,
        start_from: FirstStates | None,
    ) -> None:
        n = self.n_worlds = self.n_running = len(seeds)
        self.mission, self.n_steps = mission, mission.steps
        self.on_error = on_error or ("raise" if n == 1 else "record")
        self.raises_when_all_fail = on_error is None
        self.running, self.failed = np.ones(n, bool), np.zeros(n, bool)
        self.results: list[WorldResult | None] = [None] * n
        self.parked: dict[int, Parked] = {}
        self.has_failures, self.has_changed, self.by_substep = False, True, False
        clock = Clock(n, mission.start, mission.dt)
        keys = np.array([s % 2**64 for s in seeds], np.uint64)
        blocks = [b.name for b in mission.blocks]
        context = Context(clock, keys, blocks, mission.scene, mission.teams, self.running, threads=threads)
        self.context = context
        self.overrides = Overrides(mission, n)
        self.overrides.set(params, np.arange(n))
        given = self.overrides, keys, mission.start
        self.births = Births(*given) if start_from is None else RecordedBirths(*given, start_from)
        message_bus = self.message_bus = MessageBus([p.instance_name for p in mission.networks])
        context.topic, context.fail = message_bus.topic, self.record_failure
        self.events = Listeners(context)
        self.population = Population(context, self.overrides, advise_controllers)
        nobody = self.population.bodies
        self.checked = nobody.pos, nobody.quat, nobody.health, np.empty(0, bool)
        view = self.world_view = WorldView(self.population.bodies, context)
        view.templates, view.publish_to, view.by_type = blocks, message_bus.publish_to, message_bus.by_type

        def bind(specs: Sequence[Any]) -> list[WorldBinding]:
            return [WorldBinding.bind(p, view, self.overrides) for p in specs]

        self.networks = {r.spec.instance_name: r for r in bind(mission.networks)}
        self.interactions, self.metrics = bind(mission.interactions), bind(mission.metrics)
        self.population.prepare()

    @property
    def world_bindings(self) -> list[WorldBinding]:
        """All world plugins."""
        return [*self.interactions, *self.metrics, *self.networks.values()]

    def error(self, world: int, text: str, where: str = "") -> PluginError:
        """What ends a world although no plugin has raised."""
        return PluginError(text, where=where, step=int(self.context.clock.step[world]), world=world)

    def record_failure(self, world: int, error: PluginError) -> None:
        """End a world with an error when this step ends.

        Raises:
            PluginError: The same, where errors are raised.
        """
        if self.on_error == "raise":
            raise error
        if self.failed[world]:
            return
        self.failed[world] = self.has_failures = True
        self.results[world] = WorldResult(
            world, int(self.context.seeds[world]), "error", 0, 0.0, {}, error=error
        )
        if self.failed.all() and self.raises_when_all_fail:
            raise error
