"""HarmonicOscillatorConstController: a constant acceleration command."""

from tussle.stock.controller.harmonic_oscillator_const_controller.plugin import (
    HarmonicOscillatorConstController,
)

__all__ = ["HarmonicOscillatorConstController"]
