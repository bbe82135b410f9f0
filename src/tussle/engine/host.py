"""Plugins without a mission: bound to rows, a clock and topic ends that the caller drives."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from tussle.api.bodies import Bodies
from tussle.api.clock import Clock
from tussle.api.context import Context
from tussle.api.motion import MotionBody, MotionModel
from tussle.api.world import WorldView
from tussle.columns import Input, State
from tussle.comms import EVERYONE, TopicBuffer
from tussle.engine.group import Binding, Group
from tussle.engine.wiring import written_channels
from tussle.errors import ParameterError, listed, nearest_name
from tussle.messages import Batch, Message
from tussle.mission import Block
from tussle.scene import Scene
from tussle.stock import advise_controllers


class Host:
    """Runs the plugins of one entity (or of n alike) on states that the caller provides: a robot's node, a learner, a test.

    Set `host.pos`, `host.vel`, `host.quat` (component-first, (3, n) or (4, n)), call `step`, read `host.channel("turn_rate")`. With a
    motion model `step` moves the bodies too. Messages come in by `deliver` and go out by `sent`.

    Args:
        autonomy: One or several autonomies.
        controller: One or several controllers.
        sensor: One or several sensors.
        motion: A motion model; None leaves moving to the caller.
        n: Number of rows that have these plugins.
        n_others: Rows of others, which the plugins see; `host.others` is their place in the table.
        dt: Time between calls [s].
        team: Team of the n rows.
        seed: Seed of the draws.
        scene: Origin, ground, boundaries, bases.

    Raises:
        WiringError: The plugins do not fit together.
    """

    def __init__(
        self,
        *,
        autonomy: Any = (),
        controller: Any = (),
        sensor: Any = (),
        motion: MotionModel | None = None,
        n: int = 1,
        n_others: int = 0,
        dt: float = 0.1,
        team: int = 1,
        seed: int = 1,
        scene: Scene | None = None,
    ) -> None:
        if n < 1 or n_others < 0 or not dt > 0.0:
            raise ParameterError(
                f"Host: n = {n}, n_others = {n_others}, dt = {dt} is not allowed; n >= 1, n_others >= 0, dt > 0"
            )
        self.has_motion = motion is not None
        block = Block(
            name="host", team=team, autonomy=autonomy, controller=controller, sensor=sensor,
            motion=motion or _outlet(autonomy, controller),
        )  # fmt: skip
        self.topics: dict[tuple[str, str], TopicBuffer] = {}
        clock = Clock(1, 0.0, dt)
        context = Context(
            clock, np.array([seed], np.uint64), ["host", "others"], scene or Scene(), np.array([team])
        )
        context.topic = self._topic
        self.context = context
        self.bodies = Bodies.empty(n + n_others, 1)
        self.bodies.id[:] = np.arange(1, n + n_others + 1)
        self.bodies.place_in_block[:n] = np.arange(n)
        self.bodies.team[:] = team
        self.bodies.block[n:] = 1
        self.others = slice(n, n + n_others)
        self.group = Group("host", block, context, self.bodies, dt, 1, advise_controllers)
        self.group.table.rearrange(np.full(n, -1))
        self.group.attach(self.bodies, 0)
        self.world_view = WorldView(self.bodies, context)
        self._is_started = False

    @property
    def pos(self) -> np.ndarray:
        """Positions of all rows [m], (3, n + n_others); writable, as vel, quat and team are."""
        return self.bodies.pos

    @property
    def vel(self) -> np.ndarray:
        return self.bodies.vel

    @property
    def quat(self) -> np.ndarray:
        return self.bodies.quat

    @property
    def team(self) -> np.ndarray:
        return self.bodies.team

    @property
    def t(self) -> float:
        """Time of the next call [s]."""
        return float(self.context.clock.t[0])

    def start(self) -> None:
        """Set parameters and begin with the states that are there now; `step` does it when it is called first."""
        group, rows = self.group, np.arange(self.group.n)
        self.bodies.touch(0, self.bodies.n)
        for binding in group.walk():
            for name, column in type(binding.spec).params().items():
                if column.is_row_data:
                    value = np.asarray(binding.spec.values[name])
                    group.table.array(binding.places[name])[:] = value[:, None] if value.ndim else value
        for binding in group.bindings:
            binding.attach(group.table)
        for name, place in group.belief.items():
            group.table.array(place)[:] = getattr(self.bodies, name)[..., : group.n]
        group.motion.plugin.from_body(group.moving, rows)
        for binding in group.walk():
            binding.view.caller = binding.plugin
            binding.plugin.spawn(binding.view, rows)
        self._is_started = True

    def step(self) -> None:
        """One call of every plugin in the order of a mission's step: autonomies, controllers, motion, sensors."""
        if not self._is_started:
            self.start()
        self.bodies.touch(0, self.bodies.n)
        group = self.group
        for binding in [*group.autonomies, *group.controllers]:
            self._call(binding)
        if self.has_motion:
            group.advance(self.context.clock.dt, 1)
        for binding in group.sensors:
            self._call(binding)
        self.context.clock.step += 1

    def _call(self, binding: Binding) -> None:
        binding.view.caller = binding.plugin
        binding.pull(self.group.table)
        binding.plugin.step(binding.view)
        binding.push(self.group.table)
        for topic in self.topics.values():
            for inbox in topic.inboxes:
                if any(value is inbox for value in binding.plugin.__dict__.values()):
                    inbox.clear()

    def channel(self, name: str) -> np.ndarray:
        """What the last stage writes on a channel, (n,).

        Raises:
            ParameterError: Nobody writes it.
        """
        motion = self.group.motion
        channels = {
            c: (k, i)
            for k, column in type(motion.spec).inputs().items()
            for i, c in enumerate(column.channels)
        }
        if name not in channels:
            raise ParameterError(
                f"nobody writes channel {name!r}{nearest_name(name, channels)}; {listed(channels)}"
            )
        attribute, i = channels[name]
        array = self.group.table.array(motion.places[attribute])
        return np.array(array[i] if array.ndim == 2 else array)

    def deliver(
        self,
        type_: type[Message],
        sender: Iterable[int] = (0,),
        network: str = "GlobalNetwork",
        **fields: Any,
    ) -> None:
        """Hand messages to all rows that subscribe to the type, one per sender id; they read them in their next call."""
        ids = np.array(list(sender), np.int64)
        topic = self._topic(network, type_.__name__, type_, "host")
        topic.add(Batch.make(type_, np.zeros(len(ids), np.int64), ids, fields))
        topic.post(topic.outbox(), EVERYONE, np.zeros(len(ids), np.int64))
        topic.clear_outbox()
        topic.deliver(self.context.clock.step)

    def sent(self, type_: type[Message]) -> Batch:
        """Messages of a type that the plugins have published since this was asked last."""
        found = [t.outbox() for t in self.topics.values() if t.type is type_ and t.sent]
        for topic in self.topics.values():
            if topic.type is type_:
                topic.clear_outbox()
        return Batch.concatenate(found) if found else Batch.empty(type_)

    def _topic(self, network: str, name: str, type_: type[Message], where: str) -> TopicBuffer:
        return self.topics.setdefault((network, name), TopicBuffer(network, name, type_))


def _outlet(autonomy: Any, controller: Any) -> MotionModel:
    """A motion model that reads every channel of the last stage and moves nothing: its inputs are the caller's outputs."""
    stages = [p for p in _as_list(controller) if not p.passthrough][-1:] or _as_list(autonomy)
    units: dict[str, str] = {}
    for plugin in stages:
        for _, column in written_channels(plugin):
            units.update(zip(column.channels, column.units, strict=True))
    body: dict[str, Any] = {name: Input(unit=unit, optional=True) for name, unit in units.items()}
    made = type("Outlet", (_Outlet,), {"__doc__": _Outlet.__doc__, **body})
    return made()  # type: ignore[no-any-return]


def _as_list(value: Any) -> list[Any]:
    return list(value) if isinstance(value, (list, tuple)) else [value]


class _Outlet(MotionModel):
    """Where the channels of a hosted entity end; the caller moves it."""

    grade = "portable"
    atomic = True
    x = State("still", doc="Nothing.")

    @staticmethod
    def advance(x: Any, u: Any, p: Any, dt: float, substeps: int) -> None:
        """Nothing moves."""

    def from_body(self, body: MotionBody, rows: np.ndarray) -> None:
        """Nothing to take over."""

    def to_body(self, body: MotionBody) -> None:
        """Nothing to publish."""
