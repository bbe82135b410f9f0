"""Shapes that plugins draw; they cost next to nothing where nobody looks.

`g.draw.vectors(pos=g.pos, direction=self.desired_velocity,
colour=(255, 0, 0))`. Positions and directions are (3,) or (3, n) [m], world frame:

| kind | draws | attributes, the first being needed |
|---|---|---|
| points | dots | pos, size [m] |
| cloud | dots coloured by a value | pos, value (n,), low, high, size [m] |
| line | a line from one position to the next | pos, width [pixels] |
| vectors | arrows | pos, direction [m] |
| sphere | balls | pos, radius [m] |
| box | boxes | pos, size [m] (number or (3,)), quat |
| cone | cones with their tip at pos | pos, direction, length [m], angle (of the whole opening) [rad] |
| text | words | pos, text |
| mesh | triangles | vertices (3, v), faces (f, 3), pos, quat |

All take `colour` (red, green, blue, 0 to 255: (3,) or (3, n)), `opacity` (0 to 1), `lifetime` [s] of simulated time (until the next step
without it) and `world` (a number, or one per item: `g.world`), without which a shape is seen in all worlds of a stack.
"""

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
