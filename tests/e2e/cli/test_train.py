"""`tussle train` trains, continues, and writes a policy that flies."""

from __future__ import annotations

import sys

import pytest
from cli_process import call
from needs import NEEDS


def test_without_torch_it_says_what_to_install(monkeypatch):
    pytest.importorskip("onnxruntime", reason="onnxruntime is not installed: pip install 'tussle[policy]'")
    monkeypatch.setitem(sys.modules, "torch", None)
    monkeypatch.delitem(sys.modules, "tussle.rl.train", raising=False)
    done = call("train", "tussle/RLSimple-v0")
    assert done.returncode != 0
    assert "pip install 'tussle[train]'" in done.stderr


def test_a_robot_learns_to_stay_near_the_origin(tmp_path, monkeypatch):
    torch = pytest.importorskip("torch", reason=NEEDS["torch"].reason)
    monkeypatch.chdir(tmp_path)
    done = call("train", "tussle/RLSimple-v1")
    assert "did you mean 'tussle/RLSimple-v0'" in done.stderr
    command = "train", "tussle/RLSimple-v0", "--out", "robot", "--worlds", 16
    done = call(*command, "--minutes", 0.25)
    assert done.returncode == 0, done.stderr
    curve = (tmp_path / "robot" / "curve.csv").read_text().splitlines()
    rewards = [float(line.split(",")[-1]) for line in curve[1:]]
    assert max(rewards[-3:]) > rewards[0] + 0.2
    assert (tmp_path / "robot" / "curve.png").read_bytes()[:4] == b"\x89PNG"
    assert "has a checkpoint; continue it with --resume" in call(*command).stderr
    before = torch.load(tmp_path / "robot" / "checkpoint.pt", weights_only=True)
    assert call(*command, "--resume", "--minutes", 0.25).returncode == 0
    after = torch.load(tmp_path / "robot" / "checkpoint.pt", weights_only=True)
    assert after["counts"][1] == before["counts"][1] + 16 * 128
    assert len(after["curve"]) == len(before["curve"]) + 1

    from tussle import Simulation
    from tussle.rl import NearOrigin
    from tussle.stock import Learned

    mission = NearOrigin().given
    policy = Learned(policy=str(tmp_path / "robot" / "policy.onnx"))
    mission = mission.replace(blocks=[mission.blocks[0].replace(autonomy=policy)])
    with Simulation(mission, seeds=range(1, 9)) as simulation:
        simulation.step(60)
        near = abs(simulation.read("robot.pos")[0][..., 0]) < 2.5
    assert near.mean() > 0.7


def test_settings_come_from_a_file_and_the_command_line(tmp_path, monkeypatch):
    pytest.importorskip("torch", reason=NEEDS["torch"].reason)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "ppo.toml").write_text(
        "worlds = 4\ndecisions = 16\nevaluate_every = 1\nevaluate_episodes = 6\n"
    )
    command = (
        "train",
        "tussle/PredatorsAndPrey-v0",
        "--out",
        "roles",
        "--settings",
        "ppo.toml",
        "--minutes",
        0.0001,
    )
    done = call(*command, "--set", "worlds=2")
    assert done.returncode == 0, done.stderr
    assert "evaluated: return" in done.stdout
    assert "95 % interval" in done.stdout
    names = {path.name for path in (tmp_path / "roles").iterdir()}
    assert names >= {"prey.onnx", "keepers.onnx", "switchers.onnx", "evaluations.csv", "curve.png"}
    assert "resume with the same task and settings" in call(*command, "--resume").stderr
    assert call(*command, "--set", "worlds=2", "--resume").returncode == 0
    (tmp_path / "ppo.toml").write_text("world = 4\n")
    done = call("train", "tussle/RLSimple-v0", "--settings", "ppo.toml")
    assert "ppo.toml: there is no setting 'world' (did you mean 'worlds'?)" in " ".join(done.stderr.split())


def test_the_curve_is_shown_in_tensorboard_and_episodes_are_recorded(tmp_path, monkeypatch):
    accumulator = "tensorboard.backend.event_processing.event_accumulator"
    read = pytest.importorskip(accumulator, reason=NEEDS["tensorboard"].reason).EventAccumulator
    monkeypatch.chdir(tmp_path)
    few = "--set", "evaluate_episodes=3", "--set", "decisions=16", "--set", "evaluate_every=1"
    command = "train", "tussle/RLSimple-v0", "--out", "robot", "--worlds", 2, *few, "--minutes", 0.0001
    done = call(*command, "--tensorboard", "--record-episodes")
    assert done.returncode == 0, done.stderr
    for name in ("best", "worst"):
        (path,) = (tmp_path / "robot").glob(f"{name}-*")
        assert f"tussle replay {path.relative_to(tmp_path)}" in " ".join(done.stderr.split())
        assert call("analyze", path).returncode == 0
    events = read(str(tmp_path / "robot" / "tensorboard")).Reload()
    curve = (tmp_path / "robot" / "curve.csv").read_text().splitlines()
    (shown,) = events.Scalars("reward_per_decision")
    assert [shown.step, shown.value] == pytest.approx([float(x) for x in curve[1].split(",")][1::3])
    assert {"evaluated", "low", "high"} <= set(events.Tags()["scalars"])
    monkeypatch.setitem(sys.modules, "torch.utils.tensorboard", None)
    assert "pip install 'tussle[tensorboard]'" in call(*command, "--resume", "--tensorboard").stderr
