"""Message types that plugins share, and batches of messages stored as columns."""

from __future__ import annotations

from functools import cache
from typing import Any, ClassVar

import numpy as np

from tussle.declare.columns import Column, EntityRef, Field, Handle, Numbers
from tussle.declare.lists import RaggedColumn
from tussle.errors import DeclarationError, ParameterError, listed, nearest_name

__all__ = [
    "BoundaryCrossed",
    "BoundaryShape",
    "CaptureEntity",
    "ChargeAdded",
    "ChargePercentage",
    "CustomKeyPress",
    "EntityCaptured",
    "EntityCollided",
    "EntityHitGround",
    "FlagCaptured",
    "FlagTaken",
    "GPSStatus",
    "GoalReached",
    "ManualControl",
    "Message",
    "Messages",
    "PointCloud",
    "RemoveEntity",
    "RewardGiven",
    "RoadGraph",
    "SpawnEntity",
    "TextMessage",
    "Waypoint",
    "WaypointList",
    "WaypointStatus",
    "WorldPointClicked",
]


class Message:
    """A message type; abstract.

    Fields are declared as class attributes: `Field` (at most one of them ragged), `EntityRef`, or `Handle` for any picklable object.
    """

    fields: ClassVar[dict[str, Column]] = {}

    def __init_subclass__(cls) -> None:
        cls.fields = {
            k: c for base in reversed(cls.__mro__) for k, c in vars(base).items() if isinstance(c, Column)
        }
        for name, column in cls.fields.items():
            if not isinstance(column, (Field, EntityRef, Handle)):
                raise DeclarationError(
                    f"{cls.__name__}.{name}: a message field is a Field, EntityRef or Handle, not {type(column).__name__}"
                )
            if name in (
                taken := ("world", "sender", "type", "data", *(k for k in vars(Messages) if k[0] != "_"))
            ):
                raise DeclarationError(
                    f"{cls.__name__}.{name}: the name is reserved in messages, as are {', '.join(taken)}; choose another one"
                )
        if sum(isinstance(c, Field) and c.ragged for c in cls.fields.values()) > 1:
            raise DeclarationError(
                f"{cls.__name__} has more than one ragged field; split it into two message types"
            )


class Messages:
    """Messages of one type as columns, ordered by (world, sender, send order).

    Attributes:
        type: The message type.
        world: World of each message, (n,).
        sender: Id of the sending entity, 0 for the world, (n,).
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

    def take(self, index: np.ndarray) -> Messages:
        """Select the messages `index`, in that order."""
        data: dict[str, Any] = {}
        for name, column in self.type.fields.items():
            values = self.data[name]
            if isinstance(values, RaggedColumn):
                data[name] = values.take(index)
            elif isinstance(column, Handle):
                data[name] = [values[i] for i in index]
            else:
                data[name] = np.take(values, index, axis=-1)
        return Messages(self.type, self.world[index], self.sender[index], data)

    def sizes(self) -> np.ndarray:
        """Size of each message [byte], (n,): 8 for each number, also of lists; 0 for objects."""
        size = np.zeros(self.n)
        for name, column in self.type.fields.items():
            if isinstance(column, Numbers):
                values = self.data[name]
                of_list = values.count if isinstance(values, RaggedColumn) else 1
                size += 8.0 * max(1, len(column.fields)) * of_list
        return size

    @classmethod
    def empty(cls, type_: type[Message]) -> Messages:
        """The empty batch of a type; one shared object per type."""
        return _empty(type_)  # type: ignore[arg-type]

    @classmethod
    def make(
        cls, type_: type[Message], world: np.ndarray, sender: np.ndarray, values: dict[str, Any]
    ) -> Messages:
        """Make a batch from values by field name; scalars are repeated, missing numbers are 0.

        Raises:
            ParameterError: A name is not a field, or a value has the wrong shape.
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
    def join(cls, batches: list[Messages]) -> Messages:
        """Concatenate batches in the given order."""
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
    def concatenate(cls, batches: list[Messages]) -> Messages:
        """Concatenate batches and sort them by (world, sender); the sort is stable."""
        joined = cls.join(batches)
        order = np.lexsort((joined.sender, joined.world))
        return joined if (order[1:] > order[:-1]).all() else joined.take(order)


@cache
def _empty(type_: Any) -> Messages:
    return Messages.make(type_, np.zeros(0, np.int64), np.zeros(0, np.int64), {})


def _field_values(type_: type[Message], name: str, column: Column, value: Any, n: int) -> Any:
    where = f"{type_.__name__}.{name}"
    if isinstance(column, Handle):
        if isinstance(value, list) and len(value) != n:
            raise ParameterError(f"{where}: {len(value)} objects; expected one object, or a list of {n}")
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
        out = np.empty(shape, dtype)  # np.broadcast_to would dominate the cost of a message
        out[...] = source
        return out
    except ValueError:
        raise ParameterError(f"{where}: shape {np.shape(value)} does not fit {shape}") from None


def _list_values(where: str, column: Numbers, value: Any, n: int) -> RaggedColumn:
    """One list per message, copied, so that later writes do not change a sent message."""
    if isinstance(value, RaggedColumn):
        if len(value) != n or value.data.shape[:-1] != column.shape:
            raise ParameterError(
                f"{where}: {len(value)} lists with items of shape {value.data.shape[:-1]}; expected {n} lists with items of "
                f"shape {column.shape}"
            )
        return value.copy()
    if value is None or isinstance(value, np.ndarray):
        value = [np.empty(0) if value is None else value] * n
    if not isinstance(value, (list, tuple)) or len(value) != n:
        shape = f"({len(column.fields)}, m)" if column.fields else "(m,)"
        raise ParameterError(
            f"{where}: expected an array {shape} for all messages, or a list of {n} such arrays"
        )
    try:
        return RaggedColumn.from_rows(value, column)
    except ParameterError as error:
        raise ParameterError(f"{where}: {error}") from None


class CaptureEntity(Message):
    """The sender claims to have captured another entity; an interaction plugin decides in the same step."""

    target = EntityRef(doc="Claimed entity.")


class EntityCaptured(Message):
    """A confirmed capture."""

    source = EntityRef(doc="Capturing entity.")
    target = EntityRef(doc="Captured entity.")
    source_team = Field(dtype=int)
    target_team = Field(dtype=int)


class EntityCollided(Message):
    """Two entities collided; sent once per pair, the smaller id first."""

    first = EntityRef()
    second = EntityRef()
    first_team = Field(dtype=int)
    second_team = Field(dtype=int)


class EntityHitGround(Message):
    """An entity hit the ground."""

    entity = EntityRef()
    team = Field(dtype=int)


class BoundaryCrossed(Message):
    """An entity left the boundary that contained it, or entered it again."""

    entity = EntityRef()
    boundary = Field(dtype=int, doc="Id of the boundary.")
    inside = Field(dtype=bool, doc="Whether it is inside now.")


class FlagTaken(Message):
    """An entity took a flag."""

    entity = EntityRef()
    team = Field(dtype=int, doc="Team of the entity.")
    boundary = Field(dtype=int, doc="Id of the flag's boundary.")


class FlagCaptured(Message):
    """An entity brought a flag home."""

    entity = EntityRef()
    team = Field(dtype=int, doc="Team of the entity.")
    boundary = Field(dtype=int, doc="Id of the flag's boundary.")


class RoadGraph(Message):
    """A graph of roads, sent once at the start."""

    graph = Field(dtype=int, doc="Id of the graph.")
    roads = Handle(doc="A `networkx` graph; each node has the attribute pos [m], (3,), world frame.")


class PointCloud(Message):
    """A scan of a lidar."""

    points = Field(
        "x y z range in_range",
        unit="m m m m 1",
        ragged=True,
        doc="Ends of the rays, body frame, and their ranges.",
    )


class RewardGiven(Message):
    """An entity earned a reward."""

    entity = EntityRef()
    team = Field(dtype=int, doc="Team of the entity.")
    reward = Field()


class TextMessage(Message):
    """A text, such as the name of a state on the topic `State`, or of an event on the topic `Event`."""

    text = Handle(doc="The text.", is_text=True)
    to = EntityRef(doc="Entity that it is for; none if it is for all that receive it.")


class ChargeAdded(Message):
    """The battery of an entity is charged."""

    entity = EntityRef(doc="Entity with the battery.")
    charge = Field(doc="Charge that is added; negative to take it.")


class ChargePercentage(Message):
    """Charge of the sender's battery."""

    percentage = Field(doc="Charge above the smallest one, in percent of the range.")


class Waypoint(Message):
    """A target position."""

    pos = Field("x y z", unit="m m m")


WAYPOINT_MODES = ("follow_once", "back_and_forth", "loiter", "racetrack")
"""Behavior at the end of a waypoint list; `WaypointList.mode` is an index into this tuple."""


class WaypointList(Message):
    """Waypoints to visit in order."""

    points = Field(
        "x y z roll pitch yaw position_tolerance turn_tolerance",
        unit="m m m rad rad rad m rad",
        ragged=True,
        doc="Positions and attitudes in the world frame, and tolerances.",
        example=(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 10.0, 0.5),
    )
    mode = Field(dtype=int, doc="Index into WAYPOINT_MODES.")


class WaypointStatus(Message):
    """A waypoint was reached, or skipped."""

    index = Field(dtype=int, doc="Index of the next waypoint.")
    n_waypoints = Field(dtype=int, doc="Length of the list.")
    is_done = Field(dtype=bool, doc="Whether the end of the list was reached.")
    is_skipped = Field(dtype=bool, doc="Whether the waypoint was skipped, since it could not be reached.")


class GPSStatus(Message):
    """Measurements of a satellite receiver."""

    geodetic = Field("latitude longitude altitude", unit="rad rad m", doc="Position of the last fix, WGS84.")
    has_fix = Field(dtype=bool, doc="Whether there is a fix now.")
    t = Field(unit="s", doc="Time of the last fix.")


class GoalReached(Message):
    """An entity came to its goal for the first time."""

    entity = EntityRef(doc="Who came there.")
    team = Field(dtype=int, doc="Its team.")
    t = Field(unit="s", doc="Time of arrival.")


class BoundaryShape(Message):
    """The shape of a boundary, sent once at the start."""

    boundary = Field(dtype=int, doc="Id of the boundary.")
    team = Field(dtype=int, doc="Team that the boundary belongs to.")
    shape = Handle(doc="A shape of `tussle.scene`.")


class WorldPointClicked(Message):
    """A user of the viewer clicked on a point in the world; sender is 0."""

    pos = Field("x y z", unit="m m m")


class CustomKeyPress(Message):
    """A user of the viewer pressed the key that is reserved for plugins; sender is 0."""

    key = Handle(doc="Name of the key.", is_text=True)


class ManualControl(Message):
    """An operator drives an entity: from the next step on the sticks set its channels, in place of its autonomies."""

    entity = EntityRef(doc="Entity that is driven.")
    is_on = Field(dtype=bool, doc="It is driven; else its autonomies have it back.")
    sticks = Field("ahead left up", doc="Deflections, from -1 to 1; what they mean depends on its channels.")


class RemoveEntity(Message):
    """Request the removal of an entity; it is removed at the end of the step."""

    entity = EntityRef(doc="Entity that is removed.")
    why = Handle(doc="Cause of its death, for the events.", is_text=True)


class SpawnEntity(Message):
    """Request a new entity of a block; it appears at the beginning of the next step."""

    block = Handle(doc="Name of the template block.", is_text=True)
    pos = Field("x y z", unit="m m m")
    vel = Field("vx vy vz", unit="m/s m/s m/s")
    quat = Field("w qx qy qz")
