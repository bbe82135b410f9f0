"""NoisyState: noisy measurements of an entity's own state."""

from tussle.plugins.stock.sensor.noisy_state.plugin import NoisyState

__all__ = ["NoisyState"]
