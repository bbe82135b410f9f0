"""What must hold in a game, how near games come to breaking it, and how likely that is: specifications, rare events, worst games."""

from tussle.stress.chances import Chance
from tussle.stress.confidence import Assurance
from tussle.stress.distributions import Distribution
from tussle.stress.estimates import Probability, Sample
from tussle.stress.games import Played, StressGame
from tussle.stress.given import GivenGame, given_games
from tussle.stress.importance import ImportanceEstimate
from tussle.stress.monitor import Monitor, Verdict
from tussle.stress.recorded import RecordedMonitor
from tussle.stress.search import FailureSearch, Tried
from tussle.stress.shrink import SmallestGame
from tussle.stress.specification import Specification
from tussle.stress.splitting import Repetition
from tussle.stress.study import Stress
from tussle.stress.why import Counterfactual, Why

__all__ = [
    "Assurance",
    "Chance",
    "Counterfactual",
    "Distribution",
    "FailureSearch",
    "GivenGame",
    "ImportanceEstimate",
    "Monitor",
    "Played",
    "Probability",
    "RecordedMonitor",
    "Repetition",
    "Sample",
    "SmallestGame",
    "Specification",
    "Stress",
    "StressGame",
    "Tried",
    "Verdict",
    "Why",
    "given_games",
]
