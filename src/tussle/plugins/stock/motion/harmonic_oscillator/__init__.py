"""HarmonicOscillator: a mass on a damped vertical spring."""

from tussle.plugins.stock.motion.harmonic_oscillator.plugin import HarmonicOscillator

__all__ = ["HarmonicOscillator"]
