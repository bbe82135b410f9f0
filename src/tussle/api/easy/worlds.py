"""Arguments of world plugins in easy mode: one world (`OneWorld`) and the entities in it (`Member`)."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np

from tussle.api.bodies import IN_PLACE
from tussle.api.easy.entities import (
    Entity,
    Observer,
    Other,
    public_names,
    squared_distance,
    whole_id,
)
from tussle.api.easy.shared import RandomNumbers, Search, WorldDraw
from tussle.api.easy.values import (
    BODY,
    VECTORS,
    Cells,
    Columns,
    ReceivedMessage,
    Write,
    check_id,
    make_type,
    with_ids,
)
from tussle.api.world import WorldView
from tussle.arguments import explained
from tussle.declare.columns import Column, State
from tussle.declare.messages import Message
from tussle.errors import ParameterError, listed, nearest_name
from tussle.world.scene import Scene


class WorldShared:
    """Data shared by all worlds of one plugin during a call.

    Attributes:
        plugin: The bound plugin.
        author: The object passed as `self` to the author's methods.
        g: The view.
        own: Columns of the plugin.
        cells: Columns of one number, as memory views.
        truth: Body columns of all entities.
        teams: Team number -> its row in per-team columns.
    """

    def __init__(self, plugin: Any, w: WorldView, hook: str) -> None:
        self.plugin, self.author, self.g = plugin, plugin._author_self(), w
        self.own: dict[str, Any] = plugin.__dict__
        self.cells = Cells(self.own)
        self.bodies = w.bodies
        self.truth = Columns(w.bodies)
        self.teams = {team: place for place, team in enumerate(w.teams.tolist())}
        self.search, self.draws = Search(w), RandomNumbers(w, w.n_worlds)
        self.draws.clear(hook)

    def world(self, number: int) -> OneWorld:
        one: OneWorld = self.plugin.world_types[0](self, number)
        return one


@explained
class Member(Observer, Other):
    """An entity in a world plugin: its body, the plugin's per-entity columns and neighbour queries.

    Interactions may write `health`, `force` [N] and `torque` [N m]. `w.move` moves an entity and `w.kill` removes it. Entities found by
    `near` and `nearest` have `offset` and `distance`.
    """

    __slots__ = ()
    _called = "an entity"
    _writers: ClassVar[dict[str, Write]] = {}

    def __init__(self, shared: WorldShared, entity: int, row: int, by: Any = None) -> None:
        set_ = object.__setattr__
        for name, value in zip(
            ("_shared", "_body", "_row", "_by", "_id"),
            (shared, shared.truth, row, by or self, entity),
            strict=True,
        ):
            set_(self, name, value)

    @property
    def _own(self) -> dict[str, Any]:
        return self._shared.own  # type: ignore[no-any-return]

    @property
    def _cells(self) -> Cells:
        return self._shared.cells  # type: ignore[no-any-return]

    def __setattr__(self, name: str, value: Any) -> None:
        write = self._writers.get(name)
        if write is not None:
            write(self, name, value)
        elif name in IN_PLACE:
            try:  # NumPy takes None for NaN
                getattr(self._shared.bodies, name)[..., self._row] = "" if value is None else value
            except (TypeError, ValueError):
                self._refuse(
                    f"an entity's {name} takes {'three numbers' if name in VECTORS else 'a number'}, not {value!r:.60}"
                )
        elif name in BODY:
            self._refuse(
                f"{name} of an entity is read-only; w.move(entity, pos=...) changes pos, vel and quat"
            )
        else:
            names = [*self._writers, *IN_PLACE]
            self._refuse(
                f"an entity's {name!r} cannot be written{nearest_name(name, names)}; {listed(names)}"
            )

    def _other(self, entity: int, row: int) -> Member:
        return type(self)(self._shared, entity, row, self)


@explained
class OneWorld:
    """One world in easy mode: its entities, the plugin's columns by name, and methods that change the world.

    A column of one number is a Python number, of k numbers an array (k,). A per-team column is indexed by team number: `w.lost[2] += 1`.
    """

    __slots__ = ("_cells", "_members", "_own", "_row", "_shared")
    _called: ClassVar[str] = "w"
    _columns: ClassVar[tuple[str, ...]] = ()
    _writers: ClassVar[dict[str, Write]] = {}
    _shared: WorldShared
    _row: int

    def __init__(self, shared: WorldShared, world: int) -> None:
        set_ = object.__setattr__
        set_(self, "_shared", shared)
        set_(self, "_own", shared.own)
        set_(self, "_cells", shared.cells)
        set_(self, "_row", world)
        set_(self, "_members", None)

    def __getattr__(self, name: str) -> Any:
        if name in self._columns:
            self._refuse(f"w.{name} cannot be read, only published: w.publish(message type, ...)")
        allowed = list(dict.fromkeys((*self._columns, *public_names(type(self)))))
        self._refuse(f"w has no {name!r}{nearest_name(name, allowed)}; {listed(allowed)}")

    def __setattr__(self, name: str, value: Any) -> None:
        write = self._writers.get(name)
        if write is not None:
            write(self, name, value)
            return
        column = self._shared.plugin.columns.get(name)
        if isinstance(column, State):
            whole = {"team": f"w.{name}[team]", "entity": f"entity.{name}"}[column.per]
            self._refuse(f"{name} has one value per {column.per}: write {whole} = value")
        if column is not None or hasattr(type(self), name):
            self._refuse(f"w.{name} is read-only")
        setattr(self._shared.plugin, name, value)  # raises the error about columns

    def _refuse(self, text: str) -> Any:
        raise AttributeError(f"{type(self._shared.plugin).__name__}: {text}")

    # -- entities -------------------------------------------------------------------------------------------------------------

    @property
    def entities(self) -> list[Member]:
        """All entities of this world, by id."""
        if self._members is None:
            shared, (rows, start, _, _) = self._shared, self._shared.g._bodies.layout()
            mine = rows[start[self._row] : start[self._row + 1]].tolist()
            member = shared.plugin.world_types[1]
            ids = shared.truth["id"]
            object.__setattr__(self, "_members", [member(shared, ids[row], row) for row in mine])
        return list(self._members)

    def entity(self, number: int) -> Member | None:
        """The entity with an id; None for id 0 and for removed entities.

        Raises:
            ParameterError: No entity has had this id.
        """
        found = self._entity(whole_id("w.entity", number))
        if found is None:
            check_id("w.entity", number, self._shared.g.context, self._row)
        return found

    def _entity(self, number: int) -> Member | None:
        row = self._shared.g.rows_at(np.array([self._row]), np.array([number])).item()
        return None if row < 0 else self._shared.plugin.world_types[1](self._shared, number, row)

    def distance(self, first: Entity, second: Entity) -> float:
        """Distance between two entities [m]."""
        return math.sqrt(squared_distance(first, second))

    def kill(self, entity: Member, why: str) -> bool:
        """Remove an entity at the end of this step, for the reason `why`. Until then it stays visible.

        Returns:
            True if it is removed by this call, False if an earlier one in this step did so.
        """
        return bool(self._shared.g.kill(self._rows("kill", entity), why).item())

    def move(self, entity: Member, *, pos: Any = None, vel: Any = None, quat: Any = None) -> None:
        """Set pos [m] (3,), vel [m/s] (3,) or quat (4,) of an entity. Its motion model continues from the new state."""
        self._shared.g.move(self._rows("move", entity), pos=pos, vel=vel, quat=quat)
        self._shared.truth.clear()
        self._shared.search.clear()

    def _rows(self, what: str, entity: Any) -> np.ndarray:
        if not isinstance(entity, Member):
            raise ParameterError(
                f"w.{what} takes an entity from w.entities or from a message, not {entity!r}"
            )
        if entity._shared is not self._shared or self._shared.g.world[entity._row] != self._row:
            raise ParameterError(
                f"w.{what}: the entity {entity._id} was found in another {'world' if entity._shared is self._shared else 'call'}; "
                f"keep its id, and find it again with w.entity({entity._id})"
            )
        return np.array([entity._row])

    def spawn(self, block: str, **where: Any) -> None:
        """Request a new entity of a block. It is born at the beginning of the next step.

        Args:
            block: Name of the entity block used as template.
            **where: pos [m] (3,), vel [m/s] (3,), quat (4,), team; the block's values by default.
        """
        self._shared.g.spawn(block, self._row, **where)

    # -- messages, random numbers, time -----------------------------------------------------------------------------------------------

    def inbox(self, type_: type[Message]) -> list[ReceivedMessage]:
        """All messages of a type published so far in this step in this world, on any topic, ordered by sender."""
        batch = self._shared.g.inbox(type_)
        first, last = np.searchsorted(batch.world, (self._row, self._row + 1)).tolist()
        return [ReceivedMessage(self, batch, i) for i in range(first, last)]

    def publish(self, type_: type[Message], network: str = "", **fields: Any) -> None:
        """Publish a message with the world as sender. `EntityRef` fields take entities."""
        self._shared.g.publish(type_, self._row, network, **with_ids(fields))

    def uniform(self, label: str = "") -> float:
        """The next uniform draw in [0, 1) for this world, step and label, independent of other worlds."""
        return self._shared.draws.next(self._row, "uniform", label)

    random = uniform

    def normal(self, label: str = "") -> float:
        """The next standard normal draw; otherwise as `uniform`."""
        return self._shared.draws.next(self._row, "normal", label)

    @property
    def t(self) -> float:
        """Time of the visible states [s]."""
        return self._shared.g.t.item(self._row)  # type: ignore[no-any-return]

    @property
    def dt(self) -> float:
        """Time since the plugin's last call [s]."""
        return self._shared.g.dt

    @property
    def step_count(self) -> int:
        """Current step number."""
        return self._shared.g.step_count.item(self._row)  # type: ignore[no-any-return]

    @property
    def seed(self) -> int:
        """Seed of this world."""
        return self._shared.g.seeds.item(self._row)  # type: ignore[no-any-return]

    @property
    def teams(self) -> list[int]:
        """Team numbers of the mission, ascending."""
        return list(self._shared.teams)

    @property
    def scene(self) -> Scene:
        """Origin, ground, boundaries and bases."""
        return self._shared.g.scene

    @property
    def draw(self) -> WorldDraw:
        """Draw shapes in this world: `w.draw.line(pos=...)`, as `g.draw`."""
        return WorldDraw(self._shared.g.draw, self._row)

    def __repr__(self) -> str:
        return f"<world {self._row}>"


def make_world_types(columns: dict[str, Column], owner: str) -> tuple[type[OneWorld], type[Member]]:
    """Subclasses of `OneWorld` and `Member` with the columns of a plugin as attributes."""
    of_entity = {k: c for k, c in columns.items() if isinstance(c, State) and c.per == "entity"}
    of_world = {k: c for k, c in columns.items() if k not in of_entity}
    return make_type(OneWorld, of_world, owner), make_type(Member, of_entity, owner)
