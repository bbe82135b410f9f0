"""HarmonicOscillatorConstController: a constant acceleration command."""

from tussle.plugins.stock.controller.harmonic_oscillator_const_controller.plugin import (
    HarmonicOscillatorConstController,
)

__all__ = ["HarmonicOscillatorConstController"]
