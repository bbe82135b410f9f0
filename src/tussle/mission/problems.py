"""What is wrong with a mission file, and what is worth saying about it: collected, so that all of it is told at once."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from itertools import islice
from typing import NamedTuple

from tussle.errors import MissionError, listed, nearest_name
from tussle.texts import LONGEST_SHOWN, shown

MOST_LINES = 100
"""Errors told at once, and notes; a file with more is most likely not a mission."""

MOST_GUESSED = 1000
"""Names of a file among which the right one is looked for."""


class Place(NamedTuple):
    """A file and a line of it; line 0 is what was set from outside."""

    file: str
    line: int

    def __str__(self) -> str:
        return f"{self.file}:{self.line}" if self.line else f"{self.file}, as set"


class Problems:
    """Errors and notes of one reading.

    Args:
        strict: What is unknown is an error instead of a note.
    """

    def __init__(self, *, strict: bool = False) -> None:
        self.strict = strict
        self._errors: dict[str, list[Place]] = {}
        self._notes: dict[str, list[Place]] = {}
        self._n_unsaid = 0
        self._absent: dict[tuple[str, str], str] = {}

    def error(self, place: Place, text: str) -> None:
        """Something that keeps the mission from being played.

        Raises:
            MissionError: There are too many by now.
        """
        self._errors.setdefault(text, []).append(place)
        if len(self._errors) >= MOST_LINES:
            self._errors["there may be more: reading stopped here"] = [place]
            self.check()

    def absent(self, place: Place, what: str, name: str, known: Collection[str]) -> None:
        """A name that the file does not explain; the guess at the right one, which takes a while, is made once for each name."""
        if (what, name) not in self._absent:
            some = list(islice(known, MOST_GUESSED))
            more = ", ..." if len(known) > len(some) else ""
            guess = nearest_name(name[:LONGEST_SHOWN], some)
            self._absent[what, name] = f"there is no {what} {shown(name)}{guess}; {listed(some)}{more}"
        self.error(place, self._absent[what, name])

    def note(self, place: Place, text: str) -> None:
        """Something that the reader of the file should know."""
        if len(self._notes) < MOST_LINES or text in self._notes:
            self._notes.setdefault(text, []).append(place)
        else:
            self._n_unsaid += 1

    def unknown(
        self, place: Place, what: str, name: str, allowed: Iterable[str], *, lists: bool = False
    ) -> None:
        """A tag or attribute that means nothing: a note, or with `strict` or where it was set from outside an error."""
        if not self.strict and len(self._notes) >= MOST_LINES:
            self._n_unsaid += 1  # without the guess at the right name, which takes a while
            return
        known = sorted(allowed)
        text = f"{what} {shown(name)} is unknown{nearest_name(name[:LONGEST_SHOWN], known)}"
        if self.strict or not place.line:
            self.error(place, f"{text}; {listed(known)}" if lists else text)
        else:
            self.note(place, f"{text}; it is ignored")

    @property
    def notes(self) -> tuple[str, ...]:
        """One line each, in the order of the file."""
        more = [f"... and {self._n_unsaid} notes more"] if self._n_unsaid else []
        return (*_lines(self._notes), *more)

    def check(self) -> None:
        """Raise what there is.

        Raises:
            MissionError: There are errors; one line each.
        """
        if not self._errors:
            return
        raise MissionError("\n".join(_lines(self._errors)))


def _lines(found: dict[str, list[Place]]) -> list[str]:
    """Each text once, with all its places; ordered by file and line of the first."""
    order = sorted(found.items(), key=lambda item: item[1][0].line)
    return [f"{_places(places)}: {text}" for text, places in order]


def _places(places: list[Place]) -> str:
    """For instance "a.xml:12", or "a.xml:12, 40, 41" for the same thing at several lines."""
    first = places[0]
    lines = list(dict.fromkeys(p.line for p in places if p.file == first.file))
    rest = f", {', '.join(str(line) for line in lines[1:6])}" if len(lines) > 1 else ""
    return f"{first}{rest}{' ...' if len(lines) > 6 else ''}"
