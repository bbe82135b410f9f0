"""The moments that a film shows: states between the recorded ones."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from tussle.errors import ParameterError
from tussle.view.frame import Frame
from tussle.view.recording import Recording

MOST_PICTURES = 1_000_000
"""More than eleven hours of film at 25 pictures per second."""
LEAP_OF_EXTENT = 0.25
"""Share of the diagonal of all positions above which a move between two records is a jump, as across a closed world, and is not
flown."""


class Moments:
    """The times of a film's pictures, and what is seen at each.

    Args:
        recording: What is filmed.
        start: Time of the first picture [s].
        stop: Time that the last picture reaches [s].
        speed: Simulated seconds per second of film.
        fps: Pictures per second of film.

    Attributes:
        t: Time of each picture [s], (k,).
        pace: Simulated time between two pictures [s].
        leap: Distance that nobody moves between two records but by a jump [m].

    Raises:
        ParameterError: There are too many pictures.
    """

    def __init__(self, recording: Recording, start: float, stop: float, speed: float, fps: float) -> None:
        self.recording = recording
        self.speed = speed
        self.fps = fps
        self.pace = speed / fps
        n_intervals = max(0, round((stop - start) / self.pace))
        if n_intervals >= MOST_PICTURES:
            raise ParameterError(
                f"speed = {speed:g} is not allowed here: a film from {start:g} to {stop:g} s has {n_intervals:,} pictures at {fps:g} per "
                f"second; it takes up to {MOST_PICTURES:,}"
            )
        self.t = np.minimum(start + self.pace * np.arange(n_intervals + 1), stop)
        self.leap = LEAP_OF_EXTENT * float(np.linalg.norm(np.subtract(*recording.extent)))
        # Neighbouring pictures lie between the same two records, and a trail asks for older ones.
        self._recorded = lru_cache(maxsize=8)(recording.frame)

    def __len__(self) -> int:
        return len(self.t)

    def at(self, t: float) -> Frame:
        """What is seen at a time [s]."""
        i = self.recording.index_at(t)
        before = self._recorded(i)
        if t <= before.t or i + 1 >= self.recording.n_frames:
            return before
        return between(before, self._recorded(i + 1), t, self.leap)

    def picture(self, k: int) -> Frame:
        """What is seen in a picture by its number."""
        return self.at(float(self.t[k]))


def between(before: Frame, after: Frame, t: float, leap: float) -> Frame:
    """Those of one record as they are somewhat later.

    Positions follow the cubic that has the recorded positions and velocities at both ends, where these agree with each other, else
    a straight line; attitudes turn the shorter way. Who is gone in the second record flies on as it did.

    Args:
        before: A record.
        after: The next one.
        t: A time between them [s].
        leap: Distance that nobody moves but by a jump [m]; who jumps stays until then.
    """
    dt = after.t - before.t
    u = (t - before.t) / dt
    rows = np.minimum(np.searchsorted(after.id, before.id), max(len(after) - 1, 0))
    stays = after.id[rows] == before.id if len(after) else np.zeros(len(before), bool)
    pos, quat, vel = before.pos + before.vel * (u * dt), before.quat.copy(), before.vel.copy()
    there = rows[stays]
    pos[stays] = _flown(before.pos[stays], after.pos[there], before.vel[stays], after.vel[there], u, dt, leap)
    quat[stays] = _turned(before.quat[stays], after.quat[there], u)
    vel[stays] += u * (after.vel[there] - before.vel[stays])
    return Frame(t, before.step, before.id, before.team, before.block, pos, quat, vel, before.health)


def _flown(
    p0: np.ndarray, p1: np.ndarray, v0: np.ndarray, v1: np.ndarray, u: float, dt: float, leap: float
) -> np.ndarray:
    """Positions [m], (n, 3), at the share u of the way."""
    way = p1 - p0
    straight = p0 + u * way
    # Hermite's cubic on the unit interval. Where the mean velocity is not about that of the way, it would swing out.
    cubic = straight + u * (1.0 - u) * ((1.0 - u) * (v0 * dt - way) - u * (v1 * dt - way))
    length = np.linalg.norm(way, axis=1)
    agrees = np.linalg.norm(0.5 * (v0 + v1) * dt - way, axis=1) < 0.25 * length
    flown: np.ndarray = np.where(agrees[:, None], cubic, straight)
    jumps = length > max(leap, 1e-9)
    flown[jumps] = p0[jumps]
    return flown


def _turned(q0: np.ndarray, q1: np.ndarray, u: float) -> np.ndarray:
    """Attitudes, (n, 4), at the share u of the way."""
    sign = np.where((q0 * q1).sum(axis=1, keepdims=True) < 0.0, -1.0, 1.0)
    turned = (1.0 - u) * q0 + u * sign * q1
    length = np.linalg.norm(turned, axis=1, keepdims=True)
    result: np.ndarray = np.where(length > 1e-9, turned / np.maximum(length, 1e-9), q0)
    return result
