"""Reading of untrusted files: regular files only, of limited size, and JSON documents checked against a schema."""

from __future__ import annotations

import json
import math
import numbers
import re
import stat
import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePath, PurePosixPath
from typing import Any

from tussle.checksums import BLANK, MARK, is_intact, sealed
from tussle.errors import ParameterError, TussleError, clipped, listed, nearest_name

MAX_BYTES = 1 << 25
"""Maximum size of a document. Parsed JSON takes up to about twenty times as much memory."""
CHECKSUM = "checksum"
"""Field of a document that holds its checksum."""
DAMAGED = f"is damaged: its checksum does not match its content; if it was edited, remove the line {CHECKSUM!r} to read it as it is"


def size_of(path: Path, most: int | None = None) -> int:
    """Size of a regular file [B]. Pipes and devices are refused, since opening them can block forever.

    Raises:
        OSError: The file does not exist, is not a regular file, or is larger than `most`.
    """
    about = path.stat()
    if not stat.S_ISREG(about.st_mode):
        raise OSError("it is not a regular file")
    if most is not None and about.st_size > most:
        raise OSError(f"its size is {about.st_size:,} bytes; the limit is {most:,}")
    return about.st_size


def read_bytes(path: Path, error: type[TussleError], most: int = MAX_BYTES) -> bytes:
    """Read a file. All files that a mission names are read by this function, or by `read_text`.

    Raises:
        TussleError: As `error`: the file is not a regular file, or is larger than `most` bytes.
    """
    try:
        n = size_of(path, most)
        with path.open("rb") as file:
            return file.read(n)  # Python reserves as much memory as may be read
    except (OSError, ValueError) as reason:
        raise error(f"{path}: cannot be read: {getattr(reason, 'strerror', None) or reason}") from None


def read_part(path: Path, error: type[TussleError], start: int, n: int) -> bytes:
    """Read a part of a file of any size: n bytes from `start`, fewer where it ends before.

    Raises:
        TussleError: As `error`: the file is not a regular file, or cannot be read.
    """
    try:
        size_of(path)
        with path.open("rb") as file:
            file.seek(start)
            return file.read(n)
    except (OSError, ValueError, OverflowError) as reason:
        raise error(f"{path}: cannot be read: {getattr(reason, 'strerror', None) or reason}") from None


def read_text(path: Path, error: type[TussleError], most: int = MAX_BYTES) -> str:
    """Read a UTF-8 text file.

    Raises:
        TussleError: As `error`: the file is not a regular file, is larger than `most` bytes, or is not UTF-8 text.
    """
    try:
        return read_bytes(path, error, most).decode("utf-8")
    except UnicodeDecodeError as reason:
        raise error(f"{path}: cannot be read: {reason}") from None


# -- schemas ------------------------------------------------------------------------------------------------------------------

Rule = Any
"""Schema of a value: `bool` or `str`, one of the rules below, a tuple of the allowed values, [rule] for a list, or for an object a
dict from field names to rules. Further fields of an object are ignored."""


@dataclass(frozen=True)
class Whole:
    """An integer within bounds."""

    least: int = 0
    most: int = 2**63 - 1


@dataclass(frozen=True)
class Real:
    """A number within bounds; with `is_any`, also the strings "inf", "-inf" and "nan", which stand for numbers JSON lacks."""

    least: float = -sys.float_info.max
    most: float = sys.float_info.max
    is_any: bool = False


POSITIVE = Real(math.ulp(0.0))
"""A finite number > 0."""


@dataclass(frozen=True)
class Map:
    """An object with any field names that match the regular expression `names`; all values follow one rule."""

    rule: Rule
    names: str = r"[\s\S]*"


@dataclass(frozen=True)
class Maybe:
    """A field that may be null or missing."""

    rule: Rule


@dataclass(frozen=True)
class Either:
    """A value that follows at least one of several rules; `allowed` describes them in messages."""

    rules: tuple[Rule, ...]
    allowed: str


@dataclass(frozen=True)
class Checked:
    """A value that follows a rule and passes a further check, which takes value and place and returns as `problem` does."""

    rule: Rule
    problem: Callable[[Any, str], str]


def _path_problem(text: str, where: str) -> str:
    path = PurePosixPath(text)
    is_inside = text and "\0" not in text and not path.is_absolute() and ".." not in path.parts
    return "" if is_inside else _refused(where, text, "a path inside the directory")


Inside = Checked(str, _path_problem)
"""A relative path that stays inside its base directory."""


def _colour_problem(text: str, where: str) -> str:
    return "" if re.fullmatch("#[0-9a-f]{6}", text) else _refused(where, text, 'a colour "#rrggbb"')


Colour = Checked(str, _colour_problem)
"""A colour "#rrggbb"."""
Team = r"-?\d{1,10}"
"""Pattern of a team number as a field name."""


def problem(value: Any, rule: Rule, where: str = "") -> str:
    """Describe what is wrong with a value: "worlds[0].steps = -1 is not allowed; ..."; "" if it follows the rule."""
    match rule:
        case dict():
            return _object_problem(value, rule, where)
        case Map():
            if not isinstance(value, dict):
                return _refused(where, value, "an object")
            if wrong := [
                name for name in value if not re.fullmatch(rule.names, name) or _has_surrogates(name)
            ]:
                return f"{where}: the name {_shown(wrong[0])} is not allowed"
            return _first(problem(inner, rule.rule, f"{where}.{name:.80}") for name, inner in value.items())
        case list():  # not `case [inside]`, which takes a tuple of one allowed value for a list, too
            (inside,) = rule
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
    return _scalar_problem(value, rule, where)


def is_whole(value: Any) -> bool:
    """Whether a value is a whole number, of Python or of NumPy, and no truth value."""
    return isinstance(value, numbers.Integral) and not isinstance(value, bool)


MAX_DIGITS = 18
"""So many digits are a whole number of 64 bits."""


def is_count(text: str) -> bool:
    """Whether a text is a whole number from 0 on, such that `int` reads it: of digits such as ², `str.isdigit` is true, too."""
    return text.isascii() and text.isdigit() and len(text) <= MAX_DIGITS


def several(given: Iterable[Any]) -> tuple[Any, ...]:
    """Items of an argument that takes several texts or paths; a text or path alone is one."""
    return (given,) if isinstance(given, (str, PurePath)) else tuple(given)


def check_argument(name: str, value: Any, rule: Rule) -> None:
    """Check an argument of a function; a number of NumPy counts as the Python number.

    Raises:
        ParameterError: It does not follow the rule.
    """
    if violation := problem(value.item() if getattr(value, "ndim", 1) == 0 else value, rule, name):
        raise ParameterError(violation)


def _object_problem(value: Any, rule: Mapping[str, Rule], where: str) -> str:
    if not isinstance(value, dict):
        return _refused(where, value, "an object")
    missing = [name for name, inner in rule.items() if name not in value and not isinstance(inner, Maybe)]
    if missing:
        return f"{where or 'the document'} lacks {', '.join(missing)}"
    above = f"{where}." if where else ""
    return _first(problem(value.get(name), inner, above + name) for name, inner in rule.items())


def _scalar_problem(value: Any, rule: Rule, where: str) -> str:
    """Describe what is wrong with a value that is not a container."""
    if isinstance(rule, tuple):
        is_there = any(type(value) is type(one) and value == one for one in rule)
        guess = nearest_name(value, rule) if isinstance(value, str) else ""
        return (
            "" if is_there else f"{where} = {_shown(value)} is not allowed{guess}; {listed(map(repr, rule))}"
        )
    if rule is bool:
        return "" if isinstance(value, bool) else _refused(where, value, "true or false")
    if rule is str:
        return (
            _refused(where, value, "a text") if not isinstance(value, str) or _has_surrogates(value) else ""
        )
    if isinstance(rule, Whole):
        is_good = type(value) is int and rule.least <= value <= rule.most
        bounds = f">= {rule.least}" if rule.most == Whole.most else f"from {rule.least} to {rule.most}"
        return "" if is_good else _refused(where, value, f"a whole number {bounds}")
    is_named = rule.is_any and value in ("inf", "-inf", "nan")
    is_good = is_named or (type(value) in (int, float) and rule.least <= value <= rule.most)
    bounds = "> 0" if rule == POSITIVE else f"from {rule.least:g} to {rule.most:g}"
    return "" if is_good else _refused(where, value, f"a number {bounds}")


def _has_surrogates(text: str) -> bool:
    """Return True if a text holds surrogates, which JSON can escape but UTF-8 cannot encode."""
    return any("\ud800" <= letter <= "\udfff" for letter in text)


def _refused(where: str, value: Any, allowed: str) -> str:
    return f"{where or 'the document'} = {_shown(value)} is not allowed; it takes {allowed}"


def _shown(value: Any) -> str:
    """A value as shortened text for a message; of a list or an object, only the number of items."""
    if isinstance(value, (list, dict)) and value:
        return f"{'a list' if isinstance(value, list) else 'an object'} of {len(value)}"
    text = (
        ascii(value)
        if not isinstance(value, int) or abs(value) < 10**80
        else "a number of more than 80 digits"
    )
    return clipped(text)


def _first(problems: Iterable[str]) -> str:
    return next((text for text in problems if text), "")


@dataclass(frozen=True)
class Document:
    """A kind of JSON document.

    Attributes:
        noun: What it describes, such as "the batch".
        version: Required value of its field `format`.
        rule: Its schema.
        error: Class of the errors that are raised.
    """

    noun: str
    version: int
    rule: Rule
    error: type[TussleError]

    def read(self, path: Path) -> dict[str, Any]:
        """Read a document and check it against its schema.

        Raises:
            TussleError: As `error`: the file cannot be read, has another format version, or violates the schema; the message names
                file and field.
        """
        text = read_text(path, self.error)
        try:
            found = json.loads(text, parse_constant=_no_number)
        except (ValueError, RecursionError) as reason:
            why = "lists or objects are nested too deeply" if isinstance(reason, RecursionError) else reason
            raise self.error(f"{path}: cannot be read: {why}") from None
        version = found.get("format") if isinstance(found, dict) else None
        if type(version) is not int or version != self.version:
            raise self.error(
                f"{path}: {self.noun} has format {_shown(version)}; this version of tussle reads format {self.version}"
            )
        if violation := problem(found, self.rule):
            raise self.error(f"{path}: {violation}")
        if found.pop(CHECKSUM, None) is not None and not is_intact(text.encode()):
            raise self.error(f"{path}: {DAMAGED}")
        return dict(found)

    def is_damaged(self, path: Path) -> bool:
        """Return True if a file has a checksum that does not match its content."""
        try:
            data = read_text(path, self.error).encode()
        except TussleError:
            return False
        return MARK in data and not is_intact(data)


def json_text(values: Mapping[str, Any]) -> str:
    """A document with its checksum. The values are those of JSON."""
    return sealed(
        (json.dumps({CHECKSUM: BLANK, **values}, indent=1, allow_nan=False) + "\n").encode()
    ).decode()


def _no_number(name: str) -> None:
    raise ValueError(f"{name} is not a JSON number")
