"""Predator's choice, claims and pursuit against brute force."""

import numpy as np
import pytest
from neighbor_stacks import stack

from tussle.numeric.quaternion import quat_from_euler
from tussle.plugins.stock.autonomy.predator import kernels

N_WORLDS = 3
DT = 0.1


def game(n=60, seed=0, tied=False):
    rng = np.random.default_rng(seed)
    draw = (
        (lambda: rng.integers(-3, 4, (3, n)).astype(float))
        if tied
        else (lambda: rng.normal(size=(3, n)) * 10.0)
    )
    s = stack([draw() for _ in range(N_WORLDS)], groups=6)
    team = np.where(s.group == 5, 2 + s.source % 2, 1)
    return s, team, int(np.flatnonzero(s.group == 5)[0])


def run(s, team, first, target, switching, capture_range=4.0, room=5000, vel=None):
    index = s.index(20.0)
    n = len(s.ids) - first
    row_of = {each: row for row, each in enumerate(zip(s.world.tolist(), s.ids.tolist(), strict=True))}
    target_row = np.array(
        [row_of.get(each, -1) for each in zip(s.world[first:].tolist(), target.tolist(), strict=True)]
    )
    claim_row, claim_other = np.zeros(room, np.int64), np.zeros(room, np.int64)
    own = [axis[first:].copy() for axis in s.pos]
    n_claims = np.zeros(1, np.int64)
    fits = kernels.hunt(
        (*own, np.full(n, capture_range)),
        (team[first:], np.ones(n, np.int64), np.full(n, switching), np.full(n, vel is not None)),
        (np.zeros((3, len(s.ids))) if vel is None else vel, DT),
        (target, target_row, claim_row, claim_other, n_claims), (s.ids, s.world, index.place, index.order), first,
        (*index.table, index.gather(team.astype(float))),
    )  # fmt: skip
    assert fits == (n_claims[0] <= room)
    if not fits:  # with the room that is asked for, or more, they fit
        return run(s, team, first, target, switching, capture_range, int(n_claims[0]), vel)
    return target_row, n_claims[0], claim_row, claim_other, index


@pytest.mark.parametrize("tied", [False, True])
@pytest.mark.parametrize("n", [60, 900])
def test_the_nearest_prey_is_hunted_and_ties_go_to_the_smaller_id(tied, n):
    s, team, first = game(n, tied=tied)
    target = np.zeros(len(s.ids) - first, np.int64)
    rows, *_ = run(s, team, first, target, True)
    for i, row in enumerate(rows):
        _, square = s.near(first + i, 1.0)
        prey = np.flatnonzero((s.world == s.world[first + i]) & (team == 1))
        assert row == prey[np.lexsort((s.ids[prey], square[prey]))[0]]
        assert target[i] == s.ids[row]


def test_a_living_target_is_kept_and_a_gone_one_replaced():
    s, team, first = game()
    n = len(s.ids) - first
    target = np.full(n, s.ids[0])
    target[1] = s.ids.max() - 1
    rows, *_ = run(s, team, first, target, False)
    kept = np.arange(n) != 1
    assert (target[kept] == s.ids[0]).all()
    assert (s.world[rows] == s.world[first:]).all()
    assert team[rows[1]] == 1


def test_without_prey_there_is_no_target_and_commands_persist():
    s, team, first = game()
    team[team == 1] = 7
    target = np.zeros(len(s.ids) - first, np.int64)
    rows, *_ = run(s, team, first, target, True)
    assert (rows == -1).all()
    assert (target == 0).all()
    n = len(rows)
    own = [axis[first:].copy() for axis in s.pos]
    outputs = [np.full(n, 5.0) for _ in range(3)]
    level = np.array([np.ones(n), np.zeros(n), np.zeros(n), np.zeros(n)])
    kernels.pursue(tuple(own), tuple(level), np.full(n, 35.0), rows, s.pos, tuple(outputs))
    kernels.point(*own[:2], np.full(n, 35.0), rows, s.pos, *outputs[:2])
    assert all((o == 5.0).all() for o in outputs)


@pytest.mark.parametrize("room", [5000, 3, 0])
def test_claims_are_everyone_of_another_team_in_range(room):
    s, team, first = game(200)
    target = np.zeros(len(s.ids) - first, np.int64)
    _, n_claims, claim_row, claim_other, index = run(s, team, first, target, True, room=room)
    expected = []
    for i in range(len(target)):
        near, _ = s.near(first + i, 4.0)
        near = near[team[near] != team[first + i]]
        expected += [(i, j) for j in near[np.argsort(index.place[near])]]
    assert n_claims == len(expected) > 10
    assert list(zip(claim_row, claim_other, strict=True))[:n_claims] == expected


@pytest.mark.parametrize("speed", [1.0, 30.0])
def test_between_steps_those_are_claimed_that_will_come_within_range(speed):
    s, team, first = game(200)
    vel = np.random.default_rng(1).normal(0.0, speed, (3, len(s.ids)))
    target = np.zeros(len(s.ids) - first, np.int64)
    _, n_claims, claim_row, claim_other, _ = run(s, team, first, target, True, vel=vel)
    times = np.linspace(0.0, DT, 101)
    certain, possible = set(), set()
    for i in range(len(target)):
        row = first + i
        others = np.flatnonzero((s.world == s.world[row]) & (team != team[row]))
        offset, closing = s.pos[:, others] - s.pos[:, [row]], vel[:, others] - vel[:, [row]]
        least = np.min([np.linalg.norm(offset + t * closing, axis=0) for t in times], axis=0)
        certain |= {(i, j) for j in others[least < 4.0]}
        possible |= {(i, j) for j in others[least < 4.0 + 0.001 * speed]}
    claimed = set(zip(claim_row[:n_claims].tolist(), claim_other[:n_claims].tolist(), strict=True))
    assert len(claimed) == n_claims
    assert certain <= claimed <= possible
    assert len(certain) > 10


def test_pursuit_points_at_the_target():
    s, team, first = game()
    n = len(s.ids) - first
    target = np.zeros(n, np.int64)
    rows, *_ = run(s, team, first, target, True)
    own = [axis[first:].copy() for axis in s.pos]
    yaw, climb = np.linspace(-3, 3, n), np.linspace(-1, 1, n)
    speed, turn, pitch, heading, fast = (np.zeros(n) for _ in range(5))
    quat = tuple(quat_from_euler(np.zeros(n), -climb, yaw))
    kernels.pursue(tuple(own), quat, np.full(n, 35.0), rows, s.pos, (speed, turn, pitch))
    kernels.point(*own[:2], np.full(n, 35.0), rows, s.pos, heading, fast)
    d = s.pos[:, rows] - np.array(own)
    np.testing.assert_allclose(heading, np.arctan2(d[1], d[0]), atol=1e-14)
    np.testing.assert_allclose(np.exp(1j * turn), np.exp(1j * (heading - yaw)), atol=1e-13)
    np.testing.assert_allclose(
        np.exp(1j * pitch), np.exp(1j * (np.arctan2(d[2], np.hypot(*d[:2])) - climb)), atol=1e-13
    )
    assert (speed == 35.0).all()
    assert (fast == 35.0).all()
