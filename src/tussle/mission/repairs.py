"""Mending of XML that is not well-formed but that SCRIMMAGE's parser reads, since it checks less.

That parser ends a comment at the first "-->", whatever is in it; it ends the last open tag at any closing tag, whatever its name; and
it takes & for itself where it begins no entity.
"""

from __future__ import annotations

import re
from typing import NamedTuple

from tussle.errors import clipped

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
