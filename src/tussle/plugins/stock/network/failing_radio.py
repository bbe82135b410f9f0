"""Radios that are out for a while, and jamming."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from tussle.api import Links, Messages, Network, Param, State, WorldView
from tussle.numeric import exp

OUTAGE, JAMMED = range(2)


class FailingRadio(Network):
    """Delivers messages to all within range, but loses them in bursts: a radio that is out neither sends nor receives.

    A radio that works goes out with `failure_rate`, and is out for a time that is exponentially distributed with the mean `outage`: the
    model of Gilbert (1960, Capacity of a burst-noise channel, section 2), in continuous time; at first in its steady state. All radios
    of a world are jammed from `jam_start` on for `jam_duration`. An entity always receives its own messages.
    """

    grade = "portable"
    losses = ("outage", "jammed")

    range = Param(math.inf, unit="m", ge=0.0, doc="Distance below which messages are received.")
    failure_rate = Param(
        0.1, unit="1/s", ge=0.0, lt=math.inf, doc="Outages of a radio that begin at random, per time."
    )
    outage = Param(1.0, unit="s", gt=0.0, doc="Mean time that a radio is out.")
    jam_start = Param(math.inf, unit="s", gt=-math.inf, doc="Time at which jamming begins; inf for never.")
    jam_duration = Param(math.inf, unit="s", gt=0.0, doc="Time that it lasts.")
    is_out = State(dtype=bool, per="entity", doc="Whether the radio was out at known_at.")
    known_at = State(unit="s", default=-math.inf, per="entity", doc="Time of the last message of the world.")

    def transmit(self, w: WorldView, outboxes: Sequence[Messages]) -> Links:
        """Lose the messages from and to radios that are out."""
        has_messages = np.zeros(w.n_worlds, bool)
        for batch in outboxes:
            has_messages[batch.world] = True
        # Only there: whether other worlds of the stack have messages changes nothing.
        self._advance(w, np.flatnonzero(has_messages[w.world]))
        links = Links(w, outboxes, self.range[w.world])
        links.lose(OUTAGE, self.is_out[links.sender[links.message]] | self.is_out[links.receiver])
        since = w.t - self.jam_start + 1e-6 * w.dt
        is_jammed = (since >= 0.0) & (since < self.jam_duration)
        links.lose(JAMMED, is_jammed[links.world[links.message]])
        return links

    def _advance(self, w: WorldView, rows: np.ndarray) -> None:
        """Draw which radios of some rows, (m,), are out now, given which were when they were last drawn."""
        world, known_at = w.world[rows], self.known_at[rows]
        now, rate, back = w.t[world], self.failure_rate[world], 1.0 / self.outage[world]
        share, is_known = rate / np.maximum(rate + back, 1e-300), np.isfinite(known_at)
        left = exp(-(rate + back) * (now - np.where(is_known, known_at, now)))
        probability = np.where(is_known, share + (self.is_out[rows] - share) * left, share)
        draw = w.uniform_by("outage", world, w.id[rows], np.zeros(len(rows), np.int64))
        self.is_out[rows] = draw < probability
        self.known_at[rows] = now
