"""The frames of a recording as tracks: who was there from when to when, and where, in pieces that are read one by one.

A track is one entity over frames that follow each other. Where an entity is missing for a while, changes its team, or jumps, as at
the edge of a world that is closed upon itself, another track of the same id begins: between the frames of one track it moves evenly.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from tussle.view.export.packing import MOST, column, deflated, ints, reals
from tussle.view.frame import Frame

N_ROWS = 150_000
"""States of a piece, about: some hundredths of a second of work for a browser."""
LEAST_FRAMES, MOST_FRAMES = 32, 1024
"""Frames of a piece: with fewer the first states weigh too much, with more a page has to read too much before it shows anything."""
STEP = 0.002
"""Coarsest step of positions [m]."""
STEPS_OF_BODY, STEPS_OF_EXTENT = 20, 50_000
"""Steps of positions that the smallest body and the diagonal of all positions have at least."""
UNIT = 2047
"""Steps of a component of an attitude between 0 and sqrt(1/2)."""
FULL_HEALTH = 255


@dataclass(frozen=True)
class Grain:
    """How positions and attitudes are rounded.

    Attributes:
        low: What is added to positions [m], (3,).
        step: Distance between positions that can be told apart along an axis [m].
        full_health: Health that counts as FULL_HEALTH steps.
    """

    low: tuple[float, float, float]
    step: float
    full_health: float

    @property
    def position_error(self) -> float:
        """Largest distance between a position and what it is rounded to [m]."""
        return 0.5 * math.sqrt(3.0) * self.step

    @property
    def angle_error(self) -> float:
        """Largest angle between an attitude and what it is rounded to [rad].

        Three components err by e = sqrt(3)/2 steps together. The fourth follows from them and is 1/2 or more, so it errs by no more
        than sqrt(3) e; an angle is twice what the quaternion errs.
        """
        return 2.0 * 2.0 * 0.5 * math.sqrt(3.0) * math.sqrt(0.5) / UNIT


def grain_of(low: np.ndarray, high: np.ndarray, smallest: float, full_health: float) -> Grain:
    """The rounding that suits a game.

    Args:
        low: Lower corner of all positions [m], (3,).
        high: Upper corner [m], (3,).
        smallest: Length of the smallest body [m].
        full_health: The most health of all.
    """
    diagonal, widest = float(np.linalg.norm(high - low)), float((high - low).max())
    wanted = min(STEP, smallest / STEPS_OF_BODY, diagonal / STEPS_OF_EXTENT if diagonal > 0.0 else STEP)
    step = max(_round_down(wanted), widest / MOST)
    x, y, z = (float(c) for c in low)
    return Grain((x, y, z), step, full_health)


def _round_down(value: float) -> float:
    """The largest of 1, 2 and 5 times powers of ten that is not above a number > 0."""
    power = math.floor(math.log10(value) + 1e-9)
    return next(m * 10.0**power for m in (5, 2, 1) if m == 1 or m * 10.0**power <= value * (1.0 + 1e-9))


class Tracks:
    """Who was there from when to when.

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

    def follow(self, i: int, frame: Frame) -> np.ndarray:
        """The track of each entity in the frame that comes next, (n,)."""
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
        """Whether they cannot have moved from there to here."""
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


@dataclass
class _Piece:
    """Frames that are packed together."""

    first: int
    parts: list[tuple[np.ndarray, ...]]
    n_rows: int = 0

    def add(self, tracks: np.ndarray, *columns: np.ndarray) -> None:
        self.parts.append((tracks, *columns))
        self.n_rows += len(tracks)

    @property
    def last(self) -> int:
        return self.first + len(self.parts) - 1

    @property
    def is_full(self) -> bool:
        n_frames = len(self.parts)
        return n_frames >= MOST_FRAMES or (self.n_rows >= N_ROWS and n_frames >= LEAST_FRAMES)

    def packed(self) -> bytes:
        """Columns x, y, z, then which component of the attitude is left out and the other three, then health, track after track."""
        joined = [np.concatenate(parts) for parts in zip(*self.parts, strict=True)]
        order = np.argsort(joined[0], kind="stable")
        tracks = joined[0][order]
        is_head = np.diff(tracks, prepend=-1) != 0
        data = []
        for values in joined[1:]:
            rows = values[order]
            data += [column(c, is_head) for c in (rows.T if rows.ndim == 2 else [rows])]
        return deflated(b"".join(data))


@dataclass(frozen=True)
class Packed:
    """All frames of a recording as bytes.

    Attributes:
        index: Times of the frames and the table of tracks, deflated.
        pieces: Frames first to last and their bytes. The last frame of a piece is the first of the next.
        n_tracks: Tracks in the table.
        n_entities: Ids in it.
        n_rows: States in all pieces.
    """

    index: bytes
    pieces: list[tuple[int, int, bytes]]
    n_tracks: int
    n_entities: int
    n_rows: int


def pack(frames: Iterable[Frame], grain: Grain, leap: float) -> Packed:
    """Frames, in order, as tracks and pieces; there is at least one."""
    tracks, piece = Tracks(leap), _Piece(0, [])
    times: list[float] = []
    pieces: list[tuple[int, int, bytes]] = []
    for i, frame in enumerate(frames):
        times.append(frame.t)
        row = (
            tracks.follow(i, frame),
            rounded_positions(frame.pos, grain),
            rounded_attitudes(frame.quat),
            rounded_health(frame.health, grain),
        )
        piece.add(*row)
        if piece.is_full:
            pieces.append((piece.first, piece.last, piece.packed()))
            piece = _Piece(i, [])
            piece.add(*row)
    if not pieces or len(piece.parts) > 1:
        pieces.append((piece.first, piece.last, piece.packed()))
    table = tracks.table()
    index = deflated(reals(np.array(times)) + b"".join(ints(c) for c in table.values()))
    n_rows = int((table["last"] - table["first"] + 1).sum())
    return Packed(index, pieces, len(table["id"]), len(np.unique(table["id"])), n_rows)


def rounded_positions(pos: np.ndarray, grain: Grain) -> np.ndarray:
    """Positions [m], (n, 3), in steps above the lower corner."""
    steps: np.ndarray = np.rint((pos - np.array(grain.low)) / grain.step).astype(np.int64)
    return steps


def rounded_attitudes(quat: np.ndarray) -> np.ndarray:
    """Which component is largest, and the three others in steps, (n, 4).

    The largest is taken as positive, for q and -q are the same attitude, and follows from the others, none of which is above
    sqrt(1/2).

    Args:
        quat: (w, x, y, z) of any length but 0, (n, 4).
    """
    quat = quat / np.linalg.norm(quat, axis=1, keepdims=True)
    largest = np.argmax(np.abs(quat), axis=1)
    sign = np.where(np.take_along_axis(quat, largest[:, None], 1) < 0.0, -1.0, 1.0)
    others = (largest[:, None] + np.arange(1, 4)) % 4
    steps = np.rint(np.take_along_axis(quat * sign, others, 1) * (UNIT / math.sqrt(0.5)))
    return np.concatenate([largest[:, None], steps.astype(np.int64)], axis=1)


def rounded_health(health: np.ndarray, grain: Grain) -> np.ndarray:
    """Health in steps of the most that anybody had, (n,)."""
    share = np.clip(health / grain.full_health, 0.0, 1.0) if grain.full_health > 0.0 else 0.0 * health
    return np.rint(np.nan_to_num(share) * FULL_HEALTH).astype(np.int64)
