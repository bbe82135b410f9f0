"""Radio with a limited range."""

from __future__ import annotations

import numpy as np

from tussle.api import Messages, Network, Param, WorldView


class SphereNetwork(Network):
    """Delivers a message to each entity nearer than `range` with probability `prob_transmit`, and always to the sender.

    Distances are measured at the end of the step in which the message is sent. The existing system measured from the sender's new
    position to the old positions of the others, and could lose messages of an entity to itself.
    """

    grade = "portable"

    range = Param(100.0, unit="m", ge=0.0, doc="Distance below which messages are received.")
    prob_transmit = Param(1.0, ge=0.0, le=1.0, doc="Probability that a receiver gets a message.")
    filter_comms_plane = Param(
        False, doc="Block messages across a horizontal plane, such as the water surface."
    )
    comms_boundary_altitude = Param(0.0, unit="m", doc="Altitude of the plane.")
    comms_boundary_epsilon = Param(0.0, unit="m", ge=0.0, doc="Distance by which both sides overlap.")

    def route(self, w: WorldView, messages: Messages) -> tuple[np.ndarray, np.ndarray]:
        sender = w.rows_at(messages.world, messages.sender)
        pairs = w.near(self.range[w.world])
        first, last = np.searchsorted(pairs.row, sender), np.searchsorted(pairs.row, sender, side="right")
        count = np.where(sender >= 0, last - first, 0)
        number = np.repeat(np.arange(messages.n), count)
        place = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
        receiver = pairs.other[np.repeat(first, count) + place]
        heard = self._passes_plane(w, sender[number], receiver)
        heard &= self._is_transmitted(w, messages, number, receiver)
        own = np.flatnonzero(sender >= 0)
        return np.concatenate([own, number[heard]]), np.concatenate([sender[own], receiver[heard]])

    def _passes_plane(self, w: WorldView, sender: np.ndarray, receiver: np.ndarray) -> np.ndarray:
        world = w.world[receiver]
        height, slack = self.comms_boundary_altitude[world], self.comms_boundary_epsilon[world]
        a, b = w.pos[2][sender], w.pos[2][receiver]
        same_side = ((a > height - slack) & (b > height - slack)) | (
            (a < height + slack) & (b < height + slack)
        )
        return np.asarray(same_side | ~self.filter_comms_plane[world])

    def _is_transmitted(
        self, w: WorldView, messages: Messages, number: np.ndarray, receiver: np.ndarray
    ) -> np.ndarray:
        # Draws are keyed by sender, index of the message among the sender's in this step, and receiver, so other senders and
        # receivers do not affect them.
        is_first = np.ones(messages.n, bool)
        is_first[1:] = (messages.world[1:] != messages.world[:-1]) | (
            messages.sender[1:] != messages.sender[:-1]
        )
        ordinal = np.arange(messages.n) - np.maximum.accumulate(np.where(is_first, np.arange(messages.n), 0))
        key = messages.sender[number] + (ordinal[number] << 32)
        world = messages.world[number]
        return np.asarray(w.uniform_by("loss", world, key, w.id[receiver]) < self.prob_transmit[world])
