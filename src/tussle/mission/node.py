"""Parsing of XML text to a tree of nodes, with the file and line of each tag and attribute.

The parser is expat from the standard library: it reports where a tag begins (libxml2 reports where it ends), and it reports every
construct that could read other files or grow before it takes effect, so it can be refused.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple
from xml.parsers import expat
from xml.sax.saxutils import escape, quoteattr

from tussle.errors import MissionError, clipped
from tussle.mission.limits import Limits
from tussle.mission.problems import Place, Problems

NAMESPACE_END = "}"
ATTRIBUTE = re.compile(rb"\s+([^\s=<>/]+)\s*=\s*(?:\"[^\"]*\"|'[^']*')")


@dataclass(slots=True)
class Node:
    """A tag.

    Attributes:
        tag: Its name; with a namespace, "ADDRESS}NAME".
        attributes: Attributes in order, as written.
        text: Its own text without that of its children, stripped.
        children: The tags in it.
        place: File and line where it begins.
        lines: Line of each attribute.
    """

    tag: str
    attributes: dict[str, str]
    text: str
    children: list[Node]
    place: Place
    lines: dict[str, int] = field(default_factory=dict)

    def where(self, attribute: str = "") -> Place:
        """Place of an attribute, or of the tag."""
        return Place(self.place.file, self.lines.get(attribute, self.place.line))

    def find_all(self, tag: str) -> Iterator[Node]:
        return (child for child in self.children if child.tag == tag)

    def copied(self) -> Node:
        """A deep copy."""
        return Node(
            self.tag,
            dict(self.attributes),
            self.text,
            [c.copied() for c in self.children],
            self.place,
            dict(self.lines),
        )

    def to_text(self, indent: str = "") -> str:
        """Write the tree as XML."""
        attributes = "".join(f" {_local(k)}={quoteattr(v)}" for k, v in self.attributes.items())
        start = f"{indent}<{_local(self.tag)}{attributes}"
        if not self.children:
            return f"{start}>{escape(self.text)}</{_local(self.tag)}>\n" if self.text else f"{start}/>\n"
        inner = "".join(child.to_text(indent + "  ") for child in self.children)
        text = f"{indent}  {escape(self.text)}\n" if self.text else ""
        return f"{start}>\n{text}{inner}{indent}</{_local(self.tag)}>\n"


def _local(name: str) -> str:
    return name.rpartition(NAMESPACE_END)[2]


@dataclass
class Budget:
    """Counts of tags and characters that all files of a mission share, checked against the limits."""

    limits: Limits
    nodes: int = 0
    text: int = 0

    def spend_nodes(self, amount: int, place: Place) -> None:
        """Count tags.

        Raises:
            MissionError: There are too many.
        """
        self.nodes += amount
        if self.nodes > self.limits.nodes:
            raise MissionError(
                f"{place}: there are more than {self.limits.nodes:,} tags, copies of shared tags included; "
                f"use allow_large for a file that you trust"
            )

    def spend_copy(self, node: Node) -> None:
        """Count a tag and its content, copied from another place of the file.

        Raises:
            MissionError: There are too many tags or characters.
        """
        self.spend_nodes(1, node.place)
        size = len(node.tag) + len(node.text) + sum(len(k) + len(v) for k, v in node.attributes.items())
        self.spend_text(size, str(node.place))
        for child in node.children:
            self.spend_copy(child)

    def spend_text(self, amount: int, file: str) -> None:
        """Count characters.

        Raises:
            MissionError: There are too many.
        """
        self.text += amount
        if self.text > self.limits.text:
            raise MissionError(
                f"{file}: the mission is longer than {self.limits.text:,} characters; use allow_large for a file that you trust"
            )


class _Builder:
    """Builds the tree from expat's events."""

    def __init__(self, data: bytes, file: str, line_of: Callable[[int], int], budget: Budget) -> None:
        self.data, self.file, self.line_of, self.budget = data, file, line_of, budget
        self.stack: list[tuple[Node, list[str]]] = []
        self.root: Node | None = None
        self.parser = parser = expat.ParserCreate("utf-8", namespace_separator=NAMESPACE_END)
        parser.buffer_text = True
        parser.ordered_attributes = True
        parser.StartElementHandler = self.start
        parser.EndElementHandler = self.end
        parser.CharacterDataHandler = self.characters
        parser.StartDoctypeDeclHandler = self.doctype

    def refuse(self, text: str) -> MissionError:
        return MissionError(f"{Place(self.file, self.line_of(self.parser.CurrentLineNumber))}: {text}")

    def doctype(self, name: str, *_: Any) -> None:
        raise self.refuse(
            "a DOCTYPE is not allowed: it can define entities that grow or read other files, and a mission needs none; remove it"
        )

    def start(self, tag: str, flat: list[str]) -> None:
        line = self.parser.CurrentLineNumber
        place = Place(self.file, self.line_of(line))
        self.budget.spend_nodes(1, place)
        if len(self.stack) >= self.budget.limits.depth:
            raise self.refuse(f"tags are nested more than {self.budget.limits.depth} deep")
        names = flat[::2]
        node = Node(tag, dict(zip(names, flat[1::2], strict=True)), "", [], place)
        if names:
            node.lines = self.lines_of_attributes(line)
        if self.stack:
            self.stack[-1][0].children.append(node)
        else:
            self.root = node
        self.stack.append((node, []))

    def lines_of_attributes(self, line: int) -> dict[str, int]:
        """Line of each attribute of the tag that begins here; expat reports only the line of the tag."""
        place, lines = self.parser.CurrentByteIndex, {}
        name = re.compile(rb"<[^\s<>/]+").match(self.data, place)
        place = name.end() if name else place
        while match := ATTRIBUTE.match(self.data, place):
            begin = match.start(1)
            line += self.data.count(b"\n", place, begin)
            lines[match[1].decode("utf-8", "replace")] = self.line_of(line)
            line += self.data.count(b"\n", begin, match.end())
            place = match.end()
        return lines

    def end(self, _tag: str) -> None:
        node, parts = self.stack.pop()
        node.text = "".join(parts).strip()

    def characters(self, text: str) -> None:
        if self.stack:
            self.stack[-1][1].append(text)


def parse(
    text: str,
    file: str,
    budget: Budget,
    line_of: Callable[[int], int] = int,
    problems: Problems | None = None,
) -> tuple[Node, str]:
    """Parse an XML text to its root tag.

    Args:
        text: Text of the whole file.
        file: Its name, for messages.
        budget: Limits that it shares with the mission's other files.
        line_of: Maps a line of `text` to the line of the original file.
        problems: Receives what was repaired in a text that is not well-formed; None to repair nothing.

    Returns:
        The root tag, and the text, well-formed.

    Raises:
        MissionError: It is malformed, has a DOCTYPE, or is too large.
    """
    try:
        return _parsed(text, file, budget, line_of), text
    except _MalformedError as error:
        first = str(error)
        well_formed, changes = repair(text) if problems is not None else (text, [])
        if problems is None or not changes:
            raise MissionError(first) from None
    try:
        root = _parsed(well_formed, file, budget, line_of)
    except _MalformedError as error:  # one of the two is the cause
        raise MissionError("\n".join(dict.fromkeys((first, str(error))))) from None
    for line, why, repaired in changes:
        problems.note_repair(Place(file, line_of(line)), f"this is not well-formed XML: {why}", repaired)
    return root, well_formed


class _MalformedError(Exception):
    """A text is not well-formed XML."""


def _parsed(text: str, file: str, budget: Budget, line_of: Callable[[int], int]) -> Node:
    data = text.encode("utf-8", "surrogatepass")
    builder = _Builder(data, file, line_of, budget)
    n_before = budget.nodes
    try:
        builder.parser.Parse(data, True)
    except expat.ExpatError as error:
        budget.nodes = n_before
        raise _MalformedError(
            f"{Place(file, line_of(error.lineno))}: this is not well-formed XML: {expat.ErrorString(error.code)}{_hint(error)}"
        ) from None
    assert builder.root is not None
    return builder.root


def _hint(error: expat.ExpatError) -> str:
    hints = {
        expat.errors.XML_ERROR_TAG_MISMATCH: " (a tag above is not closed, or is closed by another name)",
        expat.errors.XML_ERROR_UNDEFINED_ENTITY: " (only &lt; &gt; &amp; &quot; and &apos; are defined)",
        expat.errors.XML_ERROR_INVALID_TOKEN: " (in text, < is written &lt;)",
    }
    return hints.get(expat.ErrorString(error.code), "")


OPENING = re.compile(r"""<([^\s<>/!?]++)(?:[^"'<>]++|"[^"<]*+"|'[^'<]*+')*+>""")
CLOSING = re.compile(r"</([^\s<>]++)\s*+>")
AMPERSAND = re.compile(r"&(?!(?:lt|gt|amp|quot|apos|#\d{1,7}|#x[0-9A-Fa-f]{1,6});)")
OPAQUE = (("<!--", "-->"), ("<![CDATA[", "]]>"), ("<?", "?>"))
"""Begin and end of what holds no tags."""


class Repair(NamedTuple):
    """A change that helps to make a text well-formed.

    Attributes:
        line: Line of the text.
        why: What is wrong there.
        repaired: The line after all changes.
    """

    line: int
    why: str
    repaired: str


def repair(text: str) -> tuple[str, list[Repair]]:
    """Return a text of the same lines with comments, closing tags and ampersands repaired, and the changes.

    A text with other faults is repaired up to the first of them.
    """
    repairer = _Repairer(text)
    repairer.run()
    lines = repairer.repaired.split("\n")
    return repairer.repaired, [Repair(line, why, lines[line - 1].strip()) for line, why in repairer.changes]


class _Repairer:
    """Copies a text from left to right, with changes."""

    def __init__(self, text: str) -> None:
        self.text, self.place, self.line = text, 0, 1
        self.parts: list[str] = []
        self.open_tags: list[str] = []
        self.changes: list[tuple[int, str]] = []

    @property
    def repaired(self) -> str:
        return "".join([*self.parts, self.text[self.place :]])

    def run(self) -> None:
        while (begin := self.text.find("<", self.place)) >= 0:
            self.copy_escaped(begin)
            if not (self.opaque() or self.closing() or self.opening()):
                return

    def copy(self, end: int, new: str | None = None, why: str = "") -> None:
        """Copy up to `end`, or put `new` in its place; `why` says what was wrong there."""
        if why:
            self.changes.append((self.line, why))
        old = self.text[self.place : end]
        self.parts.append(old if new is None else new)
        self.line += old.count("\n")
        self.place = end

    def copy_escaped(self, end: int) -> None:
        """Copy up to `end`, each single & as an entity."""
        for match in AMPERSAND.finditer(self.text, self.place, end):
            self.copy(match.start())
            self.copy(match.end(), "&amp;", "& is not written &amp;")
        self.copy(end)

    def opaque(self) -> bool:
        """Copy a comment, or another part without tags, if one begins here and ends."""
        for first, last in OPAQUE:
            if self.text.startswith(first, self.place):
                begin = self.place + len(first)
                end = self.text.find(last, begin)
                if end < 0:
                    return False
                inner = self.text[begin:end]
                if first == "<!--" and "--" in f"{inner}-":
                    new = re.sub("-(?=-)|-$", "- ", inner)
                    self.copy(end + len(last), f"{first}{new}{last}", '"--" is inside a comment')
                else:
                    self.copy(end + len(last))
                return True
        return False

    def closing(self) -> bool:
        """Copy a closing tag, if one begins here, with the name of the last open tag."""
        match = CLOSING.match(self.text, self.place)
        if match is None:
            return False
        name = self.open_tags.pop() if self.open_tags else match[1]
        if name == match[1]:
            self.copy(match.end())
        else:
            why = f"<{clipped(name)}> is closed by </{clipped(match[1])}>"
            self.copy(match.end(), match[0].replace(match[1], name, 1), why)
        return True

    def opening(self) -> bool:
        """Copy an opening tag, if one begins here."""
        match = OPENING.match(self.text, self.place)
        if match is None:
            return False
        if not match[0].endswith("/>"):
            self.open_tags.append(match[1])
        self.copy_escaped(match.end())
        return True
