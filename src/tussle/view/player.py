"""A game that can be played forwards and wound back."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from tussle.engine.simulation import Simulation
from tussle.messages import Message, Messages
from tussle.record import Events
from tussle.view.frame import Event, frame_of
from tussle.view.timeline import History, Timeline

if TYPE_CHECKING:
    from tussle.record import Recorder

MOST_EVENTS = 100_000
"""Events that are kept; collisions beyond that are not."""


@dataclass(frozen=True)
class Injection:
    """Something said to the plugins from outside.

    Attributes:
        step: The step that it is part of.
        type: The message type.
        network: The network that carries it; "" is the one that reaches everyone.
        topic: Its topic; "" is the type's name.
        fields: Field -> value.
    """

    step: int
    type: type[Message]
    network: str = ""
    topic: str = ""
    fields: dict[str, Any] = field(default_factory=dict)


class Player:
    """One world of a simulation, played step by step, wound back by snapshots, and the same bits whenever it is played again.

    What is said from outside is part of the game from its step on and is said again when that step is played again. Observers and
    listeners of the simulation, a recorder for one, are told of each step once: while steps are replayed they hear nothing. When
    something is said in a step that had been played before, or the world begins anew, the game takes another course: recorders, whose
    directory holds one game, are closed as of the furthest step played, and other observers are told of the new course.

    Args:
        simulation: The simulation.
        world: The world that is watched; the game goes on until it ends.
        every: Least simulated time between snapshots [s].
        limit: Memory for snapshots and for frames [B], half of it for each.

    Attributes:
        timeline: Snapshots.
        history: Frames as they went by.
        step: Step that the world is in.
        injections: What was said from outside, in order of its steps.
        events: Births, deaths, captures, collisions, ends, in order.
        notes: What the user should know, one line each.
        is_broken: A step failed; only winding back helps.
    """

    def __init__(self, simulation: Simulation, world: int, every: float, limit: float) -> None:
        self.simulation, self.world = simulation, world
        self.timeline = Timeline(simulation, world, every, 0.5 * limit)
        self.history = History(simulation, world, 0.5 * limit)
        self.injections: list[Injection] = []
        self.events: list[Event] = []
        self.notes: list[str] = []
        self.is_broken = False
        self.step = self._read_step()
        self.first_step = self._told = self.step
        self._tell_of_those_who_are_there()
        simulation.events.listen(self._hear)
        self._remember()

    def close(self) -> None:
        """Leave the simulation as one that nobody watches."""
        self.simulation.events.forget(self._hear)

    def _read_step(self) -> int:
        return int(self.simulation.state.context.clock.step[self.world])

    @property
    def last_step(self) -> int:
        """The furthest step that has been reached."""
        return max(self._told, self.step)

    @property
    def is_over(self) -> bool:
        """The world has ended, or broken."""
        return self.is_broken or not self.simulation.state.running[self.world]

    # -- forwards ---------------------------------------------------------------------------------------------------------------

    def advance(self) -> None:
        """Make one step; none where the game is over."""
        if self.is_over:
            return
        sim, step = self.simulation, self.step
        sim.events.is_replaying = step < self._told
        self._told = max(self._told, step + 1)
        try:
            for said in self.injections and [said for said in self.injections if said.step == step]:
                sim.publish(said.type, [self.world], network=said.network, topic=said.topic, **said.fields)
            sim.step()
        except BaseException:
            self.is_broken = True
            raise
        finally:
            sim.events.is_replaying = False
        self.step = self._read_step()
        self._remember()

    def rest(self, seconds: float) -> None:
        """The game has waited on purpose: time for what is done beside it."""
        self.timeline.rest(seconds)
        self.history.rest(seconds)

    def _remember(self) -> None:
        self.history.offer(self.step)
        self.timeline.offer(self.step)

    # -- backwards ----------------------------------------------------------------------------------------------------------------

    def wind(self, step: int) -> int:
        """Go to the last moment not after a step from which it can be reached by `advance`.

        Returns:
            The step to advance to: the one asked for, or the nearest that can be reached.
        """
        step, here = max(step, self.first_step), self.step
        if step == here and not self.is_broken:
            return step
        is_back = step < here or self.is_broken
        if is_back and self.timeline.refusal:
            self.note(f"the game cannot be wound back: {self.timeline.refusal}")
            return here
        if is_back and not self.is_broken and here >= self._told:
            self.timeline.keep(here)  # so that the present is at hand when it is wanted again
        nearest = self.timeline.nearest(step)
        if nearest is not None and (is_back or nearest[0] > here):
            self.simulation.restore(nearest[1])
            self.is_broken, self.step = False, nearest[0]
        return step

    # -- another course -----------------------------------------------------------------------------------------------------------

    def publish(self, type_: type[Message], network: str, topic: str, fields: dict[str, Any]) -> None:
        """Say something to the plugins: part of the next step.

        Raises:
            ParameterError: The type has no such field.
            WiringError: There is no such network, or the topic carries another type.
        """
        if self.is_over:
            self.note(f"{type_.__name__}: the game is over, and nobody hears it")
            return
        self._check(type_, network, topic, fields)
        step = self.step
        if step < self._told:
            self._end_recordings()
            self.timeline.forget_after(step)
            self.history.forget_after(step)
            self.injections[:] = [said for said in self.injections if said.step <= step]
            self._forget_events(step)
            self._told = step
        self.injections.append(Injection(step, type_, network, topic, fields))

    def _check(self, type_: type[Message], network: str, topic: str, fields: dict[str, Any]) -> None:
        """Say it in no world at all, so that what is wrong with it shows now and not in the step."""
        self.simulation.publish(type_, [], network=network, topic=topic)
        Messages.make(type_, np.zeros(1, np.int64), np.zeros(1, np.int64), fields)

    def reset(self, seed: int | None) -> None:
        """Begin the world anew, with another seed where one is given."""
        self._end_recordings()
        for part in (self.timeline, self.history):
            part.clear()
        self.injections.clear()
        self.events.clear()
        self.is_broken = False
        self.simulation.reset([self.world], None if seed is None else [seed])
        self.first_step = self._told = self.step = self._read_step()
        self._remember()

    def _end_recordings(self) -> None:
        """Close the recorders as of the furthest step: what they have written is one game, and the next steps are another's."""
        recorders = self._recorders()
        newest = self.timeline.nearest(self._told)
        if not recorders:
            return
        here = None
        if newest is not None and newest[0] > self.step:
            here = self.simulation.snapshot()
            self.simulation.restore(newest[1])
        for recorder in recorders:
            t = float(self.simulation.t[self.world])
            recorder.close("the game was wound back or begun anew, and took another course")
            self.note(
                f"{recorder.directory}: the recording ends at {t:g} s, since the game takes another course"
            )
        if here is not None:
            self.simulation.restore(here)

    def _recorders(self) -> list[Recorder]:
        if not self.simulation.observers:
            return []
        from tussle.record import Recorder

        owners = [getattr(observer, "__self__", None) for observer in self.simulation.observers]
        return [owner for owner in owners if isinstance(owner, Recorder)]

    # -- words --------------------------------------------------------------------------------------------------------------------

    def note(self, text: str) -> None:
        """Keep a note, once."""
        if text not in self.notes:
            self.notes.append(text)

    def _tell_of_those_who_are_there(self) -> None:
        frame = frame_of(self.simulation, self.world)
        names = self.simulation.state.context.block_names
        self.events += [
            Event(frame.t, "birth", int(who), 0, names[block])
            for who, block in zip(frame.id, frame.block, strict=True)
        ]

    def _hear(self, told: Events) -> None:
        clock = self.simulation.state.context.clock
        for i in range(len(told)):
            if told.world[i] != self.world:
                continue
            if len(self.events) >= MOST_EVENTS and told.kind == "collision":
                self.note(f"of the collisions, those after the {MOST_EVENTS}th event are not kept")
                return
            t = float(clock.start + told.step[i] * clock.dt)
            self.events.append(Event(t, told.kind, int(told.id[i]), int(told.other[i]), told.text[i]))

    def _forget_events(self, step: int) -> None:
        clock = self.simulation.state.context.clock
        limit = clock.start + (step - 0.5) * clock.dt
        self.events[:] = [h for h in self.events if h.t < limit]
