"""Debug shapes drawn by plugins. Drawing costs almost nothing when no viewer is attached.

Example: `g.draw.vectors(pos=g.pos, direction=self.desired_velocity,
colour=(255, 0, 0))`. Positions and directions are (3,) or (3, n) [m], world
frame:

| kind | draws | attributes; the first is required |
|---|---|---|
| points | points | pos, size [m] |
| cloud | points coloured by a value | pos, value (n,), low, high, size [m] |
| line | a polyline through the positions | pos, width [pixels] |
| vectors | arrows | pos, direction [m] |
| sphere | spheres | pos, radius [m] |
| box | boxes | pos, size [m] (number or (3,)), quat |
| cone | cones with the apex at pos | pos, direction, length [m], angle (full opening angle) [rad] |
| text | labels | pos, text |
| mesh | triangle meshes | vertices (3, v), faces (f, 3), pos, quat |

All shapes accept `colour` (red, green, blue, 0 to 255; (3,) or (3, n)), `opacity` (0 to 1), `lifetime` [s] in simulated time (default:
until the next step) and `world` (a number, or one per item such as `g.world`; default: visible in all worlds of the stack).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

KINDS = ("points", "line", "vectors", "sphere", "box", "cone", "text", "mesh", "cloud")


@dataclass
class Draw:
    """Pass each drawn shape to all `sinks` as (kind, attributes)."""

    sinks: list[Callable[[str, dict[str, Any]], None]] = field(default_factory=list)

    def __getattr__(self, kind: str) -> Callable[..., None]:
        if kind not in KINDS:
            raise AttributeError(f"there is no shape {kind!r}; there are: {', '.join(KINDS)}")
        return lambda **attributes: self._shape(kind, attributes)

    def _shape(self, kind: str, attributes: dict[str, Any]) -> None:
        for sink in self.sinks:
            sink(kind, attributes)
