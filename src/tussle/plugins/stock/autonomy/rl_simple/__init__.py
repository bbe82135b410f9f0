"""RLSimple and RLConsensus: robots earn rewards near the origin or near each other, with actions of an actor."""

from tussle.plugins.stock.autonomy.rl_simple.plugin import RLConsensus, RLSimple, adapted

__all__ = ["RLConsensus", "RLSimple", "adapted"]
