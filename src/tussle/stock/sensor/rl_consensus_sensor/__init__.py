"""RLConsensusSensor: observations for RLConsensus."""

from tussle.stock.sensor.rl_consensus_sensor.plugin import RLConsensusSensor

__all__ = ["RLConsensusSensor"]
