"""Arguments of entity plugins in easy mode: the entity itself (`Me`) and other entities (`Other`)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from tussle.api.easy.shared import Shared, WorldDraw
from tussle.api.easy.values import (
    BODY,
    NUMBERS,
    VECTORS,
    Columns,
    ReceivedMessage,
    Write,
    check_id,
    with_ids,
    write_number,
)
from tussle.arguments import explained
from tussle.declare.columns import Publish
from tussle.errors import ParameterError, listed, nearest_name
from tussle.world.scene import Scene

ROLES = {
    "autonomy": "an autonomy decides",
    "controller": "a controller steers",
    "sensor": "a sensor measures",
}
MAX_CACHED = 64
"""Number of `Other` objects that an entity caches, so that they are not created again in each step."""


def _read_only(of: Any, value: Any) -> None:
    of._refuse(f"{of._called} is read-only")


def _of_body(name: str, doc: str) -> property:
    return property(lambda of: of._body[name][of._row], _read_only, doc=doc)


@explained
class Entity:
    """Body of an entity as plain values; abstract."""

    __slots__ = ("_body", "_row", "_shared")
    _called: ClassVar[str] = "entity"
    _columns: ClassVar[tuple[str, ...]] = ()
    _body: Columns
    _row: int
    _shared: Any

    def __getattr__(self, name: str) -> Any:
        if name in self._columns:
            self._refuse(f"me.{name} cannot be read, only published: me.publish({name!r}, ...)")
        allowed = list(dict.fromkeys((*self._columns, *BODY, *public_names(type(self)))))
        self._refuse(f"{self._called} has no {name!r}{nearest_name(name, allowed)}; {listed(allowed)}")

    def _refuse(self, text: str) -> Any:
        raise AttributeError(f"{type(self._shared.plugin).__name__}: {text}")

    def _body_row(self) -> int:
        return self._row

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Entity):
            return NotImplemented
        return self._body_row() == other._body_row() and self._shared.bodies is other._shared.bodies

    def __hash__(self) -> int:
        return hash(self._body_row())


for _name, _doc in {**VECTORS, **NUMBERS}.items():
    setattr(Entity, _name, _of_body(_name, _doc))


def public_names(cls: type) -> list[str]:
    """Public attributes of a class, without columns and body columns."""
    return [n for n in dir(cls) if not n.startswith("_") and n not in BODY]


def whole_id(called: str, number: Any) -> int:
    """An id as a whole number.

    Raises:
        ParameterError: It is none.
    """
    is_number = isinstance(number, (int, float, np.number)) and not isinstance(number, bool)
    if not is_number or number != number // 1 or number < 0:
        raise ParameterError(
            f"{called}: {number!r} is no id; ids are whole numbers from 1 on, and 0 is nobody"
        )
    return int(number)


def squared_distance(a: Entity, b: Entity) -> float:
    """Squared distance [m^2], bit-identical to the kernels' result."""
    try:
        ax, ay, az = a._body.xyz
        bx, by, bz = b._body.xyz
    except AttributeError:
        raise ParameterError(f"distance takes two entities, not {a!r} and {b!r}") from None
    i, j = a._row, b._row
    x, y, z = ax[i] - bx[j], ay[i] - by[j], az[i] - bz[j]
    return x * x + y * y + z * z  # type: ignore[no-any-return]


@explained
class Other(Entity):
    """Another entity: its true state, and its position relative to the observing entity."""

    __slots__ = ("_by", "_id")
    _called = "another entity"
    _id: int

    def __init__(self, by: Any, entity: int, row: int) -> None:
        self._shared, self._body, self._row = by._shared, by._shared.truth, row
        self._by, self._id = by, entity

    @property
    def offset(self) -> np.ndarray:
        """Position relative to the observing entity [m], (3,), world frame."""
        by = self._by
        return self._body["pos"][self._row] - by._body["pos"][by._row]  # type: ignore[no-any-return]

    @property
    def distance(self) -> float:
        """Distance from the observing entity [m]."""
        return math.sqrt(squared_distance(self, self._by))

    def __repr__(self) -> str:
        return f"<entity {self._id} of team {self._body['team'][self._row]}>"


@explained
class Observer(Entity):
    """An entity with neighbour queries; abstract."""

    __slots__ = ()

    if TYPE_CHECKING:

        def _other(self, entity: int, row: int) -> Any: ...

    def nearest(
        self, team: str | int | None = None, radius: float | None = None, k: int | None = None
    ) -> Any:
        """The nearest other entity, or None. At equal distance, the one with the smaller id.

        Args:
            team: "own", "other", a team number, or None for all.
            radius: Only entities nearer than this [m].
            k: Return a list of the k nearest, nearest first; shorter if there are fewer.
        """
        if k is not None and (type(k) is not int or k < 1):
            raise ParameterError(f"nearest: k = {k!r} is not allowed; it takes a whole number >= 1")
        search = self._shared.search
        cached = search.cached.get((k or 1, team))
        found = cached[self._row] if cached else search.nearest(self._row, k or 1, team)
        if k is None and radius is None:
            return self._other(*found[0]) if found else None
        others = [self._other(entity, row) for entity, row in found]
        if radius is not None:
            others = [o for o in others if radius > 0.0 and squared_distance(o, self) < radius * radius]
        if k is not None:
            return others
        return others[0] if others else None

    def near(self, radius: float, team: str | int | None = None) -> list[Other]:
        """Other entities nearer than radius [m], nearest first; `team` as in `nearest`."""
        search = self._shared.search
        cached = search.cached.get((radius, team, "near"))
        found = cached[self._row] if cached else search.near(self._row, radius, team)
        return [self._other(entity, row) for entity, row in found]


@explained
class Me(Observer):
    """One entity in easy mode: the columns of its plugin by name, its body as the entity believes it to be, and neighbour queries.

    A column of one number is a Python number, of k numbers an array (k,), of `EntityRef` an `Other` or None, of `Subscribe` a list of
    messages.
    """

    __slots__ = ("_cells", "_own", "_seen", "_world")
    _called = "me"
    _writers: ClassVar[dict[str, Write]] = {}

    def __init__(self, shared: Shared, row: int, world: int) -> None:
        set_ = object.__setattr__
        set_(self, "_shared", shared)
        set_(self, "_body", shared.belief)
        set_(self, "_own", shared.own)
        set_(self, "_cells", shared.cells)
        set_(self, "_row", row)
        set_(self, "_world", world)
        set_(self, "_seen", {})

    def __setattr__(self, name: str, value: Any) -> None:
        write = self._writers.get(name)
        if write is write_number:
            try:
                self._cells[name][self._row] = value  # `write_number` inlined, for speed
                return
            except (TypeError, ValueError):
                pass
        if write is None:
            self._cannot_write(name, value)
        else:
            write(self, name, value)

    def _cannot_write(self, name: str, value: Any) -> None:
        plugin = self._shared.plugin
        column = plugin.columns.get(name)
        if column is not None:
            raise AttributeError(
                f"me.{name} is read-only: it is a {type(column).__name__} of {type(plugin).__name__}"
            )
        if name in BODY:
            raise AttributeError(
                f"me.{name} is read-only: {ROLES[plugin.kind]}, and the motion model moves {self._shared.g.who(self._row)}"
            )
        if name in public_names(type(self)):
            raise AttributeError(f"me.{name} is read-only")
        setattr(plugin, name, value)  # raises the error about columns

    # -- others -------------------------------------------------------------------------------------------------------------

    def entity(self, number: Any) -> Other | None:
        """The entity with an id, as sensors and messages give it; None for id 0 and for removed entities.

        Raises:
            ParameterError: No entity has had this id.
        """
        found = self._entity(whole_id("me.entity", number))
        if found is None:
            check_id("me.entity", number, self._shared.g.context, self._world)
        return found

    def _entity(self, entity: int) -> Other | None:
        """The entity with an id; None for id 0 and for removed entities."""
        row = self._shared.row_of(self._world, entity)
        return None if row < 0 else self._other(entity, row)

    def _other(self, entity: int, row: int) -> Other:
        found = self._seen.get(entity)
        if found is None:
            if len(self._seen) >= MAX_CACHED:
                self._seen.clear()
            found = self._seen[entity] = Other(self, entity, row)
        return found  # type: ignore[no-any-return]

    def distance(self, other: Entity) -> float:
        """Distance to another entity [m]."""
        return math.sqrt(squared_distance(other, self))

    # -- time, random numbers, messages -----------------------------------------------------------------------------------------------

    @property
    def t(self) -> float:
        """Time of the visible states [s]."""
        return self._body["t"][self._row]  # type: ignore[no-any-return]

    @property
    def dt(self) -> float:
        """Time since the plugin's last call [s]."""
        return self._shared.g.dt  # type: ignore[no-any-return]

    @property
    def step_count(self) -> int:
        """Current step number."""
        return self._body["step_count"][self._row]  # type: ignore[no-any-return]

    @property
    def motion_state(self) -> np.ndarray:
        """State of the entity's motion model, (m,): the initial state of a planner's rollout."""
        return self._body["motion_state"][self._row]  # type: ignore[no-any-return]

    @property
    def scene(self) -> Scene:
        """Origin, ground, boundaries and bases."""
        return self._shared.g.scene  # type: ignore[no-any-return]

    @property
    def draw(self) -> WorldDraw:
        """Draw shapes in this entity's world: `me.draw.line(pos=...)`, as `g.draw`."""
        return WorldDraw(self._shared.g.draw, self._world)

    def uniform(self, label: str = "") -> float:
        """The next uniform draw in [0, 1) for this entity, step and label, independent of other entities and worlds."""
        return self._shared.draws.next(self._row, "uniform", label)  # type: ignore[no-any-return]

    random = uniform

    def normal(self, label: str = "") -> float:
        """The next standard normal draw; otherwise as `uniform`."""
        return self._shared.draws.next(self._row, "normal", label)  # type: ignore[no-any-return]

    def fail(self, why: str) -> None:
        """End this entity's world with an error at the end of the step. Other worlds continue."""
        self._shared.g.fail(self._row, why)

    def _messages(self, topic: str) -> list[ReceivedMessage]:
        shared = self._shared
        of_row = shared.heard.get(topic)
        if of_row is None:
            of_row = shared.heard[topic] = shared.own[topic].by_row()
        return [ReceivedMessage(self, batch, i) for batch, i in of_row(self._row)]

    def publish(self, topic: str, **fields: Any) -> None:
        """Publish a message on the topic of a `Publish` column. `EntityRef` fields take entities."""
        plugin = self._shared.plugin
        if not isinstance(plugin.columns.get(topic), Publish):
            topics = [k for k, c in plugin.columns.items() if isinstance(c, Publish)]
            raise AttributeError(
                f"{type(plugin).__name__} has no Publish column {topic!r}{nearest_name(topic, topics)}; {listed(topics)}"
            )
        self._own[topic].publish([self._row], **with_ids(fields))

    def _body_row(self) -> int:
        return self._row + self._shared.g.first  # type: ignore[no-any-return]

    @property
    def _id(self) -> int:
        return self._body["id"][self._row]  # type: ignore[no-any-return]

    def __repr__(self) -> str:
        return f"<{self._shared.g.who(self._row)}>"
