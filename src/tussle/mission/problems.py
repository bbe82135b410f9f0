"""Errors and notes about a mission file, collected so that they are reported together."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from itertools import islice
from typing import NamedTuple

from tussle.declare.texts import shown
from tussle.errors import MissionError, listed, nearest_name

MAX_LINES = 100
"""Maximum number of errors, and of notes; a file with more is most likely not a mission."""

MAX_REPAIRED = 200
"""Characters of a repaired line in a message."""
MAX_GUESSED = 1000
"""Maximum number of names that are searched for the nearest one."""


class Place(NamedTuple):
    """A file and a line; line 0 is a value that was set from outside the file."""

    file: str
    line: int

    def __str__(self) -> str:
        return f"{self.file}:{self.line}" if self.line else f"{self.file}, value set from outside"


class Strictness(NamedTuple):
    """Whether unknown tags and attributes of a file are errors.

    Attributes:
        is_strict: They are errors instead of notes.
        reason: Why, and how to choose otherwise; "" if the user has chosen.
    """

    is_strict: bool
    reason: str = ""


class Problems:
    """Errors and notes of one reading.

    Attributes:
        strictness: Whether unknown tags and attributes are errors.
    """

    def __init__(self) -> None:
        self.strictness = Strictness(True)
        self._errors: dict[str, list[Place]] = {}
        self._notes: dict[str, list[Place]] = {}
        self._n_omitted = 0
        self._absent: dict[tuple[str, str], str] = {}
        self._unknown: dict[tuple[str, str], tuple[str, str]] = {}
        self._has_unknown = False
        self._repairs: dict[str, tuple[str, list[Place]]] = {}

    def error(self, place: Place, text: str) -> None:
        """Add an error: the mission cannot be run.

        Raises:
            MissionError: There are too many errors.
        """
        self._errors.setdefault(text, []).append(place)
        if len(self._errors) >= MAX_LINES:
            self._errors["reading stopped here; there may be more errors"] = [place]
            self.check()

    def absent(self, place: Place, what: str, name: str, known: Collection[str]) -> None:
        """Add an error about a name that the file does not define. The slow search for the nearest name is done once per name."""
        if (what, name) not in self._absent:
            some = list(islice(known, MAX_GUESSED))
            more = ", ..." if len(known) > len(some) else ""
            guess = nearest_name(name, some)
            self._absent[what, name] = f"there is no {what} {shown(name)}{guess}; {listed(some)}{more}"
        self.error(place, self._absent[what, name])

    def note(self, place: Place, text: str) -> None:
        """Add a note, a message about the file that is not an error."""
        if len(self._notes) < MAX_LINES or text in self._notes:
            self._notes.setdefault(text, []).append(place)
        else:
            self._n_omitted += 1

    def unknown(
        self, place: Place, what: str, name: str, allowed: Iterable[str], *, lists: bool = False
    ) -> None:
        """Add an error about an unknown tag or attribute; a note if the reading is lenient and the file has it."""
        if not self.strictness.is_strict and len(self._notes) >= MAX_LINES:
            self._n_omitted += 1  # skips the search for the nearest name, which is slow
            return
        if (what, name) not in self._unknown:
            known = sorted(allowed)
            text = f"{what} {shown(name)} is unknown{nearest_name(name, known)}"
            self._unknown[what, name] = text, listed(known)
        text, allowed_names = self._unknown[what, name]
        if self.strictness.is_strict or not place.line:
            self._has_unknown |= bool(place.line)
            self.error(place, f"{text}; {allowed_names}" if lists else text)
        else:
            self._has_unknown = True
            self.note(place, f"{text}; it is ignored")

    def note_repair(self, place: Place, what: str, repaired: str) -> None:
        """Add what is wrong but has a meaning in SCRIMMAGE: an error, or a note if the reading is lenient and the file has it.

        Args:
            place: The place.
            what: What is wrong.
            repaired: How the same is written right.
        """
        if not place.line:
            self.error(place, what)
            return
        self._repairs.setdefault(what, (repaired, []))[1].append(place)

    def _mends(self, text: str) -> dict[str, list[Place]]:
        return {
            f"{what}; {text} {shown(repaired, MAX_REPAIRED)}": places
            for what, (repaired, places) in islice(self._repairs.items(), MAX_LINES)
        }

    @property
    def notes(self) -> tuple[str, ...]:
        """The notes, one line each, in the order of the file."""
        notes = self._notes if self.strictness.is_strict else self._notes | self._mends("it is read as")
        more = [f"... and {self._n_omitted} more notes"] if self._n_omitted else []
        why = [self.strictness.reason] if self._has_unknown and self.strictness.reason else []
        return (*_lines(notes), *more, *why)

    def at(self, place: Place) -> list[str]:
        """Return the notes about a place."""
        return [text for text, places in self._notes.items() if place in places]

    def check(self) -> None:
        """Raise the collected errors.

        Raises:
            MissionError: There are errors; the message has one line for each, and one on how unknown names are ignored.
        """
        is_strict = self.strictness.is_strict
        errors = self._errors | self._mends("write") if is_strict else self._errors
        if not errors:
            return
        why = [self.strictness.reason] if self._has_unknown and is_strict else []
        if self._repairs and is_strict and self.strictness.reason:
            why.append("--lenient (strict=False) reads what is malformed as SCRIMMAGE does, with a note")
        raise MissionError("\n".join([*_lines(errors), *filter(None, why)]))


def _lines(found: dict[str, list[Place]]) -> list[str]:
    """Return one line per text with its places, ordered by the line of the first place."""
    order = sorted(found.items(), key=lambda item: item[1][0].line)
    return [f"{_places(places)}: {text}" for text, places in order]


def _places(places: list[Place]) -> str:
    """Return places as text: "a.xml:12", or "a.xml:12, 40, 41" for several lines."""
    first = places[0]
    lines = list(dict.fromkeys(p.line for p in places if p.file == first.file))
    rest = f", {', '.join(str(line) for line in lines[1:6])}" if len(lines) > 1 else ""
    return f"{first}{rest}{' ...' if len(lines) > 6 else ''}"
