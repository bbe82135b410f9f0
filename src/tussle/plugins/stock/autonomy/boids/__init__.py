"""Flocking."""

from tussle.plugins.stock.autonomy.boids.plugin import Boids

__all__ = ["Boids"]
