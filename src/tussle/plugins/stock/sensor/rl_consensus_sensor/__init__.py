"""RLConsensusSensor: observations for RLConsensus."""

from tussle.plugins.stock.sensor.rl_consensus_sensor.plugin import RLConsensusSensor

__all__ = ["RLConsensusSensor"]
