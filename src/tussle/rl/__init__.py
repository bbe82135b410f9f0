"""Learners' interfaces to missions: arrays, Gymnasium and PettingZoo over one stack of worlds."""

from tussle.errors import MissingExtraError

try:
    import gymnasium
except ImportError:
    raise MissingExtraError("tussle.rl needs Gymnasium and PettingZoo: pip install 'tussle[rl]'") from None

from tussle.rl.action import Act
from tussle.rl.games import PredatorPrey
from tussle.rl.observation import Component, Computed, Each, Means, Nearest, Own, Sectors
from tussle.rl.reward import Situation, Term, alive, captured, captures, collisions, died
from tussle.rl.swarm import Swarm, make_swarm
from tussle.rl.task import Task

__all__ = [
    "Act",
    "Component",
    "Computed",
    "Each",
    "Means",
    "Nearest",
    "Own",
    "PredatorPrey",
    "Sectors",
    "Situation",
    "Swarm",
    "Task",
    "Term",
    "alive",
    "captured",
    "captures",
    "collisions",
    "died",
    "make_swarm",
]
