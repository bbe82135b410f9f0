"""Context in which an engine and its thruster emit their code: names, state, time step."""

from __future__ import annotations

from dataclasses import dataclass

from tussle.aircraft.code import Code, normal
from tussle.aircraft.functions import emit_function
from tussle.aircraft.node import Element
from tussle.errors import clipped


@dataclass
class Bench:
    """The place of one engine in the generated code.

    Attributes:
        code: The code to which they are added.
        index: Number of the engine, from 0.
        dt: Expression of the time step [s].
        throttle: Expression of the throttle's position.
        mixture: Expression of the mixture's position.
        is_reversible: Whether the engine emits the locals `is_reversed` and `reverse` (0 to 1) for its propeller.
        has_levers: Whether the engine passes the levers of pitch and feather to its propeller; a turbine does not.
    """

    code: Code
    index: int
    dt: str
    throttle: str
    mixture: str
    is_reversible: bool = False
    has_levers: bool = True

    def name(self, leaf: str) -> str:
        """Name of a property of the engine."""
        return normal(f"propulsion/engine[{self.index}]/{leaf}")

    def local(self, label: str) -> str:
        """Name of a local variable of the engine."""
        return f"engine{self.index}_{label}"

    def slot(self, leaf: str, initial: float = 0.0) -> str:
        """Variable of a property of the engine that survives the step; it may be read and assigned in lines."""
        return slot(self.code, self.name(leaf), initial)

    def state(self, label: str, initial: float = 0.0) -> str:
        """Variable of state of the engine that is no property of JSBSim."""
        name = f"state/engine{self.index}-{label}"
        self.code.initial.setdefault(name, initial)
        return self.code.read(name)

    def command(self, leaf: str, initial: float = 0.0) -> str:
        """Variable of a property of the engine that may be set from outside."""
        self.code.inputs.add(self.name(leaf))
        return self.slot(leaf, initial)

    def given(self, leaf: str, default: float) -> str:
        """Expression of a property of the engine: the default, if nothing writes or sets it."""
        return given(self.code, self.name(leaf), default)

    def read(self, name: str) -> str:
        """Expression of a property."""
        return self.code.read(name)

    def write(self, leaf: str, expression: str) -> None:
        """Emit the assignment of a property of the engine."""
        self.code.write(self.name(leaf), expression)

    def functions(self, node: Element, kind: str) -> None:
        """Emit the functions of the engine's file that run before ("pre") or after ("post") its step.

        Raises:
            AircraftError: A function has an unknown type.
        """
        for each in node.find_all("function"):
            given_kind = each.get("type") or "pre"
            if given_kind not in ("pre", "post"):
                raise each.error(f"type {clipped(given_kind)!r} is not supported; there are: pre, post")
            if given_kind == kind:
                emit_function(self.code, each)


def slot(code: Code, name: str, initial: float) -> str:
    """Variable of a property that survives the step; it may be read and assigned in lines."""
    name = normal(name)
    code.initial.setdefault(name, initial)
    code.section.touched[name] = None
    return code.read(name)


def given(code: Code, name: str, default: float) -> str:
    """Expression of a property that is a constant, unless something writes or sets it."""
    name = normal(name)
    if name in code.inputs or any(name in section.touched for section in code.sections.values()):
        code.initial.setdefault(name, default)
        return code.read(name)
    code.initial.setdefault(name, default)
    return repr(default)


def numbered(node: Element, index: int) -> Element:
    """A copy of a file's content in which [#] is the number of the engine."""
    mark, number = "[#]", f"[{index}]"
    return Element(
        node.tag,
        node.place,
        {name: text.replace(mark, number) for name, text in node.attributes.items()},
        [text.replace(mark, number) for text in node.chunks],
        [numbered(each, index) for each in node.children],
    )
