"""The errors of tussle, and how names and texts from outside stand in what is said."""

from __future__ import annotations

import difflib
import unicodedata
from collections.abc import Iterable


class TussleError(Exception):
    """Any error that tussle itself raises about what it was given; abstract."""


class DeclarationError(TussleError, TypeError):
    """A plugin class declares something unsound. Raised where the class is defined or checked, never in a step."""


class ParameterError(TussleError, ValueError):
    """A parameter is unknown, of the wrong type, or outside what is allowed."""


class UnitError(ParameterError):
    """A value carries a unit that is unknown or measures something else."""


class WiringError(TussleError):
    """Plugins do not fit together: a channel or topic that nobody writes, or that has another unit or type."""


class MissionError(TussleError, ValueError):
    """A mission says something impossible; the message begins with file and line where there is one."""


class SnapshotError(TussleError):
    """A snapshot cannot be taken, or does not belong to the simulation it is restored into."""


class RecordError(TussleError):
    """A run cannot be recorded, or what is there is no recorded run; what had been written before stays whole."""


class BatchError(TussleError):
    """A batch cannot be played, or what is there is no batch or another one; what had been played before stays whole."""


class ViewError(TussleError):
    """A game cannot be shown: a page cannot be served, or a picture or film cannot be made."""


class MissingExtraError(TussleError, ImportError):
    """A feature needs a package that only an extra installs; the message names both."""


class ConformanceError(TussleError):
    """A plugin breaks a rule of the contract.

    Args:
        plugin: Name of its class.
        rule: What it breaks, such as "snapshot".
        evidence: What was seen.
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
        message: What happened, in words.
        where: Entity or block, such as "predator 3".
        step: Number of the step; None outside the loop.
        world: Number of the world in its stack; None when all of them are concerned.
        plugin: Name of the plugin instance.
        cause: The exception that the plugin raised; None when it returned but left a value that is not allowed.
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
        # The default rebuilds an exception from its positional arguments only, and errors come back from worker processes.
        return (type(self), (self.message,), dict(self.__dict__))


def nearest_name(wrong: str, allowed: Iterable[str]) -> str:
    """A guess at what was meant, to be put behind the wrong name: " (did you mean 'max_speed'?)", or "" without a good guess."""
    names = list(allowed)
    folded: dict[str, str] = {}
    for name in names:
        folded.setdefault(name.lower(), name)
    close = difflib.get_close_matches(wrong.lower(), folded, n=1)
    return f" (did you mean {folded[close[0]]!r}?)" if close else ""


def listed(names: Iterable[str]) -> str:
    """All that there is, in the given order: "there are: a, b, c", or "there are none"."""
    text = ", ".join(names)
    return f"there are: {text}" if text else "there are none"


def visible(text: str) -> str:
    r"""A text in which what steers a terminal or turns the order of letters is shown as an escape: "\x1b", "\u202e".

    Line ends and tabs stay, and so do the joiners that some scripts are written with.
    """
    return text if text.isprintable() else "".join(map(_shown, text))


def _shown(character: str) -> str:
    is_hidden = (
        unicodedata.category(character) in ("Cc", "Cf", "Cs", "Zl", "Zp") or character in "\ufffe\uffff"
    )
    if is_hidden and character not in "\n\t\u200c\u200d":
        return character.encode("unicode_escape").decode("ascii")
    return character
