"""States between the recorded ones, at the times of a film's pictures."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from tussle.errors import ParameterError
from tussle.view.frame import Frame
from tussle.view.recording import Recording

MAX_PICTURES = 1_000_000
"""Largest number of pictures of a film: eleven hours at 25 pictures per second."""
JUMP_OF_EXTENT = 0.25
"""Share of the diagonal of all positions above which a move between two records is a jump, as across a periodic world."""


class Moments:
    """Times and states of a film's pictures.

    Args:
        recording: The recorded run.
        start: Time of the first picture [s].
        stop: Latest time of the last picture [s].
        speed: Simulated seconds per second of film.
        fps: Pictures per second of film.

    Attributes:
        t: Time of each picture [s], (k,).
        jump: Longest distance of a move between two records that is not a jump [m].

    Raises:
        ParameterError: There are too many pictures.
    """

    def __init__(self, recording: Recording, start: float, stop: float, speed: float, fps: float) -> None:
        self.recording, self.speed = recording, speed
        period = speed / fps
        n_intervals = max(0, round((stop - start) / period))
        if n_intervals >= MAX_PICTURES:
            raise ParameterError(
                f"speed = {speed:g} is not allowed here: a film from {start:g} to {stop:g} s has {n_intervals:,} pictures at {fps:g} per "
                f"second; it takes up to {MAX_PICTURES:,}"
            )
        self.t = np.minimum(start + period * np.arange(n_intervals + 1), stop)
        self.jump = JUMP_OF_EXTENT * float(np.linalg.norm(np.subtract(*recording.extent)))
        # Neighbouring pictures lie between the same two records, and a trail needs older ones.
        self._recorded = lru_cache(maxsize=8)(recording.frame)

    def __len__(self) -> int:
        return len(self.t)

    def at(self, t: float) -> Frame:
        """The state at a time [s]."""
        i = self.recording.index_at(t)
        before = self._recorded(i)
        if t <= before.t or i + 1 >= self.recording.n_frames:
            return before
        return interpolated(before, self._recorded(i + 1), t, self.jump)


def interpolated(before: Frame, after: Frame, t: float, jump: float) -> Frame:
    """The entities of one record at a later time.

    Positions follow the cubic through the recorded positions and velocities where these agree, else a straight line; attitudes
    turn the shorter way. An entity that the second record lacks keeps its velocity.

    Args:
        before: A record.
        after: The next record.
        t: A time between them [s].
        jump: Longest distance that is not a jump [m]; an entity that jumps stays until the next record.
    """
    dt = after.t - before.t
    u = (t - before.t) / dt
    rows = np.minimum(np.searchsorted(after.id, before.id), max(len(after) - 1, 0))
    stays = after.id[rows] == before.id if len(after) else np.zeros(len(before), bool)
    pos, quat, vel = before.pos + before.vel * (u * dt), before.quat.copy(), before.vel.copy()
    there = rows[stays]
    p0, v0, v1 = before.pos[stays], before.vel[stays], after.vel[there]
    pos[stays] = _positions(p0, after.pos[there], v0 * dt, v1 * dt, u, jump)
    quat[stays] = _attitudes(before.quat[stays], after.quat[there], u)
    vel[stays] += u * (v1 - v0)
    return Frame(t, before.step, before.id, before.team, before.block, pos, quat, vel, before.health)


def _positions(
    p0: np.ndarray, p1: np.ndarray, d0: np.ndarray, d1: np.ndarray, u: float, jump: float
) -> np.ndarray:
    """Positions [m], (n, 3), at the share u of the interval; d0 and d1 are the velocities times its length [m]."""
    way = p1 - p0
    straight = p0 + u * way
    # Hermite's cubic on the unit interval. Where the mean velocity differs much from the way, it would overshoot.
    cubic = straight + u * (1.0 - u) * ((1.0 - u) * (d0 - way) - u * (d1 - way))
    length = np.linalg.norm(way, axis=1)
    agrees = np.linalg.norm(0.5 * (d0 + d1) - way, axis=1) < 0.25 * length
    pos: np.ndarray = np.where(agrees[:, None], cubic, straight)
    jumps = length > max(jump, 1e-9)
    pos[jumps] = p0[jumps]
    return pos


def _attitudes(q0: np.ndarray, q1: np.ndarray, u: float) -> np.ndarray:
    """Attitudes, (n, 4), at the share u of the interval."""
    sign = np.where((q0 * q1).sum(axis=1, keepdims=True) < 0.0, -1.0, 1.0)
    turned = (1.0 - u) * q0 + u * sign * q1
    length = np.linalg.norm(turned, axis=1, keepdims=True)
    quat: np.ndarray = np.where(length > 1e-9, turned / np.maximum(length, 1e-9), q0)
    return quat
