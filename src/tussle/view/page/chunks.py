"""The binary frame format of offline files, replays and live games.

A chunk holds frames that follow one another, as tracks, and needs no other chunk to be read. A track is one entity over frames that
follow each other. Where an entity is missing for a while, changes its team, or jumps, as at the edge of a world that is closed upon
itself, another track of the same id begins: between the frames of one track it moves evenly. A live frame is a chunk of one frame.

Layout, numbers as `tussle.view.page.packing` writes them:

| part | holds |
|---|---|
| `<5d` | lower corner x, y, z [m], step of positions [m], health that counts as `FULL_HEALTH` steps |
| `<3I` | number of the first frame, frames F, tracks K |
| `reals` | times of the frames [s], (F,) |
| 5 x `ints` | per track, (K,): id, team, block, first and last frame, counted from the chunk's first |
| 8 x `column` | states, track after track: x, y, z in steps above the corner; attitude (`rounded_attitudes`); health in steps |
"""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tussle.view.frame import Frame
from tussle.view.page.packing import MAX_VALUE, column, ints, reals

STEP = 0.002
"""Coarsest step of positions [m]."""
STEPS_OF_BODY, STEPS_OF_EXTENT = 20, 50_000
"""Steps of positions that the smallest body and the diagonal of all positions have at least."""
UNIT = 2047
"""Steps of a component of an attitude between 0 and sqrt(1/2)."""
FULL_HEALTH = 255


ANGLE_ERROR = 2.0 * 2.0 * 0.5 * math.sqrt(3.0) * math.sqrt(0.5) / UNIT
"""Largest angle between an attitude and what it is rounded to [rad].

Three components err by e = sqrt(3)/2 steps together. The fourth follows from them and is 1/2 or more, so it errs by no more than
sqrt(3) e; an angle is twice what the quaternion errs."""


@dataclass(frozen=True)
class Grain:
    """Rounding of positions and health.

    Attributes:
        low: What is added to positions [m], (3,).
        step: Distance between positions that can be told apart along an axis [m].
        full_health: Health that counts as FULL_HEALTH steps.
    """

    low: tuple[float, float, float]
    step: float
    full_health: float


def grain_of(pos: np.ndarray, health: np.ndarray, step: float) -> Grain:
    """The rounding of positions [m], (n, 3), and health, (n,): steps of this length [m], or longer ones where they lie too far apart."""
    if not len(pos):
        return Grain((0.0, 0.0, 0.0), step, 0.0)
    low, high = pos.min(axis=0), pos.max(axis=0)
    x, y, z = (float(c) for c in low)
    full = float(np.nan_to_num(health, posinf=0.0).max())
    return Grain((x, y, z), max(step, float((high - low).max()) / MAX_VALUE), full)


def step_of(low: np.ndarray, high: np.ndarray, smallest: float) -> float:
    """The step of positions that suits a game [m].

    Args:
        low: Lower corner of all positions [m], (3,).
        high: Upper corner [m], (3,).
        smallest: Length of the smallest body [m].
    """
    diagonal, widest = float(np.linalg.norm(high - low)), float((high - low).max())
    wanted = min(STEP, smallest / STEPS_OF_BODY, diagonal / STEPS_OF_EXTENT if diagonal > 0.0 else STEP)
    return max(_round_down(wanted), widest / MAX_VALUE)


def position_error(step: float) -> float:
    """Largest distance between a position and what it is rounded to in steps along each axis [m]."""
    return 0.5 * math.sqrt(3.0) * step


def _round_down(value: float) -> float:
    """The largest of 1, 2 and 5 times powers of ten that is not above a number > 0."""
    power = math.floor(math.log10(value) + 1e-9)
    return next(m * 10.0**power for m in (5, 2, 1) if m == 1 or m * 10.0**power <= value * (1.0 + 1e-9))


class Tracks:
    """The intervals of frames in which entities exist.

    Args:
        leap: Distance above which an entity has jumped [m]; its speed must be far from explaining it, too.

    Attributes:
        id: Of each track, (n,); so are team and block.
        first: Its first frame; last: its last.
    """

    def __init__(self, leap: float) -> None:
        self.leap = leap
        self._new: list[tuple[np.ndarray, ...]] = []
        self._last = np.zeros(0, np.int64)
        self._before: tuple[Frame, np.ndarray] | None = None

    def assign(self, i: int, frame: Frame) -> np.ndarray:
        """Return the track of each entity of the next frame, (n,)."""
        tracks = np.full(len(frame), -1, np.int64)
        if self._before is not None:
            was, its = self._before
            rows, olds = _matches(frame, was)
            goes_on = ~self._jumped(was, olds, frame, rows)
            tracks[rows[goes_on]] = its[olds[goes_on]]
        new = np.flatnonzero(tracks < 0)
        if len(new):
            n = len(self._last)
            tracks[new] = np.arange(n, n + len(new))
            self._last = np.concatenate([self._last, np.zeros(len(new), np.int64)])
            begin = np.full(len(new), i, np.int64)
            self._new.append((frame.id[new], frame.team[new], frame.block[new], begin))
        self._last[tracks] = i
        self._before = frame, tracks
        return tracks

    def _jumped(self, was: Frame, olds: np.ndarray, now: Frame, rows: np.ndarray) -> np.ndarray:
        """Return which entities moved further than is possible without a jump."""
        moved = np.linalg.norm(now.pos[rows] - was.pos[olds], axis=1)
        speeds = [np.linalg.norm(f.vel[r], axis=1) for f, r in ((was, olds), (now, rows))]
        return np.asarray(moved > np.maximum(self.leap, 10.0 * (now.t - was.t) * np.maximum(*speeds)))

    def table(self) -> dict[str, np.ndarray]:
        """The columns id, team, block, first, last."""
        nothing = (np.zeros(0, np.int64),) * 4
        columns = [np.concatenate(parts) for parts in zip(nothing, *self._new, strict=True)]
        return dict(zip(("id", "team", "block", "first", "last"), [*columns, self._last], strict=True))


def _matches(frame: Frame, was: Frame) -> tuple[np.ndarray, np.ndarray]:
    """Rows of those who were there before, in the same team and block, here and there."""
    if np.array_equal(frame.id, was.id):
        rows = olds = np.arange(len(frame))
    else:
        _, rows, olds = np.intersect1d(frame.id, was.id, assume_unique=True, return_indices=True)
    stays = (frame.team[rows] == was.team[olds]) & (frame.block[rows] == was.block[olds])
    return rows[stays], olds[stays]


def pack(first: int, frames: Sequence[Frame], step: float, leap: float = math.inf) -> bytes:
    """Pack one or more consecutive frames into a chunk. Entities without a finite position are omitted.

    Args:
        first: Number of the first frame.
        frames: The frames.
        step: Distance between positions that can be told apart along an axis [m].
        leap: Distance above which an entity has jumped [m].
    """
    frames = [_somewhere(frame) for frame in frames]
    tracks = Tracks(leap)
    numbers = np.concatenate([tracks.assign(i, frame) for i, frame in enumerate(frames)])
    order = np.argsort(numbers, kind="stable")
    is_head = np.diff(numbers[order], prepend=-1) != 0
    pos, quat, health = (
        np.concatenate([getattr(frame, name) for frame in frames])[order]
        for name in ("pos", "quat", "health")
    )
    grain = grain_of(pos, health, step)
    columns = [*rounded_positions(pos, grain).T, *rounded_attitudes(quat).T, rounded_health(health, grain)]
    table = tracks.table()
    head = struct.pack(
        "<5d3I", *grain.low, grain.step, grain.full_health, first, len(frames), len(table["id"])
    )
    times = reals(np.array([frame.t for frame in frames]))
    return b"".join([head, times, *(ints(c) for c in table.values()), *(column(c, is_head) for c in columns)])


def _somewhere(frame: Frame) -> Frame:
    """Return the frame without entities whose position is not finite."""
    is_there = np.isfinite(frame.pos).all(axis=1)
    if is_there.all():
        return frame
    rows = {
        name: getattr(frame, name)[is_there]
        for name in ("id", "team", "block", "pos", "quat", "vel", "health")
    }
    return replace(frame, **rows)


def rounded_positions(pos: np.ndarray, grain: Grain) -> np.ndarray:
    """Positions [m], (n, 3), in steps above the lower corner."""
    steps: np.ndarray = np.rint((pos - np.array(grain.low)) / grain.step).astype(np.int64)
    return steps


def rounded_attitudes(quat: np.ndarray) -> np.ndarray:
    """Return the number of the largest component, and the three others in steps, (n, 4).

    The largest is taken as positive, for q and -q are the same attitude, and follows from the others, none of which is above
    sqrt(1/2).

    Args:
        quat: (w, x, y, z) of any length, (n, 4); of length 0 it is level, to the east.
    """
    quat = np.nan_to_num(quat, posinf=0.0, neginf=0.0)
    length = np.linalg.norm(quat, axis=1, keepdims=True)
    quat = np.where(length > 0.0, quat / np.where(length > 0.0, length, 1.0), [1.0, 0.0, 0.0, 0.0])
    largest = np.argmax(np.abs(quat), axis=1)
    sign = np.where(np.take_along_axis(quat, largest[:, None], 1) < 0.0, -1.0, 1.0)
    others = (largest[:, None] + np.arange(1, 4)) % 4
    steps = np.rint(np.take_along_axis(quat * sign, others, 1) * (UNIT / math.sqrt(0.5)))
    return np.concatenate([largest[:, None], steps.astype(np.int64)], axis=1)


def rounded_health(health: np.ndarray, grain: Grain) -> np.ndarray:
    """Health in steps of the most that anybody had, (n,)."""
    share = np.clip(health / grain.full_health, 0.0, 1.0) if grain.full_health > 0.0 else 0.0 * health
    return np.rint(np.nan_to_num(share) * FULL_HEALTH).astype(np.int64)
