"""Tasks that come with tussle."""

from __future__ import annotations

from tussle.rl.action import Act
from tussle.rl.observation import NearestOthers, Own
from tussle.rl.reward import Term, alive, captured
from tussle.rl.task import Task


class PredatorPrey(Task):
    """The paper's game for the prey: 100 learners flee from ten predators (DeMarco, Squires, Day and Pippin 2018)."""

    mission = "predator_prey"
    learners = "prey"
    observation = (
        Own("pos", scale=1000.0, origin=(0.0, 0.0, 200.0), frame="heading"),
        Own("vel forward", scale={"vel": 30.0}, frame="heading"),
        NearestOthers(8, scale={"offset": 200.0, "relative_vel": 30.0}),
    )
    action = (
        Act("speed", 0.0, 30.0),
        Act("turn_rate", -1.0, 1.0),
        Act("pitch_rate", -1.0, 1.0),
    )
    reward = {"alive": Term(alive, 0.01), "captured": Term(captured, -1.0)}  # noqa: RUF012 - declared as ClassVar in Task


__all__ = ["PredatorPrey"]
