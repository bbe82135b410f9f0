"""A network between the plugins of one entity."""

from __future__ import annotations

from tussle.api import SAME_ENTITY, Messages, Network, WorldView


class LocalNetwork(Network):
    """Delivers each message to the subscribers of the sending entity only."""

    grade = "portable"

    def route(self, w: WorldView, messages: Messages) -> str:
        return SAME_ENTITY
