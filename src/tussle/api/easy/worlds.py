"""What a world's plugin is given in easy mode: one world, and the entities in it."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np

from tussle.api.easy.entities import Entity, Other, Seeing, offered, square_between
from tussle.api.easy.looks import DrawIn, Draws
from tussle.api.easy.search import Search
from tussle.api.easy.values import BODY, Cells, Columns, ReceivedMessage, Write, make_type, plain
from tussle.api.world import WorldView
from tussle.columns import Column, State
from tussle.errors import ParameterError, listed, nearest_name
from tussle.messages import Message
from tussle.scene import Scene

WRITABLE = ("health", "force", "torque")


class WorldLook:
    """What the worlds of one plugin share during a call.

    Attributes:
        plugin: The bound plugin.
        author: What its author knows as `self`.
        g: The view.
        own: The plugin's columns.
        truth: Body columns of everybody.
        teams: Number of each team -> its place in columns per team.
    """

    def __init__(self, plugin: Any, w: WorldView, hook: str) -> None:
        self.plugin, self.author, self.g = plugin, plugin._for_one(), w
        self.own: dict[str, Any] = plugin.__dict__
        self.cells = Cells(self.own)
        self.bodies = w.bodies
        self.truth = Columns(w.bodies)
        self.teams = {team: place for place, team in enumerate(w.teams.tolist())}
        self.search, self.draws = Search(w), Draws(w, w.n_worlds)
        self.draws.clear(hook)

    def world(self, number: int) -> OneWorld:
        """One of the worlds."""
        one: OneWorld = self.plugin.world_types[0](self, number)
        return one


class Member(Seeing, Other):
    """An entity in a world plugin: its body, the plugin's columns per entity, and whom it is near.

    `health`, `force` [N] and `torque` [N m] can be written by interactions; it is moved by `w.move` and removed by `w.kill`. What `near`
    and `nearest` find has `offset` and `distance`.
    """

    __slots__ = ()
    _called = "an entity"
    _writers: ClassVar[dict[str, Write]] = {}

    def __init__(self, look: WorldLook, entity: int, row: int, by: Any = None) -> None:
        set_ = object.__setattr__
        for name, value in zip(
            ("_look", "_body", "_row", "_by", "_id"), (look, look.truth, row, by or self, entity), strict=True
        ):
            set_(self, name, value)

    @property
    def _own(self) -> dict[str, Any]:
        return self._look.own  # type: ignore[no-any-return]

    @property
    def _cells(self) -> Cells:
        return self._look.cells  # type: ignore[no-any-return]

    def __setattr__(self, name: str, value: Any) -> None:
        write = self._writers.get(name)
        if write is not None:
            write(self, name, value)
        elif name in WRITABLE:
            getattr(self._look.bodies, name)[..., self._row] = value
        elif name in BODY:
            self._refuse(
                f"{name} of an entity is read-only; pos, vel and quat change by w.move(entity, pos=...)"
            )
        else:
            names = [*self._writers, *WRITABLE]
            self._refuse(
                f"an entity's {name!r} cannot be written{nearest_name(name, names)}; {listed(names)}"
            )

    def _other(self, entity: int, row: int) -> Member:
        return type(self)(self._look, entity, row, self)


class OneWorld:
    """One world in easy mode: its entities, the plugin's columns by name, and the means to change what is in it.

    Numbers are Python's, several are an array (k,); a column per team is read and written by team number: `w.lost[2] += 1`.
    """

    __slots__ = ("_cells", "_look", "_members", "_own", "_row")
    _called: ClassVar[str] = "w"
    _columns: ClassVar[tuple[str, ...]] = ()
    _writers: ClassVar[dict[str, Write]] = {}
    _look: WorldLook
    _row: int

    def __init__(self, look: WorldLook, world: int) -> None:
        set_ = object.__setattr__
        set_(self, "_look", look)
        set_(self, "_own", look.own)
        set_(self, "_cells", look.cells)
        set_(self, "_row", world)
        set_(self, "_members", None)

    def __getattr__(self, name: str) -> Any:
        if name in self._columns:
            self._refuse(f"w.{name} is sent, not read: w.publish(its message type, ...)")
        allowed = list(dict.fromkeys((*self._columns, *offered(type(self)))))
        self._refuse(f"w has no {name!r}{nearest_name(name, allowed)}; {listed(allowed)}")

    def __setattr__(self, name: str, value: Any) -> None:
        write = self._writers.get(name)
        if write is not None:
            write(self, name, value)
            return
        column = self._look.plugin.columns.get(name)
        if isinstance(column, State):
            whole = {"team": f"w.{name}[team]", "entity": f"entity.{name}"}[column.per]
            self._refuse(f"{name} has a value per {column.per}: write {whole} = value")
        if column is not None or hasattr(type(self), name):
            self._refuse(f"w.{name} is read-only")
        setattr(self._look.plugin, name, value)  # refused there, with the sentence on columns

    def _refuse(self, text: str) -> Any:
        raise AttributeError(f"{type(self._look.plugin).__name__}: {text}")

    # -- entities -------------------------------------------------------------------------------------------------------------

    @property
    def entities(self) -> list[Member]:
        """All entities of this world, by id."""
        if self._members is None:
            look, (rows, start, _, _) = self._look, self._look.g._bodies.layout()
            mine = rows[start[self._row] : start[self._row + 1]].tolist()
            member = look.plugin.world_types[1]
            ids = look.truth["id"]
            object.__setattr__(self, "_members", [member(look, ids[row], row) for row in mine])
        return list(self._members)

    def entity(self, number: int) -> Member | None:
        """The entity of an id; None for 0 and for who is gone."""
        row = self._look.g.rows_at(np.array([self._row]), np.array([number])).item()
        return None if row < 0 else self._look.plugin.world_types[1](self._look, number, row)

    _entity = entity

    def distance(self, first: Entity, second: Entity) -> float:
        """Distance between two entities [m]."""
        return math.sqrt(square_between(first, second))

    def kill(self, entity: Member, why: str) -> None:
        """Remove an entity at the end of this step; others still see it until then."""
        self._look.g.kill(self._rows("kill", entity), why)

    def move(self, entity: Member, *, pos: Any = None, vel: Any = None, quat: Any = None) -> None:
        """Put an entity elsewhere: pos [m], vel [m/s], (3,), quat, (4,); its motion model takes it over."""
        self._look.g.move(self._rows("move", entity), pos=pos, vel=vel, quat=quat)
        self._look.truth.clear()
        self._look.search.clear()

    def _rows(self, what: str, entity: Any) -> np.ndarray:
        if not isinstance(entity, Member):
            raise ParameterError(f"w.{what} takes an entity, of w.entities or of a message, not {entity!r}")
        return np.array([entity._row])

    def spawn(self, block: str, **where: Any) -> None:
        """Ask for a new entity of a block; it appears at the beginning of the next step.

        Args:
            block: Name of the entity block that serves as template.
            **where: pos, vel (3,), quat (4,), team; what is missing is the block's.
        """
        self._look.g.spawn(block, self._row, **where)

    # -- messages, chance, time -----------------------------------------------------------------------------------------------

    def inbox(self, type_: type[Message]) -> list[ReceivedMessage]:
        """All messages of a type published so far in this step in this world, whatever their topic, by sender."""
        batch = self._look.g.inbox(type_)
        first, last = np.searchsorted(batch.world, (self._row, self._row + 1)).tolist()
        return [ReceivedMessage(self, batch, i) for i in range(first, last)]

    def publish(self, type_: type[Message], network: str = "", **fields: Any) -> None:
        """Send a message in the name of the world; fields that refer to entities take entities."""
        self._look.g.publish(type_, self._row, network, **plain(fields))

    def uniform(self, label: str = "") -> float:
        """A draw in [0, 1), in each step the next one under its label: the same in this world whatever others there are."""
        return self._look.draws.next(self._row, "uniform", label)

    random = uniform

    def normal(self, label: str = "") -> float:
        """A standard normal draw; as `uniform`."""
        return self._look.draws.next(self._row, "normal", label)

    @property
    def t(self) -> float:
        """Time of the states that are seen [s]."""
        return self._look.g.t.item(self._row)  # type: ignore[no-any-return]

    @property
    def dt(self) -> float:
        """Time since the plugin's last call [s]."""
        return self._look.g.dt

    @property
    def step_count(self) -> int:
        """Number of the step."""
        return self._look.g.step_count.item(self._row)  # type: ignore[no-any-return]

    @property
    def seed(self) -> int:
        """Seed of this world."""
        return self._look.g.seeds.item(self._row)  # type: ignore[no-any-return]

    @property
    def teams(self) -> list[int]:
        """Team numbers of the mission, ascending."""
        return list(self._look.teams)

    @property
    def scene(self) -> Scene:
        """Origin, ground, boundaries."""
        return self._look.g.scene

    @property
    def draw(self) -> DrawIn:
        """Draws shapes: `w.draw.line(pos=...)`, as elsewhere, in this world."""
        return DrawIn(self._look.g.draw, self._row)

    def __repr__(self) -> str:
        return f"<world {self._row}>"


def make_world_types(columns: dict[str, Column], owner: str) -> tuple[type[OneWorld], type[Member]]:
    """`OneWorld` and `Member` with a plugin's columns as attributes."""
    of_entity = {k: c for k, c in columns.items() if isinstance(c, State) and c.per == "entity"}
    of_world = {k: c for k, c in columns.items() if k not in of_entity}
    return make_type(OneWorld, of_world, owner), make_type(Member, of_entity, owner)
