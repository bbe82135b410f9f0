"""A stack of worlds that plays one mission."""

from __future__ import annotations

import threading
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from tussle.api.plugin import GRADES
from tussle.columns import Handle
from tussle.engine import access
from tussle.engine.arrivals import give_birth, reset
from tussle.engine.result import WorldResult
from tussle.engine.schedule import Call, compose
from tussle.engine.snapshot import Snapshot, restore, snapshot, state_hash
from tussle.engine.state import SimulationState
from tussle.engine.step_end import take_out_dead, world_result
from tussle.errors import MissionError, ParameterError, PluginError
from tussle.messages import Message, Messages
from tussle.mission import Mission

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

    Attributes:
        state: All data; what the methods here do is done by functions of it.
        observers: Called with the simulation at the beginning of each step.
        events: Who is told of births, deaths, captures, collisions and ends.

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
        numbers = list(seeds) if isinstance(seeds, Iterable) else [seeds]
        if isinstance(threads, bool) or int(threads) != threads or threads < 1:
            raise ParameterError(f"threads = {threads!r} is not allowed; it takes a whole number >= 1")
        self._check(mission, numbers, on_error)
        self.mission, self.n_worlds = mission, len(numbers)
        self.observers: list[Callable[[Simulation], None]] = []
        self.is_closed = False
        self._resumed = threading.Event()
        self._resumed.set()
        self.state = SimulationState(mission, numbers, params or {}, threads, on_error, start_from)
        self.events = self.state.events
        self.events.on_change = self.state.population.on_new_group = self._forget_schedule
        try:
            self.reset(range(self.n_worlds))
            self._schedule: list[Call] | None = compose(self.state)
            for text in self.state.message_bus.unheard():
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

    def _forget_schedule(self) -> None:
        self._schedule = None

    # -- running ------------------------------------------------------------------------------------------------------------

    @property
    def t(self) -> np.ndarray:
        """Time of each world [s], (n_worlds,)."""
        return self.state.context.clock.t

    @property
    def steps(self) -> np.ndarray:
        """Steps made by each world, (n_worlds,)."""
        return self.state.context.clock.step.copy()

    @property
    def is_over(self) -> bool:
        """No world is running."""
        return self.state.n_running == 0

    @property
    def schedule(self) -> list[Call]:
        """The calls of a step, in order."""
        if self._schedule is None:
            self._schedule = compose(self.state)
        return self._schedule

    def step(self, n: int = 1) -> None:
        """Make n steps in all running worlds; none where all have ended.

        Raises:
            PluginError: With on_error="raise", a plugin failed.
        """
        for _ in range(n):
            if not self.state.n_running:
                return
            self._step()

    def _step(self) -> None:
        state = self.state
        try:
            if state.births.has_rates or state.world_view.births:
                give_birth(state)
            if self.observers and not self.events.is_replaying:
                for observer in self.observers:
                    observer(self)
            for call in self.schedule:
                call.run()
        except PluginError as error:
            self._stop(error)

    def _stop(self, error: PluginError) -> None:
        """An exception ends the stack."""
        state = self.state
        if state.on_error == "record" and not state.raises_when_all_fail:
            for world in np.flatnonzero(state.running):
                state.record_failure(int(world), error)
            state.world_view.moved = []
            take_out_dead(state)
            return
        # From here on, so that what is printed is the plugin's own lines and not the way through the engine.
        raise error.with_traceback(None) from error.cause

    def run(self, until: float | None = None) -> list[WorldResult]:
        """Step until all worlds have ended, or have reached the time `until` [s]; waits while paused.

        Returns:
            The result of each world so far.
        """
        state = self.state
        while state.n_running:
            if until is not None and float(self.t[state.running].min()) >= until - 1e-6 * self.mission.dt:
                break
            self._resumed.wait()
            self._step()
        return self.result()

    def run_until(self, condition: Callable[[Simulation], bool]) -> None:
        """Step until condition(self) holds or all worlds have ended."""
        while self.state.n_running and not condition(self):
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
        if len(set(listed_)) < len(listed_) or not set(listed_) <= set(range(self.n_worlds)):
            raise ParameterError(
                f"reset: there are worlds 0 to {self.n_worlds - 1}, each once, not {listed_}"
            )
        if seeds is not None:
            _check_seeds(seeds)
            if len(seeds) != len(listed_):
                raise ParameterError(f"reset: {len(seeds)} seeds for {len(listed_)} worlds")
        reset(self.state, listed_, seeds, params)

    # -- from outside -----------------------------------------------------------------------------------------------------------

    def read(self, path: str) -> tuple[np.ndarray, np.ndarray]:
        """A column by path: "predator.pos" -> values (n_worlds, capacity, 3) and who lives (n_worlds, capacity), by place in block.

        The capacity is the block's count, and more only where plugins ask for births beyond it. Who is dead or unborn reads NaN, -1 in
        whole numbers, false in truth values. Of a ragged column each item is the entity's list, (k, m) or (m,), None where nobody lives.

        Paths: "block.pos", "block.Plugin.column", and for world plugins "SimpleCaptureMetrics.captures" -> (n_worlds, ...), all true.
        """
        return access.read(self.state, path)

    def write(self, path: str, values: Any) -> None:
        """Set a column by path, shaped as `read` gives it; rows of the dead are ignored. A parameter is set for now, not for resets."""
        access.write(self.state, path, values)

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
        running, message_bus = self.state.running, self.state.message_bus
        chosen = np.flatnonzero(running) if worlds is None else np.array(list(worlds), np.int64)
        if len(chosen) and (chosen.min() < 0 or chosen.max() >= self.n_worlds):
            raise ParameterError(f"publish: there are worlds 0 to {self.n_worlds - 1}, not {chosen.tolist()}")
        batch = Messages.make(type_, chosen, np.zeros(len(chosen), np.int64), fields)
        buffer = message_bus.topic(network, topic or type_.__name__, type_, "publish")
        buffer.add(batch.take(np.flatnonzero(running[chosen])))

    def snapshot(self) -> Snapshot:
        """All columns, and nothing else. `restore` goes back to it: the same future, bit for bit."""
        return snapshot(self.state)

    def restore(self, snapshot: Snapshot) -> None:
        """Go back to a snapshot of this simulation or of one like it.

        Raises:
            SnapshotError: It belongs to another mission or number of worlds.
        """
        restore(self.state, snapshot)

    def result(self) -> list[WorldResult]:
        """Result of each world, as it stands now for those that go on."""
        state = self.state
        return [
            r if r is not None and not state.running[w] else world_result(state, w, "")
            for w, r in enumerate(state.results)
        ]

    def state_hash(self, world: int = 0) -> str:
        """Hash of all columns of one world: equal states, and only these, have equal hashes."""
        done, state = self.state.results[world], self.state
        return done.state_hash if done is not None and not state.running[world] else state_hash(state, world)

    @property
    def grade(self) -> str:
        """What is promised of the result's bits: that of its weakest plugin."""
        plugins = [b.plugin for g in self.state.population.groups for b in g.walk()]
        plugins += [r.plugin for r in self.state.world_bindings]
        return max((type(p).grade for p in plugins), key=GRADES.index, default="portable")

    def describe(self) -> str:
        """The step as a printed list, with the channels that have several writers, and the grade."""
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

    def close(self) -> None:
        """Release all that plugins hold outside the arrays; called by `with`. A second call does nothing."""
        if not self.is_closed:
            self.is_closed = True
            self.state.population.close_handles()
            self.state.context.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __del__(self) -> None:
        if getattr(self, "is_closed", True) is False and hasattr(self, "state"):
            self.close()


def _check_seeds(seeds: Iterable[Any]) -> None:
    for seed in seeds:
        if isinstance(seed, bool) or not isinstance(seed, (int, np.integer)):
            raise ParameterError(f"seed {seed!r} is not allowed; it takes a whole number")
