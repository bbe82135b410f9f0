"""Files that anybody may have written: read only where they are files, only so much of them, and JSON only as its schema says."""

from __future__ import annotations

import json
import re
import stat
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

from tussle.errors import TussleError, listed, nearest_name

MOST_BYTES = 1 << 25
"""Of a document. Python takes some twenty times as much for what JSON can say in it."""
LONGEST_SHOWN = 80


def size_of(path: Path, most: int | None = None) -> int:
    """Length of a file [B]; a pipe or a device, opening which could wait for ever, is none.

    Raises:
        OSError: There is no such file, it is something else, or it is longer than `most`.
    """
    about = path.stat()
    if not stat.S_ISREG(about.st_mode):
        raise OSError("this is not a regular file")
    if most is not None and about.st_size > most:
        raise OSError(f"it has {about.st_size:,} bytes; allowed are {most:,}")
    return about.st_size


def read_text(path: Path, error: type[TussleError], most: int = MOST_BYTES) -> str:
    """A file's text.

    Raises:
        TussleError: As `error`: it is no regular file, is longer than `most` bytes, or is not text in UTF-8.
    """
    try:
        size_of(path, most)
        with path.open("rb") as file:
            return file.read(most).decode("utf-8")
    except (OSError, ValueError) as reason:
        raise error(f"{path}: cannot be read: {getattr(reason, 'strerror', None) or reason}") from None


# -- schemas ------------------------------------------------------------------------------------------------------------------

Rule = Any
"""What a value may be: `bool` or `str`, one of the rules below, a tuple of the values that are allowed, [rule] for a list, or a dict
from the names of an object's fields to their rules. An object may have further fields; nothing reads them."""


@dataclass(frozen=True)
class Whole:
    """A whole number within bounds."""

    least: int = 0
    most: int = 2**63 - 1


@dataclass(frozen=True)
class Real:
    """A number within bounds; with `is_any`, also one of those that JSON does not know, which stand there by name."""

    least: float = -1.7976931348623157e308
    most: float = 1.7976931348623157e308
    is_any: bool = False


@dataclass(frozen=True)
class Map:
    """An object whose names are not known before, but how they are written."""

    rule: Rule
    names: str = r"[\s\S]*"


@dataclass(frozen=True)
class Maybe:
    """A field that may be null, or not there."""

    rule: Rule


@dataclass(frozen=True)
class Either:
    """What keeps one of some rules; `allowed` says them in words."""

    rules: tuple[Rule, ...]
    allowed: str


@dataclass(frozen=True)
class Checked:
    """What keeps a rule, and a function then says nothing against; the function takes value and place, as `problem` does."""

    rule: Rule
    problem: Callable[[Any, str], str]


def _against_path(text: str, where: str) -> str:
    path = PurePosixPath(text)
    is_inside = text and "\0" not in text and not path.is_absolute() and ".." not in path.parts
    return "" if is_inside else _refused(where, text, "a path inside the directory")


Inside = Checked(str, _against_path)
"""A relative path that stays below where it begins."""
Team = r"-?\d{1,10}"
"""How the number of a team is written as a name."""


def problem(value: Any, rule: Rule, where: str = "") -> str:
    """What is wrong with a value, beginning with which it is: "worlds[0].steps = -1 is not allowed; ..."; "" for nothing."""
    match rule:
        case dict():
            return _against_fields(value, rule, where)
        case Map():
            if not isinstance(value, dict):
                return _refused(where, value, "an object")
            if wrong := [name for name in value if not re.fullmatch(rule.names, name) or _against_text(name)]:
                return f"{where}: the name {_shown(wrong[0])} is not allowed"
            return _first(problem(inner, rule.rule, f"{where}.{name:.80}") for name, inner in value.items())
        case [inside]:
            if not isinstance(value, list):
                return _refused(where, value, "a list")
            return _first(problem(inner, inside, f"{where}[{i}]") for i, inner in enumerate(value))
        case Maybe():
            return "" if value is None else problem(value, rule.rule, where)
        case Either():
            is_kept = any(not problem(value, one, where) for one in rule.rules)
            return "" if is_kept else _refused(where, value, rule.allowed)
        case Checked():
            return problem(value, rule.rule, where) or rule.problem(value, where)
    return _against_plain(value, rule, where)


def _against_fields(value: Any, rule: Mapping[str, Rule], where: str) -> str:
    if not isinstance(value, dict):
        return _refused(where, value, "an object")
    missing = [name for name, inner in rule.items() if name not in value and not isinstance(inner, Maybe)]
    if missing:
        return f"{where or 'it'} says nothing of {', '.join(missing)}"
    above = f"{where}." if where else ""
    return _first(problem(value.get(name), inner, above + name) for name, inner in rule.items())


def _against_plain(value: Any, rule: Rule, where: str) -> str:
    """What is wrong with a value that holds no others."""
    if isinstance(rule, tuple):
        is_there = any(type(value) is type(one) and value == one for one in rule)
        guess = nearest_name(value[:LONGEST_SHOWN], rule) if isinstance(value, str) else ""
        return (
            "" if is_there else f"{where} = {_shown(value)} is not allowed{guess}; {listed(map(repr, rule))}"
        )
    if rule is bool:
        return "" if isinstance(value, bool) else _refused(where, value, "true or false")
    if rule is str:
        return _refused(where, value, "a text") if not isinstance(value, str) or _against_text(value) else ""
    if isinstance(rule, Whole):
        is_good = type(value) is int and rule.least <= value <= rule.most
        return "" if is_good else _refused(where, value, f"a whole number from {rule.least} to {rule.most}")
    is_named = rule.is_any and value in ("inf", "-inf", "nan")
    is_good = is_named or (type(value) in (int, float) and rule.least <= value <= rule.most)
    return "" if is_good else _refused(where, value, f"a number from {rule.least:g} to {rule.most:g}")


def _against_text(text: str) -> bool:
    """JSON can name halves of characters, which nothing can write."""
    return any("\ud800" <= letter <= "\udfff" for letter in text)


def _refused(where: str, value: Any, allowed: str) -> str:
    return f"{where or 'the document'} = {_shown(value)} is not allowed; it takes {allowed}"


def _shown(value: Any) -> str:
    """A value for a message, which is not longer than a message bears: of what holds others, how many."""
    if isinstance(value, (list, dict)) and value:
        return f"{'a list' if isinstance(value, list) else 'an object'} of {len(value)}"
    text = (
        ascii(value)
        if not isinstance(value, int) or abs(value) < 10**80
        else "a number of more than 80 digits"
    )
    return text if len(text) <= LONGEST_SHOWN else text[:LONGEST_SHOWN] + "..."


def _first(said: Iterable[str]) -> str:
    return next((text for text in said if text), "")


@dataclass(frozen=True)
class Document:
    """A kind of JSON document.

    Attributes:
        noun: What it describes: "the batch".
        version: Its `format`.
        rule: Its schema.
        error: What is raised.
    """

    noun: str
    version: int
    rule: Rule
    error: type[TussleError]

    def read(self, path: Path) -> dict[str, Any]:
        """The document in a file.

        Raises:
            TussleError: As `error`: it cannot be read, has another version, or breaks its schema; the message names file and field.
        """
        text = read_text(path, self.error)
        try:
            found = json.loads(text, parse_constant=_no_number)
        except (ValueError, RecursionError) as reason:
            why = (
                "lists or objects stand in one another too deep"
                if isinstance(reason, RecursionError)
                else reason
            )
            raise self.error(f"{path}: cannot be read: {why}") from None
        version = found.get("format") if isinstance(found, dict) else None
        if type(version) is not int or version != self.version:
            raise self.error(
                f"{path}: {self.noun} has format {_shown(version)}; this tussle reads format {self.version}"
            )
        if said := problem(found, self.rule):
            raise self.error(f"{path}: {said}")
        return dict(found)


def _no_number(name: str) -> None:
    raise ValueError(f"{name} is no number in JSON")
