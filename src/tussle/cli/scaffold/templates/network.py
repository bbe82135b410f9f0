"""A network: decides which messages reach which entities."""

import numpy as np

from tussle.api import Messages, Network, Param, WorldView


class New(Network):
    """Radio with a limited range: a message reaches the sender and all entities nearer than `radius`."""

    grade = "portable"

    radius = Param(400.0, unit="m", ge=0.0, doc="Range of the radio.")

    def route(self, w: WorldView, messages: Messages) -> tuple[np.ndarray, np.ndarray]:
        """Return, for each delivery, the index of the message and the row of the receiver."""
        sender = w.rows_at(messages.world, messages.sender)
        near = w.near(self.radius[w.world])  # pairs (row, other), ordered by row
        first = np.searchsorted(near.row, sender, side="left")
        count = np.where(sender >= 0, np.searchsorted(near.row, sender, side="right") - first, 0)
        number = np.repeat(np.arange(messages.n), count)
        place = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
        own = np.flatnonzero(sender >= 0)
        receiver = near.other[np.repeat(first, count) + place]
        return np.concatenate([own, number]), np.concatenate([sender[own], receiver])
