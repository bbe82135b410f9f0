"""A stack of worlds that plays one mission."""

from __future__ import annotations

import threading
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from tussle.api.bodies import Bodies
from tussle.api.clock import Clock
from tussle.api.context import Context
from tussle.api.kinds import Interaction, WorldPlugin
from tussle.api.plugin import GRADES
from tussle.api.world import WorldView
from tussle.columns import Handle
from tussle.engine import access, failure
from tussle.engine.births import Births, Room, joined
from tussle.engine.events import Herald
from tussle.engine.mail import Mail
from tussle.engine.params import Overrides
from tussle.engine.population import Population
from tussle.engine.referees import Referee
from tussle.engine.result import WorldResult
from tussle.engine.schedule import Call, Schedule
from tussle.engine.start_from import RecordedBirths
from tussle.engine.step_end import StepEnd
from tussle.engine.subset import call_referee
from tussle.errors import MissionError, ParameterError, PluginError
from tussle.messages import Batch, Message
from tussle.mission import Mission
from tussle.stock import advise_controllers

if TYPE_CHECKING:
    from tussle.record import FirstStates


class Simulation:
    """Plays a mission in one world per seed, all in step.

    World k is bit for bit what it would be alone, whatever the stack.

    Args:
        mission: What is played.
        seeds: Seed of each world; a single number is a stack of one.
        params: Parameters by path ("prey.Boids.gain", "prey.speed", "SimpleCapture.capture_range"); one value, or one per world.
        threads: Threads that a step may use; the result is the same with any number.
        on_error: What an error does that belongs to one world, such as a state that is not finite: "raise" raises it, "record" ends
            the world with the error in its result, and the others go on. By default "raise" for one world and "record" for several.
            An exception in a plugin ends the whole stack: with an explicit "record" in the results of all running worlds, else it is
            raised.
        start_from: Ids, times of birth and first states, in all worlds, instead of the blocks' placement; see `tussle.read_table`.

    Raises:
        MissionError: The mission cannot be played.
        WiringError: Plugins do not fit together.
        ParameterError: A parameter is unknown or not allowed.
    """

    def __init__(
        self,
        mission: Mission,
        seeds: int | Iterable[int] = 1,
        params: Mapping[str, Any] | None = None,
        *,
        threads: int = 1,
        on_error: str | None = None,
        start_from: FirstStates | None = None,
    ) -> None:
        self.mission = mission
        numbers = list(seeds) if isinstance(seeds, Iterable) else [seeds]
        if isinstance(threads, bool) or int(threads) != threads or threads < 1:
            raise ParameterError(f"threads = {threads!r} is not allowed; it takes a whole number >= 1")
        self._check(mission, numbers, on_error)
        n = self.n_worlds = len(numbers)
        self.on_error = on_error or ("raise" if n == 1 else "record")
        self._raises_when_all_fail = on_error is None
        self.running = np.ones(n, bool)
        self.n_running = n
        self.failed = np.zeros(n, bool)
        self.results: list[WorldResult | None] = [None] * n
        self.observers: list[Callable[[Simulation], None]] = []
        self.parked: dict[int, access.Parked] = {}
        self.events = Herald(self)
        self.is_closed = False
        self.is_replaying = (
            False  # observers and listeners have been told of these steps and are not told again
        )
        self.step_end = StepEnd(self)
        self._resumed = threading.Event()
        self._resumed.set()
        clock = Clock(n, mission.start, mission.dt)
        seeds_ = np.array([s % 2**64 for s in numbers], np.uint64)
        self.context = Context(
            clock,
            seeds_,
            [b.name for b in mission.blocks],
            mission.scene,
            mission.teams,
            self.running,
            threads=threads,
        )
        self.overrides = Overrides(mission, n)
        self.overrides.set(params or {}, np.arange(n))
        self._build(seeds_, start_from)
        try:
            self.reset(range(n))
            self._schedule: list[Call] | None = Schedule(self).compose()
            for text in self.mail.unheard():
                warnings.warn(text, RuntimeWarning, stacklevel=2)
        except Exception:
            self.close()
            raise

    def _check(self, mission: Mission, seeds: Sequence[Any], on_error: str | None) -> None:
        if not isinstance(mission, Mission):
            raise MissionError(f"Simulation needs a Mission, not {mission!r}")
        if not seeds:
            raise MissionError("seeds is empty; give one number or several")
        _check_seeds(seeds)
        if on_error not in (None, "raise", "record"):
            raise ParameterError(f"on_error = {on_error!r} is not allowed; it is 'raise' or 'record'")
        for plugin in [*mission.world_plugins, *(p for b in mission.blocks for p in b.plugins)]:
            most = Handle.most_worlds(plugin)
            if most is not None and len(seeds) > most:
                raise MissionError(
                    f"{plugin.instance_name} takes part in at most {most} worlds of one stack, not {len(seeds)}"
                )

    def _build(self, seeds: np.ndarray, start_from: FirstStates | None) -> None:
        mission = self.mission
        self.births = (
            Births(self.overrides, seeds, mission.start)
            if start_from is None
            else RecordedBirths(self.overrides, seeds, mission.start, start_from)
        )
        self.mail = Mail(self)
        self.topics = self.mail.topics
        self.context.topic = self.mail.topic
        is_sequential = mission.update == "sequential"
        self.population = Population(
            self.context,
            self.overrides,
            self.n_worlds,
            mission.motion_multiplier,
            is_sequential,
            advise_controllers,
        )
        view = self.world_view = WorldView(self.population.bodies, self.context)
        view.templates = [b.name for b in mission.blocks]
        view.publish_to = self.mail.publish_to
        self.mail.names = [p.instance_name for p in mission.networks]

        def bind(specs: Iterable[Any]) -> list[Referee]:
            return [Referee.bind(p, view, self.overrides) for p in specs]

        self.networks = bind(mission.networks)
        self.mail.networks = {r.spec.instance_name: r for r in self.networks}
        self.interactions, self.metrics = bind(mission.interactions), bind(mission.metrics)
        self.population.on_new_group = self.forget_schedule
        self.population.on_failure = self.context.fail = self.record_failure
        self.population.prepare()

    def forget_schedule(self) -> None:
        self._schedule = None

    @property
    def referees(self) -> list[Referee]:
        return [*self.interactions, *self.metrics, *self.networks]

    # -- running ------------------------------------------------------------------------------------------------------------

    @property
    def t(self) -> np.ndarray:
        """Time of each world [s], (n_worlds,)."""
        return self.context.clock.t

    @property
    def steps(self) -> np.ndarray:
        """Steps made by each world, (n_worlds,)."""
        return self.context.clock.step.copy()

    @property
    def is_over(self) -> bool:
        """No world is running."""
        return self.n_running == 0

    @property
    def schedule(self) -> list[Call]:
        """The calls of a step, in order."""
        if self._schedule is None:
            self._schedule = Schedule(self).compose()
        return self._schedule

    def step(self, n: int = 1) -> None:
        """Make n steps in all running worlds; none where all have ended.

        Raises:
            PluginError: With on_error="raise", a plugin failed.
        """
        for _ in range(n):
            if not self.n_running:
                return
            self._step()

    def _step(self) -> None:
        try:
            if self.births.has_rates or self.world_view.births:
                self._give_birth()
            if not self.is_replaying:
                for observer in self.observers:
                    observer(self)
            for call in self.schedule:
                call.run()
        except PluginError as error:
            self._stop(error)

    def _stop(self, error: PluginError) -> None:
        """An exception ends the stack."""
        if self.on_error == "record" and not self._raises_when_all_fail:
            for world in np.flatnonzero(self.running):
                self.record_failure(int(world), error)
            self.world_view.moved = []
            self.step_end.take_out_dead()
            return
        # From here on, so that what is printed is the plugin's own lines and not the way through the engine.
        raise error.with_traceback(None) from error.cause

    def run(self, until: float | None = None) -> list[WorldResult]:
        """Step until all worlds have ended, or have reached the time `until` [s]; waits while paused.

        Returns:
            The result of each world so far.
        """
        while self.n_running:
            if until is not None and float(self.t[self.running].min()) >= until - 1e-6 * self.mission.dt:
                break
            self._resumed.wait()
            self._step()
        return self.result()

    def run_until(self, condition: Callable[[Simulation], bool]) -> None:
        """Step until condition(self) holds or all worlds have ended."""
        while self.n_running and not condition(self):
            self._resumed.wait()
            self._step()

    def pause(self) -> None:
        """Make `run` wait before its next step; `step` still steps."""
        self._resumed.clear()

    def resume(self) -> None:
        """Let `run` go on."""
        self._resumed.set()

    @property
    def is_paused(self) -> bool:
        return not self._resumed.is_set()

    # -- beginning and end of worlds ------------------------------------------------------------------------------------------

    def reset(
        self,
        worlds: Iterable[int],
        seeds: Sequence[int] | None = None,
        params: Mapping[str, Any] | None = None,
    ) -> None:
        """Begin some worlds anew, with other seeds and parameters where given; the others are untouched.

        Args:
            worlds: Numbers of the worlds.
            seeds: New seed of each; by default its last one.
            params: As for the constructor, one value or one per world of `worlds`.
        """
        listed_ = [int(w) for w in worlds]
        chosen = np.array(sorted(listed_), np.int64)
        if len(chosen) and (chosen[0] < 0 or chosen[-1] >= self.n_worlds or len(set(listed_)) < len(listed_)):
            raise ParameterError(
                f"reset: there are worlds 0 to {self.n_worlds - 1}, each once, not {listed_}"
            )
        mask = np.zeros(self.n_worlds, bool)
        mask[chosen] = True
        if seeds is not None:
            _check_seeds(seeds)
            if len(seeds) != len(listed_):
                raise ParameterError(f"reset: {len(seeds)} seeds for {len(listed_)} worlds")
        if params:
            self.overrides.set(params, np.array(listed_, np.int64))
        if seeds is not None:
            self.context.seeds[listed_] = [s % 2**64 for s in seeds]
        self.context.clock.step[chosen] = 0
        self.running[chosen], self.failed[chosen] = True, False
        self.n_running = int(self.running.sum())
        for world in chosen:
            self.results[world] = None
            self.parked.pop(int(world), None)
        self.mail.drop_worlds(mask)
        view = self.world_view
        view.births = [
            {k: v if k == "block" else v[..., ~mask[b["world"]]] for k, v in b.items()} for b in view.births
        ]
        for referee in self.referees:
            referee.reset(chosen)
            if self.overrides.columns:
                referee.fill_params(self.overrides, chosen)
        due = self.births.begin(chosen)
        gone = mask | ~self.running  # worlds that ended last keep their rows as long as nobody runs
        self.repack(gone[self.population.bodies.world], self._create(due, at_start=True))
        self._set_common_step()
        self._start_referees(mask)
        self.step_end.take_out_dead()

    def _start_referees(self, mask: np.ndarray) -> None:
        for referee in self.referees:
            if type(referee.plugin).start is WorldPlugin.start:
                continue
            if mask.all():
                self._start(referee, referee.view)
            else:
                call_referee(self.population, referee, mask, self._start)
        self.take_over_moves(0.0)

    def _start(self, referee: Referee, view: WorldView) -> None:
        view.begin(referee.plugin)
        try:
            referee.plugin.start(view)
        except Exception as error:
            raise failure.in_call(error, referee.plugin, view) from error

    def _create(self, due: Mapping[int, np.ndarray], at_start: bool = False) -> Bodies | None:
        rejecting = [r for r in self.interactions if type(r.plugin).rejects is not Interaction.rejects]
        placed: dict[int, list[np.ndarray]] = {}

        def standing(world: int) -> np.ndarray:
            bodies = self.population.bodies
            here = (
                [] if at_start else [bodies.pos[:, bodies.world == world]]
            )  # at a reset, the rows of the last game are still there
            return np.concatenate([np.zeros((3, 0)), *here, *placed.get(world, [])], axis=1)

        def rejects(world: int, pos: np.ndarray, others: np.ndarray) -> bool:
            return any(r.plugin.rejects(r.view, world, pos, others) for r in rejecting)

        def fail(world: int, error: MissionError) -> None:
            if at_start and self.n_worlds == 1:
                raise error
            self.record_failure(world, self._own_error(world, str(error)))

        room = Room(rejects, standing, fail) if rejecting else None
        self.world_view.begin()
        parts = []
        for block, worlds in due.items():
            part = self.births.create(block, worlds, room=room)
            parts.append(part)
            if rejecting:
                for world in np.unique(worlds):
                    placed.setdefault(int(world), []).append(part.pos[:, part.world == world])
        return joined(parts) if parts else None

    def _give_birth(self) -> None:
        parts = []
        asked, self.world_view.births = self.world_view.births, []
        if asked:
            self._check_space(np.concatenate([wish["world"] for wish in asked]))
        is_open = self.running & ~self.failed
        names = self.context.block_names
        for wish in asked:
            where = {k: v for k, v in wish.items() if k not in ("block", "world")}
            worlds = wish["world"]
            order = np.argsort(worlds, kind="stable")
            kept = order[is_open[worlds[order]]]
            if len(kept):
                where = {k: v[..., kept] for k, v in where.items()}
                parts.append(self.births.create(names.index(wish["block"]), worlds[kept], where))
        due = self.births.due(self.context.clock.t, self.running) if self.births.has_rates else {}
        born = self._create(due) if due else None
        parts += [born] if born is not None else []
        if parts:
            self.repack(None, joined(parts))
            self.step_end.take_out_dead()  # what an entity holds outside the arrays could not be opened

    def _check_space(self, worlds: np.ndarray) -> None:
        """End the worlds that the births asked for in `worlds`, (m,), would make larger than they may be."""
        n_asked = np.bincount(worlds, minlength=self.n_worlds)
        space = self.births.space(np.bincount(self.population.bodies.world, minlength=self.n_worlds))
        limits, update = self.mission.limits, self.mission.update
        for world in map(int, np.flatnonzero(self.running & (n_asked > space))):
            text = (
                f"plugins ask for {n_asked[world]:,} more entities, and there is room for {max(0, space[world]):,}: with "
                f"update={update!r} a world holds {limits.most_rows(update):,}; for a mission you trust there is allow_large"
            )
            self.record_failure(world, self._own_error(world, text))

    def _own_error(self, world: int, text: str) -> PluginError:
        """What ends a world although no plugin has raised."""
        return PluginError(text, step=int(self.context.clock.step[world]), world=world)

    def repack(self, gone: np.ndarray | None, new: Bodies | None) -> None:
        """Remove rows (gone, (n,), true) and add newborn ones."""
        index = self.population.repack(gone, new)
        bodies = self.population.bodies
        self.world_view.reset(bodies, 0, bodies.n)
        for referee in self.referees:
            referee.rearrange(index)
        self.step_end.rows_changed()
        if new is not None:
            self.population.begin_rows(index)
            if self.events:
                self.events.births(new)

    def after_restore(self) -> None:
        """The table has been put back: views and checks look at it."""
        self.n_running = int(self.running.sum())
        bodies = self.population.bodies
        self.world_view.reset(bodies, 0, bodies.n)
        self.step_end.rows_changed()

    # -- the end of a step ----------------------------------------------------------------------------------------------------

    def take_over_moves(self, phase: float = 1.0) -> None:
        """Motion models take over the rows that world plugins have moved; beliefs follow with the next reading of their sensor."""
        view = self.world_view
        if not view.moved:
            return
        rows = np.unique(np.concatenate(view.moved))
        view.moved = []
        for group in self.population.groups:
            mine = rows[(rows >= group.first) & (rows < group.last)] - group.first
            if len(mine):
                group.moving.begin(group.motion.plugin, phase)
                try:
                    group.from_body(mine)
                except Exception as error:
                    raise failure.in_call(error, group.motion.plugin, group.moving, group) from error

    def _set_common_step(self) -> None:
        steps = np.unique(self.context.clock.step[self.running])
        self.context.clock.common = int(steps[0]) if len(steps) == 1 else -1

    # -- failures -------------------------------------------------------------------------------------------------------------

    def record_failure(self, world: int, error: PluginError) -> None:
        if self.on_error == "raise":
            raise error
        if self.failed[world]:
            return
        self.failed[world] = self.step_end.has_failures = True
        self.results[world] = WorldResult(
            world, int(self.context.seeds[world]), "error", 0, 0.0, {}, error=error
        )
        if self.failed.all() and self._raises_when_all_fail:
            raise error

    # -- from outside -----------------------------------------------------------------------------------------------------------

    def read(self, path: str) -> tuple[np.ndarray, np.ndarray]:
        """A column by path: "predator.pos" -> values (n_worlds, capacity, 3) and who lives (n_worlds, capacity), by place in block.

        The capacity is the block's count, and more only where plugins ask for births beyond it. Who is dead or unborn reads NaN, -1 in
        whole numbers, false in truth values. Of a ragged column each item is the entity's list, (k, m) or (m,), None where nobody lives.

        Paths: "block.pos", "block.Plugin.column", and for world plugins "SimpleCaptureMetrics.captures" -> (n_worlds, ...), all true.
        """
        return access.read(self, path)

    def write(self, path: str, values: Any) -> None:
        """Set a column by path, shaped as `read` gives it; rows of the dead are ignored. A parameter is set for now, not for resets."""
        access.write(self, path, values)

    def publish(
        self,
        type_: type[Message],
        worlds: Iterable[int] | None = None,
        *,
        network: str = "",
        topic: str = "",
        **fields: Any,
    ) -> None:
        """Say something to the plugins from outside, between two steps: part of the next step, in the name of the world (sender 0).

        World plugins read it in that step, entities hear it in the one after, as all messages.

        Args:
            type_: The message type.
            worlds: Worlds that it is said in; by default all that are running.
            network: The network that carries it; by default the one that reaches everyone.
            topic: By default the type's name.
            **fields: Of the message; one value, or one per world along the last axis.

        Raises:
            ParameterError: There is no such world, or the type has no such field.
            WiringError: There is no such network, or the topic carries another type.
        """
        chosen = (
            np.arange(self.n_worlds)[self.running] if worlds is None else np.array(list(worlds), np.int64)
        )
        if len(chosen) and (chosen.min() < 0 or chosen.max() >= self.n_worlds):
            raise ParameterError(f"publish: there are worlds 0 to {self.n_worlds - 1}, not {chosen.tolist()}")
        batch = Batch.make(type_, chosen, np.zeros(len(chosen), np.int64), fields)
        self.mail.topic(network, topic or type_.__name__, type_, "publish").add(
            batch.take(np.flatnonzero(self.running[chosen]))
        )

    def snapshot(self) -> access.Snapshot:
        """All columns, and nothing else. `restore` goes back to it: the same future, bit for bit."""
        return access.snapshot(self)

    def restore(self, snapshot: access.Snapshot) -> None:
        """Go back to a snapshot of this simulation or of one like it.

        Raises:
            SnapshotError: It belongs to another mission or number of worlds.
        """
        access.restore(self, snapshot)

    def result(self) -> list[WorldResult]:
        """Result of each world, as it stands now for those that go on."""
        return [
            r if r is not None and not self.running[w] else access.world_result(self, w, "")
            for w, r in enumerate(self.results)
        ]

    def state_hash(self, world: int = 0) -> str:
        """Hash of all columns of one world: equal states, and only these, have equal hashes."""
        done = self.results[world]
        return (
            done.state_hash
            if done is not None and not self.running[world]
            else access.state_hash(self, world)
        )

    @property
    def grade(self) -> str:
        """What is promised of the result's bits: that of its weakest plugin."""
        plugins = [b.plugin for g in self.population.groups for b in g.walk()] + [
            r.plugin for r in self.referees
        ]
        return max((type(p).grade for p in plugins), key=GRADES.index, default="portable")

    def describe(self) -> str:
        """The step as a printed list, with the channels that have several writers, and the grade."""
        lines = [
            f"{self.mission.name or 'mission'}: {self.n_worlds} world(s), dt {self.mission.dt:g} s, update {self.mission.update}"
        ]
        lines += [f"{i + 1:4d}  {call.label}" for i, call in enumerate(self.schedule)]
        writers = {(where, c): names for g in self.population.groups for where, c, names in g.wiring.writers}
        lines += [
            f"{where}: channel {c!r} is written by {', then '.join(names)}; the last wins"
            for (where, c), names in writers.items()
        ]
        return "\n".join([*lines, f"grade: {self.grade}"])

    def close(self) -> None:
        """Release all that plugins hold outside the arrays; called by `with`. A second call does nothing."""
        if not self.is_closed:
            self.is_closed = True
            self.population.close_handles()
            self.context.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __del__(self) -> None:
        if getattr(self, "is_closed", True) is False and hasattr(self, "population"):
            self.close()


def _check_seeds(seeds: Iterable[Any]) -> None:
    for seed in seeds:
        if isinstance(seed, bool) or not isinstance(seed, (int, np.integer)):
            raise ParameterError(f"seed {seed!r} is not allowed; it takes a whole number")
