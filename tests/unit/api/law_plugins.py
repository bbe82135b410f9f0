"""A plugin that holds a neighbour law with every reduction to the law's own function, pair after pair."""

import math

import numpy as np

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, Output, Param, State, neighbors
from tussle.stock import SingleIntegrator


def play(autonomy, steps=3, n=300, motion=SingleIntegrator(), spread=30.0, update="synchronous", **values):  # noqa: B008 - a value
    """A crowd of two teams under an autonomy that checks itself in every step."""
    crowd = {"count": n, "variance": (spread**2, spread**2, 100.0), "motion": motion}
    blocks = [Block(name=f"team_{team}", team=team, autonomy=autonomy, **crowd) for team in (1, 2)]
    with Simulation(
        Mission(blocks=blocks, end=100.0, update=update), on_error="raise", **{"seeds": [1, 2], **values}
    ) as sim:
        sim.step(steps)
        return [sim.state_hash(world) for world in range(sim.n_worlds)]


def added(numbers, lanes):
    """Sum of numbers in the order of the kernels: in one lane, or in eight lanes that are then added in pairs."""
    sums = [0.0] * 8
    for number, lane in zip(numbers, lanes, strict=True):
        sums[lane] += number
    a, b, c, d, e, f, g, h = sums
    return ((a + b) + (c + d)) + ((e + f) + (g + h))


class Every(Autonomy):
    """Each reduction, under an `if`, against the function itself called for pair after pair."""

    grade = "portable"
    sight = State(unit="m")
    gain = Param(0.5)
    drops = Param(True)
    seen = State("n total mean low high near_id", dtype=float)
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    @neighbors("sight", n="count", total="sum", mean="mean", low="min", high="max", near_id="nearest")
    @staticmethod
    def law(offset_x, distance, other_id, team, other_team, other_vel_y, gain, drops):
        if other_id == 13.0:
            return None
        amount = gain * offset_x
        if team != other_team and distance < 6.0:
            amount = amount * 2 + other_vel_y
        elif distance > 9.0 and drops:
            amount -= 1
        return team == other_team, amount, distance, amount, amount, other_id

    def spawn(self, g, rows):
        self.sight[rows] = (2.0 + 12.0 * g.uniform("sight"))[rows]

    def step(self, g):
        found = self.law(g)
        self.seen[:] = np.nan_to_num(found.values, posinf=9e9, neginf=-9e9)
        near, law = g.near(self.sight), type(self).law.laws[0].function
        near_id, near_team, near_vel, table = near.id, near.team, near.vel, [[] for _ in range(g.n)]
        for k, i in enumerate(near.row):
            values = law(
                near.offset[0, k], near.distance[k], near_id[k], g.team[i], near_team[k], near_vel[1, k], self.gain[i], self.drops[i],
            )  # fmt: skip
            if values is not None:
                lane = (near_id[k] - 1) % 8 if g.one_per_world else 0  # candidates are in order of id then
                table[i].append((*values, near.distance[k], lane))
        for i, rows in enumerate(table):
            own, amounts, distances, *_, ids, ranges, lanes = zip(*rows, strict=True) if rows else [()] * 8
            closest = min(zip(ranges, ids, strict=True), default=(math.inf, math.nan))
            total, mean = added(amounts, lanes), added(distances, lanes) / max(len(rows), 1)
            low, high = min(amounts, default=math.inf), max(amounts, default=-math.inf)
            expected = sum(own), total, mean, low, high, closest[1]
            np.testing.assert_array_equal([found.values[k, i] for k in range(6)], expected)
        self.velocity[0], self.velocity[1] = found.mean, np.where(found.n > 0, found.total, -1.0)
