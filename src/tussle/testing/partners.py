"""Partner plugins of the conformance kit's game: they exchange values and messages with the tested plugin and disturb its worlds."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from tussle.api import (
    Autonomy,
    Behavior,
    EntityRef,
    Field,
    GroupView,
    Handle,
    Input,
    Interaction,
    Message,
    Messages,
    MotionBody,
    MotionModel,
    Output,
    Param,
    Publish,
    RaggedColumn,
    Sensor,
    State,
    Subscribe,
    WorldView,
)
from tussle.declare.columns import Channel, Numbers
from tussle.numeric.quaternion import quat_from_euler

AMPLITUDES = {"m": 40.0, "m/s": 8.0, "rad": 1.0, "rad/s": 0.8, "m/s^2": 3.0}
"""Typical values of small robots, by unit; 1 for all other units."""


class KitMessage(Message):
    """Message type of the kit."""

    number = Field(doc="Any number.")
    target = EntityRef(doc="Entity nearest to the sender.")


def signal(entity: Any, step: Any, number: Any) -> np.ndarray:
    """A number in [-1, 1) that differs between entities, steps and numbers; bit-identical on every machine."""
    phase = 0.6180339887498949 * entity + 0.1357913579 * step + 0.3819660112501051 * number
    return np.asarray(2.0 * (phase - np.floor(phase)) - 1.0)


def squash(x: np.ndarray) -> np.ndarray:
    """Map x to (-1, 1), so that every bit of x has an effect; NaN where x is not finite, so that it is noticed."""
    return np.asarray(x / (1.0 + np.abs(x)))


def write_signals(plugin: Any, g: GroupView, variation: np.ndarray) -> None:
    """Fill all outputs with signals of the amplitudes of their units, plus a small part of `variation`, (n,)."""
    number = 0
    for name, column in plugin.outputs().items():
        if column.ragged:
            number += 1
            plugin.__dict__[name].set(*_made_lists(column, g, number))
            continue
        for values, unit in zip(np.atleast_2d(plugin.__dict__[name]), column.units, strict=True):
            number += 1
            size = AMPLITUDES.get(unit, 1.0)
            values[:] = size * (0.8 * signal(g.id, g.step_count, number) + 0.1 * squash(variation))


def _made_lists(column: Channel, g: GroupView, number: float) -> tuple[np.ndarray, np.ndarray]:
    """Start and items of lists with 0 to 2 signals per row."""
    row = np.repeat(np.arange(g.n), (g.id + g.step_count) % 3)
    size = np.array([AMPLITUDES.get(unit, 1.0) for unit in column.units])[:, None]
    items = size * signal(g.id[row], g.step_count[row], number + 0.1 * np.arange(len(size))[:, None])
    return np.searchsorted(row, np.arange(g.n + 1)), items if column.fields else items[0]


def extended_squash(data: np.ndarray) -> np.ndarray:
    """`squash` for values that may be infinite, or nan, for a reason, such as the range of a ray that meets nothing."""
    return squash(np.clip(np.nan_to_num(data, nan=0.5, posinf=np.inf, neginf=-np.inf), -1e300, 1e300))


def row_signal(values: Any) -> np.ndarray:
    """A number per row that depends on all numbers of an input, (n,)."""
    if isinstance(values, RaggedColumn):
        values = values.sum(extended_squash(values.data))
    return np.asarray(sum(extended_squash(line) for line in np.atleast_2d(values)))


def can_fill(message: type[Message]) -> bool:
    """Return True if the kit can fill messages of this type: not if they hold opaque objects."""
    return not any(isinstance(column, Handle) for column in message.fields.values())


def filled(message: type[Message], g: GroupView, rows: np.ndarray, nearest: np.ndarray) -> dict[str, Any]:
    """Fields of one message from each of `rows` about the entity in body row `nearest`, (m,).

    The first of several references, and of several teams, is that of the sender.
    """
    refs = [name for name, column in message.fields.items() if isinstance(column, EntityRef)]
    teams = [name for name in message.fields if "team" in name]
    out: dict[str, Any] = {}
    for number, (name, column) in enumerate(message.fields.items()):
        value = signal(g.id[rows], g.step_count[rows], number + 0.5)
        if isinstance(column, EntityRef):
            out[name] = g.id[rows] if len(refs) > 1 and name == refs[0] else g.bodies.id[nearest]
        elif name in {"pos", "vel", "quat"}:
            out[name] = getattr(g, name)[:, rows]
        elif "team" in name:
            out[name] = g.team[rows] if name == teams[0] else g.bodies.team[nearest]
        elif isinstance(column, Field) and column.ragged:
            shape = (*column.shape, 2)
            out[name] = RaggedColumn.from_rows([np.full(shape, 10.0 * v) for v in value], column)
        elif isinstance(column, Numbers):
            size = np.array([AMPLITUDES.get(unit, 1.0) for unit in column.units])
            numbers = size[:, None] * value if column.shape else size[0] * value
            out[name] = numbers > 0.0 if column.dtype is bool else numbers.astype(column.dtype)
    return out


def message_signal(batch: Messages) -> np.ndarray:
    """A number per message that depends on all of its numbers, (n,)."""
    total = signal(batch.sender, 0.0, 1.0)
    for name, column in batch.type.fields.items():
        if isinstance(column, Field) and column.ragged:
            lists = batch.data[name]
            total = total + row_signal(lists.sum(extended_squash(lists.data)))
        elif isinstance(column, (Field, EntityRef)):
            for values in np.atleast_2d(batch.data[name]):
                total = total + squash(values.astype(float))
    return total


class Driver(Autonomy):
    """Writes values that vary with time and entity, publishes and receives messages; abstract: `driver` adds the columns."""

    grade = "portable"
    heard = State(doc="Sum over all received messages.")
    own = Output("kit_x kit_y kit_z", unit="m/s", doc="Moves the entity if it has the kit's motion model.")

    def step(self, g: GroupView) -> None:
        for name in self.topics():
            inbox = self.__dict__[name]
            if isinstance(type(self).columns[name], Subscribe) and inbox:
                rows, batch = inbox.pairs()
                np.add.at(self.heard, rows, message_signal(batch))
        variation = squash(g.pos[0]) + squash(g.vel[1]) + squash(g.yaw) + squash(self.heard)
        for name in self.inputs():
            variation = variation + row_signal(self.__dict__[name])
        write_signals(self, g, variation)
        self._publish_all(g)

    def _publish_all(self, g: GroupView) -> None:
        names = [name for name, column in self.topics().items() if isinstance(column, Publish)]
        if names:
            nearest = g.nearest().other[0]
            rows = np.flatnonzero(((g.id + g.step_count) % 3 == 0) & (nearest >= 0))
            for name in names if len(rows) else ():
                message = type(self).columns[name].message  # type: ignore[attr-defined]
                self.__dict__[name].publish(rows, **filled(message, g, rows, nearest[rows]))


class SignalSensor(Sensor):
    """Writes values that vary with time and entity, for autonomies to read; abstract: `signal_sensor` adds the columns."""

    grade = "portable"

    def step(self, g: GroupView) -> None:
        write_signals(self, g, g.pos[0])


def drift(x: np.ndarray, u: np.ndarray, p: np.ndarray, dt: float, substeps: int) -> None:
    """The kit's motion: every input accelerates by a bounded amount."""
    turn = np.zeros(x.shape[1])
    x[3:6] *= 0.8
    for j in range(u.shape[0]):
        push = squash(u[j])
        x[3 + j % 3] += 2.0 * push
        x[3 + (j + 1) % 3] += push
        turn += 0.5 * push
    x[:3] += dt * x[3:6]
    x[6] += dt * turn
    x[7] = 0.3 * squash(turn)


class Sink(MotionModel):
    """Motion model that reads all channels written for it and moves by them; abstract: `sink` adds the inputs."""

    grade = "portable"
    x = State("x y z vx vy vz yaw climb", unit="m m m m/s m/s m/s rad rad")
    advance = drift

    def from_body(self, body: MotionBody, rows: np.ndarray) -> None:
        self.x[:3, rows], self.x[3:6, rows] = body.pos[:, rows], body.vel[:, rows]
        self.x[6, rows], self.x[7, rows] = body.yaw[rows], body.climb[rows]

    def to_body(self, body: MotionBody) -> None:
        body.pos[:], body.vel[:] = self.x[:3], self.x[3:6]
        body.set_attitude(0.0, self.x[7], self.x[6])


class SignalBehavior(Behavior):
    """A behavior for plugins that contain behaviors."""

    grade = "portable"

    def step(self, g: GroupView) -> None:
        self.desired_velocity[:] = [6.0 * signal(g.id, g.step_count, k) for k in range(3)]


class Reaper(Interaction):
    """Deaths, births, a moved entity, and worlds that end at different times; all depend only on the world's seed."""

    grade = "portable"
    chance = Param(0.03, ge=0.0, le=1.0, doc="Probability that an entity dies in a step.")
    last_step = Param(12, doc="Step from which all entities of every third world die.")

    def step(self, w: WorldView) -> None:
        step = w.step_count[w.world]
        dice = w.uniform_by("death", w.world, w.id, np.zeros(w.n, np.int64))
        is_doomed = (w.seeds[w.world] % 3 == 1) & (step >= self.last_step[w.world])
        w.kill((dice < self.chance[w.world]) | is_doomed, "reaped")
        born = np.flatnonzero(w.step_count == 5 + (w.seeds % 2).astype(np.int64))
        place = 20.0 * w.uniform("place", 3)[:, born]
        w.spawn("red", born, pos=place, vel=0.1 * place)
        rows = np.flatnonzero((w.id == 2) & (step == 8))
        level = np.zeros(len(rows))
        w.move(rows, pos=w.pos[:, rows] + 3.0, quat=quat_from_euler(level + 0.1, level - 0.2, level + 1.0))


# -- classes made for a plugin ----------------------------------------------------------------------------------------------------


def _inputs(channels: Iterable[Channel], optional: bool) -> dict[str, Any]:
    return {
        f"in_{i}": Input(" ".join(c.channels), optional=optional, **_form(c)) for i, c in enumerate(channels)
    }


def _outputs(channels: Iterable[Channel]) -> dict[str, Any]:
    return {f"out_{i}": Output(" ".join(c.channels), **_form(c)) for i, c in enumerate(channels)}


def _form(column: Channel) -> dict[str, Any]:
    unit = " ".join(unit or "1" for unit in column.units)
    return (
        {"unit": unit, "ragged": True, "fields": " ".join(column.fields)} if column.ragged else {"unit": unit}
    )


def _made(base: type, name: str, columns: dict[str, Any]) -> Any:
    return type(name, (base,), {"__doc__": base.__doc__, "__module__": __name__, **columns})()


def driver(
    writes: Iterable[Channel], reads: Iterable[Channel], publishes: Iterable[Any], subscribes: Iterable[Any]
) -> Driver:
    """An autonomy that writes and reads these channels, and publishes and subscribes to these topics: (message, topic, network)."""
    columns = {**_outputs(writes), **_inputs(reads, optional=True)}
    for i, (message, topic, network) in enumerate(publishes):
        columns[f"publish_{i}"] = Publish(message, topic=topic, network=network)
    for i, (message, topic, network) in enumerate(subscribes):
        columns[f"subscribe_{i}"] = Subscribe(message, topic=topic, network=network)
    made: Driver = _made(Driver, "Driver", columns)
    return made


def sink(reads: Iterable[Channel]) -> Sink:
    """A motion model that reads these channels, except lists."""
    made: Sink = _made(Sink, "Sink", _inputs([c for c in reads if not c.ragged], optional=False))
    return made


def signal_sensor(writes: Iterable[Channel]) -> SignalSensor:
    """A sensor that writes these channels."""
    made: SignalSensor = _made(SignalSensor, "SignalSensor", _outputs(writes))
    return made
