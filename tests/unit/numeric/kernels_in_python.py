"""A game whose author's kernel, device function and derivative say where they run; prints that and the state hash."""

import sys

import numpy as np

from tussle import Block, Mission, Simulation
from tussle.api import (
    Autonomy,
    Controller,
    Input,
    MotionModel,
    Output,
    Param,
    State,
    neighbors,
    row_law,
    together,
)
from tussle.numeric import cos, sin
from tussle.numeric.kernel import device, kernel


@device
def half(x):
    return 0.5 * x


@kernel("F F Fw")
def drive(east, yaw, speed):
    for i in range(east.shape[0]):
        speed[i] = half(east[i]) + sin(yaw[i])


class Car(MotionModel):
    """A car that turns at a constant rate."""

    lag = Param(0.5, unit="s", gt=0.0)
    x = State("east north yaw v", unit="m m rad m/s")
    speed = Input(unit="m/s")

    @staticmethod
    def derivative(yaw, v, speed, lag):
        return v * cos(yaw), v * sin(yaw), 0.1, (speed - v) / lag

    def from_body(self, body, rows):
        self.x[:2, rows] = body.pos[:2, rows]
        self.x[2, rows] = body.yaw[rows]

    def to_body(self, body):
        body.pos[:2] = self.x[:2]
        body.vel[:2] = self.x[3] * np.stack([cos(self.x[2]), sin(self.x[2])])
        body.set_attitude(yaw=self.x[2])


class Trim(Controller):
    """Drive slower the farther it is east."""

    asked = Input("speed", unit="m/s")
    speed = Output(unit="m/s")
    memory = State("last n", unit="m/s 1")

    @row_law("speed", "memory")
    @staticmethod
    def trim(speed, pos_x, memory, dt):
        last, n = memory
        return half(speed + last) - dt * pos_x if n > 0.0 else speed, (speed, n + 1.0)


class Driver(Autonomy):
    """Drive as the kernel says."""

    speed = Output(unit="m/s")
    sight = Param(30.0, unit="m")

    @neighbors("sight", teams="own", n="count", gap="mean", push="sum", low="min", mate="nearest")
    @staticmethod
    def law(offset_x, distance, inverse_distance, other_id, other_vel_y):
        if distance > 25.0:
            return None
        return offset_x > 0.0, distance, inverse_distance * other_vel_y, offset_x, other_id

    @neighbors("sight", other="each")
    @staticmethod
    def pairs(id, other_id):  # noqa: A002 - a column
        if id > other_id:
            return None
        return other_id

    @staticmethod
    def ahead(offset_x, offset_y):
        return offset_x + offset_y > -10.0

    seen = together(law, where=ahead)

    def step(self, g):
        drive(g.pos[0], g.yaw, self.speed)
        found, pairs = self.seen(g), self.pairs(g)
        self.speed += (
            found.law_gap + found.law_push + np.maximum(found.law_low, -5.0) + np.nan_to_num(found.law_mate)
        )
        self.speed += found.law_n + np.bincount(pairs.row, pairs.other, g.n)


block = Block(
    name="cars",
    team=1,
    count=12,
    variance=(100.0, 100.0, 0.0),
    autonomy=Driver(),
    controller=Trim(),
    motion=Car(),
)
hashes, seen = [], set()


def look(frame, event, _):
    """Note which functions of this file run."""
    if frame.f_code.co_filename == __file__:
        seen.add(frame.f_code.co_name)


for update in ("synchronous", "sequential"):
    simulation = Simulation(Mission(blocks=[block], end=1.0, update=update))
    simulation.step()  # compiles, which takes several times as long under a profile
    sys.setprofile(look)
    simulation.run()
    sys.setprofile(None)
    hashes.append(simulation.state_hash())
print(" ".join(sorted(seen & {"half", "drive", "derivative", "law", "pairs", "ahead", "trim"})))
print(*hashes)
