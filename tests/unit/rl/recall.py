"""A game that needs memory, as a file of plugins: the side on which a robot stands is seen at the start only, and asked for at the end."""

import numpy as np

from tussle.mission import Block, Mission
from tussle.rl import Act, Computed, Task, Term, register
from tussle.stock import SingleIntegrator

DECISIONS = 6


def side(simulation):
    """-1 or 1, (W, A)."""
    return np.sign(simulation.read("robot.pos")[0][..., 1])


def cue_and_time(simulation):
    """The side, 0 after the first decision, and the share of the game that is over, (W, A, 2)."""
    where, share = side(simulation), simulation.t[:, None] / DECISIONS
    return np.stack([np.where(share == 0.0, where, 0.0), np.broadcast_to(share, where.shape)], axis=-1)


def answered(now):
    """At the end, 1 for who drives to its side along x, else -1; before, 0."""
    is_over = now.t[:, None] > DECISIONS - 0.5
    return np.where(is_over, np.sign(now.vel[..., 0]) * side(now.simulation), 0.0)


class Recall(Task):
    mission = Mission(
        blocks=[
            Block(
                name="robot",
                count=2,
                placement="uniform",
                half_width=(0.0, 10.0, 0.0),
                scatter_first=True,
                motion=SingleIntegrator(),
            )
        ],
        dt=1.0,
        end=float(DECISIONS),
    )
    learners = "robot"
    observation = Computed(2, cue_and_time)
    action = (Act("velocity_x", levels=[-1.0, 1.0]),)
    reward = {"answered": Term(answered)}  # noqa: RUF012


register("test/Recall-v0", Recall)
