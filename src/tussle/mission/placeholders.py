"""Replacement of placeholders, `${name=default}`, in the text of a mission."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from xml.sax.saxutils import escape

from tussle.errors import MissionError
from tussle.mission.node import Budget
from tussle.mission.problems import Place, Problems

PLACEHOLDER = re.compile(r"\$\{([^=${}\s]{1,200})(?:=([^{}]*))?\}")


@dataclass
class Replaced:
    """A text after replacement of its placeholders.

    Attributes:
        text: The text to parse.
        names: Placeholders outside comments, with their defaults.
        places: Name -> places where it stands outside comments.
        ends: Line of `text` at the end of each replacement that changed the number of lines.
        shifts: Number to add to lines from there on to get the line of the file.
    """

    text: str
    names: dict[str, str] = field(default_factory=dict)
    places: dict[str, list[Place]] = field(default_factory=dict)
    ends: list[int] = field(default_factory=list)
    shifts: list[int] = field(default_factory=list)

    @property
    def line_of(self) -> Callable[[int], int]:
        """Maps a line of the new text to the line of the file."""

        def shifted(line: int) -> int:
            i = bisect_right(self.ends, line)
            return max(1, line + (self.shifts[i - 1] if i else 0))

        return shifted


def _comments(text: str) -> Iterator[tuple[int, int]]:
    """Begin and end of each comment. A regular expression would take quadratic time if many comments begin and none ends."""
    begin = text.find("<!--")
    while begin >= 0 and (end := text.find("-->", begin)) >= 0:
        yield begin, end
        begin = text.find("<!--", end)


def replace_placeholders(
    text: str, file: str, overrides: Mapping[str, str], problems: Problems, budget: Budget
) -> Replaced:
    """Replace every placeholder by its override, or else by its default.

    An override is a value, never markup: <, >, & and quotes in it are escaped.

    Raises:
        MissionError: The result is too long.
    """
    comments = list(_comments(text))
    starts = [a for a, _ in comments]
    safe = {name: escape(value, {'"': "&quot;"}) for name, value in overrides.items()}
    done, parts, out = 0, [], Replaced("")
    size, line, at, shift = 0, 1, 0, 0
    for match in PLACEHOLDER.finditer(text):
        name: str = match[1]
        default: str | None = match[2]
        place = Place(file, line + text.count("\n", at, match.start()))
        i = bisect_right(starts, match.start()) - 1
        is_comment = i >= 0 and match.start() < comments[i][1]
        if not is_comment:
            out.names.setdefault(name, default or "")
            out.places.setdefault(name, []).append(place)
        value = safe.get(name, default)
        if value is None:
            value = match[0] if is_comment else ""
            if not is_comment:
                problems.error(
                    place,
                    f"${{{name}}} has no default and is not set; write ${{{name}=default}} or set {name}",
                )
        parts += [text[done : match.start()], value]
        size += match.start() - done + len(value)
        if size > budget.limits.text:
            raise MissionError(
                f"{file}: the mission is longer than {budget.limits.text:,} characters with its placeholders replaced"
            )
        done = match.end()
        line, at = line + text.count("\n", at, done), done
        change = match[0].count("\n") - value.count("\n")
        if change:
            shift += change
            out.ends.append(line - shift)
            out.shifts.append(shift)
    out.text = "".join([*parts, text[done:]])
    budget.spend_text(max(0, len(out.text) - len(text)), file)
    return out
