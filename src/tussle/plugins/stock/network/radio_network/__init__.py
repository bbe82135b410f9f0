"""Radio with fading, bandwidth, queues and jammers."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from tussle.api import Links, Messages, Network, Param, State, WorldView
from tussle.api.links import BLOCKS
from tussle.numeric import exp, log
from tussle.plugins.stock.network.radio_network import kernels

QUEUE, PLANE, _, _, HALF_DUPLEX, CHANCE, BLOCKED = range(7)
NOBODY = -1
MIN_RECEPTION = 0.01
"""Rayleigh fading: receivers that would receive a smaller share of the messages are out of reach."""


class RadioNetwork(Network):
    """Broadcasts each message by radio to the entities around the sender; the sender itself always receives it.

    At distance d the ratio of signal to noise is (range / d)^path_loss_exponent, with 1 as the least that can be received. A jammer at
    distance d of the receiver adds (jammer_range / d)^path_loss_exponent to the noise of 1; those beyond `jammer_range`, weaker than
    the noise, are neglected. With Rayleigh fading the signal's power is exponentially distributed, independently for each message and
    receiver, so the share exp(-noise / signal) is received (Goldsmith 2005, Wireless Communications, section 6.3.1).

    A transmitter sends its messages one after another. With `half_duplex`, the messages of a step begin at a random time in the step,
    and a receiver that sends itself at some time of a message does not receive it. Whether a message is received is decided at the
    positions of the step in which it is published, even if it waits in the queue. Messages of several senders do not collide.

    With `shared_bandwidth` the senders of a world use one channel in turn, as if a perfect protocol gave it to them: each sends its
    messages of a step when those before it have sent theirs, by the order of ids, and `half_duplex` loses nothing. With
    `propagation_speed`, such as 1,500 m/s for sound in water, a message arrives later by the distance over that speed; whether the
    receiver sends then is judged by what it has to send when the message is published.
    """

    grade = "portable"
    named_teams = ("jammer_team",)
    losses = ("queue", "plane", "fading", "jammed", "half_duplex", "chance", "blocked")

    range = Param(
        100.0, unit="m", gt=0.0, doc="Distance below which messages are received; with fading, 37 % of them."
    )
    prob_transmit = Param(
        1.0, ge=0.0, le=1.0, doc="Probability that a receiver gets a message, besides all other losses."
    )
    blocked_by = Param(
        "nothing", choices=BLOCKS, doc="Obstacles between sender and receiver that block a message."
    )
    filter_comms_plane = Param(
        False, doc="Block messages across a horizontal plane, such as the water surface."
    )
    comms_boundary_altitude = Param(0.0, unit="m", doc="Altitude of the plane.")
    comms_boundary_epsilon = Param(0.0, unit="m", ge=0.0, doc="Distance by which both sides overlap.")
    path_loss_exponent = Param(2.0, ge=1.0, le=10.0, doc="Decay of power with distance; 2 in free space.")
    fading = Param("none", choices=("none", "rayleigh"), doc="Distribution of the received power.")
    jammer_team = Param(NOBODY, doc="Team whose entities jam all receivers near them; -1 is none.")
    jammer_range = Param(100.0, unit="m", ge=0.0, doc="Distance at which a jammer is as strong as the noise.")
    bandwidth = Param(math.inf, gt=0.0, doc="Bandwidth of each sender [bit/s].")
    shared_bandwidth = Param(False, doc="All senders of a world share the bandwidth, in turn.")
    propagation_speed = Param(
        math.inf,
        unit="m/s",
        gt=0.0,
        doc="Speed of the signal; 1500 m/s for sound in water, inf for no delay.",
    )
    overhead = Param(
        28.0, ge=0.0, lt=math.inf, doc="Bytes of a message beside 8 for each number; 28 are UDP over IPv4."
    )
    queue_limit = Param(
        math.inf, ge=0.0, doc="Bytes waiting at a sender above which new messages are dropped."
    )
    half_duplex = Param(False, doc="A sender does not receive while it sends.")
    is_stochastic_delay = Param(False, doc="Draw the delay of each message and receiver.")
    delay_jitter = Param(
        0.05, unit="s", ge=0.0, doc="Half width of the uniform distribution around comm_delay."
    )
    busy_until = State(
        unit="s", per="entity", default=-math.inf, doc="Time at which the transmitter is free."
    )

    def transmit(self, w: WorldView, outboxes: Sequence[Messages]) -> Links:
        """Decide which messages are received, and when."""
        factor = (
            exp(log(-math.log(MIN_RECEPTION)) / self.path_loss_exponent) if self.fading == "rayleigh" else 1.0
        )
        links = Links(w, outboxes, (factor * self.range)[w.world])
        world, message = links.world[links.message], links.message
        start, end, is_sent, on_air = self._send(w, links, outboxes)
        if not is_sent.all():
            links.lose(QUEUE, ~is_sent[message])
        plane = self.filter_comms_plane, self.comms_boundary_altitude, self.comms_boundary_epsilon
        links.lose_across(w, PLANE, *plane)
        links.lose_hidden(w, BLOCKED, self.blocked_by)
        self._fade(w, links, world)
        travel = links.distance / self.propagation_speed[world]
        if (in_turn := self.half_duplex & ~self.shared_bandwidth).any():
            first, last = on_air[0][links.receiver], on_air[1][links.receiver]
            is_busy = (first < end[message] + travel) & (start[message] + travel < last)
            links.lose(HALF_DUPLEX, in_turn[world] & is_busy)
        links.lose_by_chance(w, CHANCE, "chance", self.prob_transmit)
        delay = np.maximum(0.0, (end - w.t[links.world])[message] + travel)
        if self.is_stochastic_delay.any():
            jitter = np.where(self.is_stochastic_delay, self.delay_jitter, 0.0)[world]
            delay += jitter * (2.0 * links.uniform(w, "delay") - 1.0)
        links.delay = delay
        return links

    def _fade(self, w: WorldView, links: Links, world: np.ndarray) -> None:
        jammer_team = self.jammer_team[w.world]
        is_jammer = (w.team == jammer_team) & (jammer_team != NOBODY)
        if self.fading == "none" and not is_jammer.any():
            return
        noise = self._noise(w, is_jammer) if is_jammer.any() else np.ones(w.n)
        fades = self.fading == "rayleigh"
        draw = links.uniform(w, "fading") if fades else links.distance
        limits = self.range, self.path_loss_exponent
        kernels.fade((links.receiver, world), links.distance, draw, noise, limits, fades, links.outcome)

    def _noise(self, w: WorldView, is_jammer: np.ndarray) -> np.ndarray:
        """Return the power of noise and jammers at each row, (n,); the noise alone is 1."""
        near = w.near(np.where(is_jammer, self.jammer_range[w.world], 0.0))
        world = w.world[near.row]
        ratio = self.jammer_range[world] / np.maximum(near.distance, kernels.NEAREST)
        power = exp(self.path_loss_exponent[world] * log(ratio))
        order = np.lexsort((w.id[near.row], near.other))  # rounding must not depend on the order of the rows
        noise = np.ones(w.n)
        np.add.at(noise, near.other[order], power[order])
        return noise

    def _send(
        self, w: WorldView, links: Links, outboxes: Sequence[Messages]
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, tuple[np.ndarray, np.ndarray]]:
        """Start and end of each message on the air [s] and whether it is sent, (k,); first and last time on the air of each row, (n,)."""
        size = np.concatenate([batch.sizes() for batch in outboxes]) + self.overhead[links.world]
        begin, own = w.t - w.dt, w.world
        waits = np.maximum(0.0, self.busy_until - begin[own])
        ahead = np.where(waits > 0.0, waits * np.minimum(self.bandwidth, 1e300)[own] / 8.0, 0.0)
        on_air = (
            np.where(waits > 0.0, begin[own], np.inf),
            np.where(waits > 0.0, self.busy_until, -np.inf),
        )
        offset = np.zeros(w.n)
        if self.half_duplex.any():
            sent = np.flatnonzero(links.sender >= 0)
            air = np.bincount(links.sender[sent], 8.0 * size[sent] / self.bandwidth[links.world[sent]], w.n)
            draw = w.uniform_by("offset", own, w.id, np.zeros(w.n, np.int64))
            offset = np.where(self.half_duplex[own], draw * np.maximum(0.0, w.dt - air), 0.0)
        k = len(size)
        span = np.zeros(k), np.zeros(k), np.zeros(k, bool)
        channel = np.full(w.n_worlds, -np.inf)
        np.maximum.at(channel, own, self.busy_until)
        order = np.argsort(links.sender, kind="stable") if self.shared_bandwidth.any() else np.arange(k)
        limits = self.bandwidth, self.queue_limit, begin, self.shared_bandwidth
        queue = ahead, self.busy_until, channel
        kernels.send(order, (links.sender, links.world), size, limits, offset, queue, on_air, span)
        return *span, on_air
