"""The plugins of one entity among themselves."""

from __future__ import annotations

from tussle.api import SAME_ENTITY, Batch, Network, WorldView


class LocalNetwork(Network):
    """Each message reaches the subscribers of the entity that sent it, and nobody else."""

    grade = "portable"

    def route(self, w: WorldView, messages: Batch) -> str:
        return SAME_ENTITY
