"""A damped spring along the vertical."""

from tussle.stock.motion.harmonic_oscillator.plugin import HarmonicOscillator

__all__ = ["HarmonicOscillator"]
