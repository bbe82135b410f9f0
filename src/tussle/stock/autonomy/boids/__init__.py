"""Flocking."""

from tussle.stock.autonomy.boids.plugin import Boids

__all__ = ["Boids"]
