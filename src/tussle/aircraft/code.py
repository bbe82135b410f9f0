"""Emission of a kernel's source: properties, state, constants, and sections of code that share them.

Each property and each piece of state is a local variable of the generated function. Those that must survive a step are slots of the
state, float64 [slot, row]; those that are always written before they are read are not stored.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np

from tussle.aircraft.node import AircraftError, Element
from tussle.errors import clipped, nearest_name
from tussle.numeric.source import INDENT

MAX_LINES = 40_000
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?\Z")
SURFACE = re.compile(
    r"fcs/(left-aileron|right-aileron|elevator|rudder|flap|speedbrake|spoiler)-pos-(rad|deg)\Z"
)
DEGREES, RADIANS = repr(180.0 / np.pi), repr(np.pi / 180.0)
STATE = "state/"
"""Begins the names of state that is no property."""


def normal(name: str) -> str:
    """The name of a property without the index 0."""
    return name.strip().replace("[0]", "").removeprefix("/fdm/jsbsim/")


@dataclass
class CodeLine:
    """A line of a section.

    Attributes:
        depth: Its indentation.
        text: Source text.
        name: The property or state that it writes and that, if nobody reads it, makes the line needless; "" otherwise.
    """

    depth: int
    text: str
    name: str = ""


@dataclass
class CodeSection:
    """Lines of code that run in order.

    Attributes:
        lines: The lines.
        written: Names that are written for certain so far.
        live: Names that are read before they are written for certain: they come from the state.
        touched: All names that are written somewhere.
    """

    lines: list[CodeLine] = field(default_factory=list)
    written: set[str] = field(default_factory=set)
    live: dict[str, None] = field(default_factory=dict)
    touched: dict[str, None] = field(default_factory=dict)


class Code:
    """Code that the parts of an aircraft emit, in the order in which it runs.

    Attributes:
        initial: Property -> its value before the first step.
        constants: Property -> value that never changes.
        inputs: Properties that may be set from outside; they are slots that nobody needs to write.
        tables: Numbers of all tables, one after the other: `tables` of the generated function.
        section: The section that is being written.
        arrays: Name -> shape of arrays in which a step works.
        rings: Number of rows of each ring, after all slots.
    """

    def __init__(self) -> None:
        self.initial: dict[str, float] = {}
        self.constants: dict[str, float] = {}
        self.inputs: set[str] = set()
        self.sections: dict[str, CodeSection] = {}
        self.names: dict[str, str] = {}
        self._variables: set[str] = set()
        self.readers: dict[str, Element | None] = {}
        self.kept: dict[str, None] = {}
        self.arrays: dict[str, tuple[int, int]] = {}
        self.rings: list[int] = []
        self._numbers: list[float] = []
        self._placed: dict[tuple[float, ...], int] = {}
        self._depth = self._count = self._total = 0
        self.section = self.begin("step")

    # -- sections and lines ---------------------------------------------------------------------------------------------------

    def begin(self, name: str) -> CodeSection:
        """Continue with a section, new if there is none of that name."""
        self.section = self.sections.setdefault(name, CodeSection())
        return self.section

    def line(self, text: str) -> None:
        """Emit a line; several are given by several calls.

        Raises:
            AircraftError: The aircraft's code is too long.
        """
        self._add(CodeLine(self._depth, text))

    def _add(self, line: CodeLine) -> None:
        self._total += 1
        if self._total > MAX_LINES:
            raise AircraftError(f"the aircraft needs more than {MAX_LINES} lines of generated code")
        self.section.lines.append(line)

    def lines(self, text: str) -> None:
        """Emit lines with their own relative indentation."""
        for line in text.strip("\n").splitlines():
            bare = line.lstrip(" ")
            if bare:
                self._add(CodeLine(self._depth + (len(line) - len(bare)) // 4, bare))

    @contextmanager
    def block(self, head: str) -> Iterator[None]:
        """Emit `head:`; the code emitted inside is indented, and may not run."""
        self.line(head + ":")
        self._depth += 1
        before = len(self.section.lines)
        yield
        if len(self.section.lines) == before or all(each.name for each in self.section.lines[before:]):
            self.line("pass")
        self._depth -= 1

    def temporary(self, expression: str) -> str:
        """Emit a local variable that holds the value of an expression; return its name."""
        self._count += 1
        name = f"t{self._count}"
        self.line(f"{name} = {expression}")
        return name

    def short(self, expression: str) -> str:
        """Return the expression, or a temporary variable for it if it is long."""
        return expression if len(expression) <= 100 else self.temporary(expression)

    # -- values ---------------------------------------------------------------------------------------------------------------

    def variable(self, name: str) -> str:
        """The variable of a property or of a piece of state."""
        if name not in self.names:
            short = re.sub(r"\W+", "_", name.removeprefix(STATE), flags=re.ASCII).strip("_")[:60]
            text = f"{'s' if name.startswith(STATE) else 'p'}_{short}"
            unique, k = text, 1
            while unique in self._variables:
                k += 1
                unique = f"{text}_{k}"
            self._variables.add(unique)
            self.names[name] = unique
        return self.names[name]

    def _read(self, name: str) -> str:
        if name not in self.section.written:
            self.section.live[name] = None
        return self.variable(name)

    def read(self, name: str, node: Element | None = None) -> str:
        """Return the expression of a property; `node` reads it, and is named in the message if nothing writes it."""
        name = normal(name)
        if name in self.constants:
            return repr(self.constants[name])
        self.readers.setdefault(name, node)
        return self._read(name)

    def value(self, text: str, node: Element | None = None) -> str:
        """Return the expression of a text of the file: a number, a property, or a property with a minus sign.

        Raises:
            AircraftError: It is empty, or not finite.
        """
        text = text.strip()
        if not text and node is not None:
            raise node.error("it needs a number or the name of a property")
        if NUMBER.match(text):
            return repr(float(text))
        if text.startswith("-"):
            return f"(-{self.read(text[1:], node)})"
        return self.read(text, node)

    def write(self, name: str, expression: str) -> None:
        """Emit the assignment of a property; it is left out if nobody reads the property. Its relatives follow it."""
        name = normal(name)
        variable = self._write(name, expression)
        surface = SURFACE.match(name)
        if surface:
            stem, unit = surface.groups()
            other, ratio = ("deg", DEGREES) if unit == "rad" else ("rad", RADIANS)
            self._write(f"fcs/{stem}-pos-{other}", f"{variable} * {ratio}", read=name)
            self._write(
                f"fcs/mag-{stem}-pos-rad",
                f"abs({self.variable(f'fcs/{stem}-pos-rad')})",
                read=f"fcs/{stem}-pos-rad",
            )

    def _write(self, name: str, expression: str, read: str = "") -> str:
        variable = self.variable(name)
        if read:
            self.readers.setdefault(read, None)
        self._add(CodeLine(self._depth, f"{variable} = {expression}", name))
        self.section.touched[name] = None
        if not self._depth:
            self.section.written.add(name)
        return variable

    def state(self, label: str, initial: float = 0.0) -> str:
        """Return the variable of a new piece of state, to be read and assigned in lines at will."""
        name = f"{STATE}{label}"
        k = 1
        while name in self.names:
            k += 1
            name = f"{STATE}{label}-{k}"
        self.initial[name] = initial
        self.kept[name] = None
        return self.variable(name)

    def ring(self, capacity: int) -> str:
        """Return the name of the first of new rows of the state, which code reads and writes as x[name + k, row]."""
        self.rings.append(capacity)
        return f"ring_{len(self.rings) - 1}"

    def keep(self, name: str) -> None:
        """Keep a property as a slot, so that it can be read from outside."""
        self.kept[normal(name)] = None
        self.readers.setdefault(normal(name), None)

    def constant(self, values: Sequence[float]) -> int:
        """Store numbers in `tables`; return the place of the first."""
        key = tuple(map(float, values))
        if key not in self._placed:
            self._placed[key] = len(self._numbers)
            self._numbers.extend(key)
        return self._placed[key]

    @property
    def tables(self) -> np.ndarray:
        """All numbers of tables, (k,)."""
        return np.array([*self._numbers, 0.0])

    # -- the whole ------------------------------------------------------------------------------------------------------------

    def is_used(self, name: str) -> bool:
        """Return True if somebody reads a property or keeps it."""
        return name in self.readers or name in self.kept

    def known(self) -> set[str]:
        """Return the properties that are written, set or given."""
        made = {name for section in self.sections.values() for name in section.touched}
        return made | self.initial.keys() | self.inputs

    def check(self, settable: Sequence[str] = ()) -> None:
        """Check that all properties that are read are written, set or given.

        Raises:
            AircraftError: One is not.
        """
        made = self.known() | set(settable)
        for name, node in self.readers.items():
            if name not in made:
                near = nearest_name(name, made)
                message = (
                    f"property {clipped(name, 120)!r} is read, but nothing that is compiled writes it{near}"
                )
                raise AircraftError(message) if node is None else node.error(message)

    def slots(self) -> list[str]:
        """Names of all slots, in order."""
        used = dict(self.kept)
        for section in self.sections.values():
            used |= dict.fromkeys(name for name in section.live if name in self.names)
        used |= dict.fromkeys(name for name in sorted(self.inputs) if name in self.names)
        return list(used)

    def body(self, name: str, depth: int) -> Iterator[str]:
        """Lines of a section."""
        for line in self.sections[name].lines:
            if not line.name or self.is_used(line.name):
                yield INDENT * (depth + line.depth) + line.text
