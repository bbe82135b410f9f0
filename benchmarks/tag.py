"""The game of tag from the multi-agent particle environments (Lowe et al. 2017) as a task: its law of motion, observations and rewards.

Three adversaries chase a faster agent between two round landmarks. With the same positions and actions, `mpe2.simple_tag_v3` gives the
same trajectories, observations and rewards.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from tussle import Block, Mission
from tussle.api import Controller, Input, MotionModel, Output, Param, State
from tussle.numeric import exp, log
from tussle.numeric.kernel import kernel
from tussle.rl import Act, Each, Own, Situation, Task, Term
from tussle.stock import Still

CONTACT_FORCE, MARGIN, DAMPING = 100.0, 1e-3, 0.25


@kernel("(F F) (F F F) (I I I) (F2 F) (Fw Fw)")
def total_force(push, own, places, others, total):
    """Push [N] times strength, and the contact forces of all others, in order of id: a soft maximum of the penetration."""
    x, y, strength = own
    row_world, place, world_start = places
    points, radius = others
    for i in range(x.shape[0]):
        fx, fy = push[0][i] * strength[i], push[1][i] * strength[i]
        w, me = row_world[i], place[i]
        for p in range(world_start[w], world_start[w + 1]):
            dx, dy = x[i] - points[0, p], y[i] - points[1, p]
            reach = radius[me] + radius[p] + 50.0 * MARGIN  # beyond, the force is below 1e-20 N
            square = dx * dx + dy * dy
            if p != me and square < reach * reach:
                distance = math.sqrt(square)
                depth = -(distance - (radius[me] + radius[p])) / MARGIN
                soft = (max(depth, 0.0) + log(1.0 + exp(-abs(depth)))) * MARGIN
                fx += CONTACT_FORCE * dx / distance * soft
                fy += CONTACT_FORCE * dy / distance * soft
        total[0][i], total[1][i] = fx, fy


class Contact(Controller):
    """Adds contact forces to the push of an agent."""

    strength = Param(3.0, unit="N", gt=0.0)
    push_x = Input()
    push_y = Input()
    total_x = Output(unit="N")
    total_y = Output(unit="N")

    def step(self, g: Any) -> None:
        index = g.index(np.inf)
        rows = slice(g.first, g.last)
        places = index.row_world[rows], index.place[rows], index.world_start
        own = *g.components("pos")[:2], self.strength
        others = index.points, g.by_place(index, "radius")[0]
        total_force((self.push_x, self.push_y), own, places, others, (self.total_x, self.total_y))


@kernel("F2w F2 F2 f8 i8")
def slide(x, u, p, dt, substeps):
    """Positions advance by the old velocities, which are then damped, pushed [N] at mass 1, and limited to p [m/s]."""
    for _ in range(substeps):
        for i in range(x.shape[1]):
            x[0, i] += x[2, i] * dt
            x[1, i] += x[3, i] * dt
            vx, vy = x[2, i] * (1.0 - DAMPING) + u[0, i] * dt, x[3, i] * (1.0 - DAMPING) + u[1, i] * dt
            speed = math.sqrt(vx * vx + vy * vy)
            if speed > p[0, i]:
                vx, vy = vx / speed * p[0, i], vy / speed * p[0, i]
            x[2, i], x[3, i] = vx, vy


class Particle(MotionModel):
    """A particle in the plane."""

    max_speed = Param(1.0, unit="m/s", gt=0.0)
    x = State("x y vx vy", unit="m m m/s m/s")
    total_x = Input(unit="N")
    total_y = Input(unit="N")
    advance = slide

    def from_body(self, body: Any, rows: np.ndarray) -> None:
        self.x[:2, rows], self.x[2:, rows] = body.pos[:2, rows], body.vel[:2, rows]

    def to_body(self, body: Any) -> None:
        body.pos[:2], body.vel[:2] = self.x[:2], self.x[2:]


def block(name: str, count: int, radius: float, half_width: float, **plugins: Any) -> Block:
    width = (half_width, half_width, 0)
    team = int(name == "agent")
    return Block(
        name=name,
        team=team,
        count=count,
        radius=radius,
        placement="uniform",
        half_width=width,
        scatter_first=True,
        **plugins,
    )


def rewards(now: Situation) -> np.ndarray:
    """10 per contact for all adversaries, minus 10 for the agent, which must also stay in the field; agents are the last in a world."""
    pos = now.pos[..., :2]
    offset = pos[:, :3] - pos[:, 3:]
    n_contacts = (np.sqrt((offset * offset).sum(axis=-1)) < 0.075 + 0.05).sum(axis=1)
    side = np.abs(pos[:, 3])
    outside = np.where(
        side < 0.9, 0.0, np.where(side < 1.0, (side - 0.9) * 10.0, np.minimum(np.exp(2.0 * side - 2.0), 10.0))
    )
    agent = -10.0 * n_contacts - outside[:, 0] - outside[:, 1]
    return np.stack([10.0 * n_contacts] * 3 + [agent], axis=1)


OWN = Own("vel pos", planar=True)
LANDMARKS = Each("landmark", planar=True)
MOVES = Act("push_x push_y", levels=[(0, 0), (-1, 0), (1, 0), (0, -1), (0, 1)])


class Tag(Task):
    mission = Mission(
        name="tag",
        dt=0.1,
        end=2.5,
        blocks=[
            block("adversary", 3, 0.075, 1.0, controller=Contact(), motion=Particle()),
            block("agent", 1, 0.05, 1.0, controller=Contact(strength=4), motion=Particle(max_speed=1.3)),
            block("landmark", 2, 0.2, 0.9, motion=Still()),
        ],
    )
    learners = "adversary agent"
    observation = {  # noqa: RUF012
        "adversary": [
            OWN,
            LANDMARKS,
            Each("adversary agent", planar=True),
            Each("agent", "vel", planar=True),
        ],
        "agent": [OWN, LANDMARKS, Each("adversary", planar=True)],
    }
    action = MOVES
    reward = {"tag": Term(rewards)}  # noqa: RUF012
