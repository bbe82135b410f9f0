"""Message types that plugins share, and the columns that hold many messages at once."""

from __future__ import annotations

from functools import cache
from typing import Any, ClassVar

import numpy as np

from tussle.columns import Column, EntityRef, Field, Handle, Numbers
from tussle.errors import DeclarationError, ParameterError, listed, nearest_name
from tussle.lists import RaggedColumn


class Message:
    """A message type; abstract.

    Fields are declared as class attributes: `Field`, at most one of them a list (`ragged=True`), `EntityRef`, or a `Handle` for any
    picklable object.
    """

    fields: ClassVar[dict[str, Column]] = {}

    def __init_subclass__(cls) -> None:
        cls.fields = {
            k: c for base in reversed(cls.__mro__) for k, c in vars(base).items() if isinstance(c, Column)
        }
        for name, column in cls.fields.items():
            if not isinstance(column, (Field, EntityRef, Handle)):
                raise DeclarationError(
                    f"{cls.__name__}.{name}: a message holds Field, EntityRef or Handle, not {type(column).__name__}"
                )
            if name in ("world", "sender", "n"):
                raise DeclarationError(f"{cls.__name__}.{name}: the name is reserved in messages")
        if sum(isinstance(c, Field) and c.ragged for c in cls.fields.values()) > 1:
            raise DeclarationError(
                f"{cls.__name__} has more than one ragged field; make two message types of it"
            )


class Batch:
    """Messages of one type as columns, ordered by (world, sender, order of sending).

    Attributes:
        type: The message type.
        world: World of each message, (n,).
        sender: Id of the entity that sent it, 0 for the world, (n,).
        data: Field name -> array (n,) or (k, n), `RaggedColumn`, or list.
    """

    def __init__(
        self, type_: type[Message], world: np.ndarray, sender: np.ndarray, data: dict[str, Any]
    ) -> None:
        self.type = type_
        self.world = world
        self.sender = sender
        self.data = data

    @property
    def n(self) -> int:
        return len(self.world)

    def __len__(self) -> int:
        return len(self.world)

    def __getattr__(self, name: str) -> Any:
        try:
            return self.__dict__["data"][name]
        except KeyError:
            fields = self.__dict__["type"].fields if "type" in self.__dict__ else {}
            raise AttributeError(
                f"messages of this type have no field {name!r}{nearest_name(name, fields)}; {listed(fields)}"
            ) from None

    def take(self, index: np.ndarray) -> Batch:
        """The messages `index`, in that order."""
        data: dict[str, Any] = {}
        for name, column in self.type.fields.items():
            values = self.data[name]
            if isinstance(values, RaggedColumn):
                data[name] = values.take(index)
            elif isinstance(column, Handle):
                data[name] = [values[i] for i in index]
            else:
                data[name] = np.ascontiguousarray(values[..., index])
        return Batch(self.type, self.world[index], self.sender[index], data)

    @classmethod
    def empty(cls, type_: type[Message]) -> Batch:
        """No messages; the one such batch of a type."""
        return _empty(type_)  # type: ignore[arg-type]

    @classmethod
    def make(
        cls, type_: type[Message], world: np.ndarray, sender: np.ndarray, values: dict[str, Any]
    ) -> Batch:
        """Columns from values by field name; scalars are repeated, missing numbers are 0.

        Raises:
            ParameterError: A value belongs to no field, or has another shape.
        """
        n = len(world)
        for name in values:
            if name not in type_.fields:
                raise ParameterError(
                    f"{type_.__name__} has no field {name!r}{nearest_name(name, type_.fields)}; {listed(type_.fields)}"
                )
        data = {
            name: _field_values(type_, name, column, values.get(name), n)
            for name, column in type_.fields.items()
        }
        return cls(type_, np.ascontiguousarray(world, np.int64), np.ascontiguousarray(sender, np.int64), data)

    @classmethod
    def join(cls, batches: list[Batch]) -> Batch:
        """All messages in one, in the order given."""
        first = batches[0]
        if len(batches) == 1:
            return first
        data: dict[str, Any] = {}
        for name, column in first.type.fields.items():
            parts = [b.data[name] for b in batches]
            if isinstance(parts[0], RaggedColumn):
                data[name] = RaggedColumn.join(parts)
            elif isinstance(column, Handle):
                data[name] = [v for p in parts for v in p]
            else:
                data[name] = np.concatenate(parts, axis=-1)
        return cls(
            first.type,
            np.concatenate([b.world for b in batches]),
            np.concatenate([b.sender for b in batches]),
            data,
        )

    @classmethod
    def concatenate(cls, batches: list[Batch]) -> Batch:
        """All messages in one, stably ordered by (world, sender)."""
        joined = cls.join(batches)
        order = np.lexsort((joined.sender, joined.world))
        return joined if (order[1:] > order[:-1]).all() else joined.take(order)


@cache
def _empty(type_: Any) -> Batch:
    return Batch.make(type_, np.zeros(0, np.int64), np.zeros(0, np.int64), {})


def _field_values(type_: type[Message], name: str, column: Column, value: Any, n: int) -> Any:
    where = f"{type_.__name__}.{name}"
    if isinstance(column, Handle):
        if isinstance(value, list) and len(value) != n:
            raise ParameterError(f"{where}: {len(value)} objects; needed is one object, or a list of {n}")
        return list(value) if isinstance(value, list) else [value] * n
    assert isinstance(column, Numbers)
    if column.ragged:
        return _list_values(where, column, value, n)
    shape = (*column.shape, n)
    dtype = np.dtype(column.dtype)
    try:
        source = np.asarray(0 if value is None else value, dtype)
        if column.shape and source.ndim == 1:
            source = source[:, None]
        if source.ndim > len(shape):
            raise ValueError
        out = np.empty(shape, dtype)  # np.broadcast_to takes longer than all the rest of a message
        out[...] = source
        return out
    except ValueError:
        raise ParameterError(f"{where}: shape {np.shape(value)} does not fit {shape}") from None


def _list_values(where: str, column: Numbers, value: Any, n: int) -> RaggedColumn:
    """A list per message, as a copy: what is sent does not change."""
    if isinstance(value, RaggedColumn):
        if len(value) != n or value.data.shape[:-1] != column.shape:
            raise ParameterError(
                f"{where}: lists of {len(value)} rows, items of shape {value.data.shape[:-1]}; needed are {n} rows, {column.shape}"
            )
        return value.copy()
    if value is None or isinstance(value, np.ndarray):
        value = [np.empty(0) if value is None else value] * n
    if not isinstance(value, (list, tuple)) or len(value) != n:
        shape = f"({len(column.fields)}, m)" if column.fields else "(m,)"
        raise ParameterError(
            f"{where}: needed is an array {shape} for all messages, or a list of {n} such arrays"
        )
    try:
        return RaggedColumn.from_rows(value, column)
    except ParameterError as error:
        raise ParameterError(f"{where}: {error}") from None


class CaptureEntity(Message):
    """A claim by the sender to have captured another entity; a referee judges it in the same step."""

    target = EntityRef(doc="Entity claimed.")


class EntityCaptured(Message):
    """A capture that held."""

    source = EntityRef(doc="Entity that captured.")
    target = EntityRef(doc="Entity that was captured.")
    source_team = Field(dtype=int)
    target_team = Field(dtype=int)


class EntityCollided(Message):
    """Two entities met; sent once per pair, the smaller id first."""

    first = EntityRef()
    second = EntityRef()
    first_team = Field(dtype=int)
    second_team = Field(dtype=int)


class EntityHitGround(Message):
    """An entity came down to the ground."""

    entity = EntityRef()
    team = Field(dtype=int)


class BoundaryCrossed(Message):
    """An entity left the boundary that contains it, or entered one that it had left."""

    entity = EntityRef()
    boundary = Field(dtype=int, doc="Id of the boundary.")
    inside = Field(dtype=bool, doc="Whether it is inside now.")


class Waypoint(Message):
    """A point to go to."""

    pos = Field("x y z", unit="m m m")


WAYPOINT_MODES = ("follow_once", "back_and_forth", "loiter", "racetrack")
"""What is done at the end of a list of waypoints; `WaypointList.mode` is a number of these."""


class WaypointList(Message):
    """Points to go to one after the other."""

    points = Field(
        "x y z roll pitch yaw position_tolerance turn_tolerance",
        unit="m m m rad rad rad m rad",
        ragged=True,
        doc="Places in the world frame, attitudes there, and how near is near enough.",
    )
    mode = Field(dtype=int, doc="Number in WAYPOINT_MODES.")


class WaypointStatus(Message):
    """A waypoint has been reached."""

    index = Field(dtype=int, doc="Number of the waypoint that comes next.")
    n_waypoints = Field(dtype=int, doc="Length of the list.")
    is_done = Field(dtype=bool, doc="Whether the list is at its end.")


class BoundaryShape(Message):
    """The shape of a boundary, told once at the start."""

    boundary = Field(dtype=int, doc="Id of the boundary.")
    team = Field(dtype=int, doc="Team that it belongs to.")
    shape = Handle(doc="A shape of `tussle.scene`.")


class WorldPointClicked(Message):
    """Someone who watches has pointed at a place in the world; sender is 0."""

    pos = Field("x y z", unit="m m m")


class CustomKeyPress(Message):
    """Someone who watches has pressed the key that is kept for the plugins; sender is 0."""

    key = Handle(doc="Name of the key.")


class SpawnEntity(Message):
    """Ask for a new entity of a block; it appears at the beginning of the next step."""

    block = Handle(doc="Name of the block that serves as template.")
    pos = Field("x y z", unit="m m m")
    vel = Field("vx vy vz", unit="m/s m/s m/s")
    quat = Field("w qx qy qz")
