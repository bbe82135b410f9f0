"""A network that reaches all entities."""

from __future__ import annotations

from tussle.api import EVERYONE, Messages, Network, WorldView


class GlobalNetwork(Network):
    """Delivers each message to every subscriber in its world, including the sender's own plugins, without loss."""

    grade = "portable"

    def route(self, w: WorldView, messages: Messages) -> str:
        return EVERYONE
