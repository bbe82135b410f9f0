"""When each message is on the air."""

from __future__ import annotations

from tussle.numeric.kernel import kernel


@kernel("I I F (F F F) F (Fw Fw) (Fw Fw) (Fw Fw Bw)")
def send(row, world, size, limits, offset, queue, on_air, span):
    """Send the messages of each transmitter one after another; drop those that find a full queue.

    Args:
        row: Row of the sender of each message, -1 for none, (k,).
        world: World of each message, (k,).
        size: Size of each message [byte], (k,).
        limits: Bandwidth [bit/s], queue limit [byte] and beginning of the step [s], (n_worlds,) each.
        offset: Time after the beginning of the step at which an idle transmitter starts [s], (n,).
        queue: Data that waits at each row [byte], and time at which its transmitter is free [s], (n,) each, updated.
        on_air: First and last time at which a row sends in this step [s], (n,) each, updated.
        span: Start and end of each message on the air [s], and whether it was sent, (k,) each, written.
    """
    bandwidth, limit, begin = limits
    ahead, busy_until = queue
    first, last = on_air
    start, end, is_sent = span
    for k in range(row.shape[0]):
        own, of = row[k], world[k]
        is_sent[k] = own >= 0 and ahead[own] <= limit[of]
        if is_sent[k]:
            ahead[own] += size[k]
            start[k] = max(busy_until[own], begin[of] + offset[own])
            end[k] = start[k] + 8.0 * size[k] / bandwidth[of]
            busy_until[own] = end[k]
            first[own] = min(first[own], start[k])
            last[own] = end[k]
