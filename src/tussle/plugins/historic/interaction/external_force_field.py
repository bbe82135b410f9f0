"""ExternalForceField as in SCRIMMAGE."""

from __future__ import annotations

from tussle.api import WorldView
from tussle.plugins.stock.interaction import external_force_field


class ExternalForceField(external_force_field.ExternalForceField):
    """ExternalForceField that acts from the first step on; in tussle the forces of a step act in the next one, so not in the first."""

    def start(self, w: WorldView) -> None:
        self.step(w)
