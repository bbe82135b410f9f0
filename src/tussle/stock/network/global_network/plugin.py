"""Everybody hears everything."""

from __future__ import annotations

from tussle.api import EVERYONE, Batch, Network, WorldView


class GlobalNetwork(Network):
    """Each message reaches every subscriber of its world, the sender's own plugins among them; nothing is lost."""

    grade = "portable"

    def route(self, w: WorldView, messages: Batch) -> str:
        return EVERYONE
