"""The outputs of a plugin that other plugins read, and which others it has left out."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Self


class Wired(frozenset[str]):
    """Names of the outputs that other plugins read. A plugin that asks for another output does not write it.

    Attributes:
        skipped: Outputs that were asked for and that nobody reads: their columns hold what they held at first.
        is_asked: Whether the plugin has asked for any output.
    """

    skipped: set[str]
    is_asked: bool

    def __new__(cls, names: Iterable[str] = ()) -> Self:
        made = super().__new__(cls, names)
        made.skipped, made.is_asked = set(), False
        return made

    def __contains__(self, name: object) -> bool:
        self.is_asked = True
        is_read = super().__contains__(name)
        if not is_read:
            self.skipped.add(str(name))
        return is_read

    def isdisjoint(self, names: Iterable[Any]) -> bool:
        asked = list(names)
        is_none_read = super().isdisjoint(asked)
        if is_none_read:
            self.skipped.update(asked)
        return is_none_read


__all__ = ["Wired"]
