"""Learners' interfaces to missions: arrays, Gymnasium and PettingZoo over one stack of worlds."""

from tussle.errors import MissingExtraError

try:
    import gymnasium  # noqa: F401
    import pettingzoo  # noqa: F401
except ImportError:
    raise MissingExtraError("tussle.rl needs Gymnasium and PettingZoo: pip install 'tussle[rl]'") from None

from tussle.rl.action import Act
from tussle.rl.environments import TaskEnv, TaskVectorEnv, make, make_vec, register
from tussle.rl.games import Consensus, NearOrigin, PredatorPrey, PredatorTeam
from tussle.rl.observation import Component, Computed, Each, Means, NearestOthers, Own, Sectors
from tussle.rl.parallel import TaskParallelEnv, parallel_env
from tussle.rl.policy_file import write_policy
from tussle.rl.reward import Situation, Term, alive, captured, captures, collisions, died
from tussle.rl.swarm import Swarm, make_swarm, record_episode
from tussle.rl.task import Task

__all__ = [
    "Act",
    "Component",
    "Computed",
    "Consensus",
    "Each",
    "Means",
    "NearOrigin",
    "NearestOthers",
    "Own",
    "PredatorPrey",
    "PredatorTeam",
    "Sectors",
    "Situation",
    "Swarm",
    "Task",
    "TaskEnv",
    "TaskParallelEnv",
    "TaskVectorEnv",
    "Term",
    "alive",
    "captured",
    "captures",
    "collisions",
    "died",
    "make",
    "make_swarm",
    "make_vec",
    "parallel_env",
    "record_episode",
    "register",
    "write_policy",
]

register("tussle/PredatorPrey-v0", PredatorPrey)
register("tussle/PredatorTeam-v0", PredatorTeam)
register("tussle/RLSimple-v0", NearOrigin)
register("tussle/RLConsensus-v0", Consensus)
