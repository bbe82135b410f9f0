"""A constant push on an oscillator."""

from tussle.stock.controller.harmonic_oscillator_const_controller.plugin import (
    HarmonicOscillatorConstController,
)

__all__ = ["HarmonicOscillatorConstController"]
