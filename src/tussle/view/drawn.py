"""Shapes that plugins draw."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from tussle.engine.simulation import Simulation
from tussle.record.shapes import attributes_in, lifetime_of


@dataclass(frozen=True, eq=False)
class Shape:
    """A shape that a plugin has drawn.

    Attributes:
        kind: One of `tussle.api.draw.KINDS`.
        attributes: Its attributes; arrays are copies.
        t: Time at the beginning of the step that drew it [s].
    """

    kind: str
    attributes: dict[str, Any]
    t: float


class DrawCollector:
    """Collects the shapes that the plugins of a simulation draw, while it is open.

    A shape is visible until the next step, or for its `lifetime` [s] of simulated time. A shape with the attribute `world` is visible
    in that world only; the attribute is a number, or an array with the world of each item of the shape.

    Args:
        simulation: The simulation.
        world: Number of the world that is shown.
    """

    def __init__(self, simulation: Simulation, world: int) -> None:
        self._simulation, self._world = simulation, world
        self._fresh: list[Shape] = []
        self._lasting: list[Shape] = []
        self.is_open = False

    def open(self) -> None:
        """Start collecting."""
        if not self.is_open:
            self._simulation.state.context.draw.sinks.append(self._add)
            self.is_open = True

    def close(self) -> None:
        """Stop collecting and drop all shapes."""
        if self.is_open:
            self._simulation.state.context.draw.sinks.remove(self._add)
            self.is_open = False
        self.clear()

    def clear(self) -> None:
        """Drop all shapes."""
        self._fresh, self._lasting = [], []

    def begin_step(self) -> None:
        """Keep only shapes with a lifetime; called before each step."""
        self._lasting += [s for s in self._fresh if lifetime_of(s.attributes) > 0.0]
        self._fresh = []

    def shapes(self) -> tuple[Shape, ...]:
        """The visible shapes, in the order in which they were drawn."""
        now = float(self._simulation.t[self._world])
        # Tolerates rounding: a lifetime of 1 s lasts ten steps of 0.1 s.
        slack = 1e-6 * self._simulation.mission.dt
        self._lasting = [s for s in self._lasting if s.t <= now < s.t + lifetime_of(s.attributes) - slack]
        return (*self._lasting, *self._fresh)

    def _add(self, kind: str, attributes: dict[str, Any]) -> None:
        kept = attributes_in(attributes, self._world)
        if kept is not None:
            t = float(self._simulation.t[self._world])
            self._fresh.append(Shape(kind, kept, t))
