"""Orders: messages that plugins of an entity take, and parameters of theirs that are set, typed by a user."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tussle.declare.columns import Column, EntityRef, Handle, Numbers, Param, Subscribe
from tussle.declare.messages import Message
from tussle.engine.arrivals import who_rejects
from tussle.engine.births import VALUES
from tussle.engine.group import Binding, Group
from tussle.engine.simulation import Simulation
from tussle.errors import ParameterError, listed, nearest_name
from tussle.numeric import cos, sin
from tussle.numeric.quaternion import quat_from_euler
from tussle.record.inputs import COLUMN, ExternalInput

MAX_ITEMS = 1000
"""Items of a list in an order."""
MAX_TEXT = 1000
"""Characters of a text in an order."""
NUMBER, WHOLE, FLAG, ENTITY, TEXT = "number", "whole", "flag", "entity", "text"


@dataclass(frozen=True)
class OrderField:
    """A field of an order.

    Attributes:
        name: Its name.
        kind: "number", "whole", "flag", "entity" (an id, 0 for none) or "text".
        parts: Names of its components; none for a single value.
        units: SI unit of each component, or the only one.
        is_list: It is a list of such values.
        doc: Its description.
        example: Values of an item with which a form begins.
    """

    name: str
    kind: str
    parts: tuple[str, ...]
    units: tuple[str, ...]
    is_list: bool
    doc: str
    example: tuple[float, ...] = ()


@dataclass(frozen=True)
class OrderKind:
    """Messages of a topic to which plugins of an entity subscribe; or a parameter, which has no network.

    Attributes:
        network: Network of the topic.
        topic: Its name; or plugin and parameter, "GoTo.speed".
        message: Name of the message's type; of a parameter "".
        plugins: Plugins that subscribe.
        doc: What the message is.
        fields: Its fields; of a parameter one, "value".
    """

    network: str
    topic: str
    message: str
    plugins: tuple[str, ...]
    doc: str
    fields: tuple[OrderField, ...]


def orders_of(group: Group) -> list[OrderKind]:
    """The orders that the entities of a group take; none of messages with objects that cannot be typed."""
    heard: dict[tuple[str, str], tuple[type[Message], list[str]]] = {}
    for binding in group.walk():
        for name, column in type(binding.spec).columns.items():
            if isinstance(column, Subscribe):
                topic = binding.plugin.__dict__[name].topic
                heard.setdefault((topic.network, topic.name), (topic.type, []))[1].append(
                    ".".join(binding.path)
                )
    found: list[OrderKind] = []
    for (network, topic), (type_, plugins) in heard.items():
        fields = [field_of(name, column) for name, column in type_.fields.items()]
        if all(fields):
            doc = (type_.__doc__ or "").strip().partition("\n")[0]
            typed = tuple(each for each in fields if each is not None)
            found.append(OrderKind(network, topic, type_.__name__, tuple(dict.fromkeys(plugins)), doc, typed))
    return found + [
        OrderKind("", ".".join((*binding.path, name)), "", (".".join(binding.path),), column.doc, (field,))
        for binding in group.walk()
        for name, column in parameters_of(binding).items()
        if (field := field_of("value", column)) is not None
    ]


def parameters_of(binding: Binding) -> dict[str, Param]:
    """The parameters of a plugin that can be set in a game: those that have a number for each entity."""
    params = type(binding.spec).params()
    return {name: c for name, c in params.items() if name in binding.params and not (c.ragged or c.choices)}


def setting_inputs(
    simulation: Simulation, world: int, path: str, value: Any, ids: Sequence[int]
) -> list[ExternalInput]:
    """The inputs that set a parameter of some entities, one for each of their blocks.

    Args:
        simulation: The simulation.
        world: Number of the world.
        path: Plugin and parameter, "GoTo.speed".
        value: The value, or those of its components.
        ids: Ids of the entities.

    Raises:
        ParameterError: An entity does not exist or has no such parameter, or the value is not allowed.
    """
    state = simulation.state
    bodies, names = state.population.bodies, state.context.block_names
    rows = bodies.rows_of(np.full(len(ids), world), np.array(ids, np.int64))
    if (rows < 0).any():
        raise ParameterError(f"{path}: world {world} has no entity {ids[int(np.argmin(rows))]} now")
    found = []
    for block in dict.fromkeys(bodies.block[rows].tolist()):
        mine = rows[bodies.block[rows] == block]
        group = next(g for g in state.population.groups if g.first <= mine[0] < g.last)
        known = {".".join((*b.path, k)): c for b in group.walk() for k, c in parameters_of(b).items()}
        if path not in known:
            raise ParameterError(
                f"{names[block]} has no parameter {path!r} that can be set{nearest_name(path, known)}; {listed(known)}"
            )
        column = known[path]
        field = field_of("value", column)
        assert field is not None
        new = _read(f"{names[block]}.{path}", field, value)
        column.convert(new.tolist(), names[block])
        values = simulation.read(f"{names[block]}.{path}")[0][world]
        values[bodies.block_index[mine]] = new
        step = int(state.context.clock.step[world])
        found.append(ExternalInput(step, COLUMN, f"{names[block]}.{path}", values.tolist()))
    return found


def birth_fields(
    simulation: Simulation, world: int, block: str, pos: np.ndarray, n_asked: int
) -> dict[str, Any]:
    """The fields of the `SpawnEntity` that asks for an entity of a block, with heading and speed of the block without their variance.

    Args:
        simulation: The simulation.
        world: Number of the world.
        block: Name of the block.
        pos: Position [m], (3,).
        n_asked: Number of entities that were asked for before this step.

    Raises:
        ParameterError: There is no such block, the world has no space, or an interaction rejects the position.
    """
    state = simulation.state
    names, births = list(state.world_view.templates), state.births
    if block not in names:
        raise ParameterError(
            f"spawn: there is no block {block!r}{nearest_name(block, names)}; {listed(names)}"
        )
    n_alive = np.bincount(state.population.bodies.world, minlength=state.n_worlds)
    n_requested = sum(int((asked["world"] == world).sum()) for asked in state.world_view.births)
    if births.space(n_alive)[world] <= n_requested + n_asked:
        raise ParameterError(
            f"spawn: world {world} has its most entities; allow_large of the mission raises the limit"
        )
    if name := who_rejects(state, world, pos):
        x, y, z = pos
        raise ParameterError(f"spawn: no entity can be at {x:g} {y:g} {z:g} m: {name} rejects the position")
    spec = births.overrides.mission.blocks[names.index(block)]
    values = births.overrides.block_values(spec, VALUES, np.array([world]))
    heading, climb, roll, speed = values[:4, 0]
    ahead = np.array([cos(climb) * cos(heading), cos(climb) * sin(heading), sin(climb)])
    vel = speed * ahead if spec.velocity is None else np.array(spec.velocity)
    return {
        "block": [block],
        "pos": pos,
        "vel": vel,
        "quat": np.array(quat_from_euler(roll, -climb, heading)),
    }


def field_of(name: str, column: Column) -> OrderField | None:
    """A field of a message; None for an object that cannot be typed."""
    if isinstance(column, Handle):
        return OrderField(name, TEXT, (), ("",), False, column.doc) if column.is_text else None
    assert isinstance(column, Numbers)
    kinds = {bool: FLAG, int: WHOLE}
    kind = ENTITY if isinstance(column, EntityRef) else kinds.get(column.dtype, NUMBER)
    return OrderField(
        name,
        kind,
        tuple(column.fields),
        tuple(column.units),
        column.ragged,
        column.doc,
        getattr(column, "example", ()),
    )


def fields_from(type_: type[Message], values: Mapping[str, Any]) -> dict[str, Any]:
    """The fields of a message, as `Simulation.publish` takes them, from what a user has typed.

    Args:
        type_: The message type.
        values: Field -> a number, a truth value, a text, a list of numbers by component, or of a list a list of such items.

    Raises:
        ParameterError: There is no such field, or a value does not fit.
    """
    fields = {name: field_of(name, column) for name, column in type_.fields.items()}
    found: dict[str, Any] = {}
    for name, value in values.items():
        field = fields.get(name)
        if field is None:
            raise ParameterError(
                f"{type_.__name__} has no field {name!r} that can be typed{nearest_name(name, fields)}; {listed(fields)}"
            )
        found[name] = _read(f"{type_.__name__}.{name}", field, value)
    return found


def _read(where: str, field: OrderField, value: Any) -> Any:
    if field.kind == TEXT:
        if not isinstance(value, str) or len(value) > MAX_TEXT:
            raise ParameterError(f"{where}: it takes a text of at most {MAX_TEXT} characters")
        return [value]
    items = value if field.is_list else [value]
    if not isinstance(items, Sequence) or isinstance(items, str) or len(items) > MAX_ITEMS:
        raise ParameterError(f"{where}: it takes a list of at most {MAX_ITEMS} items")
    dtype = {FLAG: bool, WHOLE: np.int64, ENTITY: np.int64}.get(field.kind, float)
    rows = np.array([_numbers(where, field, item) for item in items], dtype).reshape(
        len(items), len(field.parts) or 1
    )
    whole = np.ascontiguousarray(rows.T if field.parts else rows[:, 0])
    return [whole] if field.is_list else whole[..., 0]


def _numbers(where: str, field: OrderField, item: Any) -> list[Any]:
    n = len(field.parts)
    numbers = item if n else [item]
    kinds: tuple[type, ...] = (
        (bool,) if field.kind == FLAG else (int,) if field.kind in (WHOLE, ENTITY) else (int, float)
    )
    most = 2**63 - 1 if kinds == (int,) else sys.float_info.max
    is_right = isinstance(numbers, Sequence) and not isinstance(numbers, str) and len(numbers) == (n or 1)
    if is_right:
        for number in numbers:
            is_right &= isinstance(number, kinds) and isinstance(number, bool) == (field.kind == FLAG)
            is_right = is_right and abs(number) <= most
    if not is_right:
        what = {FLAG: "true or false", WHOLE: "a whole number", ENTITY: "the id of an entity"}.get(
            field.kind, "a number"
        )
        raise ParameterError(
            f"{where}: it takes {f'{n} numbers, {chr(32).join(field.parts)}' if n else what}"
        )
    return list(numbers)
