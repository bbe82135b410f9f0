"""Transmission times of messages, and fading of their signals."""

from tussle.numeric import exp, log
from tussle.numeric.kernel import kernel

FADING, JAMMED = 3, 4
"""Outcomes of links, one more than the places of the reasons in `RadioNetwork.losses`."""
NEAREST = 1e-3
"""Distance below which the received power is constant [m]."""


@kernel("I (I I) F (F F F B) F (Fw Fw Fw) (Fw Fw) (Fw Fw Bw)")
def send(order, place, size, limits, offset, queue, on_air, span):
    """Send the messages of each transmitter one after another; drop those that find a full queue.

    Args:
        order: Numbers of the messages in the order in which they are sent, (k,).
        place: Row of the sender of each message, -1 for none, and its world, (k,) each.
        size: Size of each message [byte], (k,).
        limits: Bandwidth [bit/s], queue limit [byte], beginning of the step [s], and whether all senders share a channel, (n_worlds,) each.
        offset: Time after the beginning of the step at which an idle transmitter starts [s], (n,).
        queue: Data that waits at each row [byte] and time at which its transmitter is free [s], (n,) each, and time at which the shared
            channel is free [s], (n_worlds,), updated.
        on_air: First and last time at which a row sends in this step [s], (n,) each, updated.
        span: Start and end of each message on the air [s], and whether it was sent, (k,) each, written.
    """
    row, world = place
    bandwidth, limit, begin, shares = limits
    ahead, busy_until, channel = queue
    first, last = on_air
    start, end, is_sent = span
    for k in order:
        own, of = row[k], world[k]
        is_sent[k] = own >= 0 and ahead[own] <= limit[of]
        if is_sent[k]:
            ahead[own] += size[k]
            start[k] = max(busy_until[own], begin[of] + offset[own])
            if shares[of]:
                start[k] = max(start[k], channel[of])
            end[k] = start[k] + 8.0 * size[k] / bandwidth[of]
            busy_until[own] = end[k]
            channel[of] = max(channel[of], end[k])
            first[own] = min(first[own], start[k])
            last[own] = end[k]


@kernel("(I I) F F F (F F) b1 Iw")
def fade(place, distance, draw, noise, limits, fades, outcome):
    """Set the outcome of links whose signal is too weak.

    Args:
        place: Row of each receiver, and world of each link, (m,) each.
        distance: Distance of sender and receiver [m], (m,).
        draw: Uniform draws, (m,).
        noise: Power of noise and jammers at each row; the noise alone is 1, (n,).
        limits: Range [m] and path loss exponent, (n_worlds,) each.
        fades: Whether the signal's power is exponentially distributed; otherwise it is the mean.
        outcome: Outcomes, (m,); those that are 0 may change.
    """
    row, world = place
    reach, exponent = limits
    for k in range(distance.shape[0]):
        if outcome[k] == 0:
            ratio = max(distance[k], NEAREST) / reach[world[k]]
            n = exponent[world[k]]
            least = ratio * ratio if n == 2.0 else exp(n * log(ratio))
            power = -log(1.0 - draw[k]) if fades else 1.0
            if fades and power < least:
                outcome[k] = FADING
            elif noise[row[k]] > 1.0 and power < least * noise[row[k]]:
                outcome[k] = JAMMED
