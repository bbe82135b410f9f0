"""A stack of worlds that simulates one mission."""

from __future__ import annotations

import math
import threading
import warnings
import weakref
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from importlib import import_module
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from tussle.api.plugin import GRADES
from tussle.declare.columns import Handle
from tussle.declare.displays import counted, line, listing, page, table
from tussle.declare.messages import Message, Messages
from tussle.documents import Maybe, Real, Whole, check_argument, is_whole
from tussle.engine import access, failure
from tussle.engine.arrivals import reset, spawn_due
from tussle.engine.calls import Schedule
from tussle.engine.delivery import order
from tussle.engine.joined_calls import joined
from tussle.engine.reseed import branch_keys, renew_keys, set_rekeys
from tussle.engine.result import WorldResult
from tussle.engine.rows import place
from tussle.engine.schedule import compose
from tussle.engine.snapshot import Snapshot, restore, snapshot, state_hash
from tussle.engine.state import SimulationState
from tussle.engine.step_end import remove_dead, world_result
from tussle.engine.stiffness import check_stiffness
from tussle.engine.whole_steps import WholeSteps
from tussle.errors import MissionError, ParameterError, PluginError, SnapshotError
from tussle.mission import GivenMission, Mission, mission_of
from tussle.mission.rekeys import Rekeys
from tussle.mission.spec import SHUFFLED
from tussle.notebook_bar import notebook_bar
from tussle.numeric.kernel import refresh_kernels
from tussle.record.inputs import COLUMN, GIVER, ExternalInput, fields_of, given_by, of_message

if TYPE_CHECKING:
    from tussle.record import FirstStates

MAX_SEED = 2**64 - 1


class Simulation:
    """Simulate a mission in a stack of worlds, one world per seed.

    Each world gives bit-identical results alone and in any stack.

    Args:
        mission: The mission, the name of one that ships ("predator_prey"), or a mission file. Notes on a file are warnings.
        seeds: Seed of each world; a single number for a stack of one world. By default the seed of the mission file, or else 1.
        params: Parameters by path ("prey.Boids.gain", "prey.speed", "SimpleCapture.capture_range"); one value, or one per world.
        threads: Number of threads a step may use; results do not depend on it.
        on_error: Handling of an error of one world, for example a state that is not finite: "raise" raises it, "record" ends the world
            with the error in its result while the others continue. By default "raise" for one world and "record" for several.
            An exception in a plugin ends the whole stack: with an explicit "record", it is stored in the results of all running
            worlds; otherwise it is raised.
        start_from: Ids, times of birth and initial states for all worlds, in place of the blocks' placement; see `tussle.read_table`.

    Attributes:
        state: All data of the simulation.
        observers: Functions called with the simulation at the beginning of each step.
        schedule: The calls of a step, in order; `schedule.insert` adds one.
        events: Listeners for births, deaths, captures, collisions and ends of worlds.

    Raises:
        MissionError: There is no such mission, it is invalid, or `seeds` is empty.
        WiringError: The plugins cannot be connected.
        ParameterError: A parameter is unknown, or a value is not allowed.
    """

    def __init__(
        self,
        mission: GivenMission,
        seeds: int | Iterable[int] | None = None,
        params: Mapping[str, Any] | None = None,
        *,
        threads: int = 1,
        on_error: str | None = None,
        start_from: FirstStates | None = None,
    ) -> None:
        mission, seed = mission_of(mission, "Simulation")
        if seeds is None:
            seeds = 1 if seed is None else seed
        numbers = list(seeds) if isinstance(seeds, Iterable) else [seeds]
        check_argument("threads", threads, Whole(1))
        self._check(mission, numbers, on_error)
        refresh_kernels()
        self.mission, self.n_worlds = mission, len(numbers)
        self.observers: list[Callable[[Simulation], None]] = []
        self._inputs: dict[int, dict[int, list[ExternalInput]]] = {}
        self.is_closed = False
        self._whole_steps = WholeSteps()
        self._resumed = threading.Event()
        self._resumed.set()
        self.state = SimulationState(mission, numbers, params or {}, threads, on_error, start_from)
        self.state.context.simulation = weakref.ref(self)
        self.state.context.move = partial(place, self.state)
        self.events = self.state.events
        self.schedule = Schedule(partial(compose, self.state), partial(joined, self.state), weakref.ref(self))
        self.events.on_change = self.state.population.on_new_group = self.schedule.forget
        try:
            self.reset(range(self.n_worlds))
            _ = self.schedule.calls
            check_stiffness(self.state)
            absent = () if mission.is_from_file else mission.absent_teams()
            for text in (*self.state.message_bus.network_mismatches(), *absent):
                warnings.warn(text, RuntimeWarning, stacklevel=2)
        except Exception:
            self.close()
            raise

    def _check(self, mission: Mission, seeds: Sequence[Any], on_error: str | None) -> None:
        if not seeds:
            raise MissionError("seeds is empty; it takes one or more numbers")
        _check_seeds(seeds)
        if mission.reseed is not None and mission.reseed_time is None:
            raise MissionError(f"mission: reseed = {mission.reseed!r} needs a reseed_time")
        if on_error not in (None, "raise", "record"):
            raise ParameterError(f"on_error = {on_error!r} is not allowed; it is 'raise' or 'record'")
        if mission.update in SHUFFLED and len(seeds) > 1:
            raise MissionError(
                f"update={mission.update!r} takes one world at a time, not a stack of {len(seeds)}"
            )
        for plugin in [*mission.world_plugins, *(p for b in mission.blocks for p in b.plugins)]:
            most = Handle.most_worlds(plugin)
            if most is not None and len(seeds) > most:
                raise MissionError(
                    f"{plugin.instance_name} supports at most {most} worlds in one stack, not {len(seeds)}"
                )

    # -- running ------------------------------------------------------------------------------------------------------------

    @property
    def t(self) -> np.ndarray:
        """Time of each world [s], (n_worlds,)."""
        return self.state.context.clock.t

    @property
    def steps(self) -> np.ndarray:
        """Number of steps completed by each world, (n_worlds,)."""
        return self.state.context.clock.step.copy()

    @property
    def is_over(self) -> bool:
        """True if all worlds have ended."""
        return self.state.n_running == 0

    def step(self, n: int = 1) -> None:
        """Advance all running worlds by n steps.

        Raises:
            ParameterError: `n` is not a whole number >= 0.
            PluginError: A plugin failed, and `on_error` does not record it.
        """
        if n.__class__ is not int or n < 0:
            check_argument("n", n, Whole())
        for _ in range(n):
            if not self.state.n_running:
                return
            self._step()

    def _step(self) -> None:
        state = self.state
        self._whole_steps.begin()
        try:
            if self._inputs:
                self._play_inputs()
            renew_keys(state)
            if state.births.has_rates or state.world_view.births:
                spawn_due(state)
            if self.observers and not self.events.is_replaying:
                for observer in self.observers:
                    observer(self)
            if state.rekeys:
                branch_keys(state)
            for function in self.schedule.functions:
                function()
        except PluginError as error:
            self._stop(error)
        except SystemExit as end:
            self._whole_steps.cut(np.flatnonzero(state.running).tolist())
            raise failure.leaving(end, int(self.steps.max())) from None
        except KeyboardInterrupt:
            self._whole_steps.cut(np.flatnonzero(state.running).tolist())
            raise
        finally:
            self._whole_steps.end()

    def _stop(self, error: PluginError) -> None:
        """End the stack after an exception: record or raise the error."""
        state = self.state
        if state.on_error == "record" and not state.raises_when_all_fail:
            for world in np.flatnonzero(state.running):
                state.record_failure(int(world), error)
            state.world_view.moved = []
            remove_dead(state)
            return
        # The engine's traceback is removed, so that only the plugin's lines are printed.
        raise error.with_traceback(None) from error.cause

    def run(self, until: float | None = None) -> list[WorldResult]:
        """Step until all worlds have ended or reached the time `until` [s]. Waits while paused. In a notebook, a bar shows the progress.

        Returns:
            The result of each world so far.

        Raises:
            ParameterError: `until` is not a number.
            PluginError: As `step`.
        """
        check_argument("until", until, Maybe(Real(-math.inf, math.inf)))
        state, end = self.state, self.mission.end if until is None else until
        with notebook_bar(self.mission.name) as show, self._whole_steps.interruptible() as check_interrupt:
            while state.n_running:
                if until is not None and float(self.t[state.running].min()) >= until - 1e-6 * self.mission.dt:
                    break
                self._resumed.wait()
                self._step()
                check_interrupt()
                if show is not None:
                    show(float(self.t.max()), end, "s")
        return self.result()

    def run_until(self, condition: Callable[[Simulation], bool]) -> None:
        """Step until condition(self) is true or all worlds have ended. Waits while paused."""
        with self._whole_steps.interruptible() as check_interrupt:
            while self.state.n_running and not condition(self):
                self._resumed.wait()
                self._step()
                check_interrupt()

    def pause(self) -> None:
        """Make `run` and `run_until` wait before the next step. `step` is not affected."""
        self._resumed.clear()

    def resume(self) -> None:
        """Let `run` and `run_until` continue."""
        self._resumed.set()

    @property
    def is_paused(self) -> bool:
        return not self._resumed.is_set()

    # -- start and end of worlds ------------------------------------------------------------------------------------------

    def reset(
        self,
        worlds: Iterable[int],
        seeds: Sequence[int] | None = None,
        params: Mapping[str, Any] | None = None,
        rekeys: Sequence[Rekeys] | None = None,
    ) -> None:
        """Restart some worlds, optionally with new seeds and parameters. The other worlds are not affected.

        Args:
            worlds: Numbers of the worlds.
            seeds: New seed of each; by default the previous one.
            params: As in the constructor; one value, or one per item of `worlds`.
            rekeys: For each, pairs of a step and the random key with which the world draws from there on: up to the start of that step
                the game is the same, then it has other luck. With a target as of `Mission` for its draws alone. By default those of the
                mission.

        Raises:
            ParameterError: A world does not exist or is given twice, or a seed or parameter is not allowed.
            MissionError: Re-keys are not in order of their steps, or a number is not allowed.
        """
        numbers = self._world_numbers("reset", worlds, ", each once")
        if seeds is not None:
            _check_seeds(seeds)
            if len(seeds) != len(numbers):
                raise ParameterError(f"reset: {len(seeds)} seeds for {len(numbers)} worlds")
        if rekeys is not None and len(rekeys) != len(numbers):
            raise ParameterError(f"reset: rekeys of {len(rekeys)} for {len(numbers)} worlds")
        set_rekeys(self.state, numbers, rekeys)
        reset(self.state, numbers, seeds, params)
        self._whole_steps.renew(numbers)

    # -- access between steps -----------------------------------------------------------------------------------------------------------

    def read(self, path: str) -> tuple[np.ndarray, np.ndarray]:
        """Return the values of a column by path, and a mask of living entities.

        "predator.pos" gives values (n_worlds, capacity, 3) and a mask (n_worlds, capacity), by place in block. The capacity is the
        block's count; it is larger only if plugins spawn more entities. Dead and unborn entities read NaN, -1 in integer columns and
        false in boolean columns. In a ragged column, each item is the entity's list, (k, m) or (m,), or None without a living entity.

        Paths: "block.pos", "block.Plugin.column", and for world plugins "SimpleCaptureMetrics.captures" -> (n_worlds, ...), with a mask
        of true values.
        """
        return access.read(self.state, path)

    def write(self, path: str, values: Any) -> None:
        """Set a column by path, with values shaped as from `read`. Rows of dead entities are ignored. A reset discards parameter values."""
        written = access.write(self.state, path, values)
        for world in np.flatnonzero(self.state.running).tolist() if self._is_told else ():
            self._tell(world, ExternalInput(self._step_of(world), COLUMN, path, written[world].tolist()))

    def publish(
        self,
        type_: type[Message],
        worlds: Iterable[int] | None = None,
        *,
        network: str = "",
        topic: str = "",
        receivers: Iterable[int] = (),
        **fields: Any,
    ) -> None:
        """Publish a message between two steps, with the world as sender (sender 0).

        World plugins read it in the next step; entities receive it in the step after, like all messages.

        With `receivers`, it is an order to some entities: they receive it then, whatever the network would do with it, and nobody else.

        Args:
            type_: Message type.
            worlds: Worlds to publish it in; by default all running worlds. Worlds that have ended are skipped.
            network: Instance name of the network that carries it; by default the network that reaches everyone.
            topic: Name of the topic; by default the name of the type.
            receivers: Ids of the entities that get it; by default whoever the network reaches.
            **fields: Fields of the message; one value, or one per world along the last axis.

        Raises:
            ParameterError: A world, a field or an entity that one names does not exist, nor an entity of `receivers`, or it does not
                subscribe to the topic.
            WiringError: The network does not exist, or the topic has another message type.
        """
        self._publish(type_, worlds, network, topic, receivers, fields)

    def _publish(
        self,
        type_: type[Message],
        worlds: Iterable[int] | None,
        network: str,
        topic: str,
        receivers: Iterable[int],
        fields: dict[str, Any],
        *,
        is_repeated: bool = False,
    ) -> None:
        """Publish as `publish`; the ids in the fields of a message that is repeated are not checked."""
        running, message_bus = self.state.running, self.state.message_bus
        if worlds is None:
            chosen = np.flatnonzero(running)
        else:
            chosen = np.array(self._world_numbers("publish", worlds), np.int64)
        ids = _whole_numbers("publish: receivers", receivers, "a list of ids")
        batch = Messages.make(type_, chosen, np.zeros(len(chosen), np.int64), fields)
        buffer = message_bus.topic(network, topic or type_.__name__, type_, "publish")
        sent = batch.take(np.flatnonzero(running[chosen]))
        order(self.state, buffer, sent, ids, is_repeated=is_repeated)
        for number, world in enumerate(sent.world.tolist()) if self._is_told else ():
            self._tell(world, of_message(sent, number, self._step_of(world), network, topic, ids))

    def _check_world(self, where: str, world: int) -> None:
        if not (is_whole(world) and 0 <= world < self.n_worlds):
            raise ParameterError(
                f"{where}: world = {world!r} is not allowed; there are worlds 0 to {self.n_worlds - 1}"
            )

    def _world_numbers(self, where: str, worlds: Iterable[int], each: str = "") -> list[int]:
        """Return numbers of worlds as a list, checked; with `each`, none may be there twice."""
        allowed = f"a list of numbers from 0 to {self.n_worlds - 1}{each}"
        found = _whole_numbers(f"{where}: worlds", worlds, allowed)
        if not all(0 <= w < self.n_worlds for w in found) or (each and len(set(found)) < len(found)):
            raise ParameterError(f"{where}: worlds = {list(found)} is not allowed; it takes {allowed}")
        return list(found)

    @property
    def _is_told(self) -> bool:
        """Whether listeners are told what comes from outside."""
        return bool(self.events.inputs) and not self.events.is_replaying

    def _step_of(self, world: int) -> int:
        return int(self.state.context.clock.step[world])

    def _tell(self, world: int, given: ExternalInput) -> None:
        told = replace(given, by=GIVER.get())
        for listener in self.events.inputs:
            listener(world, told)

    def play_inputs(self, inputs: Iterable[ExternalInput], world: int = 0) -> None:
        """Let what came from outside in another game come into a world again, each before its step, also after a reset or `restore`.

        `tussle.record.load_inputs` reads them from a run directory. A second call replaces those of the first.

        Raises:
            ParameterError: There is no such world, or an input cannot be repeated because a message held an object.
        """
        self._check_world("play_inputs", world)
        by_step: dict[int, list[ExternalInput]] = {}
        for each in inputs:
            if each.values is None:
                raise ParameterError(
                    f"play_inputs: the message {each.name} before step {each.step} held an object that was not recorded; "
                    "it cannot be repeated"
                )
            by_step.setdefault(each.step, []).append(each)
        self._inputs[world] = by_step

    def play_input(self, given: ExternalInput, world: int = 0) -> None:
        """Repeat one input now.

        Raises:
            ParameterError: There is no such column or message, or its values do not fit.
            WiringError: There is no such network.
        """
        self._check_world("play_input", world)
        with given_by(given.by):
            if given.kind == COLUMN:
                access.write(self.state, given.name, np.array(given.values), world)
                if self._is_told:
                    self._tell(world, replace(given, step=self._step_of(world)))
                return
            type_ = self.state.message_bus.type_of(given.network, given.topic or given.name, given.name)
            fields, to = fields_of(type_, given.values), given.to
            self._publish(type_, [world], given.network, given.topic, to, fields, is_repeated=True)

    def _play_inputs(self) -> None:
        for world, by_step in self._inputs.items():
            for each in by_step.get(self._step_of(world), ()) if self.state.running[world] else ():
                self.play_input(each, world)

    def snapshot(self) -> Snapshot:
        """Copy all columns. After `restore`, the simulation continues bit-identically.

        Raises:
            SnapshotError: A plugin holds objects outside the arrays and cannot save them.
        """
        return snapshot(self.state)

    def restore(self, snapshot: Snapshot) -> None:
        """Restore a snapshot of this simulation, or of one with the same mission and number of worlds.

        Raises:
            SnapshotError: The snapshot has another mission or number of worlds, or blocks that this simulation has no group for.
        """
        restore(self.state, snapshot)
        self._whole_steps.renew(range(self.n_worlds))

    def result(self, *, is_hashed: bool = True) -> list[WorldResult]:
        """Result of each world; of running worlds, the result so far.

        Args:
            is_hashed: Also the state hash of running worlds, which takes longer than the rest.
        """
        state = self.state
        return [
            r if r is not None and not state.running[w] else world_result(state, w, "", is_hashed)
            for w, r in enumerate(state.results)
        ]

    def state_hash(self, world: int = 0) -> str:
        """Hash of all columns of one world. Equal states have equal hashes; different states have different ones.

        Raises:
            ParameterError: There is no such world.
        """
        self._check_world("state_hash", world)
        result, state = self.state.results[world], self.state
        return (
            result.state_hash if result is not None and not state.running[world] else state_hash(state, world)
        )

    @property
    def grade(self) -> str:
        """Reproducibility grade of the results: the weakest grade of all plugins."""
        plugins = [b.plugin for g in self.state.population.groups for b in g.walk()]
        plugins += [r.plugin for r in self.state.world_bindings]
        return max((type(p).grade for p in plugins), key=GRADES.index, default="portable")

    def describe(self) -> str:
        """Return a text with the calls of a step, the channels with several writers, and the grade."""
        lines = [
            f"{self.mission.name or 'mission'}: {self.n_worlds} world(s), dt {self.mission.dt:g} s, update {self.mission.update}"
        ]
        lines += [f"{i + 1:4d}  {call.label}" for i, call in enumerate(self.schedule)]
        groups = self.state.population.groups
        writers = {(where, c): names for g in groups for where, c, names in g.wiring.writers}
        lines += [
            f"{where}: channel {c!r} is written by {', then '.join(names)}; the last wins"
            for (where, c), names in writers.items()
        ]
        return "\n".join([*lines, f"grade: {self.grade}"])

    def __repr__(self) -> str:
        return line("Simulation", repr(self.mission.name) if self.mission.name else "", *self._facts())

    def _facts(self) -> tuple[str, ...]:
        """What `repr` says of worlds, seeds, time, entities and ends."""
        state, t = self.state, self.t
        span = f"t = {t.min():.6g} s" if t.min() == t.max() else f"t = {t.min():.6g} to {t.max():.6g} s"
        bodies = state.population.bodies
        counts = np.bincount(bodies.block, minlength=len(self.mission.blocks))
        left = listing([f"{block.name} {n:,}" for block, n in zip(self.mission.blocks, counts, strict=False)])
        ends = Counter(r.end for w, r in enumerate(state.results) if r is not None and not state.running[w])
        ended = listing([f"{n:,} by {end}" for end, n in ends.items()])
        seeds = state.context.seeds.tolist()
        return (
            counted(self.n_worlds, "world"), f"seed {seeds[0]}" if len(seeds) == 1 else f"seeds {listing(seeds)}", span, f"left {left}",
            f"ended {ended}" if ended else "", "closed" if self.is_closed else "",
        )  # fmt: skip

    def _repr_html_(self) -> str:
        state, bodies, blocks = self.state, self.state.population.bodies, self.mission.blocks
        counts = np.zeros((self.n_worlds, len(blocks)), np.int64)
        np.add.at(counts, (bodies.world, bodies.block), 1)
        ends = ["running" if state.running[w] or r is None else r.end for w, r in enumerate(state.results)]
        rows = zip(state.context.seeds.tolist(), self.t.tolist(), ends, counts, strict=True)
        head = ("seed", "t [s]", "end", *(block.name for block in blocks))
        title = f"Simulation {self.mission.name}"
        return page(title, self._facts(), table(head, ((seed, t, end, *n) for seed, t, end, n in rows)))

    def view(self, world: int = 0, *, height: int = 520) -> Any:
        """Return an interactive 3D view for a notebook, which plays the simulation, paused at first; see `tussle.view.notebook`.

        Nothing else may step the simulation until `stop()` of the view.

        Args:
            world: Number of the world that is shown.
            height: Height of the view [pixels].

        Raises:
            MissingExtraError: anywidget is not installed.
            ParameterError: A value is not allowed.
        """
        # By name: the engine knows nothing of views, which are above it.
        return import_module("tussle.view.notebook").view_simulation(self, world, height)

    def close(self) -> None:
        """Release threads and all objects that plugins hold outside the arrays. Called at the end of `with`; may be called twice."""
        if not self.is_closed:
            self.is_closed = True
            self.state.population.close_handles()
            self.state.context.close()

    def __reduce__(self) -> Any:
        raise SnapshotError(
            "a simulation is neither copied nor pickled; snapshot() returns its state, which can be, and which "
            "Simulation(mission, seeds).restore(...) continues"
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __del__(self) -> None:
        if getattr(self, "is_closed", True) is False and hasattr(self, "state"):
            self.close()


def _whole_numbers(where: str, given: Any, allowed: str) -> tuple[int, ...]:
    found = (
        given.tolist()
        if isinstance(given, np.ndarray)
        else list(given)
        if isinstance(given, Iterable)
        else None
    )
    if not isinstance(found, list) or not all(map(is_whole, found)):
        raise ParameterError(f"{where} = {given!r:.60} is not allowed; it takes {allowed}")
    return tuple(map(int, found))


def _check_seeds(seeds: Any) -> None:
    if not isinstance(seeds, Iterable) or isinstance(seeds, (str, bytes, Mapping)):
        raise ParameterError(f"seeds = {seeds!r:.60} is not allowed; it takes a list of numbers")
    for seed in seeds:
        if not (is_whole(seed) and 0 <= seed <= MAX_SEED):
            raise ParameterError(f"seed {seed!r} is not allowed; it takes a whole number from 0 to 2^64 - 1")
