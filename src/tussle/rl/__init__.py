"""Learners' interfaces to missions: arrays, Gymnasium and PettingZoo over one stack of worlds."""

from tussle.errors import MissingExtraError

try:
    import gymnasium  # noqa: F401
    import pettingzoo  # noqa: F401
except ImportError:
    raise MissingExtraError("tussle.rl needs Gymnasium and PettingZoo: pip install 'tussle[rl]'") from None

from tussle.rl.action import Act
from tussle.rl.computed import Computed
from tussle.rl.dispersal import Dispersal
from tussle.rl.draws import choice, uniform
from tussle.rl.environments import TaskEnv, TaskVectorEnv, make, make_vec, register
from tussle.rl.games import Consensus, NearOrigin, PredatorPrey, PredatorsAndPrey, PredatorTeam, PreyEscape
from tussle.rl.observation import Component, Each, Means, NearestOthers, Own, Sectors
from tussle.rl.parallel import TaskParallelEnv, parallel_env
from tussle.rl.particles import Dispersion, SimpleAdversary, SimpleSpread, SimpleTag
from tussle.rl.policy_file import write_policy
from tussle.rl.reward import FoundOthers, Situation, Term, alive, captured, captures, collisions, died
from tussle.rl.robots import Coverage, FindWay, Formation, Hover, ReachPoint
from tussle.rl.swarm import Swarm, evaluate, make_swarm, record_episode
from tussle.rl.task import Task
from tussle.rl.teams import Battle, BattleBlue, CaptureTheFlag, CaptureTheFlagRed, Intercept

__all__ = [
    "Act",
    "Battle",
    "BattleBlue",
    "CaptureTheFlag",
    "CaptureTheFlagRed",
    "Component",
    "Computed",
    "Consensus",
    "Coverage",
    "Dispersal",
    "Dispersion",
    "Each",
    "FindWay",
    "Formation",
    "FoundOthers",
    "Hover",
    "Intercept",
    "Means",
    "NearOrigin",
    "NearestOthers",
    "Own",
    "PredatorPrey",
    "PredatorTeam",
    "PredatorsAndPrey",
    "PreyEscape",
    "ReachPoint",
    "Sectors",
    "SimpleAdversary",
    "SimpleSpread",
    "SimpleTag",
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
    "choice",
    "collisions",
    "died",
    "evaluate",
    "make",
    "make_swarm",
    "make_vec",
    "parallel_env",
    "record_episode",
    "register",
    "uniform",
    "write_policy",
]


def __dir__() -> list[str]:
    return sorted(__all__)


for _task in (
    Battle,
    BattleBlue,
    CaptureTheFlag,
    CaptureTheFlagRed,
    Coverage,
    Dispersal,
    Dispersion,
    FindWay,
    Formation,
    Hover,
    Intercept,
    PredatorPrey,
    PredatorTeam,
    PredatorsAndPrey,
    PreyEscape,
    ReachPoint,
    SimpleAdversary,
    SimpleSpread,
    SimpleTag,
):
    register(f"tussle/{_task.__name__}-v0", _task)
register("tussle/RLSimple-v0", NearOrigin)
register("tussle/RLConsensus-v0", Consensus)
