"""The data of a simulation as one object. Steps, resets and snapshots are functions of it, in other modules of this package."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from tussle.api.bodies import Bodies
from tussle.api.context import Clock, Context
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
from tussle.mission.rekeys import Rekeys
from tussle.plugins.stock import advise_controllers

if TYPE_CHECKING:
    from tussle.record import FirstStates


@dataclass
class Parked:
    """The last rows of a world that has ended: its parts of the body table, of each group's table and of the world plugins' tables.

    Attributes:
        bodies: Rows of the body table.
        tables: Key of a group -> (rows in `bodies`, the rows of the group's table).
        of_world: Name of a world plugin -> its values per entity, in the order of `bodies`, and of this world.
    """

    bodies: Bodies
    tables: dict[Any, tuple[np.ndarray, Stored]]
    of_world: dict[str, dict[str, Stored]]


def _births(mission: Mission, arguments: tuple[Overrides, Context, float]) -> Births:
    """Return the births of a mission, according to its `compat`."""
    if not mission.compat:
        return Births(*arguments)
    from tussle.engine.historic_births import HistoricBirths  # not loaded otherwise

    return HistoricBirths(*arguments)


class SimulationState:
    """All data of a stack of worlds, initially without entities. Arguments and errors are those of `Simulation`.

    Attributes:
        mission: The mission.
        overrides: Parameters that differ between worlds.
        context: Clocks, seeds, and other data that all views share.
        births: Ids and future births.
        message_bus: Topics with their published and pending messages.
        population: The body table, and the groups with their columns.
        world_view: View of the world plugins; holds the deaths, moves and births that they request.
        events: Listeners of events.
        on_error: Whether an error of one world is raised ("raise") or ends only this world ("record").
        raises_when_all_fail: An error is raised if no world is left.
        interactions: Bindings of the interactions.
        metrics: Bindings of the metrics.
        networks: Instance name -> binding of a network.
        running: True for worlds that have not ended, (n_worlds,).
        failed: True for worlds in which a plugin has failed, (n_worlds,).
        results: Result of each world that has ended or failed.
        parked: World -> its last rows, for those that have ended.
        rekeys: World -> its re-keys, for worlds that have some.
        manual: (world, id) -> deflections of the sticks, for entities that an operator drives.
        has_failures: A world has failed since dead entities were last removed.
        has_changed: Entities were added or removed since the end conditions were last checked.
        checked: Columns that are checked at the end of a step, and the mask of faulty rows, (n,).
        n_steps: Number of steps until the mission's end time.
        by_substep: The schedule has separate calls for each substep, even if one kernel could run all of them.
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
        self.rekeys: dict[int, Rekeys] = {}
        self.manual: dict[tuple[int, int], tuple[float, ...]] = {}
        self.has_failures, self.has_changed, self.by_substep = False, True, False
        clock = Clock(n, mission.start, mission.dt)
        keys = np.array(seeds, np.uint64)
        blocks = [b.name for b in mission.blocks]
        context = Context(clock, keys, blocks, mission.scene, mission.teams, self.running, threads=threads)
        self.context = context
        context.boxes = np.array([block.box or (0.0, 0.0, 0.0) for block in mission.blocks]).reshape(-1, 3)
        self.overrides = Overrides(mission, n)
        self.overrides.set(params, np.arange(n))
        given = self.overrides, context, mission.start
        self.births = _births(mission, given) if start_from is None else RecordedBirths(*given, start_from)
        message_bus = self.message_bus = MessageBus([p.instance_name for p in mission.networks])
        context.topic, context.fail = message_bus.topic, self.record_failure
        self.events = Listeners(context)
        self.population = Population(context, self.overrides, advise_controllers)
        context.mass_properties = self.population.mass_properties
        bodies = self.population.bodies
        self.checked = bodies.pos, bodies.quat, bodies.health, np.empty(0, bool)
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
        """Return the error of a world in which no plugin has raised an exception."""
        return PluginError(text, where=where, step=int(self.context.clock.step[world]), world=world)

    def record_failure(self, world: int, error: PluginError) -> None:
        """End a world with an error at the end of this step.

        Raises:
            PluginError: The error itself, depending on `on_error` and `raises_when_all_fail`.
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
