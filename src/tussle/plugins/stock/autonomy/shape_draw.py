"""An autonomy that draws each kind of shape."""

from __future__ import annotations

import numpy as np

from tussle.api import Autonomy, GroupView, HistoricAttributes, Param


class ShapeDraw(Autonomy):
    """Draws one shape of each kind around the entity, for a viewer; it does not move. Its code is an example of drawing by plugins."""

    grade = "portable"
    historic_attributes = HistoricAttributes(unread=("initial_speed",))

    size = Param(10.0, unit="m", gt=0.0, doc="Size of the shapes.")

    def step(self, g: GroupView) -> None:
        if not g.draw.sinks:
            return
        size, east = self.size, np.array([[1.0], [0.0], [0.0]])
        up = east[[2, 1, 0]] * size

        def beside(k: float) -> np.ndarray:
            return np.asarray(g.pos + 3.0 * k * size * east)

        def draw(kind: str, **attributes: object) -> None:
            getattr(g.draw, kind)(world=g.world, opacity=0.6, **attributes)

        draw("sphere", pos=beside(1), radius=size, colour=(255, 0, 0))
        draw("box", pos=beside(2), size=size, quat=g.quat, colour=(0, 255, 0))
        draw("cone", pos=beside(3) + up, direction=-up, length=size, angle=0.5, colour=(0, 0, 255))
        draw("vectors", pos=beside(4), direction=size * g.forward, colour=(255, 255, 0))
        draw("points", pos=beside(5), size=0.2 * size, colour=(255, 0, 255))
        draw("text", pos=g.pos + up, text=[f"entity {i}" for i in g.id], colour=(0, 255, 255))
