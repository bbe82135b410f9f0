"""A quadrotor that flies straight on, and avoids others by velocity obstacles, from what it hears of them by radio."""

import numpy as np

from tussle.api import Autonomy, Field, GroupView, Message, Output, Param, Publish, State, Subscribe


class Beacon(Message):
    """Where a quadrotor believes to be, and how fast."""

    pos = Field("x y z", unit="m")
    vel = Field("x y z", unit="m/s")


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Products of vectors (3, n), (n,)."""
    return np.asarray(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


class VelocityObstacles(Autonomy):
    """Flies on at the velocity nearest to its first one that passes the others at a distance (van den Berg et al. 2011)."""

    grade = "portable"
    gap = Param(3.0, unit="m", gt=0.0, doc="Distance at which it passes others.")
    memory = Param(0.0, unit="s", ge=0.0, doc="Time for which it remembers a beacon.")
    first = State("x y z", unit="m/s")
    known = State("x y z vx vy vz id t", unit="m m m m/s m/s m/s 1 s", ragged=True)
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")
    told = Publish(Beacon, network="radio")
    heard = Subscribe(Beacon, network="radio")

    def spawn(self, g: GroupView, rows: np.ndarray) -> None:
        self.first[:, rows] = g.vel[:, rows]

    def step(self, g: GroupView) -> None:
        self.told.publish(np.arange(g.n), pos=g.pos, vel=g.vel)
        row, heard = self.heard.pairs()
        new = np.stack([*heard.pos, *heard.vel, heard.sender, g.t[row] - g.dt])
        data = np.hstack([new, self.known.data])  # of two beacons of one sender, the first is the newer one
        row = np.concatenate([row, self.known.row])
        is_fresh = g.t[row] - data[7] < np.maximum(self.memory[row], g.dt) + 0.5 * g.dt
        is_kept = is_fresh & (data[6] != g.id[row])
        data, row = data[:, is_kept], row[is_kept]
        key, order = np.unique(1e6 * row + data[6], return_index=True)
        self.known.set(np.searchsorted(key, 1e6 * np.arange(g.n + 1)), data[:, order])
        data, row = self.known.data, self.known.row
        offset = data[:3] + data[3:6] * (g.t[row] - data[7]) - g.pos[:, row]
        closing = g.vel[:, row] - data[3:6]
        time = np.clip(dot(offset, closing) / np.maximum(dot(closing, closing), 0.01), 0.0, 6.0)
        miss = offset - time * closing
        distance = np.maximum(np.sqrt(dot(miss, miss)), 0.1)
        away = -miss / distance
        limit = dot(g.vel[:, row], away) + 0.7 * (self.gap[row] - distance) / np.maximum(time, 1.0)
        self.velocity[:] = self.first
        for _ in range(6):  # the obstacle that is violated most, again and again
            lacks = limit - dot(self.velocity[:, row], away)
            most = self.known.argmin(-lacks)
            rows = np.flatnonzero(most >= 0)
            self.velocity[:, rows] += np.maximum(lacks, 0.0)[most[rows]] * away[:, most[rows]]
