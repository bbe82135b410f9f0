"""Boids' sums and law against the formulas in NumPy, one agent at a time."""

import itertools

import numpy as np
import pytest
from neighbor_stacks import stack

from tussle.numeric.neighbors.walk import make_walk
from tussle.numeric.quaternion import quat_from_euler
from tussle.plugins.stock.autonomy.boids import kernels
from tussle.stock import Boids

REACH, SPHERE, TEAM_RANGE, OTHER_RANGE = 60.0, 30.0, 2.0, 8.0


def sums_of(s, yaw, team, quat=None, fov=(7.0, 7.0), split=None, first=0, last=None, spread=0.0):
    last = len(s.ids) if last is None else last
    n = last - first
    index = s.index(REACH)
    b = index.blocks(first, last)
    law = Boids.seen if quat is None else Boids.seen_in_view
    walk = make_walk(law.laws, law.where, lambda name: "I" if name == "team" else "F")
    own = {
        "comms_range": REACH - spread * (s.source[first:last] % 3), "sphere_of_influence": np.full(n, SPHERE),
        "minimum_team_range": np.full(n, TEAM_RANGE), "minimum_nonteam_range": np.full(n, OTHER_RANGE),
        "team": team[first:last], "fov_az": np.full(n, fov[0]), "fov_el": np.full(n, fov[1]),
    }  # fmt: skip
    if quat is not None:
        own |= {f"quat_{axis}": quat[k, first:last].copy() for k, axis in enumerate("wxyz")}
    other = {
        "other_level_forward_x": np.cos(yaw), "other_level_forward_y": np.sin(yaw), "other_team": team.astype(float)
    }  # fmt: skip
    columns = tuple(index.gather(other[name]) for name in walk.other)
    sums = np.full((walk.n_out, n), np.nan)
    by_row = tuple(own[name] for name in walk.own)
    cuts = [0, b.n_blocks] if split is None else [0, b.n_blocks // 2, b.n_blocks]
    for begin, stop in itertools.pairwise(cuts):
        walk.run(
            (b.cuts, b.spans, index.order),
            (b.points, index.points),
            columns,
            by_row,
            sums,
            first,
            (begin, stop),
            b.most,
        )
    return sums


def expected_sums(s, yaw, team, row, reach, seen=None):
    near, square = s.near(row, reach)
    if seen is not None:
        near = near[[seen(s.pos[:, j] - s.pos[:, row]) for j in near]]
    offset = s.pos[:, near] - s.pos[:, [row]]
    r = np.sqrt(square[near])
    same = team[near] == team[row]
    least = np.where(same, TEAM_RANGE, OTHER_RANGE)
    amount = np.where(r > SPHERE, 0.0, np.where(r <= least, 1e10, (SPHERE - r) / (SPHERE - least)))
    push = -amount * np.divide(offset, r, out=np.zeros_like(offset), where=r > 0.0)
    return np.concatenate([
        offset[:, same].sum(1), [np.cos(yaw[near[same]]).sum(), np.sin(yaw[near[same]]).sum(), same.sum(), (~same).sum()],
        push[:, same].sum(1), push[:, ~same].sum(1),
    ])  # fmt: skip


def scene(n=300, sigma=60.0, groups=1, mixed=True, worlds=1, seed=0):
    rng = np.random.default_rng(seed)
    s = stack(
        [rng.normal(size=(3, n)) * np.array([[sigma], [sigma], [sigma / 4]]) for _ in range(worlds)], groups
    )
    team = 1 + (s.source % 7 < 3) if mixed else 1 + (s.group == groups - 1)
    return s, np.cos(s.source * 7.0) * 3.0, team.astype(np.int64)


@pytest.mark.parametrize("mixed", [False, True])
def test_sums_equal_the_formulas(mixed):
    s, yaw, team = scene(groups=2, mixed=mixed)
    sums = sums_of(s, yaw, team, spread=9.0)
    for row in range(len(s.ids)):
        reach = REACH - 9.0 * (s.source[row] % 3)
        np.testing.assert_allclose(
            sums[:, row], expected_sums(s, yaw, team, row, reach), rtol=1e-11, atol=1e-9
        )


def test_unlimited_view_is_no_limit():
    s, yaw, team = scene(n=200)
    quat = np.random.default_rng(2).normal(size=(4, 200))
    quat /= np.sqrt((quat**2).sum(0))
    full = (2 * np.pi, 2 * np.pi)
    np.testing.assert_array_equal(sums_of(s, yaw, team, quat, full), sums_of(s, yaw, team))


@pytest.mark.parametrize("fov", [(1.5, 1.0), (4.0, 2.0), (6.2, 3.0), (2 * np.pi, 0.5)])
def test_limited_view_keeps_those_inside_both_angles(fov):
    s, yaw, team = scene(n=150)
    quat = np.stack([np.cos(yaw / 2), np.zeros(150), np.zeros(150), np.sin(yaw / 2)])
    sums = sums_of(s, yaw, team, quat, fov)
    for row in range(150):

        def seen(d, angle=yaw[row]):
            east, north = (
                np.cos(angle) * d[0] + np.sin(angle) * d[1],
                np.cos(angle) * d[1] - np.sin(angle) * d[0],
            )
            azimuth, elevation = np.arctan2(north, east), np.arctan2(d[2], np.hypot(east, north))
            return (abs(azimuth) < fov[0] / 2 or fov[0] >= 2 * np.pi) and abs(elevation) < fov[1] / 2

        np.testing.assert_allclose(
            sums[:, row], expected_sums(s, yaw, team, row, REACH, seen), rtol=1e-11, atol=1e-9
        )


def test_agents_at_one_point_push_nowhere_and_give_no_nan():
    s = stack([np.zeros((3, 20))])
    sums = sums_of(s, np.zeros(20), np.ones(20, np.int64))
    assert (sums[kernels.N_TEAM] == 19.0).all()
    assert (sums[kernels.TEAM_PUSH :] == 0.0).all()


def unit(v):
    return v / np.sqrt((v**2).sum()) if (v**2).sum() > 0.0 else v


WEIGHTS = {"goal": 0.1, "team": 1.0, "other": 10.0, "centroid": 1.0, "align": 0.5}


def run_law(s, sums, goal):
    n = sums.shape[1]
    wanted = np.full((3, n), np.nan)
    weights = (np.full(n, 30.0), *(np.full(n, w) for w in WEIGHTS.values()))
    for part in ((0, n // 3), (n // 3, n)):
        kernels.law(tuple(s.pos), goal, sums, weights, wanted, part)
    return wanted


def expected_law(pos, goal, sums, align):
    toward = unit(goal - pos)
    if sums[kernels.N_TEAM] + sums[kernels.N_OTHERS] == 0:
        return toward
    terms = [toward, sums[7:10], sums[10:13], unit(sums[0:3]), align]
    weighted = [w * t for w, t in zip(WEIGHTS.values(), terms, strict=True)]
    scale = sum(np.sqrt((t**2).sum()) for t in weighted[:4]) + np.sqrt((align**2).sum())
    return 30.0 * sum(weighted) / scale


def test_law_is_the_weighted_mean_and_the_goal_when_alone():
    s, yaw, team = scene(n=203, sigma=150.0)
    s.pos[:, 0] = 1e5
    sums = sums_of(s, yaw, team)
    goal = s.pos + np.array([[1e6], [2e5], [0.0]])
    wanted = run_law(s, sums, goal)
    assert sums[kernels.N_TEAM, 0] + sums[kernels.N_OTHERS, 0] == 0
    for i in range(203):
        align = unit(np.array([*sums[3:5, i], 0.0]))
        np.testing.assert_allclose(
            wanted[:, i], expected_law(s.pos[:, i], goal[:, i], sums[:, i], align), rtol=1e-10
        )


def test_historic_means_count_everyone_and_average_yaw_as_a_number():
    s, yaw, team = scene(n=100, sigma=100.0)
    sums = sums_of(s, yaw, team)
    plain = sums.copy()
    for i in range(100):
        near, _ = s.near(i, REACH)
        sums[kernels.HEADING, i] = yaw[near[team[near] == team[i]]].sum()
    yaw_sums = sums[kernels.HEADING].copy()
    kernels.historic_means(tuple(s.pos), sums)
    counts = plain[kernels.N_TEAM] + plain[kernels.N_OTHERS]
    for i in np.flatnonzero(counts > 0):
        count = counts[i]
        centroid = (plain[:3, i] + plain[kernels.N_TEAM, i] * s.pos[:, i]) / count
        np.testing.assert_allclose(sums[:3, i], centroid - s.pos[:, i], rtol=1e-9, atol=1e-9)
        heading = yaw_sums[i] / count
        np.testing.assert_allclose(sums[3:5, i], [np.cos(heading), np.sin(heading)], atol=1e-14)


def test_outputs_follow_the_wanted_velocity():
    rng = np.random.default_rng(4)
    n = 53
    wanted, yaw, climb, z = (
        rng.normal(size=(3, n)) * 20.0,
        rng.uniform(-3, 3, n),
        rng.uniform(-1, 1, n),
        rng.normal(size=n),
    )
    quat = quat_from_euler(np.zeros(n), -climb, yaw)
    quat = tuple(2.0 * np.ascontiguousarray(part) for part in quat)  # of any length
    fast, out, results = np.full(n, 30.0), np.empty((3, n)), [np.empty(n) for _ in range(6)]
    wanted[:, 1] = 0.0
    size = np.sqrt((wanted**2).sum(0))
    kernels.velocity(wanted, fast, out)
    np.testing.assert_allclose(out, 30.0 * wanted / np.where(size > 0.0, size, 1.0), rtol=1e-14)
    kernels.historic_velocity(wanted, fast, out)
    np.testing.assert_allclose(out, wanted * np.minimum(15.0 / np.maximum(size, 1.0), 1.0), rtol=1e-14)
    for part in ((0, 7), (7, n)):
        kernels.rates(wanted, quat, fast, *results[:3], part)
    turn = np.arctan2(wanted[1], wanted[0]) - yaw
    np.testing.assert_allclose(results[1], np.arctan2(np.sin(turn), np.cos(turn)), atol=1e-14)
    np.testing.assert_allclose(results[2], np.arctan2(wanted[2], np.hypot(*wanted[:2])) - climb, atol=1e-14)
    kernels.desired(wanted, z, fast, *results[3:])
    np.testing.assert_allclose(results[3], np.arctan2(wanted[1], wanted[0]), atol=1e-15)
    np.testing.assert_array_equal(results[5], z + wanted[2])
    assert (results[0] == 30.0).all()
    assert (results[4] == 30.0).all()
