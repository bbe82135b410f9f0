"""Error classes, and the formatting of names and external text in messages."""

from __future__ import annotations

import difflib
import unicodedata
from collections.abc import Iterable

MAX_SHOWN = 80
"""Largest number of characters of a foreign text in a message."""


class TussleError(Exception):
    """Base class of the errors that tussle raises about its input; abstract."""


class DeclarationError(TussleError, TypeError):
    """A plugin class has an invalid declaration. Raised when the class is defined or checked, never during a step."""


class ParameterError(TussleError, ValueError):
    """A parameter is unknown, has the wrong type, or is out of bounds."""


class PortError(ParameterError):
    """A port of this machine cannot be opened: another program has it, or the address is not this machine's."""


class UnitError(ParameterError):
    """A value has an unknown unit, or a unit of another quantity."""


class WiringError(TussleError):
    """Plugins do not fit together: a channel or topic has no writer, or has another unit or type."""


class MissionError(TussleError, ValueError):
    """A mission is invalid; the message begins with file and line if it was read from a file."""


class MissingFileError(MissionError):
    """A file that a mission names is in none of the folders that are searched."""


class SnapshotError(TussleError):
    """A snapshot cannot be taken, or does not fit the simulation it is restored into."""


class RecordError(TussleError):
    """A run cannot be recorded or read. Data written before the error stays intact."""


class BatchError(TussleError):
    """A batch cannot be run or read, or the directory holds another batch. Earlier results stay intact."""


class ViewError(TussleError):
    """A page cannot be served, or a picture or film cannot be made."""


class MissingExtraError(TussleError, ImportError):
    """A feature needs a package from an optional extra; the message names both."""


class RosError(TussleError):
    """The ROS master cannot be reached, the domain of ROS 2 cannot be joined, or a node sent something that is not allowed."""


class ConformanceError(TussleError):
    """A plugin breaks a rule of the plugin contract.

    Args:
        plugin: Name of the plugin class.
        rule: Name of the rule, such as "snapshot".
        evidence: What was observed.
    """

    def __init__(self, plugin: str, rule: str, evidence: str) -> None:
        super().__init__(plugin, rule, evidence)
        self.plugin = plugin
        self.rule = rule
        self.evidence = evidence

    def __str__(self) -> str:
        return f"{self.plugin} breaks the rule {self.rule!r}: {self.evidence}"


class PluginError(TussleError):
    """A plugin failed while the simulation ran.

    Args:
        message: What happened.
        where: Entity or block, such as "predator 3".
        step: Number of the step; None outside the step loop.
        world: Number of the world in its stack; None if all worlds are concerned.
        plugin: Name of the plugin instance.
        cause: Exception raised by the plugin; None if the plugin returned but left an invalid value.
    """

    def __init__(
        self,
        message: str,
        *,
        where: str = "",
        step: int | None = None,
        world: int | None = None,
        plugin: str = "",
        cause: BaseException | None = None,
    ) -> None:
        super().__init__(message)
        self.message = message
        self.where = where
        self.step = step
        self.world = world
        self.plugin = plugin
        self.cause = cause
        self.__cause__ = cause

    def __str__(self) -> str:
        step = "" if self.step is None else f"step {self.step}"
        world = "" if self.world is None else f"world {self.world}"
        place = ", ".join(part for part in (self.plugin, self.where, world, step) if part)
        return f"{place}: {self.message}" if place else self.message

    def __reduce__(self) -> tuple[object, ...]:
        # Errors are pickled by worker processes; the default would keep only the positional arguments.
        return (type(self), (self.message,), dict(self.__dict__))


def clipped(text: str, longest: int = MAX_SHOWN) -> str:
    """The text; of a longer one, its beginning and "..."."""
    return text if len(text) <= longest else text[:longest] + "..."


def nearest_name(wrong: str, allowed: Iterable[str]) -> str:
    """Suggestion to append to a wrong name: " (did you mean 'max_speed'?)", or "" if no allowed name is close."""
    names = list(allowed)
    folded: dict[str, str] = {}
    for name in names:
        folded.setdefault(name.lower(), name)
    close = difflib.get_close_matches(wrong[:MAX_SHOWN].lower(), folded, n=1)
    return f" (did you mean {folded[close[0]]!r}?)" if close else ""


def slip_of(name: str, known: Iterable[str]) -> str | None:
    """The known name that another one differs from by one letter, or by the order of its letters; None if there is none."""

    def is_slip(one: str) -> bool:
        less, more = sorted((name, one), key=len)
        if len(less) == len(more):
            return sorted(less) == sorted(more) or sum(a != b for a, b in zip(less, more, strict=True)) == 1
        return len(more) - len(less) == 1 and any(more[:i] + more[i + 1 :] == less for i in range(len(more)))

    names = list(known)
    return None if name in names else next(filter(is_slip, names), None)


def listed(names: Iterable[str]) -> str:
    """List names in the given order: "there are: a, b, c", or "there are none"."""
    text = ", ".join(names)
    return f"there are: {text}" if text else "there are none"


def visible(text: str) -> str:
    r"""Escape control characters and invisible formatting characters: "\x1b", "\u202e".

    Newlines, tabs and zero-width joiners, which some scripts need, are kept.
    """
    return text if text.isprintable() else "".join(map(_shown, text))


def _shown(character: str) -> str:
    is_hidden = (
        unicodedata.category(character) in ("Cc", "Cf", "Cs", "Zl", "Zp") or character in "\ufffe\uffff"
    )
    if is_hidden and character not in "\n\t\u200c\u200d":
        return character.encode("unicode_escape").decode("ascii")
    return character
