"""An autonomy that flies straight on."""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.api import (
    Autonomy,
    GroupView,
    Handle,
    HistoricAttributes,
    Output,
    Param,
    Publish,
    State,
    Subscribe,
    unit,
)
from tussle.declare.messages import BoundaryShape, SpawnEntity
from tussle.numeric import atan2
from tussle.numeric.quaternion import quat_from_euler

AHEAD = 1e6  # [m]: far enough that the direction does not change during a run
SPAWN_PERIOD = 2.0  # [s]


class Straight(Autonomy):
    """Holds the initial heading, altitude and speed.

    With `enable_boundary_control` an entity outside the boundary that it last received turns back: towards the centre, or straight across a
    plane. It keeps its altitude. If turning cannot bring it back, as below a boundary that begins above it, it flies on.
    """

    grade = "portable"
    historic_attributes = HistoricAttributes(unread=("save_camera_images",))

    speed = Param(21.0, unit="m/s", ge=0.0, doc="Desired speed.")
    enable_boundary_control = Param(False, structural=True, doc="Turn back outside a boundary.")
    generate_entities = Param(
        False,
        structural=True,
        doc="Spawn an entity every 2 s, 10 m to the left, heading 90 degrees to the left.",
    )
    template = Param("gen_straight", doc="Entity block of the new entities.")
    goal = State("x y z", unit="m", doc="Point far ahead.")
    is_fenced = State(dtype=bool, doc="Whether a boundary was received.")
    fence = Handle(doc="The boundary received last.")
    fences = Subscribe(BoundaryShape)
    births = Publish(SpawnEntity)
    desired_altitude = Output(unit="m")
    desired_speed = Output(unit="m/s")
    desired_heading = Output(unit="rad")

    def named_blocks(self) -> tuple[str, ...]:
        """Return the block of the new entities, with `generate_entities`."""
        return (self.values["template"],) if self.values["generate_entities"] else ()

    def spawn(self, g: GroupView, rows: np.ndarray) -> None:
        self.goal[:, rows] = g.pos[:, rows] + AHEAD * g.column("forward", rows)
        self.goal[2, rows] = g.pos[2, rows]

    def step(self, g: GroupView) -> None:
        if self.enable_boundary_control:
            self._turn_back(g)
        direction = unit(self.goal - g.pos)
        self.desired_altitude[:] = self.goal[2]
        self.desired_speed[:] = self.speed
        self.desired_heading[:] = atan2(direction[1], direction[0])
        if self.generate_entities:
            self._request_spawns(g)

    def _turn_back(self, g: GroupView) -> None:
        if self.fences:
            rows, messages = self.fences.latest()
            for row, shape in zip(rows, messages.shape, strict=True):
                self.fence[row] = shape
                self.is_fenced[row] = True
        for row in np.flatnonzero(self.is_fenced):
            fence: Any = self.fence[row]
            pos = g.pos[:, row : row + 1]
            if not fence.contains(pos)[0]:
                way = fence.inward(pos)
                way[2] = 0.0
                if way.any():
                    self.goal[:2, row : row + 1] = (pos + AHEAD * unit(way))[:2]

    def _request_spawns(self, g: GroupView) -> None:
        elapsed = g.t - g.context.clock.start + 1e-6 * g.dt
        rows = np.flatnonzero(
            np.floor(elapsed / SPAWN_PERIOD) > np.maximum(0.0, np.floor((elapsed - g.dt) / SPAWN_PERIOD))
        )
        if len(rows):
            east, north, _ = g.forward[:, rows]
            left = np.array([-north, east, np.zeros(len(rows))])
            yaw = atan2(left[1], left[0])
            level = np.zeros(len(rows))
            self.births.publish(
                rows, block=[self.template] * len(rows), pos=g.pos[:, rows] + 10.0 * left,
                vel=self.speed[rows] * left, quat=quat_from_euler(level, level, yaw),
            )  # fmt: skip

    def save_one(self, handle: Any) -> Any:
        return handle

    def load_one(self, row: Any, state: Any) -> Any:
        return state
