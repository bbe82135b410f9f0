"""XML of aircraft files as nodes with file and line, read with limits."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from tussle.aircraft.constants import factor
from tussle.documents import read_bytes
from tussle.errors import ParameterError, clipped

MAX_BYTES = 8 << 20
MAX_NODES = 200_000
MAX_DEPTH = 60
MAX_ENTITIES, MAX_ENTITY = 100, 100


class AircraftError(ParameterError):
    """An aircraft's file cannot be read, is invalid, or uses an unsupported part of JSBSim. The message begins with file and line."""


@dataclass(eq=False)
class Element:
    """An element.

    Attributes:
        tag: Its name.
        place: "file:line".
        attributes: Name -> text.
        chunks: Texts between its children.
        children: Elements in it.
    """

    tag: str
    place: str
    attributes: dict[str, str]
    chunks: list[str] = field(default_factory=list)
    children: list[Element] = field(default_factory=list)

    def __iter__(self) -> Iterator[Element]:
        return iter(self.children)

    @property
    def text(self) -> str:
        """All its text, stripped."""
        return "".join(self.chunks).strip()

    def error(self, message: str) -> AircraftError:
        """An error at this place."""
        return AircraftError(f"{self.place}: <{clipped(self.tag)}>: {message}")

    def find_all(self, *tags: str) -> list[Element]:
        """The children with one of the tags."""
        return [each for each in self.children if each.tag in tags]

    def find(self, tag: str) -> Element | None:
        """The first child with a tag."""
        return next((each for each in self.children if each.tag == tag), None)

    def get(self, name: str, default: str = "") -> str:
        """An attribute, stripped."""
        return self.attributes.get(name, default).strip()

    def need(self, tag: str) -> Element:
        """The first child with a tag.

        Raises:
            AircraftError: There is none.
        """
        found = self.find(tag)
        if found is None:
            raise self.error(f"it needs a <{tag}>")
        return found

    def number(self, unit: str = "") -> float:
        """The text as a number, converted from the attribute `unit` to a unit.

        Raises:
            AircraftError: It is no finite number, or the unit is unknown.
        """
        return self._number(self.text, unit)

    def _number(self, text: str, unit: str = "") -> float:
        try:
            value = float(text)
        except ValueError:
            raise self.error(f"{clipped(text)!r} is not a number") from None
        if not math.isfinite(value):
            raise self.error(f"{clipped(text)!r} is not a finite number")
        given = self.get("unit").upper()
        if unit and given and given != unit:
            known = factor(given, unit)
            if known is None:
                raise self.error(f"unit {clipped(given)!r} is not known here; it becomes {unit}")
            value *= known
        return value

    def value(self, tag: str, default: float, unit: str = "") -> float:
        """The number in a child, or a default.

        Raises:
            AircraftError: It is no finite number.
        """
        found = self.find(tag)
        return default if found is None else found.number(unit)

    def attribute_number(self, name: str, default: float) -> float:
        """An attribute as a number.

        Raises:
            AircraftError: It is no finite number.
        """
        return self._number(self.get(name)) if self.get(name) else default

    def vector(self, unit: str, names: Sequence[str] = ("x", "y", "z")) -> tuple[float, float, float]:
        """Three children, 0 where one is missing, converted from the attribute `unit` of this node.

        Raises:
            AircraftError: A child is no finite number.
        """
        found = [self.find(name) for name in names]
        x, y, z = (0.0 if each is None else self._number(each.text, unit) for each in found)
        return x, y, z


def read_file(path: Path) -> Element:
    """Read an XML file. Declared entities may only be short texts.

    Raises:
        AircraftError: It cannot be read, is no XML, or exceeds a limit.
    """
    return read_text(read_bytes(path, AircraftError, MAX_BYTES), path.name)


def read_text(data: bytes, name: str) -> Element:
    """Read XML; `name` of the file is for messages.

    Raises:
        AircraftError: It is no XML, or exceeds a limit.
    """
    top = Element("", name, {})
    stack, count, entities = [top], 0, 0
    parser = expat.ParserCreate()

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal count
        count += 1
        node = Element(tag, f"{name}:{parser.CurrentLineNumber}", attributes)
        if count > MAX_NODES or len(stack) > MAX_DEPTH:
            raise node.error(
                f"the file has more than {MAX_NODES} elements, or they nest deeper than {MAX_DEPTH}"
            )
        stack[-1].children.append(node)
        stack.append(node)

    def text(part: str) -> None:
        stack[-1].chunks.append(part)

    def entity(entity_name: str, is_parameter: int, value: str | None, *_: object) -> None:
        nonlocal entities
        entities += 1
        if (
            value is None
            or is_parameter
            or len(value) > MAX_ENTITY
            or "&" in value
            or entities > MAX_ENTITIES
        ):
            raise AircraftError(
                f"{name}:{parser.CurrentLineNumber}: entity {clipped(entity_name)!r}: only {MAX_ENTITIES} short texts without "
                "references can be declared"
            )

    parser.buffer_text = True
    parser.StartElementHandler = start
    parser.EndElementHandler = lambda _: stack.pop()
    parser.CharacterDataHandler = text
    parser.EntityDeclHandler = entity
    try:
        parser.Parse(data, True)
    except expat.ExpatError as reason:
        raise AircraftError(
            f"{name}:{reason.lineno}: it is not XML: {expat.ErrorString(reason.code)}"
        ) from None
    except (ValueError, LookupError) as reason:  # AircraftError is a ValueError too
        if isinstance(reason, AircraftError):
            raise
        raise AircraftError(f"{name}: its encoding is not known: {reason}") from None
    return top.children[0]
