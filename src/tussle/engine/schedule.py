"""The step as a list of calls, composed once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np

from tussle.api.plugin import Plugin
from tussle.columns import Publish, Subscribe
from tussle.engine.group import Binding, Group
from tussle.engine.referees import Referee
from tussle.engine.subset import call_group, call_referee
from tussle.errors import ParameterError

if TYPE_CHECKING:
    from tussle.engine.simulation import Simulation


@dataclass(frozen=True, slots=True)
class Call:
    """One line of the schedule: what is done, in words, and the function that does it."""

    label: str
    run: Callable[[], None]


MOST = 10**9
"""Largest denominator of a rate per step: a mission has no more steps, and its product with their number stays within 64 bits."""


def _rate(plugin: Any, dt: float) -> Fraction | None:
    """Calls per step as an exact fraction of the decimal numbers that were written; None for every step.

    Raises:
        ParameterError: It is never called.
    """
    rate = plugin.rate
    if rate is None:
        return None
    per_step = Fraction(str(rate)) * Fraction(str(dt))
    if per_step * MOST < 1:
        least = 1.0 / (MOST * dt)
        raise ParameterError(
            f"{plugin.instance_name}: rate = {rate:g} is not allowed with dt = {dt:g}; it takes at least {least:g} calls per second"
        )
    return None if per_step >= 1 else per_step.limit_denominator(MOST)


def is_due(step: np.ndarray, per_step: Fraction) -> np.ndarray:
    """Whether floor(k p / q) changes from step k - 1 to k, for each world's step."""
    p, q = per_step.numerator, per_step.denominator
    return np.asarray((step * p) // q != ((step - 1) * p) // q)


def _is_outside(binding: Binding) -> bool:
    """Whether a plugin, or one inside it, holds objects that it opens itself, or waits for something."""
    kinds = [type(b.spec) for b in binding.walk()]
    return any(
        k.handles() and (k.open_one is not Plugin.open_one or k.ready is not Plugin.ready) for k in kinds
    )


class Schedule:
    """Composes and guards the calls of one simulation's step.

    Args:
        sim: The simulation.
    """

    def __init__(self, sim: Simulation) -> None:
        self.sim = sim

    def compose(self) -> list[Call]:
        """All calls of a step, in order."""
        sim, calls = self.sim, []
        groups = sim.population.groups
        if sim.mission.update == "sequential":
            for group in groups:
                calls += [self._entity_call("autonomy", group, b) for b in group.autonomies]
                calls += self._motion([group])
        else:
            for group in groups:
                calls += [self._entity_call("autonomy", group, b) for b in group.autonomies]
            calls += self._motion(groups)
        for group in groups:
            for binding in group.sensors:
                calls.append(self._entity_call("sensor", group, binding))
        if sim.interactions and any(g.body_inputs for g in groups):
            calls.append(
                Call("forces back to zero: the motion models have consumed them", self._clear_forces)
            )
        calls += [self._world_call("interaction", r) for r in sim.interactions if not r.plugin.is_idle]
        if sim.interactions:
            calls.append(Call("take over what was moved", sim.take_over_moves))
        calls += [self._world_call("metric", r) for r in sim.metrics if not r.plugin.is_idle]
        if sim.events:
            calls.append(Call("tell of captures and collisions", sim.events.messages))
        calls.append(
            Call("deliver messages", sim.mail.deliver)
        )  # always: the world may speak first on topics of its own
        calls.append(Call("check, remove, end", sim.step_end.run))
        return calls

    def _clear_forces(self) -> None:
        bodies = self.sim.population.bodies
        bodies.force[:] = 0.0
        bodies.torque[:] = 0.0

    def _motion(self, groups: list[Group]) -> list[Call]:
        sim = self.sim
        dt, m = sim.mission.dt, sim.mission.motion_multiplier
        calls = [self._advance_call(g, dt, m) for g in groups if not g.controllers]
        steered = [g for g in groups if g.controllers]
        for s in range(m if steered else 0):
            for group in steered:
                calls += [self._entity_call("controller", group, b, s) for b in group.controllers]
            calls += [self._advance_call(g, dt / m, 1) for g in steered]
        return calls

    # -- guarded calls --------------------------------------------------------------------------------------------------------

    def _advance_call(self, group: Group, dt: float, substeps: int) -> Call:

        def action(some: Group) -> None:
            some.moving.caller = some.motion.plugin
            some.advance(dt, substeps)

        def run() -> None:
            if group.n:
                state = (
                    None
                    if group.motion.plugin.atomic
                    else (group.x.copy(), group.bodies.floats[:, group.first : group.last].copy())
                )
                try:
                    action(group)
                except Exception as error:
                    if state is not None:
                        group.x[:], group.bodies.floats[:, group.first : group.last] = state
                    self._isolate(group, group.motion, error, action)

        if _is_outside(group.motion):
            return Call(
                self._label("motion", group, group.motion),
                lambda: self._world_by_world(group, group.motion, action),
            )
        return Call(self._label("motion", group, group.motion), run)

    def _entity_call(self, kind: str, group: Group, binding: Binding, substep: int = 0) -> Call:
        sim, path = self.sim, binding.path
        clock, dead = sim.context.clock, sim.failed
        per_step = _rate(binding.spec, clock.dt)
        topics = [
            b.plugin.__dict__[k].topic
            for b in binding.walk()
            for k, c in type(b.spec).columns.items()
            if isinstance(c, Publish)
        ]
        inboxes = [
            b.plugin.__dict__[k]
            for b in binding.walk()
            for k, c in type(b.spec).columns.items()
            if isinstance(c, Subscribe)
        ]
        is_outside = _is_outside(binding)
        atomic, linked = binding.plugin.atomic, any(b.links for b in binding.walk())
        view, plugin, table = binding.view, binding.plugin, group.table
        writable = [b.places[k] for b in binding.walk() for k in sorted(b.writable)]

        def action(some: Group) -> None:
            own = next(b for b in some.bindings if b.path == path)
            some_view = own.view
            some_view.caller, some_view.substep = own.plugin, substep
            own.pull(some.table)
            own.plugin.step(some_view)
            own.push(some.table)

        def whole() -> None:
            saved = [] if atomic else [(place, table.array(place).copy()) for place in writable]
            marks = [len(t.sent) for t in topics]
            try:
                view.caller, view.substep = plugin, substep
                if linked:
                    binding.pull(table)
                plugin.step(view)
                if linked:
                    binding.push(table)
            except Exception as error:
                for place, array in saved:
                    table.array(place)[:] = array
                for topic, mark in zip(topics, marks, strict=True):
                    topic.truncate(mark)
                self._isolate(group, binding, error, action)

        def run() -> None:
            due = None if per_step is None else is_due(clock.step, per_step) & ~dead
            if group.n:
                if is_outside:
                    self._world_by_world(group, binding, action, due)
                elif due is None or due.all():
                    whole()
                elif due.any():
                    self._part(group, binding, due, action)
            # Of a group without rows too: who comes later has not heard what was said before
            for inbox in inboxes:
                inbox.clear(due)

        def lean() -> None:
            if group.n:
                view.caller, view.substep = plugin, substep
                try:
                    plugin.step(view)
                except Exception as error:
                    self._isolate(group, binding, error, action)

        is_plain = atomic and per_step is None and not (linked or inboxes or is_outside or topics)
        return Call(self._label(kind, group, binding, substep), lean if is_plain else run)

    def _part(self, group: Group, binding: Binding, due: np.ndarray, action: Callable[[Group], None]) -> None:
        sim = self.sim
        rows = sim.population.bodies.world[group.first : group.last]
        if not due[rows].any():
            return
        marks = self._marks()
        try:
            call_group(sim.population, group, due, action)
        except Exception as error:
            self._forget_messages(marks)
            self._isolate(group, binding, error, action, due)

    def _world_by_world(
        self, group: Group, binding: Binding, action: Callable[[Group], None], due: np.ndarray | None = None
    ) -> None:
        """Call a plugin that holds something outside: what it did there in a call that failed could not be undone and done again."""
        sim = self.sim

        def when_ready(some: Group) -> None:
            sim.await_ready(some, next(b for b in some.bindings if b.path == binding.path))
            action(some)

        for world in np.unique(sim.population.bodies.world[group.first : group.last]):
            if not sim.failed[world] and (due is None or due[world]):
                self._part(group, binding, np.arange(len(sim.running)) == world, when_ready)

    def _isolate(
        self,
        group: Group,
        binding: Binding,
        error: Exception,
        action: Callable[[Group], None],
        due: np.ndarray | None = None,
    ) -> None:
        """A call has failed: find the worlds in which it does, and make it in the others."""
        sim = self.sim
        bodies = sim.population.bodies
        present = [int(w) for w in np.unique(bodies.world[group.first : group.last])]
        if due is not None:
            present = [w for w in present if due[w]]
        worlds = [
            w for w in present if not sim.failed[w]
        ]  # those that have failed in this step are still in the table
        is_only, failed = len(present) == 1, 0
        for world in worlds:
            only = np.zeros(bodies.n_worlds, bool)
            only[world] = True
            row = binding.view.failing_row if is_only else None
            caught: Exception | None = error if is_only else None
            found: list[int | None] = [row]
            if caught is None:
                caught = self._try_alone(group, binding, only, action, found)
            if caught is not None:
                failed += 1
                sim.fail(world, binding.plugin, caught, self._who(group, binding, world, found[0], is_only))
        binding.view.failing_row = None
        if not failed and len(worlds) == len(present):
            raise sim.as_plugin_error(
                error, binding.plugin, "fails in the stack but in none of its worlds alone"
            )

    def _try_alone(
        self,
        group: Group,
        binding: Binding,
        only: np.ndarray,
        action: Callable[[Group], None],
        found: list[int | None],
    ) -> Exception | None:
        def watched(some: Group) -> None:
            own = next(b for b in some.bindings if b.path == binding.path)
            own.view.failing_row = None
            try:
                action(some)
            except Exception:
                found[0] = own.view.failing_row
                raise

        marks = self._marks()
        try:
            call_group(self.sim.population, group, only, watched)
        except Exception as error:
            self._forget_messages(marks)
            return error
        return None

    def _who(self, group: Group, binding: Binding, world: int, row: int | None, is_alone: bool) -> str:
        if row is None:
            return group.name
        bodies = self.sim.population.bodies
        rows = np.flatnonzero(bodies.world[group.first : group.last] == world)
        at = row if is_alone else int(rows[row])
        return f"{group.block_of(at)} {int(bodies.id[group.first + at])}"

    # -- world plugins ----------------------------------------------------------------------------------------------------------

    def _world_call(self, kind: str, referee: Referee) -> Call:
        sim = self.sim
        clock, view, plugin = sim.context.clock, referee.view, referee.plugin
        per_step = _rate(referee.spec, clock.dt)

        def action(some: Referee, w: Any) -> None:
            w.caller = some.plugin
            some.plugin.step(w)

        def run() -> None:
            due = None if per_step is None else is_due(clock.step, per_step) & sim.running
            if due is not None and not due.any():
                return
            saved = None if plugin.atomic else referee.copy()
            floats = None if plugin.atomic else sim.population.bodies.floats.copy()
            marks = self._marks()
            counts = len(view.deaths), len(view.moved), len(view.births)
            try:
                if due is None or due[sim.running].all():
                    view.caller = plugin
                    plugin.step(view)
                else:
                    call_referee(sim.population, referee, due, action)
            except Exception as error:
                if saved is not None and floats is not None:
                    referee.restore(saved)
                    sim.population.bodies.floats[:] = floats
                    sim.population.bodies.touch(0, sim.population.bodies.n)
                self._forget_messages(marks)
                del view.deaths[counts[0] :], view.moved[counts[1] :], view.births[counts[2] :]
                self._isolate_referee(referee, error, action, due)

        def lean() -> None:
            try:
                view.caller = plugin
                plugin.step(view)
            except Exception as error:
                self._isolate_referee(referee, error, action, None)

        is_plain = plugin.atomic and per_step is None
        label = f"{kind:<12} {referee.spec.instance_name}{self._rate_text(referee.spec)}"
        return Call(label, lean if is_plain else run)

    def _marks(self) -> dict[int, int]:
        return {id(topic): len(topic.sent) for topic in self.sim.topics.values()}

    def _forget_messages(self, marks: dict[int, int]) -> None:
        for topic in self.sim.topics.values():
            topic.truncate(marks.get(id(topic), 0))

    def _isolate_referee(
        self,
        referee: Referee,
        error: Exception,
        action: Callable[[Referee, Any], None],
        due: np.ndarray | None,
    ) -> None:
        sim = self.sim
        present = np.flatnonzero(sim.running if due is None else due)
        worlds = [
            int(w) for w in present if not sim.failed[w]
        ]  # those that have failed in this step are still in the table
        failed = 0
        for world in worlds:
            only = np.zeros(len(sim.running), bool)
            only[world] = True
            marks = self._marks()
            try:
                if len(present) == 1:
                    raise error
                call_referee(sim.population, referee, only, action)
            except Exception as caught:
                self._forget_messages(marks)
                failed += 1
                sim.fail(world, referee.plugin, caught, "")
        if not failed and len(worlds) == len(present):
            raise sim.as_plugin_error(
                error, referee.plugin, "fails in the stack but in none of its worlds alone"
            )

    # -- words ----------------------------------------------------------------------------------------------------------------

    def _rate_text(self, plugin: Any) -> str:
        return f" at {plugin.rate:g} Hz" if plugin.rate is not None else ""

    def _label(self, kind: str, group: Group, binding: Binding, substep: int = 0) -> str:
        m = self.sim.mission.motion_multiplier
        part = f" ({substep + 1}/{m})" if kind == "controller" and m > 1 else ""
        place = f" {group.place}" if self.sim.mission.update == "sequential" else ""
        return f"{kind:<12} {group.name}{place}: {binding.spec.instance_name}{self._rate_text(binding.spec)}{part}"
