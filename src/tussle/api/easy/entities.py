"""What an entity's plugin is given in easy mode: the entity itself, and the others that it sees."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, ClassVar

from tussle.api.easy.looks import DrawIn, Look
from tussle.api.easy.values import (
    BODY,
    NUMBERS,
    VECTORS,
    Columns,
    ReceivedMessage,
    Write,
    plain,
    write_number,
)
from tussle.columns import Publish
from tussle.errors import ParameterError, listed, nearest_name
from tussle.scene import Scene

if TYPE_CHECKING:
    import numpy as np


ROLES = {
    "autonomy": "an autonomy decides",
    "controller": "a controller steers",
    "sensor": "a sensor measures",
}
MOST_KEPT = 64
"""Others that an entity keeps as objects, so as not to make them anew in each step."""


def _read_only(of: Any, value: Any) -> None:
    of._refuse(f"{of._called} is read-only")


def _of_body(name: str, doc: str) -> property:
    return property(lambda of: of._body[name][of._row], _read_only, doc=doc)


class Entity:
    """An entity's body, as plain values; abstract."""

    __slots__ = ("_body", "_look", "_row")
    _called: ClassVar[str] = "entity"
    _columns: ClassVar[tuple[str, ...]] = ()
    _body: Columns
    _row: int
    _look: Any

    def __getattr__(self, name: str) -> Any:
        if name in self._columns:
            self._refuse(f"me.{name} is sent, not read: me.publish({name!r}, ...)")
        allowed = list(dict.fromkeys((*self._columns, *BODY, *offered(type(self)))))
        self._refuse(f"{self._called} has no {name!r}{nearest_name(name, allowed)}; {listed(allowed)}")

    def _refuse(self, text: str) -> Any:
        raise AttributeError(f"{type(self._look.plugin).__name__}: {text}")

    def _body_row(self) -> int:
        return self._row

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Entity):
            return NotImplemented
        return self._body_row() == other._body_row() and self._look.bodies is other._look.bodies

    def __hash__(self) -> int:
        return hash(self._body_row())


for _name, _doc in {**VECTORS, **NUMBERS}.items():
    setattr(Entity, _name, _of_body(_name, _doc))


def offered(cls: type) -> list[str]:
    """What an author is offered beside columns and the body."""
    return [n for n in dir(cls) if not n.startswith("_") and n not in BODY]


def square_between(a: Entity, b: Entity) -> float:
    """Squared distance [m^2], as the kernels compute it."""
    try:
        ax, ay, az = a._body.xyz
        bx, by, bz = b._body.xyz
    except AttributeError:
        raise ParameterError(f"a distance is between two entities, not {a!r} and {b!r}") from None
    i, j = a._row, b._row
    x, y, z = ax[i] - bx[j], ay[i] - by[j], az[i] - bz[j]
    return x * x + y * y + z * z  # type: ignore[no-any-return]


class Other(Entity):
    """Another entity, as it is: its body, and where it is from the one that sees it."""

    __slots__ = ("_by", "_id")
    _called = "another entity"
    _id: int

    def __init__(self, by: Any, entity: int, row: int) -> None:
        self._look, self._body, self._row = by._look, by._look.truth, row
        self._by, self._id = by, entity

    @property
    def offset(self) -> np.ndarray:
        """From the one that sees it [m], (3,), world frame."""
        by = self._by
        return self._body["pos"][self._row] - by._body["pos"][by._row]  # type: ignore[no-any-return]

    @property
    def distance(self) -> float:
        """Distance from the one that sees it [m]."""
        return math.sqrt(square_between(self, self._by))

    def __repr__(self) -> str:
        return f"<entity {self._id} of team {self._body['team'][self._row]}>"


class Seeing(Entity):
    """An entity that can ask who is near it; abstract."""

    __slots__ = ()

    if TYPE_CHECKING:

        def _other(self, entity: int, row: int) -> Any: ...

    def nearest(
        self, team: str | int | None = None, radius: float | None = None, k: int | None = None
    ) -> Any:
        """The nearest other entity, None when there is none; the smaller id at equal distance.

        Args:
            team: "own", "other", a team number, or None for all.
            radius: Only who is nearer than that [m].
            k: Give a list of the k nearest, nearest first; shorter where there are fewer.
        """
        if k is not None and (type(k) is not int or k < 1):
            raise ParameterError(f"nearest: k = {k!r} is not allowed; it takes a whole number >= 1")
        search = self._look.search
        known = search.known.get((k or 1, team))
        found = known[self._row] if known else search.nearest(self._row, k or 1, team)
        if k is None and radius is None:
            return self._other(*found[0]) if found else None
        others = [self._other(entity, row) for entity, row in found]
        if radius is not None:
            others = [o for o in others if radius > 0.0 and square_between(o, self) < radius * radius]
        if k is not None:
            return others
        return others[0] if others else None

    def near(self, radius: float, team: str | int | None = None) -> list[Other]:
        """Other entities nearer than radius [m], nearest first; `team` as in `nearest`."""
        search = self._look.search
        known = search.known.get((radius, team, "near"))
        found = known[self._row] if known else search.near(self._row, radius, team)
        return [self._other(entity, row) for entity, row in found]


class Me(Seeing):
    """One entity in easy mode: its plugin's columns by name, its body as it believes it to be, and its view of others.

    Numbers are Python's, several are an array (k,), an `EntityRef` is an `Other` or None, a `Subscribe` a list of messages.
    """

    __slots__ = ("_cells", "_own", "_seen", "_world")
    _called = "me"
    _writers: ClassVar[dict[str, Write]] = {}

    def __init__(self, look: Look, row: int, world: int) -> None:
        set_ = object.__setattr__
        set_(self, "_look", look)
        set_(self, "_body", look.mine)
        set_(self, "_own", look.own)
        set_(self, "_cells", look.cells)
        set_(self, "_row", row)
        set_(self, "_world", world)
        set_(self, "_seen", {})

    def __setattr__(self, name: str, value: Any) -> None:
        write = self._writers.get(name)
        if write is write_number:
            try:
                self._cells[name][self._row] = value  # as `write_number` does, without a call
                return
            except (TypeError, ValueError):
                pass
        if write is None:
            self._cannot_write(name, value)
        else:
            write(self, name, value)

    def _cannot_write(self, name: str, value: Any) -> None:
        plugin = self._look.plugin
        column = plugin.columns.get(name)
        if column is not None:
            raise AttributeError(
                f"me.{name} is read-only: it is a {type(column).__name__} of {type(plugin).__name__}"
            )
        if name in BODY:
            raise AttributeError(
                f"me.{name} is read-only: {ROLES[plugin.kind]}, its motion model moves {self._look.g.who(self._row)}"
            )
        if name in offered(type(self)):
            raise AttributeError(f"me.{name} is read-only")
        setattr(plugin, name, value)  # refused there, with the sentence on columns

    # -- others -------------------------------------------------------------------------------------------------------------

    def _entity(self, entity: int) -> Other | None:
        """The entity of an id; None for 0 and for who is gone."""
        row = self._look.row_of(self._world, entity)
        return None if row < 0 else self._other(entity, row)

    def _other(self, entity: int, row: int) -> Other:
        found = self._seen.get(entity)
        if found is None:
            if len(self._seen) >= MOST_KEPT:
                self._seen.clear()
            found = self._seen[entity] = Other(self, entity, row)
        return found  # type: ignore[no-any-return]

    def distance(self, other: Entity) -> float:
        """Distance to another entity [m]."""
        return math.sqrt(square_between(other, self))

    # -- time, chance, messages -----------------------------------------------------------------------------------------------

    @property
    def t(self) -> float:
        """Time of the states that are seen [s]."""
        return self._body["t"][self._row]  # type: ignore[no-any-return]

    @property
    def dt(self) -> float:
        """Time since the plugin's last call [s]."""
        return self._look.g.dt  # type: ignore[no-any-return]

    @property
    def step_count(self) -> int:
        """Number of the step."""
        return self._body["step_count"][self._row]  # type: ignore[no-any-return]

    @property
    def motion_state(self) -> np.ndarray:
        """State of the entity's motion model, (m,): where a planner's rollout begins."""
        return self._body["motion_state"][self._row]  # type: ignore[no-any-return]

    @property
    def scene(self) -> Scene:
        """Origin, ground, boundaries."""
        return self._look.g.scene  # type: ignore[no-any-return]

    @property
    def draw(self) -> DrawIn:
        """Draws shapes: `me.draw.line(pos=...)`, as `g.draw`, in this entity's world."""
        return DrawIn(self._look.g.draw, self._world)

    def uniform(self, label: str = "") -> float:
        """A draw in [0, 1), in each step the next one under its label: the same for this entity whatever else there is."""
        return self._look.draws.next(self._row, "uniform", label)  # type: ignore[no-any-return]

    random = uniform

    def normal(self, label: str = "") -> float:
        """A standard normal draw; as `uniform`."""
        return self._look.draws.next(self._row, "normal", label)  # type: ignore[no-any-return]

    def fail(self, why: str) -> None:
        """End this entity's world with an error at the end of the step; the others go on."""
        self._look.g.fail(self._row, why)

    def _messages(self, topic: str) -> list[ReceivedMessage]:
        look = self._look
        of_row = look.heard.get(topic)
        if of_row is None:
            of_row = look.heard[topic] = look.own[topic].by_row()
        return [ReceivedMessage(self, batch, i) for batch, i in of_row(self._row)]

    def publish(self, topic: str, **fields: Any) -> None:
        """Send a message to a `Publish` column; fields that refer to entities take entities."""
        plugin = self._look.plugin
        if not isinstance(plugin.columns.get(topic), Publish):
            topics = [k for k, c in plugin.columns.items() if isinstance(c, Publish)]
            raise AttributeError(
                f"{type(plugin).__name__} publishes no {topic!r}{nearest_name(topic, topics)}; {listed(topics)}"
            )
        self._own[topic].publish([self._row], **plain(fields))

    def _body_row(self) -> int:
        return self._row + self._look.g.first  # type: ignore[no-any-return]

    @property
    def _id(self) -> int:
        return self._body["id"][self._row]  # type: ignore[no-any-return]

    def __repr__(self) -> str:
        return f"<{self._look.g.who(self._row)}>"
