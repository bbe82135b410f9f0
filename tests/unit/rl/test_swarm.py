"""Arrays of many worlds: equal to single worlds, to formulas, and to themselves after a restore."""

import gc

import numpy as np
import pytest
from flee import mission

from tussle import Simulation, load_run
from tussle.errors import ParameterError
from tussle.rl import (
    Act,
    Computed,
    Each,
    Means,
    NearestOthers,
    Own,
    Sectors,
    Term,
    make_swarm,
    record_episode,
)
from tussle.stock import SimpleCapture


def play(swarm, actions, n):
    """Observations, rewards and living agents of n steps."""
    out = []
    for k in range(n):
        obs, rewards, dead, late, info = swarm.step(actions[k % len(actions)])
        out.append([a.copy() for a in (obs, rewards, dead, late, info["alive"], info["over"])])
    return out


@pytest.mark.parametrize("autoreset", ["same_step", "next_step"])
def test_a_world_does_not_depend_on_the_others(task, autoreset):
    chance = np.random.default_rng(2)
    actions = chance.uniform(-1, 1, (8, 5, 6, 2)).astype(np.float32)
    many = make_swarm(task, 5, autoreset=autoreset, threads=2)
    many.reset(seed=10)
    alone = make_swarm(task, 1, autoreset=autoreset)
    alone.reset(seed=13)
    ends = 0
    for a, b in zip(play(many, actions, 150), play(alone, actions[:, 3:4], 150), strict=True):
        for x, y in zip(a, b, strict=True):
            np.testing.assert_array_equal(x[3], y[0])
        ends += a[-1][3]
    assert ends > 1
    assert many.simulation.state_hash(3) == alone.simulation.state_hash()


def test_an_episode_begins_like_a_simulation_of_its_seed(task):
    swarm = make_swarm(task, 2)
    swarm.reset(seed=[3, 4])
    for _ in range(70):
        swarm.step(np.zeros((2, 6, 2), np.float32))
    assert swarm.seeds[1] != 4
    same = Simulation(task.played, int(swarm.seeds[1]))
    swarm.reset([int(swarm.seeds[1])], [1])
    assert swarm.simulation.state_hash(1) == same.state_hash()
    with pytest.raises(ParameterError, match="seed = -1"):
        swarm.reset(seed=-1)
    with pytest.raises(ParameterError, match="worlds"):
        swarm.reset(worlds=[5])


def test_restore_repeats_the_game(task):
    swarm = make_swarm(task, 3)
    swarm.reset(seed=1)
    actions = np.random.default_rng(3).uniform(-1, 1, (7, 3, 6, 2)).astype(np.float32)
    play(swarm, actions, 40)
    saved = swarm.state()
    first = play(swarm, actions, 60)
    swarm.restore(saved)
    for a, b in zip(first, play(swarm, actions, 60), strict=True):
        for x, y in zip(a, b, strict=True):
            np.testing.assert_array_equal(x, y)


def looked_up(swarm):
    """Positions and velocities, (n, 3), and teams of all entities of world 0, agents first."""
    read = swarm.simulation.read
    pos, vel = (np.concatenate([read(f"{b}.{k}")[0][0] for b in ("prey", "hunters")]) for k in ("pos", "vel"))
    return pos, vel, np.array([1] * 6 + [2] * 2)


def turned(vectors, yaw):
    """Vectors, (m, 3), in a frame turned by the heading."""
    c, s = np.cos(yaw), np.sin(yaw)
    return vectors @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]).T


def test_observations_are_what_they_say(task):
    components = (
        Own("vel", scale=2.0, frame="heading"),
        Own("pos forward Unicycle.x", origin=(5.0, 0.0, 1.0)),
        NearestOthers(3, "offset relative_vel vel distance same_team present", radius=50.0),
        NearestOthers(2, "offset health", of="other", frame="world", planar=True),
        Sectors(8, 80.0),
        Means(60.0, "offset", of="own", frame="world", count_scale=4),
        Each("hunters prey", "offset", frame="body"),
        Computed(1, lambda simulation: simulation.read("prey.yaw")[0][..., None]),
    )
    swarm = make_swarm(task.replace(observation=components, dtype=np.float64), 2)
    swarm.reset(seed=3)
    play(swarm, np.random.default_rng(1).uniform(-1, 1, (5, 2, 6, 2)), 5)
    assert swarm.alive[0].all()
    pos, vel, team = looked_up(swarm)
    yaw = swarm.simulation.read("prey.yaw")[0][0]
    forward = swarm.simulation.read("prey.forward")[0][0]
    quat = swarm.simulation.read("prey.quat")[0][0]
    x = swarm.simulation.read("prey.Unicycle.x")[0][0]
    for a in range(6):
        offset, relative = pos - pos[a], vel - vel[a]
        distance = np.linalg.norm(offset, axis=1)
        others = [o for o in np.argsort(distance) if o != a]
        want = [*turned(vel[a] / 2.0, yaw[a]), *(pos[a] - (5, 0, 1)), *forward[a], *x[a]]
        for o in others[:3]:
            if distance[o] < 50.0:
                vectors = turned(np.stack([offset[o], relative[o], vel[o]]), yaw[a])
                want += [*vectors.ravel(), distance[o], float(team[o] == 1), 1.0]
            else:
                want += [0.0] * 12
        for o in [o for o in others if team[o] == 2][:2]:
            want += [*offset[o, :2], 1.0]
        ring = np.zeros(8)
        for o in others:
            ahead, left, _ = turned(offset[o][None], yaw[a])[0]
            s = int(np.floor(np.arctan2(left, ahead) / (2 * np.pi) * 8 + 0.5)) % 8
            ring[s] = max(ring[s], 1.0 - distance[o] / 80.0)
        mates = [o for o in others if team[o] == 1 and distance[o] < 60.0]
        want += [*ring, len(mates) / 4, *(offset[mates].mean(axis=0) if mates else np.zeros(3))]
        w, i, j, k = quat[a]
        body = np.array(
            [
                [1 - 2 * (j * j + k * k), 2 * (i * j + w * k), 2 * (i * k - w * j)],
                [2 * (i * j - w * k), 1 - 2 * (i * i + k * k), 2 * (j * k + w * i)],
                [2 * (i * k + w * j), 2 * (j * k - w * i), 1 - 2 * (i * i + j * j)],
            ]
        )
        for o in (6, 7, *range(6)):
            want += [] if o == a else [*(body @ offset[o])]
        np.testing.assert_allclose(swarm.obs[0, a], [*want, yaw[a]], atol=1e-9)


def test_the_dead_have_zeros_and_rewards_come_in_terms(task):
    def caught(now):
        return now.count("death", text="captured")

    terms = {**task.reward, "team": Term(caught, -2.0, per="team")}
    swarm = make_swarm(task.replace(reward=terms), 4, autoreset="disabled")
    swarm.reset(seed=1)
    n_dead, before = 0, swarm.alive.copy()
    for _ in range(59):
        _, rewards, dead, _, info = swarm.step(np.full((4, 6, 2), -1, np.float32))
        np.testing.assert_array_equal(dead, before & ~swarm.alive)
        np.testing.assert_array_equal(info["terms"]["captured"], -1.0 * dead)
        np.testing.assert_array_equal(info["terms"]["team"], -2.0 * dead.sum(axis=1, keepdims=True) * before)
        np.testing.assert_allclose(info["terms"]["alive"], 0.1 * (swarm.alive & before), rtol=1e-6)
        np.testing.assert_allclose(rewards, sum(info["terms"].values()), rtol=1e-6)
        assert not swarm.obs[~swarm.alive].any()
        n_dead += dead.sum()
        before = swarm.alive.copy()
    assert n_dead > 2


def test_an_action_can_set_a_parameter_of_an_autonomy(task):
    tuned = task.replace(action=[Act("Boids.max_speed", levels=[5.0, 15.0])])
    swarm = make_swarm(tuned, 1, autoreset="disabled")
    swarm.reset(seed=1)
    levels = np.array([[0, 1, 0, 1, 0, 1]])
    for _ in range(5):
        swarm.step(levels)
    speed = np.linalg.norm(swarm.simulation.read("prey.vel")[0][0], axis=1)
    np.testing.assert_allclose(speed, [5, 15, 5, 15, 5, 15], rtol=0.01)
    with pytest.raises(ParameterError, match="prey_2 in world 0 is"):
        swarm.step(levels * 0 + np.array([0, 0, 2, 0, 0, 0]))


def test_each_episode_draws_its_variables(task):
    harmless = mission(interactions=[SimpleCapture(capture_range=0)])
    varied = task.replace(mission=harmless, vary=["prey.Unicycle.vel_max=10:20"], decide_every=2)
    swarm = make_swarm(varied, 40)
    swarm.reset(seed=1)
    first = swarm.simulation.read("prey.Unicycle.vel_max")[0]
    assert (first == first[:, :1]).all()
    assert 10 <= first.min() < 11 < 19 < first.max() <= 20
    for _ in range(30):
        swarm.step(np.zeros((40, 6, 2), np.float32))
    assert swarm.over.all()
    assert (swarm.lengths == 30).all()
    second = swarm.simulation.read("prey.Unicycle.vel_max")[0]
    assert (second != first).all()
    swarm.reset(seed=1)
    np.testing.assert_array_equal(swarm.simulation.read("prey.Unicycle.vel_max")[0], first)


def test_memory_is_flat_over_many_resets(task):
    swarm = make_swarm(task, 4)
    swarm.reset(seed=1)
    counts = []
    for _ in range(3):
        for _ in range(40):
            swarm.reset()
            swarm.step(np.zeros((4, 6, 2), np.float32))
        gc.collect()
        counts.append(len(gc.get_objects()))
    assert counts[2] - counts[1] < 40
    swarm.close()
    assert swarm.simulation.is_closed


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"learners": "pray"}, "no block 'pray'.*'prey'"),
        ({"action": [Act("speeed", 0, 1)]}, "no channel 'speeed'.*'speed'"),
        ({"action": [Act("Boids.gian", 0, 1)]}, "no parameter 'gian'"),
        ({"action": [Act("speed", 1.0, 1.0)]}, "low and high that differ"),
        (
            {"action": [Act("speed", 0, 1), Act("turn_rate", levels=[0, 1])]},
            "all are ranges, or all have levels",
        ),
        ({"observation": [Own("velocity")]}, "Own has no 'velocity'"),
        ({"observation": [NearestOthers(0)]}, "k = 0"),
        ({"observation": [Sectors(4, np.inf)]}, "radius = inf"),
        ({"observation": ["vel"]}, "is no Component"),
        ({"reward": {"alive": 1.0}}, "reward of 'alive' = 1.0 is not allowed; it takes a Term"),
        ({"decide_every": 0}, "decide_every = 0"),
        ({"frame_skip": 2}, "no 'frame_skip'"),
        ({"decide_every": "2"}, "decide_every = '2' is not allowed; it takes a whole number"),
        ({"time_limit": "60 s"}, "time_limit = '60 s' is not allowed; it takes a number or None"),
        ({"learners": ["prey"]}, r"learners = \['prey'\] is not allowed; it takes a text"),
        ({"reward": None}, "reward = None is not allowed; it takes values by name"),
        ({"room": 20}, "room = 20 is not allowed; it takes values by name"),
        ({"room": {"prey": -1}}, "room of 'prey' = -1 is not allowed; it takes a whole number >= 0"),
        ({"room": {"pray": 9}}, r"room: there is no block 'pray' \(did you mean 'prey'\?\)"),
        ({"policies": {"prey": 3}}, "policies of 'prey' = 3 is not allowed; it takes a text"),
        ({"overrides": ["prey.count=3"]}, "overrides = .* it takes values by name"),
        ({"observation": [NearestOthers(2.5)]}, "NearestOthers: k = 2.5 is not allowed"),
        ({"observation": [Sectors("4", 9.0)]}, "Sectors: n = '4' is not allowed"),
        ({"action": [Act("speed", "0", "9")]}, "Act: low = '0' is not allowed; it takes a number or None"),
        (
            {"action": [Act("speed", levels=[1.0, np.nan])]},
            r"Act\('speed'\): nan is not allowed; it takes finite numbers",
        ),
        ({"action": [Act("speed", levels=["a", "b"])]}, r"Act\('speed'\): 'a' is not allowed"),
        (
            {"action": [Act("speed", value=np.inf), Act("turn_rate", 0, 1)]},
            r"Act\('speed'\): inf is not allowed",
        ),
        ({"action": [Act(3, 0, 1)]}, "Act: target = 3 is not allowed; it takes a text"),
    ],
)
def test_wrong_declarations_are_refused(task, values, message):
    with pytest.raises(ParameterError, match=message):
        make_swarm(task.replace(**values))


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ((3,), "Term: function = 3 is not allowed; it takes a function"),
        ((abs, "1"), "Term: weight = '1' is not allowed; it takes a number"),
        ((abs, None), "Term: weight = None is not allowed"),
        ((abs, np.nan), "Term: weight = nan is not allowed"),
    ],
)
def test_wrong_terms_are_refused(values, message):
    with pytest.raises(ParameterError, match=message):
        Term(*values)


def test_tasks_end_by_their_own_rule(task):
    class Short(type(task)):
        def ends(self, now):
            return now.pos[..., 0].max(axis=1) > 55.0

    swarm = make_swarm(Short, 3, autoreset="disabled")
    swarm.reset(seed=1)
    while not swarm.over.any():
        swarm.step(np.ones((3, 6, 2), np.float32))
    east = np.nanmax(swarm.simulation.read("prey.pos")[0][..., 0], axis=1)
    np.testing.assert_array_equal(swarm.over, east > 55.0)
    assert (swarm.terminations.all(axis=1) == swarm.over).all()
    assert not swarm.truncations.any()

    class Wrong(type(task)):
        def ends(self, now):
            return now.alive

    bad = make_swarm(Wrong)
    bad.reset(seed=1)
    with pytest.raises(
        ParameterError,
        match=r"Wrong.ends returns bool of shape \(1, 6\); it returns truth values, \(1,\), one per world",
    ):
        bad.step(np.ones((1, 6, 2), np.float32))


def test_an_episode_is_recorded_as_a_run(task, tmp_path):
    swarm = make_swarm(task, 1, autoreset="disabled")
    obs = swarm.reset(seed=9)
    total = 0.0
    while not swarm.over[0]:
        obs, rewards, *_ = swarm.step(np.sin(obs[..., :2]))
        total += rewards.sum(dtype=float)
    sums = record_episode(task, lambda seen: np.sin(seen[..., :2]), tmp_path / "run", seed=9)
    assert sums["alive"] + sums["captured"] == pytest.approx(total, rel=1e-5)
    run = load_run(tmp_path / "run")
    last = run.trajectory[run.trajectory["step"] == run.trajectory["step"].max()]
    assert 0 < len(last) <= 8
    recorded = run.trajectory["step"].max()
    assert recorded in (swarm.lengths[0] - 1, swarm.lengths[0])


def test_other_libraries_share_the_memory(task):
    swarm = make_swarm(task, 2)
    obs = swarm.reset(seed=1)
    shared = np.from_dlpack(obs)
    swarm.step(np.zeros((2, 6, 2), np.float32))
    assert np.shares_memory(shared, swarm.obs)
    np.testing.assert_array_equal(shared, swarm.obs)
