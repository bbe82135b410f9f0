"""The complete state of one entity: body, plugin columns, messages."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tussle.api.bodies import BODY_UNITS, DERIVED, FLOATS, derive
from tussle.declare.columns import Column, Numbers, Param, Subscribe
from tussle.declare.comms import EVERYONE, SAME_ENTITY
from tussle.declare.comms.topic import Delivery, TopicBuffer
from tussle.declare.lists import RaggedColumn
from tussle.declare.messages import Messages
from tussle.engine.group import Group
from tussle.engine.manual import axes_of
from tussle.engine.simulation import Simulation
from tussle.engine.table import Stored, Table
from tussle.view.orders import OrderKind, orders_of

_COMPONENTS = {3: ("x", "y", "z"), 4: ("w", "x", "y", "z")}
"""Names of the components of a vector and of a quaternion."""
MAX_MESSAGES = 50
"""Messages that are listed, of received and of sent ones."""


@dataclass(frozen=True)
class Reading:
    """A value of a column.

    Attributes:
        value: A number, an array (k,) of one with several fields, an array (m, k) of a list, or a text.
        unit: Its SI unit; one per field where they differ, separated by blanks.
        fields: Names of the components.
        doc: Its description.
        mission_unit: The unit of bare numbers in mission files, of a parameter; one per field where they differ. "" is `unit`.
        is_parameter: The column is a parameter: it says what the plugin is, not what it does.
    """

    value: Any
    unit: str = ""
    fields: tuple[str, ...] = ()
    doc: str = ""
    mission_unit: str = ""
    is_parameter: bool = False


@dataclass(frozen=True)
class ShownMessage:
    """A message.

    Attributes:
        topic: Network and name, "GlobalNetwork/Waypoint".
        sender: Id of the sender, 0 for the world.
        fields: Field -> value.
    """

    topic: str
    sender: int
    fields: dict[str, Any]


@dataclass(frozen=True, eq=False)
class EntityState:
    """State of one entity at one time.

    Attributes:
        t: Time [s].
        step: Number of the step that begins with this state.
        id: Its id.
        team: Its team.
        block: Name of its block.
        body: Column -> reading.
        plugins: Plugin, such as "MotorSchemas.AvoidEntityMS" -> column -> reading.
        received: Messages that have arrived and are unread, at most 50.
        sent: Its messages that are under way or unread, at most 50.
        orders: Messages that its plugins take and that can be typed.
        axes: Axis of an operator's sticks -> the channels that it drives; empty for an entity that cannot be driven.
        is_driven: An operator drives it.
    """

    t: float
    step: int
    id: int
    team: int
    block: str
    body: dict[str, Reading]
    plugins: dict[str, dict[str, Reading]] = field(default_factory=dict)
    received: list[ShownMessage] = field(default_factory=list)
    sent: list[ShownMessage] = field(default_factory=list)
    orders: list[OrderKind] = field(default_factory=list)
    axes: dict[str, list[str]] = field(default_factory=dict)
    is_driven: bool = False


def entity_state(
    simulation: Simulation, world: int, who: int, *, has_messages: bool = True
) -> EntityState | None:
    """The entity with an id; None if it does not exist. Of a world that has ended, its last state.

    Args:
        simulation: The simulation; used between steps only.
        world: Number of the world.
        who: The id.
        has_messages: Read its messages, too.
    """
    parked = simulation.state.parked.get(world)
    bodies = simulation.state.population.bodies if parked is None else parked.bodies
    found = np.flatnonzero((bodies.id == who) & (bodies.world == world))
    if not len(found):
        return None
    row = int(found[0])
    clock = simulation.state.context.clock
    body = {
        name: Reading(_plain(getattr(bodies, name)[..., row]), BODY_UNITS[name], _COMPONENTS.get(k, ()))
        for name, k in FLOATS.items()
    }
    for name in ("yaw", "climb", "roll"):
        angle = np.empty(1)
        assert DERIVED[name] == 1
        derive(name, np.ascontiguousarray(bodies.quat[:, row : row + 1]), 0, 1, 0, angle)
        body[name] = Reading(float(angle[0]), BODY_UNITS[name])
    state = EntityState(
        t=float(clock.t[world]),
        step=int(clock.step[world]),
        id=who,
        team=int(bodies.team[row]),
        block=simulation.state.context.block_names[int(bodies.block[row])],
        body=body,
        is_driven=(world, who) in simulation.state.manual,
    )
    for group in simulation.state.population.groups:
        if parked is None:
            if group.first <= row < group.last:
                _read_plugins(group, row - group.first, group.table, state.plugins)
                state.received.extend(_received(group, world, who) if has_messages else ())
                state.orders.extend(orders_of(group) if has_messages else ())
                state.axes.update(axes_of(group) if has_messages else {})
        elif group.key in parked.tables:
            rows, held = parked.tables[group.key]
            place = np.flatnonzero(rows == row)
            if len(place):
                _read_plugins(group, int(place[0]), held, state.plugins)
    state.sent.extend(_sent(simulation, world, who) if has_messages else ())
    return state


def _plain(value: Any) -> Any:
    """A Python number, or a copy of an array."""
    array = np.array(value)
    return array if array.ndim else array.item()


def _about(column: Column) -> dict[str, Any]:
    """What a reading says of its column."""
    if not isinstance(column, Numbers):
        return {"doc": column.doc}
    is_parameter = isinstance(column, Param)
    mission_unit = " ".join(unit or "1" for unit in column.text_units) if is_parameter else ""
    return {
        "unit": column.unit, "fields": column.fields, "doc": column.doc, "mission_unit": mission_unit, "is_parameter": is_parameter,
    }  # fmt: skip


def _read_plugins(group: Group, row: int, held: Table | Stored, into: dict[str, dict[str, Reading]]) -> None:
    """Add the columns of an entity's plugins in the order of their declaration, without the outputs that a plugin leaves out."""
    for binding in group.walk():
        columns = into[".".join(binding.path)] = {}
        for name, column in type(binding.spec).columns.items():
            about = _about(column)
            place = binding.places.get(name)
            if name in binding.asked.skipped:
                continue
            if place is not None:
                data = held.arrays[place.dtype]
                part = data[place.first : place.first + place.k] if place.k else data[place.first]
                columns[name] = Reading(_plain(part[..., row]), **about)
            elif name in binding.ragged:
                columns[name] = Reading(np.array(held.lists[binding.ragged[name]][row].T), **about)
            elif name in binding.spec.values and name not in type(binding.spec).children():
                columns[name] = Reading(binding.spec.values[name], **about)


def _received(group: Group, world: int, who: int) -> list[ShownMessage]:
    messages: list[ShownMessage] = []
    for binding in group.walk():
        for name, column in type(binding.spec).columns.items():
            if isinstance(column, Subscribe):
                inbox = binding.plugin.__dict__[name]
                for delivery in inbox.deliveries:
                    messages += shown_messages(inbox.topic, delivery.batch, _for_whom(delivery, world, who))
    return messages[-MAX_MESSAGES:]


def _for_whom(delivery: Delivery, world: int, who: int) -> np.ndarray:
    """Numbers of the messages in a delivery that an entity receives."""
    batch, to = delivery.batch, delivery.to
    if isinstance(to, str):
        assert to in (EVERYONE, SAME_ENTITY)
        mine = batch.world == world
        return np.flatnonzero(mine if to == EVERYONE else mine & (batch.sender == who))
    number, receiver = to
    return np.asarray(number[(receiver == who) & (batch.world[number] == world)])


def _sent(simulation: Simulation, world: int, who: int) -> list[ShownMessage]:
    messages: list[ShownMessage] = []
    for topic in simulation.state.message_bus.topics.values():
        for delivery in _under_way(topic):
            mine = (delivery.batch.world == world) & (delivery.batch.sender == who)
            messages += shown_messages(topic, delivery.batch, np.flatnonzero(mine))
    return messages[-MAX_MESSAGES:]


def _under_way(topic: TopicBuffer) -> Iterator[Delivery]:
    """Deliveries that are queued or lie in an inbox, each once."""
    known: dict[int, Delivery] = {id(p): p for p in topic.queue}
    for inbox in topic.inboxes:
        known |= {id(p): p for p in inbox.deliveries}
    yield from known.values()


def shown_messages(topic: TopicBuffer, batch: Messages, numbers: np.ndarray) -> list[ShownMessage]:
    """Some messages of a batch, (m,) their numbers, of more than 50 the last."""
    messages = []
    for i in numbers[-MAX_MESSAGES:]:
        fields: dict[str, Any] = {}
        for name, values in batch.data.items():
            if isinstance(values, RaggedColumn):
                fields[name] = np.array(values[int(i)].T)
            elif isinstance(values, list):
                fields[name] = values[int(i)]
            else:
                fields[name] = _plain(values[..., i])
        messages.append(ShownMessage(f"{topic.network}/{topic.name}", int(batch.sender[i]), fields))
    return messages
