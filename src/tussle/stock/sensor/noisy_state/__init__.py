"""NoisyState: an entity that knows its own state with noise."""

from tussle.stock.sensor.noisy_state.plugin import NoisyState

__all__ = ["NoisyState"]
