"""The shapes that plugins draw, as they are seen after a step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from tussle.engine.simulation import Simulation
from tussle.record.shapes import attributes_in, lifetime_of


@dataclass(frozen=True, eq=False)
class Shape:
    """Something that a plugin has drawn.

    Attributes:
        kind: One of `tussle.api.draw.KINDS`.
        attributes: What it was drawn with; arrays are copies.
        t: Time of the beginning of the step in which it was drawn [s].
    """

    kind: str
    attributes: dict[str, Any]
    t: float


class Sketchbook:
    """Collects what the plugins of a simulation draw, while it is open.

    A shape is seen until the next step, or for its `lifetime` [s] of simulated time. One with the attribute `world` is seen in
    that world only: a number, or with shapes that have several items, one per item, of which this world's are kept.

    Args:
        simulation: The simulation.
        world: The world that is watched.
    """

    def __init__(self, simulation: Simulation, world: int) -> None:
        self._simulation, self._world = simulation, world
        self._fresh: list[Shape] = []
        self._lasting: list[Shape] = []
        self.is_open = False

    def open(self) -> None:
        """Collect from now on."""
        if not self.is_open:
            self._simulation.state.context.draw.sinks.append(self._add)
            self.is_open = True

    def close(self) -> None:
        """Collect no more, and forget what there is."""
        if self.is_open:
            self._simulation.state.context.draw.sinks.remove(self._add)
            self.is_open = False
        self.clear()

    def clear(self) -> None:
        """Forget what there is: the game has jumped."""
        self._fresh, self._lasting = [], []

    def turn_page(self) -> None:
        """A step begins."""
        self._lasting += [s for s in self._fresh if lifetime_of(s.attributes) > 0.0]
        self._fresh = []

    def shapes(self) -> tuple[Shape, ...]:
        """All that is seen now, in the order in which it was drawn."""
        now = float(self._simulation.t[self._world])
        # As long as the dt that the clock rounds to matters not: a lifetime of 1 s is seen for ten steps of 0.1 s.
        slack = 1e-6 * self._simulation.mission.dt
        self._lasting = [s for s in self._lasting if s.t <= now < s.t + lifetime_of(s.attributes) - slack]
        return (*self._lasting, *self._fresh)

    def _add(self, kind: str, attributes: dict[str, Any]) -> None:
        kept = attributes_in(attributes, self._world)
        if kept is not None:
            t = float(self._simulation.t[self._world])
            self._fresh.append(Shape(kind, kept, t))
