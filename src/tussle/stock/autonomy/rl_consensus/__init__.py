"""RLConsensus: earns rewards near others, with actions of an actor."""

from tussle.stock.autonomy.rl_consensus.plugin import RLConsensus

__all__ = ["RLConsensus"]
