"""CaptureInBoundaryInteraction: defenders capture intruders in a region."""

from tussle.plugins.stock.interaction.capture_in_boundary_interaction.plugin import (
    CaptureInBoundaryInteraction,
)

__all__ = ["CaptureInBoundaryInteraction"]
