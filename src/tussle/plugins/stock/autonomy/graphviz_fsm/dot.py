"""Reader of directed graphs in the DOT language of Graphviz.

It follows the grammar of https://graphviz.org/doc/info/lang.html without HTML texts. The library pydot is not used, because it prints
the place of an error and returns None, while the error of a mission must contain the place.
"""

from __future__ import annotations

import re
from itertools import pairwise
from typing import NamedTuple

from tussle.declare.texts import shown
from tussle.errors import ParameterError

TOKEN = re.compile(
    r"""(?P<blank>(?:\s|//[^\n]*|/\*.*?\*/|^\#[^\n]*)+)
      | (?P<mark>->|--|[{}\[\]=;,:+])
      | (?P<quoted>"(?:[^"\\]|\\.)*")
      | (?P<word>[^\W\d]\w*|-?(?:\.\d+|\d+(?:\.\d*)?))""",
    re.VERBOSE | re.DOTALL | re.MULTILINE,
)
KEYWORDS = ("node", "edge", "graph", "digraph", "subgraph", "strict")
MAX_NESTED = 50
"""Maximum nesting of subgraphs."""


class Edge(NamedTuple):
    """An edge; `label` is "" if it has none."""

    tail: str
    head: str
    label: str


class DotGraph(NamedTuple):
    """A directed graph: names of its nodes in order of first appearance, and its edges in order."""

    nodes: tuple[str, ...]
    edges: tuple[Edge, ...]


class _Token(NamedTuple):
    kind: str
    text: str
    place: int


def read_dot(text: str) -> DotGraph:
    """Read a directed graph.

    Raises:
        ParameterError: The text is not a directed graph in DOT; the message has line and column.
    """
    return _Reader(text).graph()


class _Reader:
    """Recursive-descent parser: one method per rule of the grammar."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.tokens = list(self._split())
        self.next = 0
        self.depth = 0
        self.nodes: dict[str, None] = {}
        self.edges: list[Edge] = []

    def _split(self) -> list[_Token]:
        found, place = [], 0
        while place < len(self.text):
            match = TOKEN.match(self.text, place)
            if match is None:
                raise self._error(
                    place,
                    shown(self.text[place : place + 20]),
                    "a name, a text in double quotes or one of -> { } [ ] = ; ,",
                )
            kind = str(match.lastgroup)
            if kind != "blank":
                word = match[0].lower()
                found.append(
                    _Token("keyword" if kind == "word" and word in KEYWORDS else kind, match[0], place)
                )
            place = match.end()
        return [*found, _Token("end", "", len(self.text))]

    def _error(self, place: int, found: str, expected: str) -> ParameterError:
        line = self.text.count("\n", 0, place) + 1
        column = place - self.text.rfind("\n", 0, place)
        return ParameterError(
            f"line {line}, column {column} of the graph: {found} is not allowed; expected {expected}"
        )

    # -- tokens -------------------------------------------------------------------------------------------------------------------

    def _is(self, *texts: str) -> bool:
        token = self.tokens[self.next]
        return token.kind in ("mark", "keyword") and token.text.lower() in texts

    def _accept(self, *texts: str) -> bool:
        is_there = self._is(*texts)
        self.next += is_there
        return is_there

    def _refuse(self, expected: str) -> ParameterError:
        token = self.tokens[self.next]
        return self._error(token.place, shown(token.text) if token.text else "the end", expected)

    def _expect(self, text: str) -> None:
        if not self._accept(text):
            raise self._refuse(repr(text))

    def _is_name(self) -> bool:
        return self.tokens[self.next].kind in ("word", "quoted")

    def _name(self, expected: str = "a name") -> str:
        """A word, or texts in double quotes joined by +."""
        if not self._is_name():
            raise self._refuse(expected)
        token = self.tokens[self.next]
        self.next += 1
        if token.kind == "word":
            return token.text
        part = token.text[1:-1].replace('\\"', '"').replace("\\\n", "")
        return part + self._name() if self._accept("+") else part

    # -- rules --------------------------------------------------------------------------------------------------------------------

    def graph(self) -> DotGraph:
        self._accept("strict")
        if not self._accept("digraph"):
            raise self._refuse("'digraph', as edges have directions")
        if self._is_name():
            self._name()
        self._braces({})
        if self.tokens[self.next].kind != "end":
            raise self._refuse("the end")
        return DotGraph(tuple(self.nodes), tuple(self.edges))

    def _braces(self, defaults: dict[str, str]) -> list[str]:
        """Statements in braces. Returns their nodes."""
        self._expect("{")
        self.depth += 1
        if self.depth > MAX_NESTED:
            raise self._refuse(f"at most {MAX_NESTED} nested subgraphs")
        inside: dict[str, None] = {}
        while not self._accept("}"):
            inside.update(dict.fromkeys(self._statement(defaults)))
            self._accept(";")
        self.depth -= 1
        return list(inside)

    def _statement(self, defaults: dict[str, str]) -> list[str]:
        """A statement. Returns its nodes; `defaults`, the attributes of further edges, are updated by `edge [ ... ]`."""
        if self._accept("edge"):
            defaults.update(self._attributes())
            return []
        if self._accept("node", "graph"):
            self._attributes()
            return []
        if self._is_name() and self.tokens[self.next + 1].text == "=":  # of the graph, such as rankdir = LR
            self.next += 2
            self._name("a value")
            return []
        ends = [self._end(defaults)]
        while self._accept("->"):
            ends.append(self._end(defaults))
        if self._is("--"):
            raise self._refuse("'->', as edges have directions")
        own = {**defaults, **self._attributes()}
        for tails, heads in pairwise(ends):
            self.edges += [Edge(tail, head, own.get("label", "")) for tail in tails for head in heads]
        return [node for end in ends for node in end]

    def _end(self, defaults: dict[str, str]) -> list[str]:
        """An end of edges: a node, or all nodes of a subgraph."""
        if self._accept("subgraph") or self._is("{"):
            if self._is_name():
                self._name()
            return self._braces(dict(defaults))
        name = self._name("a node, '{' or '}'")
        for _ in range(2):  # a port and a compass point
            if self._accept(":"):
                self._name()
        self.nodes.setdefault(name)
        return [name]

    def _attributes(self) -> dict[str, str]:
        """Lists of attributes: [ label = "x", shape = circle ] [ ... ]."""
        found = {}
        while self._accept("["):
            while not self._accept("]"):
                key = self._name("an attribute or ']'")
                self._expect("=")
                found[key] = self._name("a value")
                self._accept(",", ";")
        return found
