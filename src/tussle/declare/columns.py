"""Columns: each array of a plugin is declared once, as a class attribute.

On the class, the attribute is the declaration (unit, shape, default, bounds, one line of documentation). On a plugin inside a
simulation, the same name is the array. Allocation, constructors, sweeps, wiring checks, reset, snapshots, hashing and the plugin's
page all read this declaration.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from tussle.arguments import explained
from tussle.declare import texts, units
from tussle.declare.displays import line, page, shortened, table
from tussle.errors import DeclarationError, ParameterError, UnitError, nearest_name

PER = ("entity", "world", "team")
MAX_NUMBER = 1e30
"""Largest finite number of a parameter: with larger ones, products of a few overflow."""
WHOLE = re.compile(r"[+-]?[0-9]{1,20}")
MAX_INTEGER = 2**53
"""All integers up to this magnitude are exact in float64."""


class Column:
    """A declared array of a plugin; abstract.

    Attributes:
        name: The attribute's name on the class, set by Python.
        owner: Name of the class that declares it.
        doc: One-line description.
    """

    name: str = ""
    owner: str = ""

    def __init_subclass__(cls) -> None:
        if "__init__" in vars(cls):
            cls.__init__ = explained(cls.__init__)  # type: ignore[method-assign]

    def __init__(self, *, doc: str = "") -> None:
        self.doc = doc

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name
        self.owner = owner.__name__

    def __get__(self, instance: object | None, owner: type) -> Any:
        # Not a data descriptor, so that Python finds the array in the bound plugin's __dict__ first, in 30 ns.
        if instance is None:
            return self
        raise AttributeError(
            f"{type(instance).__name__}.{self.name} is an array only inside a simulation; this plugin is not bound to one"
        )

    def __repr__(self) -> str:
        return line(type(self).__name__, f"{self.owner}.{self.name}".strip("."), *self._facts())

    def _facts(self) -> tuple[str, ...]:
        """What `repr` says besides the name."""
        return ()

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and self.__dict__ == other.__dict__

    __hash__ = object.__hash__


def _fields(text: str, what: str) -> tuple[str, ...]:
    if not isinstance(text, str):
        raise DeclarationError(f"{what}: names = {text!r:.60} is not allowed; it takes a text, such as 'x y'")
    names = tuple(text.split())
    for name in names:
        if not name.isidentifier():
            raise DeclarationError(f"{what}: {name!r} is not a valid name; separate names by spaces")
    if len(set(names)) != len(names):
        raise DeclarationError(f"{what}: duplicate name in {text!r}")
    return names


class Numbers(Column):
    """A column of numbers; abstract.

    Attributes:
        fields: Names of the components; empty for one number per row.
        units: Unit of each component.
        text_units: Unit of a bare number in a text, for each component.
        dtype: float, int or bool.
        ragged: Whether each row holds a list, of any length, of items with these components; the array is a `RaggedColumn`.
        recorded: Whether run directories have the column without being asked.
    """

    recorded: bool = False
    default: Any

    def __init__(
        self, fields: str, unit: str, dtype: type, doc: str, ragged: bool = False, text_unit: str = ""
    ) -> None:
        super().__init__(doc=doc)
        self.ragged = ragged
        self.fields = _fields(fields, type(self).__name__)
        self.unit = unit
        self.units, self.text_units = (
            units.split_units(each, max(1, len(self.fields))) for each in (unit, text_unit or unit)
        )
        for each in self.units:
            if not units.is_si(each):
                raise DeclarationError(
                    f"{type(self).__name__}: {each!r} is not an SI unit; declare the SI unit"
                    + (", and text_unit for mission files" if isinstance(self, Param) else "")
                )
        if dtype not in (float, int, bool):
            raise DeclarationError(f"{type(self).__name__}: dtype {dtype!r} is not one of float, int, bool")
        self.dtype = dtype

    def _facts(self) -> tuple[str, ...]:
        return f"list of {' '.join(self.fields)}".strip() if self.ragged else " ".join(
            self.fields
        ), f"[{self.unit}]" * bool(self.unit)

    def _set_default(self, default: Any) -> None:
        """Set the value of a new row: one number, or one for each component."""
        values = tuple(default) if isinstance(default, (tuple, list, np.ndarray)) else (default,)
        is_alone = not isinstance(default, (tuple, list, np.ndarray))
        allowed = {float: "a number", int: "a whole number of 64 bits", bool: "true or false"}[self.dtype]
        if not all(map(self._holds, values)) or not (is_alone or len(values) == len(self.fields)):
            several = f", or {len(self.fields)} ({', '.join(self.fields)})" if self.fields else ""
            raise DeclarationError(
                f"{type(self).__name__}: default = {default!r:.60} is not allowed; it takes {allowed}{several}"
            )
        self.default = default if is_alone else values

    def _holds(self, value: Any) -> bool:
        """Whether a value is one of the column's type."""
        if not isinstance(value, (int, float, np.number, np.bool_)):
            return False
        if self.dtype is int:
            return bool(float(value).is_integer() and -(2**63) <= value < 2**63)
        return self.dtype is float or bool(value in (0, 1))

    def _set_recorded(self, recorded: bool) -> None:
        if recorded and self.ragged:
            raise DeclarationError(
                f"{type(self).__name__}: a ragged column is not recorded; recorded=True needs one value per entity"
            )
        self.recorded = recorded

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of one row's value, or of one item if ragged: () or (k,)."""
        return (len(self.fields),) if self.fields else ()

    def read(self, text: str, from_geodetic: Callable[..., Any] | None = None) -> Any:
        """Parse a value of this column, written as in a mission file, to SI units; see `Param.convert`.

        Raises:
            ParameterError: The text is not a value of this column.
        """
        if len(text.replace(",", " ").split()) > texts.MAX_ITEMS:
            raise ParameterError(f"{texts.shown(text)} has more than {texts.MAX_ITEMS:,} numbers")
        parts = list(zip(self.fields or ("",), self.units, self.text_units, strict=True))
        if self.ragged:
            return texts.items(text, parts, bool(self.fields), from_geodetic)
        if self.fields:
            return texts.row(text, parts)
        if self.dtype is int and WHOLE.fullmatch(text.strip()):
            return int(text)
        return texts.truth(text) if self.dtype is bool else units.parse(text, *parts[0][1:])


class Param(Numbers):
    """A parameter: one value per row, or one Python value per plugin if it is `structural` or a text.

    Args:
        default: Value in SI units; its type (float, int, bool, str, tuple of floats) is the parameter's type.
        unit: SI unit, or one per field.
        ge: Smallest allowed value.
        gt: Lower bound, not allowed itself.
        le: Largest allowed value.
        lt: Upper bound, not allowed itself.
        choices: Allowed values.
        fields: Names of the components of a tuple.
        text_unit: Unit of a bare number in a mission file, where the format's unit is not SI.
        structural: The value changes the code path or array shapes, so entities with different values are in different groups.
        ragged: A list of rows of `fields` instead of one value.
        doc: One-line description.
    """

    def __init__(
        self,
        default: Any,
        *,
        unit: str = "",
        ge: float | None = None,
        gt: float | None = None,
        le: float | None = None,
        lt: float | None = None,
        choices: Iterable[Any] = (),
        fields: str = "",
        text_unit: str = "",
        structural: bool = False,
        ragged: bool = False,
        doc: str = "",
    ) -> None:
        self.is_text = isinstance(default, str)
        dtype: type = bool if isinstance(default, bool) else int if isinstance(default, int) else float
        if dtype is int and unit:
            dtype = float  # Param(35, unit="m/s") accepts 35.5
        super().__init__(fields, unit, dtype, doc, ragged, text_unit)
        self.ge, self.gt, self.le, self.lt = ge, gt, le, lt
        self.choices = tuple(choices)
        self.structural = structural or self.is_text
        self.default = self.convert(default, "default")

    def _facts(self) -> tuple[str, ...]:
        return f"default {shortened(repr(self.default))}", self.allowed()

    def _repr_html_(self) -> str:
        rows = [
            ("default", repr(self.default)),
            ("unit", self.unit),
            ("takes", self.allowed()),
            ("fields", " ".join(self.fields)),
        ]
        return page(
            f"{self.owner}.{self.name}".strip("."),
            [self.doc],
            table(("", ""), [row for row in rows if row[1]]),
        )

    @property
    def is_row_data(self) -> bool:
        """True if there is one number (or tuple) per row, stored as a column of the group's table."""
        return not self.structural and not self.ragged

    def allowed(self) -> str:
        """Describe the allowed values, for messages and pages."""
        if self.choices:
            return "one of " + ", ".join(repr(c) for c in self.choices)
        bounds = [(self.ge, ">="), (self.gt, ">"), (self.le, "<="), (self.lt, "<")]
        text = " and ".join(
            f"{sign} {bound:g}" for bound, sign in bounds if bound not in (None, -math.inf, math.inf)
        )
        kind = (
            "text"
            if self.is_text
            else {float: "a finite number", int: "a whole number", bool: "true or false"}[self.dtype]
        )
        unit = f" in {self.unit}" if self.unit else ""
        return f"{kind}{unit}{' ' + text if text else ''}"

    def read(self, text: str, from_geodetic: Callable[..., Any] | None = None) -> Any:
        """Parse a value as `Numbers.read` does; the value of a text parameter is the text itself."""
        return text.strip() if self.is_text and not self.ragged else super().read(text, from_geodetic)

    def convert(self, value: Any, where: str = "", from_geodetic: Callable[..., Any] | None = None) -> Any:
        """Check a value and convert it to plain Python in SI units. A number is SI; a text is parsed as in a mission file.

        Args:
            value: A number; a text: "40 kt", "40" in `text_unit`, "1, 0.2, 1, 45" for several fields, `[ 0 1 ] [ 2 3 ]` for a list,
                "true"; or a sequence of numbers and texts.
            where: Place for the error message.
            from_geodetic: Converts latitude, longitude [rad], altitude [m], (3,), to a world position [m]; used for rows that begin
                with GPS.

        Raises:
            ParameterError: The value has the wrong type or unit, is NaN, or is out of bounds.
        """
        if isinstance(value, str):
            value = self._parsed(value, where, lambda: self.read(value, from_geodetic))
        if self.ragged:
            if not isinstance(value, Iterable):
                raise self._error(where, value, f"a list of {self.allowed()}")
            return tuple(self._item(item, where) for item in value)
        return self._item(value, where)

    def _parsed(self, text: str, where: str, read: Callable[[], Any]) -> Any:
        """Result of `read`; its errors get the place and the text."""
        try:
            return read()
        except UnitError as error:
            raise UnitError(f"{self._place(where)} = {text!r}: {error}") from None
        except ParameterError as error:
            if self.fields or self.ragged:
                raise ParameterError(f"{self._place(where)} = {texts.shown(text)}: {error}") from None
            raise self._error(where, text, self.allowed()) from None

    def _item(self, value: Any, where: str) -> Any:
        """Convert one number, or one per field."""
        if not self.fields:
            return self._number(value, 0, where)
        try:
            values = tuple(value)
        except TypeError:
            values = ()
        if len(values) != len(self.fields):
            raise self._error(where, value, f"{len(self.fields)} values ({', '.join(self.fields)})")
        return tuple(self._number(v, i, where) for i, v in enumerate(values))

    def _number(self, value: Any, i: int, where: str) -> Any:
        if self.is_text:
            if not isinstance(value, str) or (self.choices and value not in self.choices):
                raise self._error(where, value, self.allowed())
            return value
        if isinstance(value, str):
            text = value
            value = self._parsed(text, where, lambda: units.parse(text, self.units[i], self.text_units[i]))
        if self.dtype is bool and isinstance(value, (bool, np.bool_, int, float)) and value in (0, 1):
            return bool(value)
        if self.dtype is bool or isinstance(value, (bool, np.bool_)):
            raise self._error(where, value, self.allowed())
        if isinstance(value, int) and abs(value) > MAX_NUMBER:  # which may be more than a float holds
            raise self._error(where, value, f"{self.allowed()}, of at most {MAX_NUMBER:g}")
        if not isinstance(value, (int, float, np.integer, np.floating)) or math.isnan(value):
            raise self._error(where, value, self.allowed())
        is_inexact = isinstance(value, float) and not abs(value) <= MAX_INTEGER
        if self.dtype is int and (is_inexact or int(value) != value):
            raise self._error(where, value, self.allowed())
        number = int(value) if self.dtype is int else float(value)
        if not self.is_within(number):
            raise self._error(where, value, self.allowed())
        if self.dtype is int and not -(2**63) <= number < 2**63:
            raise self._error(where, value, f"{self.allowed()} of 64 bits")
        if MAX_NUMBER < abs(number) < math.inf:
            raise self._error(where, value, f"{self.allowed()}, of at most {MAX_NUMBER:g}")
        return number

    def is_within(self, number: float) -> bool:
        """Return True if a number is within the bounds and one of the choices."""
        return (
            (self.ge is None or number >= self.ge)
            and (self.gt is None or number > self.gt)
            and (self.le is None or number <= self.le)
            and (self.lt is None or number < self.lt)
            and (not self.choices or number in self.choices)
        )

    def _place(self, where: str) -> str:
        where = "" if where == "default" else where
        if not self.owner:
            return where or "Param"
        return f"{where}: {self.owner}.{self.name}" if where else f"{self.owner}.{self.name}"

    def _error(self, where: str, value: Any, allowed: str) -> ParameterError:
        guess = nearest_name(value, self.choices) if isinstance(value, str) and self.is_text else ""
        shown = value.item() if isinstance(value, np.generic) else value
        return ParameterError(f"{self._place(where)} = {shown!r} is not allowed{guess}; it takes {allowed}")

    def __get__(self, instance: object | None, owner: type) -> Any:
        if instance is None:
            return self
        return instance.__dict__["_values"][self.name]


class State(Numbers):
    """State of a plugin: everything that it keeps from one call to the next.

    Args:
        fields: Names of the components; empty for one number per row.
        unit: SI unit, or one per field.
        default: Value of a new row.
        dtype: float, int or bool.
        per: "entity"; for world plugins also "world" or "team".
        ragged: One list per entity, initially empty; `fields` are the components of an item.
        doc: One-line description.
        recorded: Whether run directories have the column without being asked; see `tussle.Recorder`.
    """

    def __init__(
        self,
        fields: str = "",
        unit: str = "",
        default: float = 0.0,
        dtype: type = float,
        per: str = "entity",
        ragged: bool = False,
        doc: str = "",
        recorded: bool = False,
    ) -> None:
        super().__init__(fields, unit, dtype, doc, ragged)
        self._set_recorded(recorded)
        if per not in PER:
            raise DeclarationError(f"State: per={per!r} is not one of {', '.join(PER)}")
        if per == "team" and fields:
            raise DeclarationError(
                f"State: fields={fields!r} with per='team', which has one number per team; declare several columns"
            )
        if ragged and (per != "entity" or default):
            raise DeclarationError(
                "State: a ragged column is per entity and initially empty; it takes neither per nor default"
            )
        self._set_default(default)
        self.per = per


class Channel(Numbers):
    """A column that is connected to other plugins by channel names; abstract."""

    def __init__(self, channels: str, unit: str, ragged: bool, fields: str, doc: str) -> None:
        kind = type(self).__name__
        names = _fields(channels, kind)
        if fields and not ragged:
            raise DeclarationError(
                f"{kind}: fields={fields!r} needs ragged=True; channel names are the first argument"
            )
        if ragged and len(names) > 1:
            raise DeclarationError(
                f"{kind}: a ragged column is one channel, not {len(names)}; name the components of an item with fields={channels!r}"
            )
        super().__init__(fields if ragged else channels, unit, float, doc, ragged)
        self._names = names

    @property
    def channels(self) -> tuple[str, ...]:
        """Channel names; by default the attribute's name."""
        return self._names or (self.name,)


class Input(Channel):
    """Values that another plugin of the entity writes: `Input(unit="m/s")`, or `Input("velocity_x velocity_y", unit="m/s")`.

    Args:
        channels: Channel names, separated by spaces; by default the attribute's name.
        unit: SI unit, or one per channel or field.
        optional: No plugin needs to write it; without a writer it stays at `default`, or empty if ragged.
        default: Value before the first write; not for ragged inputs.
        ragged: One channel whose value is a list per entity, (k, m).
        fields: Names of the k components of an item; empty for a list of numbers.
        doc: One-line description.
    """

    def __init__(
        self, channels: str = "", unit: str = "", optional: bool = False, default: float = 0.0, ragged: bool = False,
        fields: str = "", doc: str = "",
    ) -> None:  # fmt: skip
        super().__init__(channels, unit, ragged, fields, doc)
        if ragged and default:
            raise DeclarationError("Input: a ragged column is initially empty; it takes no default")
        self.optional = optional
        self._set_default(default)


class Output(Channel):
    """Values that this plugin writes for the other plugins of its entity; arguments as those of `Input`.

    Args:
        finite: Whether all values are finite; False for a range that is inf where nothing is. The conformance kit checks it.
        recorded: As of `State`.
    """

    def __init__(
        self, channels: str = "", unit: str = "", ragged: bool = False, fields: str = "", doc: str = "", finite: bool = True,
        recorded: bool = False,
    ) -> None:  # fmt: skip
        super().__init__(channels, unit, ragged, fields, doc)
        self._set_recorded(recorded)
        self.default = 0.0
        self.finite = finite


class EntityRef(Numbers):
    """Reference to another entity by its id, which stays valid when rows change; 0 is no entity."""

    def __init__(self, doc: str = "") -> None:
        super().__init__("", "", int, doc)
        self.default = 0
        self.per = "entity"


class Handle(Column):
    """An opaque object per row: a process, a socket, a flight model.

    The plugin may define these methods:

    * open_one(row): Create the object of a new row; `row` has world, id, seed, position and more. Without it the object is None.
    * close_one(handle): Release one row's object; called exactly once for each opened object.
    * save_one(handle): Picklable state of one row's object. Without it snapshots are refused.
    * load_one(row, state): Recreate a saved object. Without it `open_one` is called.
    * ready(g): Whether the external side is ready for the next step; called until it is true or until `ready_timeout`.

    Args:
        max_worlds: Largest stack of worlds that the objects allow; None for no limit.
        ready_timeout: Longest wait for `ready` [s of wall time].
        doc: One-line description.
        is_text: In a message: the object is a text, which a user can type.
    """

    def __init__(
        self, max_worlds: int | None = None, ready_timeout: float = 10.0, doc: str = "", is_text: bool = False
    ) -> None:
        super().__init__(doc=doc)
        self.max_worlds, self.ready_timeout, self.is_text = max_worlds, ready_timeout, is_text

    @staticmethod
    def most_worlds(plugin: Any) -> int | None:
        """The largest stack of worlds that all handles of a plugin allow; None for no limit."""
        limits = [h.max_worlds for h in plugin.handles().values() if h.max_worlds is not None]
        return min(limits, default=None)


class Children(Column):
    """Plugins inside a plugin: a list of plugins of one kind.

    Args:
        kind: Base class of the plugins.
        by_state: They may have `states`, in which they act (see `tussle.api.StateFollower`).
        shares_channels: Their channels are those of the entity; otherwise they are private to the outer plugin.
        fields: Text parameters of `kind`, if a mission file gives each plugin as a row of their values: `[ a b ] [ c d ]`.
        default: The plugins of an outer plugin for which none are given; an empty list is given, too.
        doc: One-line description.
    """

    def __init__(
        self,
        kind: type,
        by_state: bool = False,
        shares_channels: bool = False,
        fields: str = "",
        default: Iterable[Any] = (),
        doc: str = "",
    ) -> None:
        super().__init__(doc=doc)
        self.kind, self.by_state, self.shares_channels = kind, by_state, shares_channels
        self.default = tuple(default)
        self.fields = _fields(fields, "Children")


class Field(Numbers):
    """A field of a message type; with `ragged` a list of items, (k, m) or (m,) per message.

    `example` has the values with which a form for the message begins; by default zeros.
    """

    def __init__(
        self,
        fields: str = "",
        unit: str = "",
        dtype: type = float,
        ragged: bool = False,
        doc: str = "",
        example: tuple[float, ...] = (),
    ) -> None:
        super().__init__(fields, unit, dtype, doc, ragged)
        self.example = example
        self.default = 0


class Topic(Column):
    """One end of a topic; abstract. A topic is (network, name, message type).

    Args:
        message: The message type.
        topic: Topic name; by default the type's name.
        network: Instance name of the network that carries it; by default the network that reaches everyone.
        topic_param: Name of a text Param of the plugin that gives the topic's name.
        network_param: Name of a text Param of the plugin that gives the network's name.
        doc: One-line description.
    """

    def __init__(
        self,
        message: type,
        *,
        topic: str = "",
        network: str = "",
        topic_param: str = "",
        network_param: str = "",
        doc: str = "",
    ) -> None:
        super().__init__(doc=doc)
        if not isinstance(getattr(message, "fields", None), dict):
            raise DeclarationError(f"{type(self).__name__}: {message!r:.60} is not a class of messages")
        self.message = message
        self.topic = topic or message.__name__
        self.network = network
        self.topic_param = topic_param
        self.network_param = network_param


class Publish(Topic):
    """The sending end of a topic."""


class Subscribe(Topic):
    """The receiving end of a topic.

    Args:
        message: The message type.
        from_outside: Messages may come from outside, by `Simulation.publish`: no warning if no plugin publishes them.
        **place: Topic, network and `doc`, as for `Publish`.
    """

    def __init__(self, message: type, *, from_outside: bool = False, **place: str) -> None:
        super().__init__(message, **place)
        self.from_outside = from_outside
