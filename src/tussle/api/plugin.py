"""The base class of all plugins: as data, and bound to a simulation."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from copy import copy
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar, Self, TypeVar

import numpy as np

from tussle.api.laws import NeighborLaw
from tussle.api.overrides import check_names, check_overrides
from tussle.api.row_laws import RowLaw
from tussle.declare.columns import (
    Children,
    Column,
    Handle,
    Input,
    Output,
    Param,
    State,
    Topic,
)
from tussle.errors import DeclarationError, ParameterError, listed, nearest_name

F = TypeVar("F", bound=Callable[..., Any])
C = TypeVar("C", bound=Column)

GRADES = ("portable", "machine", "external")
RATE = Param(1.0, unit="1/s", gt=0.0, lt=math.inf)
RESERVED = ("name", "rate", "states")
TAKEN = ("columns", "services", "wired", "values", "kind", "instance_name", "is_bound", "active_in")
"""Attributes of every plugin, which no column can be."""


@dataclass(frozen=True)
class HistoricAttributes:
    """Differences between a plugin's attributes in SCRIMMAGE mission files and its parameters.

    Attributes:
        renamed: Attribute -> parameter.
        joined: Parameter -> the attributes that are its fields.
        unread: Attributes that are ignored.
        least_zero: Parameters for which a negative number, "none" in SCRIMMAGE, is read as 0.
        differs: Parameter -> note for files that omit it, since SCRIMMAGE has another default.
        chosen_by: Attribute that names the class of a plugin file that the plugin runs; "" for none.
        chosen_default: Its value where the attribute is missing; if no plugin file has it, the plugin itself is meant.
        chosen_kind: What it names, for errors, with {} for the name.
        rest: Parameter that takes all other attributes, as an object in JSON; "" for none.
    """

    renamed: Mapping[str, str] = field(default_factory=dict)
    joined: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    unread: tuple[str, ...] = ()
    least_zero: tuple[str, ...] = ()
    differs: Mapping[str, str] = field(default_factory=dict)
    chosen_by: str = ""
    chosen_default: str = ""
    chosen_kind: str = "class {} with the methods init and step_autonomy"
    rest: str = ""


def service(method: F) -> F:
    """Mark a method as a service, which other plugins call by name with `g.call` or `w.call`."""
    method.__dict__["is_service"] = True
    return method


class Plugin:
    """A part of an entity or of the world; abstract.

    An unbound plugin is data: it compares by value, can be pickled, and its repr shows parameters that differ from the defaults. A
    simulation binds a copy, whose declared names are arrays.

    Args:
        name: Name of this instance, by default the class name. Plugins of one class in one entity need different names.
        rate: Calls per second [Hz]; None calls it in every step.
        states: States of the entity in which a plugin inside another one acts, such as "Search, Track"; None for all. `active_in` has
            their names.
        **values: Parameters, by their declared names.

    Raises:
        ParameterError: A parameter is unknown or its value is not allowed.
    """

    grade: ClassVar[str] = "machine"
    """Reproducibility: "portable" (same bits on every machine), "machine" (same bits on one machine) or "external" (no promise)."""

    historic_attributes: ClassVar[HistoricAttributes] = HistoricAttributes()
    """Attributes of SCRIMMAGE mission files that differ from the parameters."""

    needed_services: ClassVar[tuple[str, ...]] = ()
    """Services that the plugin calls; a mission in which none offers them is refused."""

    named_teams: ClassVar[tuple[str, ...]] = ()
    """Parameters that are numbers of teams; a mission file that gives one without entities gets a note. Numbers below 1 are no teams."""

    named_files: ClassVar[tuple[str, ...]] = ()
    """Parameters that are paths of files, which are looked for when a mission file is read; it is refused without them."""

    columns: ClassVar[dict[str, Column]] = {}
    services: ClassVar[tuple[str, ...]] = ()
    row_laws: ClassVar[dict[str, RowLaw]] = {}
    neighbor_laws: ClassVar[tuple[NeighborLaw, ...]] = ()

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        cls.columns = {
            k: c for base in reversed(cls.__mro__) for k, c in vars(base).items() if isinstance(c, Column)
        }
        cls.services = tuple(
            sorted(k for k in dir(cls) if getattr(getattr(cls, k, None), "is_service", False))
        )
        if cls.grade not in GRADES:
            raise DeclarationError(f"{cls.__name__}.grade is {cls.grade!r}; allowed are {', '.join(GRADES)}")
        check_names(cls, (*RESERVED, *TAKEN))
        check_overrides(cls)
        for name, law in vars(cls).items():
            if isinstance(law, (NeighborLaw, RowLaw)):
                law.check(cls, name)
        inherited = [(k, value) for base in reversed(cls.__mro__) for k, value in vars(base).items()]
        cls.row_laws = {k: law for k, law in inherited if isinstance(law, RowLaw)}
        cls.neighbor_laws = tuple(law for _, law in inherited if isinstance(law, NeighborLaw))
        params = [
            inspect.Parameter(k, inspect.Parameter.KEYWORD_ONLY, default=c.default)
            for k, c in cls.params().items()
        ]
        params += [
            inspect.Parameter(k, inspect.Parameter.KEYWORD_ONLY, default=())
            for k, c in cls.children().items()
        ]
        params += [inspect.Parameter(k, inspect.Parameter.KEYWORD_ONLY, default=None) for k in RESERVED]
        cls.__signature__ = inspect.Signature(params)  # type: ignore[attr-defined]

    def __init__(
        self,
        *unnamed: Any,
        name: str | None = None,
        rate: float | str | None = None,
        states: str | Iterable[str] | None = None,
        **values: Any,
    ) -> None:
        cls = type(self)
        if unnamed:
            raise ParameterError(
                f"{cls.__name__}({', '.join(map(repr, unnamed))}): give parameters by name; {listed(cls.params())}"
            )
        rate = None if rate is None else RATE.convert(rate, f"{cls.__name__}: rate")
        params, children = cls.params(), cls.children()
        for key in values:
            if key not in params and key not in children:
                allowed = [*params, *children, *RESERVED]
                raise ParameterError(
                    f"{cls.__name__} has no parameter {key!r}{nearest_name(key, allowed)}; {listed(allowed)}"
                )
        resolved = {k: c.convert(values[k]) if k in values else c.default for k, c in params.items()}
        for key, child in children.items():
            resolved[key] = tuple(values.get(key, child.default))
            for plugin in resolved[key]:
                if not isinstance(plugin, child.kind):
                    raise ParameterError(f"{cls.__name__}.{key}: {plugin!r} is no {child.kind.__name__}")
                if plugin.__dict__["rate"] is not None:
                    raise ParameterError(
                        f"{cls.__name__}.{key}: {plugin!r} cannot have a rate; set the rate of {cls.__name__}"
                    )
                if plugin.__dict__["active_in"] and not child.by_state:
                    raise ParameterError(
                        f"{cls.__name__}.{key}: {plugin!r} cannot have states; {cls.__name__} does not follow the state of its entity"
                    )
            names = [plugin.instance_name for plugin in resolved[key]]
            for twice in names:
                if names.count(twice) > 1:
                    raise ParameterError(
                        f"{cls.__name__}.{key}: two plugins are called {twice!r}; rename one with name=..."
                    )
        words = states.replace(",", " ").split() if isinstance(states, str) else (states or ())
        self.__dict__.update(
            _values=resolved,
            _stated=frozenset(values),
            instance_name=name or cls.__name__,
            rate=rate,
            active_in=tuple(words),
        )
        self.check_values()

    def check_values(self) -> None:
        """Check parameters that must fit together, as data; a hook that raises `ParameterError` if they do not."""

    def check_values_with(self, values: dict[str, Any]) -> None:
        """Check other values of parameters, each of which is allowed alone, as data.

        Raises:
            ParameterError: They do not fit together, or not to the parameters that stay.
        """
        other = copy(self)
        other.__dict__["_values"] = self.values | values
        other.check_values()

    def check_order(self, low: str, high: str) -> None:
        """Check that a parameter is not larger than another one; to be called by `check_values` of plugins with lower and upper limits.

        Raises:
            ParameterError: It is.
        """
        least, most = self.values[low], self.values[high]
        if not least <= most:
            raise ParameterError(
                f"{type(self).__name__}.{low} = {least!r} with {high} = {most!r} is not allowed; {low} must not be larger than {high}"
            )

    def check_range(self, low: str, high: str) -> None:
        """Check that a parameter is smaller than another one; to be called by `check_values` of plugins that divide by the difference.

        Raises:
            ParameterError: It is not.
        """
        least, most = self.values[low], self.values[high]
        if not least < most:
            raise ParameterError(
                f"{type(self).__name__}.{low} = {least!r} with {high} = {most!r} is not allowed; {low} must be smaller than {high}"
            )

    # -- declarations ---------------------------------------------------------------------------------------------------

    @classmethod
    def declared(cls, kind: type[C]) -> dict[str, C]:
        """Declarations of one kind, by name, in order of declaration, starting with base classes."""
        return {k: c for k, c in cls.columns.items() if isinstance(c, kind)}

    @classmethod
    def params(cls) -> dict[str, Param]:
        return cls.declared(Param)

    @classmethod
    def children(cls) -> dict[str, Children]:
        return cls.declared(Children)

    @classmethod
    def states(cls) -> dict[str, State]:
        return cls.declared(State)

    @classmethod
    def inputs(cls) -> dict[str, Input]:
        return cls.declared(Input)

    @classmethod
    def outputs(cls) -> dict[str, Output]:
        return cls.declared(Output)

    @classmethod
    def topics(cls) -> dict[str, Topic]:
        return cls.declared(Topic)

    @classmethod
    def handles(cls) -> dict[str, Handle]:
        return cls.declared(Handle)

    # -- as data --------------------------------------------------------------------------------------------------------

    @property
    def values(self) -> dict[str, Any]:
        """Parameters and children by name, in SI units."""
        return dict(self.__dict__["_values"])

    @property
    def stated(self) -> dict[str, Any]:
        """Parameters and children that were given, also those equal to their defaults; the others change with the plugin's laws."""
        return {k: v for k, v in self.__dict__["_values"].items() if k in self.__dict__["_stated"]}

    def replace(self, **values: Any) -> Self:
        """Copy the plugin with other parameters."""
        merged = {
            **self.stated,
            "name": self.__dict__["instance_name"],
            "rate": self.__dict__["rate"],
            "states": self.__dict__["active_in"],
            **values,
        }
        return type(self)(**merged)

    def walk(self) -> Iterator[Plugin]:
        """Yield the plugin and all plugins inside it; of a bound plugin, the bound ones."""
        yield self
        for name in self.children():
            for inner in self.__dict__.get(name, self.values[name]):
                yield from inner.walk()

    def named_regions(self) -> Iterable[float]:
        """Ids of the regions that the plugin asks for with `g.region` or `w.region`; a mission without them is refused."""
        return ()

    def named_blocks(self) -> Iterable[str]:
        """Names of the entity blocks that the plugin refers to; a mission without them is refused."""
        return ()

    def structure(self) -> tuple[Any, ...]:
        """Key that is equal for plugins that can share a group: class, name, rate, states, structural parameters and children."""
        own = self.__dict__["_values"]
        fixed = tuple((k, own[k]) for k, c in self.params().items() if c.structural)
        inner = tuple((k, tuple(c.structure() for c in own[k])) for k in self.children())
        return (type(self), *self._when(), fixed, inner)

    def __eq__(self, other: object) -> bool:
        if type(self) is not type(other):
            return NotImplemented
        return self._identity() == other._identity()

    def __hash__(self) -> int:
        return hash(self._identity())

    def _identity(self) -> tuple[Any, ...]:
        own = self.__dict__
        return (type(self), *self._when(), tuple(own["_values"].items()))

    def _when(self) -> tuple[Any, ...]:
        own = self.__dict__
        return own["instance_name"], own["rate"], own["active_in"]

    def given(self) -> Iterator[tuple[str, Any]]:
        """Yield names and values of the parameters, and of the lists of plugins, that differ from their defaults."""
        values = self.__dict__["_values"]
        yield from ((k, values[k]) for k, c in self.params().items() if values[k] != c.default)
        yield from ((k, list(values[k])) for k, c in self.children().items() if values[k] != c.default)

    def __repr__(self) -> str:
        own = self.__dict__
        parts = [f"{name}={value!r}" for name, value in self.given()]
        if own["instance_name"] != type(self).__name__:
            parts.append(f"name={own['instance_name']!r}")
        if own["rate"] is not None:
            parts.append(f"rate={own['rate']!r}")
        if own["active_in"]:
            parts.append(f"states={', '.join(own['active_in'])!r}")
        return f"{type(self).__name__}({', '.join(parts)})"

    # -- outside of tussle ----------------------------------------------------------------------------------------------

    awaits: ClassVar[str] = ""
    """Program or device that the plugin needs, for `tussle check`; {NAME} stands for a parameter."""

    @classmethod
    def with_files(cls, given: Mapping[str, str], find: Callable[[str], Path]) -> dict[str, str]:
        """Return attributes of a mission's tag that say where the files are that it names; by default those of `named_files`.

        Args:
            given: The attributes as written.
            find: Returns a file by its name or path. It raises a MissingFileError.

        Raises:
            TussleError: A file is missing or wrong.
        """
        return {name: str(find(given[name])) for name in cls.named_files if given.get(name)}

    def stand_in(self, is_moving: bool) -> tuple[str, dict[str, Any], str]:
        """Return name and parameters of a faster plugin that takes the place of this one in mission files; by default none, ("", {}, "").

        Args:
            is_moving: Whether the tag's entities are born with a velocity.

        Returns:
            Its name, its parameters, and if there is none, why: a note on the mission, or "".
        """
        return "", {}, ""

    @property
    def awaited(self) -> str:
        """The program or device that this instance needs; "" for none."""
        return self.awaits.format_map(self.values)

    # -- bound ----------------------------------------------------------------------------------------------------------

    def bound(self) -> Self:
        """Copy the plugin for a simulation, which sets the arrays; the original stays data."""
        for law in self.neighbor_laws:
            law.refresh()
        copy = object.__new__(type(self))
        copy.__dict__.update(self.__dict__, is_bound=True)
        return copy

    def __setattr__(self, name: str, value: Any) -> None:
        cls = type(self)
        if name in cls.columns:
            if not self.__dict__.get("is_bound"):
                raise ParameterError(
                    f"{cls.__name__}.{name} cannot be changed: plugins are immutable; make a copy with .replace({name}=...)"
                )
            array = self.__dict__.get(name)
            if (
                isinstance(array, np.ndarray)
                and isinstance(value, np.ndarray)
                and np.shares_memory(array, value)
            ):
                return  # `self.x += 1` has already written to the column
            raise AttributeError(
                f"{cls.__name__}.{name} is a column: write to it with {self._write_of(name)}"
            )
        raise AttributeError(
            f"{cls.__name__}.{name} is not declared{nearest_name(name, cls.columns)}: one plugin object serves all entities, so values "
            f"are stored in columns: declare {name} = State(...) in the class, then write {self._write_of(name)}"
        )

    def _write_of(self, name: str) -> str:
        return f"self.{name}[:] = value"

    def __getattr__(self, name: str) -> Any:
        cls = type(self)
        if name in cls.columns:  # Column.__get__ raises the error: the plugin is not bound
            return cls.columns[name].__get__(self, cls)
        if name.startswith("__"):  # copying and pickling ask for many
            raise AttributeError(name)
        allowed = [n for n in (*cls.columns, *dir(cls)) if not n.startswith("_")]
        raise AttributeError(
            f"{cls.__name__} has no {name!r}{nearest_name(name, allowed)}; {listed(cls.columns)}"
        )
