"""A game that can be played forwards and rewound."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from tussle.declare.displays import counted
from tussle.declare.messages import ManualControl, Message, Messages, SpawnEntity
from tussle.engine.delivery import check_order
from tussle.engine.manual import axes_of
from tussle.engine.simulation import Simulation
from tussle.errors import ParameterError, PluginError, TussleError
from tussle.record import Events
from tussle.record.inputs import GIVER, given_by
from tussle.view.alarms import SpecificationAlarms
from tussle.view.curves import GameCurves
from tussle.view.frame import Event, frame_of
from tussle.view.link import OperatorLink, Underway
from tussle.view.orders import birth_fields, setting_inputs
from tussle.view.timeline import History, Timeline

if TYPE_CHECKING:
    from tussle.record import ExternalInput, Recorder

STICK_STEPS = 127
"""Steps of a stick from its middle to its end."""
MAX_EVENTS = 100_000
"""Events up to which collisions are kept."""


@dataclass(frozen=True)
class Setting:
    """A parameter of some entities that is set from outside.

    Attributes:
        step: The step before which it is set.
        path: Plugin and parameter, "GoTo.speed".
        value: The value, or those of its components.
        to: Ids of the entities.
        by: Who set it.
    """

    step: int
    path: str
    value: Any
    to: tuple[int, ...]
    by: str = field(default_factory=GIVER.get)


@dataclass(frozen=True)
class Injection:
    """A message to the plugins from outside.

    Attributes:
        step: The step before which it is published.
        type: The message type.
        network: Its network; "" is the one that reaches everyone.
        topic: Its topic; "" is the type's name.
        fields: Field -> value.
        to: Ids of the entities that get it; () is whoever the network reaches.
        by: Who gave it.
    """

    step: int
    type: type[Message]
    network: str = ""
    topic: str = ""
    fields: dict[str, Any] = field(default_factory=dict)
    to: tuple[int, ...] = ()
    by: str = field(default_factory=GIVER.get)


class Player:
    """Plays one world of a simulation step by step and rewinds it by snapshots; a replay gives the same bits.

    Messages from outside belong to their step and are published again when it is replayed. Observers and listeners of the simulation,
    such as a recorder, are called once for each step, and not during a replay. A message in a step that has been played before, or a
    reset, changes the course of the game: recorders, whose directory holds one game, are closed at the furthest step, and other
    observers see the new course.

    Args:
        simulation: The simulation.
        world: Number of the world that is shown; the game ends with it.
        every: Least simulated time between snapshots [s].
        limit: Memory for snapshots and for frames [B], half of it for each.
        alarms: Specifications that are watched.
        inputs: What came from outside in a recorded run of the game; it comes again until a message takes the game on another course.
        link: Between the people who give orders and the game; by default they come at once.

    Attributes:
        timeline: Snapshots.
        history: Past frames.
        curves: What its quantities were in each step.
        step: Present step of the world.
        injections: Messages and settings from outside, in order of their steps.
        events: Births, deaths, captures, collisions, ends, in order.
        notes: What the user should know, one line each.
        is_broken: A step failed; the game can only be rewound.
    """

    def __init__(
        self,
        simulation: Simulation,
        world: int,
        every: float,
        limit: float,
        alarms: SpecificationAlarms,
        inputs: Sequence[ExternalInput] = (),
        link: OperatorLink | None = None,
    ) -> None:
        self.simulation, self.world, self.alarms = simulation, world, alarms
        dt = float(simulation.state.context.clock.dt)
        self._underway = None if link is None else Underway(link, dt)
        self.timeline = Timeline(simulation, world, every, 0.5 * limit)
        self.history = History(simulation, world, 0.5 * limit)
        self.injections: list[Injection | Setting] = []
        self._inputs: Sequence[ExternalInput] = ()
        self._play_inputs(inputs)
        self.events: list[Event] = []
        self.notes: list[str] = [] if link is None else [f"{link} (--link)"]
        self.curves = GameCurves(simulation, world, self.note)
        self.is_broken = False
        self._has_new_episode = False
        self.step = self._read_step()
        self.first_step = self._furthest_step = self.step
        self._add_first_births()
        simulation.events.listen(self._add_events)
        self._remember()

    def close(self) -> None:
        """Stop listening to the simulation."""
        self.simulation.events.forget(self._add_events)

    def _read_step(self) -> int:
        return int(self.simulation.state.context.clock.step[self.world])

    @property
    def last_step(self) -> int:
        """The furthest step that was reached."""
        return max(self._furthest_step, self.step)

    @property
    def is_over(self) -> bool:
        """The world has ended or a step failed."""
        return self.is_broken or not self.simulation.state.running[self.world]

    # -- forwards ---------------------------------------------------------------------------------------------------------------

    def advance(self) -> None:
        """Make one step, unless the game is over."""
        if self.is_over:
            return
        self._receive()
        sim, step = self.simulation, self.step
        sim.events.is_replaying = step < self._furthest_step
        self._furthest_step = max(self._furthest_step, step + 1)
        try:
            for given in self.injections:
                if given.step == step:
                    self._give(given)
            sim.step()
        except BaseException:
            self.is_broken = True
            raise
        finally:
            sim.events.is_replaying = False
        self.step = self._read_step()
        self._remember()

    def send(self, order: Any, do: Callable[[], None], is_sure: bool = False) -> None:
        """Let an order go over the link, and be carried out when it arrives.

        Args:
            order: What is sent, see `Underway.send`.
            do: Carries it out.
            is_sure: It is not lost.
        """
        if self._underway is None:
            do()
            return
        key = self.simulation.state.context.keys[[self.world]]
        self._underway.send(order, self.step, key, do, is_sure)
        self._receive()

    def _receive(self) -> None:
        """Carry out the orders that arrive now."""
        for do in self._underway.take(self.step) if self._underway else ():
            try:
                do()
            except TussleError as error:
                if isinstance(error, PluginError):
                    raise
                self.note(str(error))

    def _give(self, given: Injection | Setting) -> None:
        """Let what came from outside come now."""
        sim = self.simulation
        if isinstance(given, Setting):
            for written in setting_inputs(sim, self.world, given.path, given.value, given.to):
                sim.play_input(replace(written, by=given.by), self.world)
            return
        with given_by(given.by):
            sim.publish(
                given.type,
                [self.world],
                network=given.network,
                topic=given.topic,
                receivers=given.to,
                **given.fields,
            )

    def catch_up(self) -> bool:
        """Read the state after steps that others made; return whether they have reset the world since the last call."""
        step = self._read_step()
        if step < self.step:
            self._begin_episode(step)
        has_new_episode, self._has_new_episode = self._has_new_episode, False
        self.step = self._furthest_step = step
        self.history.offer(step)
        self.curves.offer(step)
        return has_new_episode

    def _begin_episode(self, step: int) -> None:
        self._has_new_episode = True
        self.events.clear()
        self.history.clear()
        self.curves.clear()
        self.alarms.clear()
        self.step = self.first_step = step

    def rest(self, seconds: float) -> None:
        """Grant time for curves, snapshots and history: the game has waited this long [s]."""
        for part in (self.timeline, self.history, self.curves):
            part.rest(seconds)

    def _remember(self) -> None:
        for part in (self.curves, self.history, self.timeline):
            part.offer(self.step)

    # -- backwards ----------------------------------------------------------------------------------------------------------------

    def wind(self, step: int) -> int:
        """Restore the last snapshot not after a step.

        Returns:
            The step to advance to: the requested one, or the nearest that can be reached.
        """
        step, here = max(step, self.first_step), self.step
        if step == here and not self.is_broken:
            return step
        is_back = step < here or self.is_broken
        if is_back and self.timeline.refusal:
            self.note(f"the game cannot be rewound: {self.timeline.refusal}")
            return here
        if self._underway and (n := self._underway.clear()):
            self.note(
                f"{counted(n, 'order')} on the way did not arrive: the time jumped from step {here} to {step}"
            )
        if is_back and not self.is_broken and here >= self._furthest_step:
            self.timeline.keep(here)  # so that the present can be restored
        nearest = self.timeline.nearest(step)
        if nearest is not None and (is_back or nearest[0] > here):
            self.simulation.restore(nearest[1])
            self.is_broken, self.step = False, nearest[0]
            self.curves.offer(self.step, is_after_gap=True)
        return step

    # -- another course -----------------------------------------------------------------------------------------------------------

    def publish(
        self,
        type_: type[Message],
        network: str,
        topic: str,
        fields: dict[str, Any],
        to: tuple[int, ...] = (),
    ) -> None:
        """Publish a message to the plugins before the next step.

        Raises:
            ParameterError: The type has no such field, or an entity cannot get it.
            WiringError: There is no such network, or the topic carries another type.
        """
        if self.is_over:
            self.note(f"{type_.__name__}: the game is over, so the message is dropped")
            return
        self._check(type_, network, topic, fields, to)
        self._take_course()
        self.injections.append(Injection(self.step, type_, network, topic, fields, to))

    def set_parameter(self, path: str, value: Any, to: tuple[int, ...]) -> None:
        """Set a parameter of some entities before the next step.

        Raises:
            ParameterError: An entity does not exist or has no such parameter, or the value is not allowed.
        """
        if self.is_over:
            self.note(f"{path}: the game is over, so it is not set")
            return
        setting_inputs(self.simulation, self.world, path, value, to)
        self._take_course()
        self.injections.append(Setting(self.step, path, value, to))

    def spawn(self, block: str, pos: np.ndarray) -> None:
        """Ask for an entity of a block at a position [m], (3,).

        Raises:
            ParameterError: There is no such block, the world has no space, or an interaction rejects the position.
        """
        asked = [g for g in self.injections if isinstance(g, Injection) and g.type is SpawnEntity]
        n_asked = sum(given.step == self.step for given in asked)
        self.publish(SpawnEntity, "", "", birth_fields(self.simulation, self.world, block, pos, n_asked))

    def drive(self, who: int, sticks: Sequence[float]) -> None:
        """Drive an entity from the next step on, with deflections ahead, left and up from -1 to 1.

        Raises:
            ParameterError: There is no such entity, or it cannot be driven.
        """
        population = self.simulation.state.population
        (row,) = population.bodies.rows_of(np.array([self.world]), np.array([who]))
        group = next((g for g in population.groups if g.first <= row < g.last), None)
        if self.is_over or group is None:
            raise ParameterError(f"drive: world {self.world} has no entity {who} now")
        if not axes_of(group):
            raise ParameterError(f"drive: entity {who} has no channel that sticks can drive")
        wanted = [round(max(-1.0, min(1.0, stick)) * STICK_STEPS) / STICK_STEPS for stick in sticks]
        last = self._last_stick(who)
        is_held = last is not None and last.fields["is_on"] and last.step <= self.step
        if last is not None and is_held and last.fields["sticks"].tolist() == wanted:
            return
        self._take_course(who)
        self._put_sticks(self.step, who, wanted)

    def release(self, who: int) -> None:
        """Give an entity back to its autonomies, after the furthest step that was played."""
        last = self._last_stick(who)
        if last is not None and last.fields["is_on"] and not self.is_over:
            self._put_sticks(self.last_step, who, None)

    def _last_stick(self, who: int) -> Injection | None:
        mine = (g for g in reversed(self.injections) if isinstance(g, Injection) and g.type is ManualControl)
        return next((g for g in mine if g.fields["entity"] == who), None)

    def _put_sticks(self, step: int, who: int, sticks: list[float] | None) -> None:
        """At most one `ManualControl` of an entity comes before a step."""
        if (last := self._last_stick(who)) is not None and last.step == step:
            self.injections.remove(last)
        fields = {"entity": who, "is_on": sticks is not None, "sticks": np.array(sticks or [0.0] * 3)}
        self.injections.append(Injection(step, ManualControl, fields=fields))

    def _take_course(self, driven: int = 0) -> None:
        """Drop what lies in the future: something comes from outside before the next step.

        Nobody holds the sticks of entities that were driven then; they go back to their autonomies, but for the one that is `driven` now.
        """
        step = self.step
        is_new = step < self._furthest_step or any(given.step >= step for given in self._inputs)
        if dropped := [given for given in self._inputs if given.step >= step]:
            self._play_inputs([given for given in self._inputs if given.step < step])
            self.note(
                f"{counted(len(dropped), 'recorded input')} after this moment will not come: the game takes another course"
            )
        if step < self._furthest_step:
            self._end_recordings()
            for part in (self.timeline, self.history, self.curves, self.alarms):
                part.forget_after(step)
            self.injections[:] = [given for given in self.injections if given.step <= step]
            self._forget_events(step)
            self._furthest_step = step
        for world, who in self.simulation.state.manual if is_new else ():
            if world == self.world and who != driven:
                self._put_sticks(step, who, None)

    def _play_inputs(self, inputs: Sequence[ExternalInput]) -> None:
        self._inputs = inputs
        self.simulation.play_inputs(inputs, self.world)

    def _check(
        self, type_: type[Message], network: str, topic: str, fields: dict[str, Any], to: tuple[int, ...]
    ) -> None:
        """Raise errors of a message now and not in the step."""
        bus, batch = (
            self.simulation.state.message_bus,
            Messages.make(type_, np.array([self.world]), np.zeros(1, np.int64), fields),
        )
        check_order(
            self.simulation.state, bus.topic(network, topic or type_.__name__, type_, "publish"), batch, to
        )

    def reset(self, seed: int | None) -> None:
        """Restart the world, with another seed if one is given."""
        self._end_recordings()
        for part in (self.timeline, self.history, self.curves, self.alarms):
            part.clear()
        self.injections.clear()
        if self._underway:
            self._underway.restart()
        self._play_inputs(())
        self.events.clear()
        self.is_broken = False
        self.simulation.reset([self.world], None if seed is None else [seed])
        self.first_step = self._furthest_step = self.step = self._read_step()
        self._remember()

    def _end_recordings(self) -> None:
        """Close the recorders at the furthest step: the next steps belong to another game."""
        recorders = self._recorders()
        newest = self.timeline.nearest(self._furthest_step)
        if not recorders:
            return
        here = None
        if newest is not None and newest[0] > self.step:
            here = self.simulation.snapshot()
            self.simulation.restore(newest[1])
        for recorder in recorders:
            t = float(self.simulation.t[self.world])
            recorder.close("the game was rewound or restarted, and took another course")
            self.note(
                f"{recorder.directory}: the recording ends at {t:g} s, because the game takes another course"
            )
        if here is not None:
            self.simulation.restore(here)

    def _recorders(self) -> list[Recorder]:
        if not self.simulation.observers:
            return []
        from tussle.record import Recorder

        owners = [getattr(observer, "__self__", None) for observer in self.simulation.observers]
        return [owner for owner in owners if isinstance(owner, Recorder)]

    # -- notes and events --------------------------------------------------------------------------------------------------------

    def note(self, text: str) -> None:
        """Add a note, once."""
        if text not in self.notes:
            self.notes.append(text)

    def _add_first_births(self) -> None:
        frame = frame_of(self.simulation, self.world)
        names = self.simulation.state.context.block_names
        self.events += [
            Event(frame.t, "birth", int(who), 0, names[block])
            for who, block in zip(frame.id, frame.block, strict=True)
        ]

    def _add_events(self, reported: Events) -> None:
        clock = self.simulation.state.context.clock
        for i in range(len(reported)):
            if reported.world[i] != self.world:
                continue
            if len(self.events) >= MAX_EVENTS and reported.kind == "collision":
                self.note(f"collisions after event {MAX_EVENTS} are not kept")
                return
            if reported.step[i] < self.step and not self.simulation.events.is_replaying:
                self._begin_episode(int(reported.step[i]))
            t = float(clock.start + reported.step[i] * clock.dt)
            self.events.append(
                Event(t, reported.kind, int(reported.id[i]), int(reported.other[i]), reported.text[i])
            )

    def _forget_events(self, step: int) -> None:
        clock = self.simulation.state.context.clock
        limit = clock.start + (step - 0.5) * clock.dt
        self.events[:] = [h for h in self.events if h.t < limit]
