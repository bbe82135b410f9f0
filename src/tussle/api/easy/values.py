"""Columns as plain values: numbers, small arrays, entities and lists of messages."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, MutableMapping
from typing import Any

import numpy as np

from tussle.api.bodies import read_only
from tussle.declare.columns import (
    Children,
    Column,
    EntityRef,
    Handle,
    Numbers,
    Output,
    Param,
    Publish,
    State,
    Subscribe,
)
from tussle.declare.messages import Messages
from tussle.errors import DeclarationError, ParameterError

VECTORS = {
    "pos": "Position [m], (3,), world frame.",
    "vel": "Velocity [m/s], (3,), world frame.",
    "quat": "Attitude (w, x, y, z), (4,).",
    "omega": "Angular velocity [rad/s], (3,).",
    "force": "Force exerted by interactions [N], (3,), world frame.",
    "torque": "Torque exerted by interactions [N m], (3,).",
    "forward": "Unit vector along the body x axis, (3,), world frame.",
}
NUMBERS = {
    "yaw": "Heading, counter-clockwise from East [rad].",
    "climb": "Elevation of the nose, up positive [rad].",
    "roll": "Bank, right wing down positive [rad].",
    "health": "Health; the entity is removed when it reaches 0.",
    "radius": "Body radius [m].",
    "mass": "Mass of the block [kg].",
    "id": "Id of the entity, unique in its world.",
    "team": "Team number.",
}
BODY = (*VECTORS, *NUMBERS)

Read = Callable[[Any], Any]
Write = Callable[[Any, str, Any], None]


def reader(name: str, column: Column) -> Read:
    """Getter of a column, for objects with `_own` (columns of the plugin) and `_row` (row in them)."""
    if isinstance(column, EntityRef):
        return lambda of: of._seen.get(number := of._cells[name][of._row]) or of._entity(number)
    if isinstance(column, Subscribe):
        return lambda of: of._messages(name)
    if isinstance(column, Children) or (isinstance(column, Param) and column.structural):
        return lambda of: of._own[name]
    if isinstance(column, Handle):
        return lambda of: of._own[name][of._row]
    if isinstance(column, State) and column.per == "team":
        return lambda of: PerTeam(of._own[name][:, of._row], of._shared.teams, f"{of._called}.{name}")
    assert isinstance(column, Numbers)
    if column.fields or is_list(column):
        return lambda of: of._own[name][..., of._row]
    return lambda of: of._cells[name][of._row]


def is_list(column: Column) -> bool:
    """Return True if the column holds a list of any length per row."""
    return isinstance(column, Numbers) and column.ragged


def writer(name: str, column: Column) -> Write | None:
    """Setter of a column; None if the plugin may not write it by attribute."""
    if isinstance(column, EntityRef):
        return _write_reference
    if not isinstance(column, (State, Output)) or (isinstance(column, State) and column.per == "team"):
        return None
    if column.dtype is int and not is_list(column):
        return _write_wholes if column.fields else _write_whole
    if column.dtype is bool and not is_list(column):
        return _write_truths if column.fields else _write_truth
    return _write_several if column.fields or is_list(column) else write_number


def write_number(of: Any, name: str, value: Any) -> None:
    """Setter of a column of one number."""
    try:
        of._cells[name][of._row] = value
    except (TypeError, ValueError):
        try:
            of._own[name][of._row] = float("" if value is None else value)  # NumPy takes None for NaN
        except (TypeError, ValueError):
            raise _wrong_value(of, name, value, "a number") from None


def are_whole(value: Any) -> bool:
    """Whether a value, or each of several, is a whole number of 64 bits."""
    given = np.asarray(value)
    if given.dtype.kind == "f":
        return bool((given == np.floor(given)).all() and (np.abs(given) < 2.0**63).all())
    return given.dtype.kind in "bi" or (given.dtype.kind == "u" and bool((given < 2**63).all()))


def _write_whole(of: Any, name: str, value: Any) -> None:
    """Setter of a column of one whole number."""
    try:
        of._cells[name][of._row] = value
    except (TypeError, ValueError):
        _write_wholes(of, name, value)


def _write_wholes(of: Any, name: str, value: Any) -> None:
    """Setter of a column of whole numbers."""
    if not are_whole(value):
        raise _wrong_value(of, name, value, "whole numbers")
    _write_several(of, name, value)


def _write_truth(of: Any, name: str, value: Any) -> None:
    """Setter of a column of one truth value."""
    if type(value) is bool:
        of._cells[name][of._row] = value
    else:
        _write_truths(of, name, value)


def _write_truths(of: Any, name: str, value: Any) -> None:
    """Setter of a column of truth values."""
    given = np.asarray(value)
    if given.dtype.kind != "b" and not (
        given.dtype.kind in "iuf" and bool(((given == 0) | (given == 1)).all())
    ):
        raise _wrong_value(of, name, value, "true or false")
    _write_several(of, name, value)


def _write_several(of: Any, name: str, value: Any) -> None:
    try:
        of._own[name][..., of._row] = "" if value is None else value  # NumPy takes None for NaN
    except (TypeError, ValueError):
        fields = type(of._shared.plugin).columns[name].fields
        wanted = f"{len(fields)} numbers ({', '.join(fields)})" if fields else "a whole number"
        raise _wrong_value(of, name, value, wanted) from None


def _wrong_value(of: Any, name: str, value: Any, wanted: str) -> ParameterError:
    shape = np.shape(value) if isinstance(value, (np.ndarray, list, tuple)) else ()
    given = f"of shape {shape}" if shape else f"{value!r:.60}"
    return ParameterError(f"{type(of._shared.plugin).__name__}.{name} takes {wanted}, not {given}")


def check_id(called: str, number: Any, context: Any, world: int) -> None:
    """See that an entity with an id has been in a world.

    Raises:
        ParameterError: None has.
    """
    largest = int(context.simulation().state.births.next_id[world]) - 1
    if number > largest:
        raise ParameterError(
            f"{called}: there has been no entity {number!r}; the largest id so far is {largest}"
        )


def _write_reference(of: Any, name: str, value: Any) -> None:
    number = 0 if value is None else getattr(value, "_id", value)
    if type(number) is not int or number < 0:
        raise _wrong_value(of, name, value, "an entity or None")
    if number is value:  # an id
        view = of._shared.g
        check_id(f"{of._called}.{name}", number, view.context, int(view.world[of._row]))
    of._own[name][of._row] = number


def make_type(base: type, columns: Mapping[str, Column], owner: str) -> type:
    """Subclass of `base` with the columns of a plugin as attributes.

    Raises:
        DeclarationError: A column has the name of an attribute of `base`.
    """
    for name in columns:
        if hasattr(base, name) and name not in BODY:
            raise DeclarationError(
                f"{owner}.{name}: {base._called}.{name} is an attribute of easy mode; choose another name"  # type: ignore[attr-defined]
            )
    own: dict[str, Any] = {
        name: property(reader(name, column), doc=column.doc)
        for name, column in columns.items()
        if not isinstance(column, Publish)
    }
    writers = {name: write for name, column in columns.items() if (write := writer(name, column))}
    made = {"__slots__": (), "__doc__": base.__doc__, "_columns": tuple(columns), "_writers": writers, **own}
    return type(base.__name__, (base,), made)


class Cells(dict[str, Any]):
    """Columns of one number, as memory views: these return Python numbers, in half the time of NumPy arrays."""

    def __init__(self, own: dict[str, Any]) -> None:
        super().__init__()
        self._own = own

    def __missing__(self, name: str) -> Any:
        cells = self[name] = memoryview(self._own[name])
        return cells


class Columns(dict[str, Any]):
    """Body columns of a view, by row: memory views for numbers, arrays (n, k) for vectors. Created when first read.

    Attributes:
        xyz: Position east, north and up [m], each a memory view (n,).
    """

    def __init__(self, view: Any) -> None:
        super().__init__()
        self._view = view
        x, y, z = view.pos
        self.xyz: Any = memoryview(x), memoryview(y), memoryview(z)

    def __missing__(self, name: str) -> Any:
        column: Any = getattr(self._view, name)
        column = self[name] = column.T if column.ndim > 1 else memoryview(column)
        return column


class PerTeam(MutableMapping[int, Any]):
    """A per-team column in one world: team number -> value."""

    def __init__(self, values: np.ndarray, teams: dict[int, int], name: str) -> None:
        self._values, self._teams, self._name = values, teams, name

    def _place(self, team: int) -> int:
        try:
            return self._teams[team]
        except KeyError:
            teams = ", ".join(map(str, self._teams))
            raise ParameterError(f"{self._name}: there is no team {team!r}; there are: {teams}") from None

    def __getitem__(self, team: int) -> Any:
        return self._values.item(self._place(team))

    def __setitem__(self, team: int, value: Any) -> None:
        if self._values.dtype.kind == "i" and not are_whole(value):
            raise ParameterError(f"{self._name} takes whole numbers, not {value!r:.60}")
        self._values[self._place(team)] = value

    def __delitem__(self, team: int) -> None:
        raise TypeError(f"{self._name} has one value per team; values cannot be deleted")

    def __iter__(self) -> Iterator[int]:
        return iter(self._teams)

    def __len__(self) -> int:
        return len(self._teams)

    def __repr__(self) -> str:
        return repr(dict(self))


class ReceivedMessage:
    """One message: its fields as attributes, and `sender`. `sender` and `EntityRef` fields are entities, None for removed ones."""

    __slots__ = ("_batch", "_i", "_of")

    def __init__(self, of: Any, batch: Messages, i: int) -> None:
        self._of, self._batch, self._i = of, batch, i

    def __getattr__(self, name: str) -> Any:
        batch, i = self._batch, self._i
        if name == "sender":
            return self._of._entity(batch.sender.item(i))
        values = getattr(batch, name)
        column = batch.type.fields.get(name)
        if isinstance(column, EntityRef):
            return self._of._entity(values.item(i))
        if isinstance(column, Handle):
            return values[i]
        item = values[..., i]
        return read_only(item) if item.ndim else item.item()

    def __repr__(self) -> str:
        fields = ", ".join(f"{name}={getattr(self, name)!r}" for name in self._batch.type.fields)
        return f"<{self._batch.type.__name__} from {self.sender!r}: {fields}>"


def with_ids(fields: dict[str, Any]) -> dict[str, Any]:
    """Message fields with entities replaced by their ids."""
    return {name: getattr(value, "_id", value) for name, value in fields.items()}
