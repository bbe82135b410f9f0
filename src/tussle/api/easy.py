"""Easy mode: an autonomy that is written for one entity at a time, in plain Python, and can be stepped through in a debugger."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from tussle.api.kinds import Autonomy
from tussle.columns import Column, EntityRef, Handle, Output, Publish, State, Subscribe
from tussle.errors import listed, nearest_name
from tussle.lists import RaggedColumn

if TYPE_CHECKING:
    from collections.abc import Callable

    from tussle.api.bodies import BodyView
    from tussle.api.group import GroupView
    from tussle.messages import Batch

VECTORS = ("pos", "vel", "quat", "omega", "force", "torque", "forward")
NUMBERS = ("yaw", "climb", "roll", "health", "radius", "mass", "id", "team")


class EasyAutonomy(Autonomy):
    """Decides for one entity at a time; abstract. Fill in `step_one`."""

    def step_one(self, me: Any) -> None:
        """One step of one entity: read and write columns as attributes of `me` (see `Me`)."""
        raise TypeError(f"{type(self).__name__} has no step_one")

    def step(self, g: GroupView) -> None:
        heard = self._messages()
        for row in range(g.n):
            try:
                self.step_one(Me(self, g, row, heard))
            except Exception:
                g.failing_row = row
                raise

    def _messages(self) -> dict[str, Callable[[int], list[tuple[Batch, int]]]]:
        return {k: self.__dict__[k].by_row() for k, c in self.columns.items() if isinstance(c, Subscribe)}


class Other:
    """Another entity as one sees it: pos, vel [m, m/s] (3,), quat (4,), yaw, climb, roll [rad], health, radius, mass, id, team."""

    __slots__ = ("_bodies", "_row")

    def __init__(self, bodies: BodyView, row: int) -> None:
        self._bodies = bodies
        self._row = row

    def __getattr__(self, name: str) -> Any:
        if name in VECTORS:
            return getattr(self._bodies, name)[:, self._row]
        if name in NUMBERS:
            return getattr(self._bodies, name)[self._row].item()
        allowed = [*VECTORS, *NUMBERS]
        raise AttributeError(
            f"another entity has no {name!r}{nearest_name(name, allowed)}; {listed(allowed)}"
        )

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, Other)
            and other._row == self._row
            and other._bodies._bodies is self._bodies._bodies
        )

    def __hash__(self) -> int:
        return hash(self._row)

    def __repr__(self) -> str:
        return f"<entity {self.id} of team {self.team}>"


class Me:
    """One entity in easy mode: its plugin's columns by name, its body (pos, vel, yaw, climb ...), and its view of others.

    Vectors are (3,) arrays, numbers are Python numbers, entity references are `Other` or None, subscriptions lists of messages.
    """

    __slots__ = ("_g", "_heard", "_plugin", "_row")

    def __init__(
        self,
        plugin: EasyAutonomy,
        g: GroupView,
        row: int,
        heard: dict[str, Callable[[int], list[tuple[Batch, int]]]],
    ) -> None:
        set_ = object.__setattr__
        set_(self, "_plugin", plugin)
        set_(self, "_g", g)
        set_(self, "_row", row)
        set_(self, "_heard", heard)

    def __getattr__(self, name: str) -> Any:
        plugin, g, row = self._plugin, self._g, self._row
        column = plugin.columns.get(name)
        if column is not None:
            return self._column(name, column)
        if name in VECTORS or name == "motion_state":
            return getattr(g, name)[:, row]
        if name in NUMBERS:
            return getattr(g, name)[row].item()
        if name == "t":
            return float(g.t[row])
        if name in ("dt", "scene"):
            return getattr(g, name)
        allowed = [*plugin.columns, *VECTORS, *NUMBERS, "t", "dt"]
        raise AttributeError(f"me has no {name!r}{nearest_name(name, allowed)}; {listed(allowed)}")

    def _column(self, name: str, column: Column) -> Any:
        plugin, g, row = self._plugin, self._g, self._row
        if isinstance(column, EntityRef):
            found = self._body_row(int(plugin.__dict__[name][row]))
            return None if found < 0 else Other(g.bodies, found)
        if isinstance(column, Subscribe):
            return [Heard(batch, i) for batch, i in self._heard[name](row)]
        if isinstance(column, Handle):
            return plugin.__dict__[name][row]
        value = plugin.__dict__.get(name)
        if not isinstance(value, (np.ndarray, RaggedColumn)):
            return getattr(plugin, name)
        value = value[..., row]
        return value if value.ndim else value.item()

    def _body_row(self, entity: int) -> int:
        if not entity:
            return -1
        g = self._g
        return int(g.bodies_rows(g.world[self._row : self._row + 1], np.array([entity]))[0])

    def __setattr__(self, name: str, value: Any) -> None:
        plugin, g, row = self._plugin, self._g, self._row
        column = plugin.columns.get(name)
        if isinstance(column, EntityRef):
            plugin.__dict__[name][row] = (
                0 if value is None else value.id if isinstance(value, Other) else int(value)
            )
        elif isinstance(column, (State, Output)):
            plugin.__dict__[name][..., row] = value
        elif column is not None:
            raise AttributeError(
                f"me.{name} is read-only: it is a {type(column).__name__} of {type(plugin).__name__}"
            )
        elif name in VECTORS or name in NUMBERS or name in ("t", "dt"):
            raise AttributeError(
                f"me.{name} is read-only: an autonomy decides, its motion model moves {g.who(row)}"
            )
        else:
            setattr(plugin, name, value)  # refused there, with the sentence on columns

    def nearest(self, team: int | None = None) -> Other | None:
        """Nearest other entity (of a team), None when there is none; the smaller id at equal distance."""
        row = self._g.nearest_row(self._row, team)
        return None if row < 0 else Other(self._g.bodies, row)

    def near(self, radius: float, team: int | None = None) -> list[Other]:
        """Other entities (of a team) nearer than radius [m], nearest first."""
        return [Other(self._g.bodies, r) for r in self._g.near_rows(self._row, radius, team)]

    def distance(self, other: Other) -> float:
        """Distance to another entity [m]."""
        x, y, z = other.pos - self.pos
        return math.sqrt(x * x + y * y + z * z)

    def uniform(self, label: str) -> float:
        """A draw in [0, 1): the same for this entity whatever else there is in the world. A second draw needs another label."""
        return float(self._g.draws_of(self._row, "uniform", label, 1)[0])

    def normal(self, label: str) -> float:
        """A standard normal draw; as `uniform`."""
        return float(self._g.draws_of(self._row, "normal", label, 1)[0])

    def publish(self, topic: str, **fields: Any) -> None:
        """Send a message to a `Publish` column; entity references may be given as entities."""
        publisher = self._plugin.__dict__.get(topic)
        if not isinstance(self._plugin.columns.get(topic), Publish):
            topics = [k for k, c in self._plugin.columns.items() if isinstance(c, Publish)]
            raise AttributeError(
                f"{type(self._plugin).__name__} publishes no {topic!r}{nearest_name(topic, topics)}; {listed(topics)}"
            )
        values = {k: v.id if isinstance(v, Other) else v for k, v in fields.items()}
        assert publisher is not None
        publisher.publish([self._row], **values)


class Heard:
    """One message: its fields as attributes, and `sender`, the id of who sent it."""

    __slots__ = ("_batch", "_i")

    def __init__(self, batch: Any, i: int) -> None:
        self._batch = batch
        self._i = i

    def __getattr__(self, name: str) -> Any:
        value = self._batch.sender if name == "sender" else getattr(self._batch, name)
        item = value[..., self._i] if isinstance(value, np.ndarray) else value[self._i]
        return item.item() if isinstance(item, np.generic) else item
