"""Policies fly the other side of a task: a folder of them, and the pool of self-play."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("onnx", reason="onnx is not installed: pip install 'tussle[policy]'")
pytest.importorskip("onnxruntime", reason="onnxruntime is not installed: pip install 'tussle[policy]'")

from leagues import CHASE, WIDTH, constant

from tussle import Simulation
from tussle.errors import ParameterError
from tussle.mission.plugin_files import load_plugin_file
from tussle.rl import CaptureTheFlag, CaptureTheFlagRed, make_swarm, write_policy
from tussle.rl.flight import registered_task
from tussle.rl.opponents import PAST_EVERY, Pool, with_policy


@pytest.fixture
def chase():
    load_plugin_file(CHASE)
    return registered_task("test/Chase-v0", "the test")


def layers(speed):
    return [([[0.0] * WIDTH] * 2, [speed, 0.0])]


def speeds(task, seeds):
    """Speed of the blue side in each world [m/s]."""
    with Simulation(task.played, seeds=seeds) as simulation:
        simulation.step(3)
        return np.linalg.norm(simulation.read("blue.vel")[0], axis=-1)[:, 0]


def test_the_seed_of_a_world_draws_a_policy_of_the_folder(chase, tmp_path):
    for name, speed in (("a", -1.0), ("b", 1.0)):
        constant(tmp_path / f"{name}.onnx", speed)
    other = registered_task("test/ChaseBlue-v0", "the test")
    task = chase.replace(mission=with_policy(chase.given, "test/ChaseBlue-v0", other, tmp_path))
    together = speeds(task, range(1, 21))
    assert 4 <= (together > 10.0).sum() <= 16
    assert set(together.round(6).tolist()) == {0.0, 20.0}
    assert [float(speeds(task, [seed])[0]) for seed in (1, 2, 3)] == together[:3].tolist()
    (tmp_path / "empty").mkdir()
    with pytest.raises(ParameterError, match="the folder has no ONNX files; it takes 1 to 64"):
        speeds(
            chase.replace(mission=with_policy(chase.given, "test/ChaseBlue-v0", other, tmp_path / "empty")),
            [1],
        )


def test_a_pool_has_the_latest_policy_and_past_ones(chase, tmp_path):
    best, folder = constant(tmp_path / "best.onnx", 0.5), tmp_path / "pool"

    def pool():
        return Pool(
            "test/Chase-v0", chase, folder, ["latest=2", "past=2", f"{best}"], 1, tmp_path / "none.onnx"
        )

    made = pool()
    names = ["00-latest", "01-latest", "02-past", "03-past", "04-best"]
    assert sorted(p.stem for p in folder.iterdir()) == names
    assert (folder / "04-best.onnx").read_bytes() == best.read_bytes()
    before = (folder / "02-past.onnx").read_bytes()
    made.add(layers(1.0), 1)
    latest = (folder / "00-latest.onnx").read_bytes()
    assert latest == (folder / "01-latest.onnx").read_bytes() != before
    assert (folder / "02-past.onnx").read_bytes() == before
    made.add(layers(0.25), PAST_EVERY)
    made.add(layers(0.75), 2 * PAST_EVERY)
    kept = [(folder / f"{name}.onnx").read_bytes() for name in names]
    assert len(set(kept)) == 3  # 0.75 is the latest one and a past one, 0.25 the other past one
    pool()  # goes on
    assert [(folder / f"{name}.onnx").read_bytes() for name in names] == kept
    for n in range(3, 40):
        made.add(layers(n / 100.0), n * PAST_EVERY)
    assert sorted(p.name for p in folder.iterdir()) == [f"{name}.onnx" for name in names]
    assert (folder / "02-past.onnx").read_bytes() != kept[2]
    assert (folder / "04-best.onnx").read_bytes() == kept[4]


def test_a_swarm_meets_the_new_policy_at_once(chase, tmp_path):
    pool = Pool("test/Chase-v0", chase, tmp_path / "pool", ["latest"], 1, tmp_path / "none.onnx")
    with make_swarm(pool.task, 2) as swarm:
        swarm.reset(seed=1)
        idle = np.zeros((2, 3, 2), np.float32)
        for speed in (-1.0, 1.0):
            pool.add(layers(speed), 1)
            swarm.step(idle)
            swarm.step(idle)
            found = np.linalg.norm(swarm.simulation.read("blue.vel")[0], axis=-1)
            np.testing.assert_allclose(found, 10.0 * (speed + 1.0), atol=1e-6)


def test_wrong_pools_are_refused(chase, tmp_path):
    flee = registered_task("test/Flee-v0", "the test")
    for name, task, entries, message in (
        ("test/Chase-v0", chase, ["later"], "there is no ONNX file later; it takes latest, past"),
        ("test/Chase-v0", chase, ["latest=x"], "opponent 'latest=x' is not allowed; it takes latest"),
        ("test/Chase-v0", chase, ["latest=65"], "a pool of 65 slots is not allowed; it takes 1 to 64"),
        ("test/Chase-v0", chase, ["past=0"], "a pool of 0 slots"),
        (
            "test/Flee-v0",
            flee,
            ["latest"],
            "the other side is another one, test/Hunt-v0; give policies of that one",
        ),
        ("x", CaptureTheFlag(opponents=""), ["latest"], "x has no other side"),
    ):
        with pytest.raises(ParameterError, match=message):
            Pool(name, task, tmp_path / "pool", entries, 1, tmp_path / "none.onnx")


def test_red_sees_and_flies_the_field_reflected_in_its_centre(tmp_path):
    blue, red = CaptureTheFlag(), CaptureTheFlagRed()
    width = sum(blue.widths["blue_runners"])
    chance = np.random.default_rng(1)
    write_policy(tmp_path / "p.onnx", [(chance.normal(0.0, 0.3, (3, width)), np.zeros(3))])
    mission = with_policy(blue.given, "tussle/CaptureTheFlag-v0", blue, tmp_path / "p.onnx")
    mission = with_policy(mission, "tussle/CaptureTheFlagRed-v0", red, tmp_path / "p.onnx")
    centre = np.array([0.0, 0.0, 100.0])
    with Simulation(mission, seeds=[1, 2]) as simulation:
        for role in ("defenders", "runners"):
            pos = simulation.read(f"blue_{role}.pos")[0]
            simulation.write(f"red_{role}.pos", 2.0 * centre - pos)
            simulation.write(f"red_{role}.vel", -simulation.read(f"blue_{role}.vel")[0])
        simulation.step(4)
        for role in ("defenders", "runners"):
            (a, _), (b, _) = (simulation.read(f"{side}_{role}.pos") for side in ("blue", "red"))
            assert np.isfinite(a).all()
            np.testing.assert_allclose(a - centre, centre - b, atol=1e-3)
            vel = simulation.read(f"blue_{role}.vel")[0]
            assert np.abs(vel).max() > 1.0


def test_a_pool_of_policies_with_memory_goes_on_while_it_is_played(chase, tmp_path):
    """The first policy does nothing, and keeps as many numbers as those that replace it."""
    pool = Pool("test/Chase-v0", chase, tmp_path / "pool", ["latest"], 1, tmp_path / "none.onnx", memory=2)
    sizes = (6, WIDTH), (6, 2), (6,), (6,)
    unit = tuple(np.full(size, 3.0) for size in sizes)
    with Simulation(pool.task.played, seeds=[1]) as simulation:
        simulation.step(3)
        assert np.abs(simulation.read("blue.Learned.memory")[0]).max() == 0.0
        pool.add([unit, (np.ones((2, 2)), np.zeros(2))], 1)
        simulation.step(3)
        assert np.abs(simulation.read("blue.Learned.memory")[0]).max() > 0.0
