"""Frames become tracks, and numbers become few bytes and themselves again."""

from __future__ import annotations

import zlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from page_reader import Bytes, read_chunk

from tussle.view import Frame
from tussle.view.page.chunks import (
    ANGLE_ERROR,
    FULL_HEALTH,
    UNIT,
    Grain,
    Tracks,
    grain_of,
    pack,
    position_error,
    rounded_attitudes,
    rounded_health,
    rounded_positions,
    step_of,
)
from tussle.view.page.packing import MAX_VALUE, column, ints, reals


def frame(t, entities):
    """A frame of {id: (team, x)} at 1 m/s."""
    ids = sorted(entities)
    n = len(ids)
    pos = np.array([[entities[i][1], 0.0, 0.0] for i in ids]).reshape(n, 3)
    whole = [np.array(c, np.int32) for c in (ids, [entities[i][0] for i in ids], [0] * n)]
    quat, vel = np.tile([1.0, 0.0, 0.0, 0.0], (n, 1)), np.tile([1.0, 0.0, 0.0], (n, 1))
    return Frame(t, round(t), *whole, pos, quat, vel, np.ones(n))


def followed(*moments):
    """Tracks of each frame, and their table; frames are 1 s apart and a leap is 10 m."""
    tracks = Tracks(leap=10.0)
    rows = [tracks.assign(i, frame(float(i), entities)).tolist() for i, entities in enumerate(moments)]
    return rows, {name: values.tolist() for name, values in tracks.table().items()}


def test_an_entity_is_one_track_as_long_as_it_is_there():
    rows, table = followed({1: (1, 0.0), 2: (1, 5.0)}, {1: (1, 1.0)}, {1: (1, 2.0), 7: (2, 0.0)})
    assert rows == [[0, 1], [0], [0, 2]]
    assert table == {
        "id": [1, 2, 7],
        "team": [1, 1, 2],
        "block": [0, 0, 0],
        "first": [0, 0, 2],
        "last": [2, 0, 2],
    }


def test_who_was_away_changed_sides_or_jumped_begins_anew():
    assert followed({1: (1, 0.0)}, {}, {1: (1, 2.0)})[0] == [[0], [], [1]]
    assert followed({1: (1, 0.0)}, {1: (2, 1.0)})[0] == [[0], [1]]
    assert followed({1: (1, 0.0), 2: (1, 0.0)}, {1: (1, 9.9), 2: (1, 10.1)})[0] == [[0, 1], [0, 2]]
    _, table = followed({1: (1, 0.0)}, {1: (1, 50.0)}, {1: (1, 51.0)})
    assert (table["first"], table["last"]) == ([0, 1], [0, 2])


def test_what_is_fast_does_not_jump():
    tracks = Tracks(leap=10.0)
    fast = frame(0.0, {1: (1, 0.0)})
    fast.vel[:] = 2.0 * fast.vel
    assert tracks.assign(0, fast).tolist() == [0]
    assert tracks.assign(1, frame(1.0, {1: (1, 19.9)})).tolist() == [0]
    assert tracks.assign(2, frame(2.0, {1: (1, 40.0)})).tolist() == [1]


def test_nobody_at_all_is_an_empty_table():
    assert followed({}, {}) == ([[], []], {name: [] for name in ("id", "team", "block", "first", "last")})


@given(st.lists(st.integers(-(2**31) + 1, 2**31 - 1), max_size=40))
def test_whole_numbers_come_back(values):
    data = ints(np.array(values, np.int64))
    assert Bytes(data).ints(len(values)) == values
    assert len(data) <= 1 + 4 * len(values)


@given(st.lists(st.lists(st.integers(-MAX_VALUE, MAX_VALUE), min_size=1, max_size=8), min_size=1, max_size=6))
def test_series_come_back(series):
    values = np.concatenate([np.array(s) for s in series])
    counts = [len(s) for s in series]
    is_head = np.zeros(len(values), bool)
    is_head[np.cumsum([0, *counts[:-1]])] = True
    assert Bytes(column(values, is_head)).column(counts).tolist() == values.tolist()


@pytest.mark.parametrize(("values", "order"), [([0, 3, 1, 4, 1, 5, 9], 1), ([10, 20, 30, 40, 50, 61], 2)])
def test_the_smaller_differences_are_taken(values, order):
    is_head = np.array([True] + [False] * (len(values) - 1))
    data = column(np.array(values), is_head)
    assert data[0] == order
    assert Bytes(data).column([len(values)]).tolist() == values


@given(st.lists(st.floats(allow_nan=False), max_size=20))
def test_real_numbers_come_back(values):
    assert Bytes(reals(np.array(values, float))).reals(len(values)).tolist() == values


def test_rough_motion_is_small_as_well():
    """Far below 25 bytes of base64 a state, with which 2,000 entities over 60 s would be 30 MB."""
    rng, n, n_frames, dt = np.random.default_rng(3), 50, 400, 0.1
    ids, nothing = np.arange(1, n + 1, dtype=np.int32), np.zeros(n, np.int32)
    pos, vel, quat = rng.uniform(-500, 500, (n, 3)), rng.normal(size=(n, 3)) * 20, rng.normal(size=(n, 4))
    frames = []
    for i in range(n_frames):
        vel = vel + rng.normal(size=(n, 3)) * 10 * dt
        pos = pos + vel * dt
        quat = quat / np.linalg.norm(quat, axis=1, keepdims=True) + rng.normal(size=(n, 4)) * 0.03
        frames.append(Frame(i * dt, i, ids, nothing, nothing, pos, quat, vel, np.ones(n)))
    data = pack(7, frames, step_of(np.full(3, -500.0), np.full(3, 500.0), 1.0), leap=250.0)
    chunk = read_chunk(data)
    assert (chunk.first, len(chunk.t), len(chunk.tracks["id"])) == (7, n_frames, n)
    assert len(zlib.compress(data, 6)) * 4 / 3 < 12 * n * n_frames


def test_a_frame_comes_back_and_who_is_nowhere_is_left_out():
    one = frame(3.0, {1: (1, 5.0), 2: (2, -4.0), 9: (1, 1e9)})
    one.pos[2] = np.nan
    one.quat[0] = np.nan
    one.quat[1] = 0.0
    chunk = read_chunk(pack(30, [one], 0.002))
    (seen,) = chunk.frames
    assert sorted(seen) == [1, 2]
    assert seen[1].pos == pytest.approx([5.0, 0.0, 0.0], abs=0.001)
    assert [seen[2].team, seen[2].health, seen[2].quat.tolist()] == [2, 1.0, [1.0, 0.0, 0.0, 0.0]]
    assert read_chunk(pack(0, [frame(0.0, {})], 0.002)).frames == [{}]


def test_a_game_that_is_wider_than_numbers_are_long_has_longer_steps():
    chunk = read_chunk(pack(0, [frame(0.0, {1: (1, -1e9), 2: (1, 1e9)})], 0.002))
    assert chunk.step == pytest.approx(2e9 / MAX_VALUE)
    assert chunk.frames[0][2].pos[0] == pytest.approx(1e9, abs=10.0)


# -- rounding ---------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("size", "smallest", "step"),
    [
        (2000.0, 1.0, 0.002),
        (10.0, 1.0, 2e-4),
        (0.0, 1.0, 0.002),
        (2000.0, 0.002, 1e-4),
        (4e6, 1.0, 4e6 / MAX_VALUE),
    ],
)
def test_positions_are_as_fine_as_the_game_and_its_bodies_are_small(size, smallest, step):
    found = step_of(np.zeros(3), np.array([size, 0.0, 0.0]), smallest)
    assert found == pytest.approx(step)
    assert size / found <= MAX_VALUE


def test_positions_are_off_by_no_more_than_is_said():
    rng = np.random.default_rng(1)
    low, high = np.array([-1e5, 30.0, -500.0]), np.array([2e4, 9e3, 1e4])
    pos = rng.uniform(low, high, (50_000, 3))
    grain = grain_of(pos, np.ones(len(pos)), step_of(low, high, 1.0))
    back = np.array(grain.low) + grain.step * rounded_positions(pos, grain)
    off = np.linalg.norm(back - pos, axis=1).max()
    assert 0.8 * position_error(grain.step) < off <= position_error(grain.step) + 1e-11


def test_attitudes_are_off_by_no_more_than_is_said():
    rng = np.random.default_rng(2)
    quat = rng.normal(size=(200_000, 4))
    # Where all components are alike, and where two are, the one that is left out errs most.
    quat[:50_000] = np.sign(quat[:50_000]) + rng.normal(size=(50_000, 4)) * 1e-3
    quat[50_000:60_000, :2] = 0.0
    quat /= np.linalg.norm(quat, axis=1, keepdims=True)
    largest, *others = rounded_attitudes(quat).T
    assert max(np.abs(o).max() for o in others) <= UNIT
    back = np.empty_like(quat)
    three = np.stack(others, 1) * np.sqrt(0.5) / UNIT
    rows = np.arange(len(quat))
    for k in range(3):
        back[rows, (largest + k + 1) % 4] = three[:, k]
    back[rows, largest] = np.sqrt(np.maximum(0.0, 1.0 - (three**2).sum(axis=1)))
    # asin of the vector part of the difference keeps small angles, which acos of its real part loses.
    w, v = back[:, :1], back[:, 1:]
    rest = w * quat[:, 1:] - quat[:, :1] * v - np.cross(v, quat[:, 1:])
    angle = 2.0 * np.arcsin(np.linalg.norm(rest, axis=1))
    assert 0.7 * ANGLE_ERROR < angle.max() <= ANGLE_ERROR


def test_health_is_a_share_of_the_most():
    health = np.array([0.0, -1.0, 2.5, 5.0, np.inf, np.nan])
    grain = Grain((0.0, 0.0, 0.0), 1.0, 5.0)
    assert rounded_health(health, grain).tolist() == [0, 0, 128, FULL_HEALTH, FULL_HEALTH, 0]
    nothing = Grain((0.0, 0.0, 0.0), 1.0, 0.0)
    assert rounded_health(np.zeros(2), nothing).tolist() == [0, 0]
