"""Shapes that plugins draw; they cost one test where nobody looks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

KINDS = ("points", "line", "vectors", "sphere", "box", "cone", "text", "mesh", "cloud")


@dataclass
class Draw:
    """Hands each drawn shape to `sinks` as (kind, attributes)."""

    sinks: list[Callable[[str, dict[str, Any]], None]] = field(default_factory=list)

    def __getattr__(self, kind: str) -> Callable[..., None]:
        if kind not in KINDS:
            raise AttributeError(f"there is no shape {kind!r}; there are: {', '.join(KINDS)}")
        return lambda **attributes: self._shape(kind, attributes)

    def _shape(self, kind: str, attributes: dict[str, Any]) -> None:
        for sink in self.sinks:
            sink(kind, attributes)
