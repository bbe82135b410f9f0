"""HarmonicOscillator: a mass on a damped vertical spring."""

from tussle.stock.motion.harmonic_oscillator.plugin import HarmonicOscillator

__all__ = ["HarmonicOscillator"]
