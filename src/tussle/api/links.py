"""Links of a radio: each message with each entity within reach of its sender."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from tussle.api.world import WorldView
from tussle.arguments import explained
from tussle.declare.messages import Messages
from tussle.errors import ParameterError
from tussle.numeric.arrays import order_by_row

BLOCKS = ("nothing", "scene", "scene and entities")
"""Kinds of obstacles between a sender and a receiver."""


@explained
class Links:
    """Each message of a step with each other entity within reach of its sender, as `Network.transmit` returns them.

    Messages of the world and of removed entities have no links. The sender itself receives its messages, unless the network says otherwise.

    Args:
        w: The view of the network.
        outboxes: Messages of each topic.
        reach: Distance below which others are candidates [m], (n,), one per row of the view.

    Attributes:
        world: World of each message, (k,); the messages of all topics, one after another.
        sender: Row of the sender of each message, (k,); -1 for the world and for removed entities.
        key: Id of the sender and index of the message among the sender's in this step, for draws, (k,).
        message: Number of the message of each link, (m,), ascending.
        receiver: Row of the candidate, (m,).
        distance: Distance of sender and candidate [m], (m,).
        outcome: 0 if the message is received, 1 + i if it is lost for reason number i of the network's `losses`, (m,).
        delay: Delay beyond `comm_delay` [s], (m,); None for none.
        reaches_sender: Whether the sender itself receives each message, (k,).
    """

    def __init__(self, w: WorldView, outboxes: Sequence[Messages], reach: np.ndarray) -> None:
        self.world = np.concatenate([batch.world for batch in outboxes])
        ids = np.concatenate([batch.sender for batch in outboxes])
        self.starts = np.cumsum([0, *(batch.n for batch in outboxes)])
        self.sender = w.rows_at(self.world, ids)
        self.key = ids + (_places_among_equal(self.sender, w.n) << 32)
        sends = np.bincount(self.sender[self.sender >= 0], minlength=w.n) > 0
        pairs = w.near(np.where(sends, reach, 0.0))
        self.message, pair = _expanded(self.sender, pairs.start)
        self.receiver, self.distance = pairs.other[pair], pairs.distance[pair]
        self.outcome = np.zeros(len(self.message), np.int64)
        self.delay: np.ndarray | None = None
        self.reaches_sender = np.ones(len(self.world), bool)

    def keep(self, where: np.ndarray) -> None:
        """Keep the links where `where`, (m,), is true; the others are not within reach."""
        self._check_marks("keep", where)
        self.message, self.receiver = self.message[where], self.receiver[where]
        self.distance, self.outcome = self.distance[where], self.outcome[where]

    def lose(self, reason: int, where: np.ndarray) -> None:
        """Mark the links where `where`, (m,), is true as lost for a reason, unless they are lost already."""
        self._check_marks("lose", where)
        self.outcome[where & (self.outcome == 0)] = 1 + reason

    def _check_marks(self, what: str, where: np.ndarray) -> None:
        if np.shape(where) != self.outcome.shape or np.asarray(where).dtype != bool:
            raise ParameterError(
                f"{what}: where is {np.asarray(where).dtype} of shape {np.shape(where)}; it takes truth values, "
                f"{self.outcome.shape}, one per link"
            )

    def uniform(self, w: WorldView, label: str) -> np.ndarray:
        """Uniform draws in [0, 1), (m,), keyed by sender, message and receiver; other entities do not affect them."""
        return w.uniform_by(label, self.world[self.message], self.key[self.message], w.id[self.receiver])

    def lose_across(
        self, w: WorldView, reason: int, is_on: np.ndarray, height: np.ndarray, slack: np.ndarray
    ) -> None:
        """Mark the links whose ends are on different sides of a horizontal plane as lost for a reason.

        Args:
            w: The view of the network.
            reason: Number of the reason.
            is_on: Whether there is a plane in each world, (n_worlds,).
            height: Altitude of the plane [m], (n_worlds,).
            slack: Distance by which both sides overlap [m], (n_worlds,).
        """
        if is_on.any():
            world = self.world[self.message]
            level, slack = height[world], slack[world]
            a, b = w.pos[2][self.sender[self.message]], w.pos[2][self.receiver]
            above = (a > level - slack) & (b > level - slack)
            self.lose(reason, is_on[world] & ~(above | ((a < level + slack) & (b < level + slack))))

    def lose_hidden(self, w: WorldView, reason: int, blocked_by: str) -> None:
        """Mark the links without a line of sight as lost for a reason.

        Args:
            w: The view of the network.
            reason: Number of the reason.
            blocked_by: One of BLOCKS.
        """
        if blocked_by != BLOCKS[0]:
            left = np.flatnonzero(self.outcome == 0)
            sender, receiver = self.sender[self.message[left]], self.receiver[left]
            is_seen = w.line_of_sight(sender, receiver, entities=blocked_by == BLOCKS[2])
            self.outcome[left[~is_seen]] = 1 + reason

    def lose_by_chance(self, w: WorldView, reason: int, label: str, share: np.ndarray) -> None:
        """Mark links as lost for a reason, so that only a share of the messages in each world, (n_worlds,), is not."""
        share = np.broadcast_to(share, w.n_worlds)
        if (share < 1.0).any():
            self.lose(reason, self.uniform(w, label) >= share[self.world[self.message]])


def _places_among_equal(row: np.ndarray, n: int) -> np.ndarray:
    """Number of earlier items with the same row, (k,); rows are -1 ... n - 1."""
    order = order_by_row(row + 1, n + 1)
    count = np.bincount(row + 1, minlength=n + 1)
    place = np.empty(len(row), np.int64)
    place[order] = np.arange(len(row)) - (np.cumsum(count) - count)[row[order] + 1]
    return place


def _expanded(row: np.ndarray, start: np.ndarray) -> tuple[np.ndarray, Any]:
    """(item, pair): each of the items, whose rows are `row`, with each pair of its row; row i has pairs start[i] ... start[i + 1] - 1."""
    if len(row) == len(start) - 1 and (row == np.arange(len(row))).all():
        return np.repeat(np.arange(len(row)), np.diff(start)), slice(None)
    first = np.where(row >= 0, start[row], 0)
    count = np.where(row >= 0, start[row + 1] - first, 0)
    item = np.repeat(np.arange(len(row)), count)
    return item, np.arange(len(item)) + np.repeat(first - (np.cumsum(count) - count), count)
