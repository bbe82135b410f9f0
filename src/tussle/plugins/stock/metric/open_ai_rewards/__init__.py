"""OpenAIRewards: sums of rewards."""

from tussle.plugins.stock.metric.open_ai_rewards.plugin import OpenAIRewards

__all__ = ["OpenAIRewards"]
