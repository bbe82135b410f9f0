"""Policies with memory are trained over whole sequences, and learn what others cannot."""

from __future__ import annotations

import numpy as np
import pytest
from leagues import WIDTH, chase_league
from needs import NEEDS
from recall import DECISIONS, Recall

from tussle import Simulation
from tussle.batch.executors import InProcess
from tussle.errors import ParameterError
from tussle.rl import Dispersal, write_policy
from tussle.rl.settings import Settings
from tussle.stock import Learned

pytest.importorskip("onnxruntime", reason="onnxruntime is not installed: pip install 'tussle[policy]'")
pytest.importorskip("onnx", reason="onnx is not installed: pip install 'tussle[policy]'")


def unit(n_in, n, value=0.0):
    """Arrays of a recurrent unit."""
    return [np.full(shape, value) for shape in ((3 * n, n_in), (3 * n, n), (3 * n,), (3 * n,))]


@pytest.mark.parametrize(
    "layers",
    [
        [unit(3, 4), (np.zeros((2, 5)), np.zeros(2))],
        [unit(3, 4)[:3]],
        [unit(3, 4)[::-1]],
        [[*unit(3, 4)[:3], np.zeros(4)]],
        [[np.zeros((4, 3)), np.zeros((4, 1)), np.zeros(4), np.zeros(4)]],
        [()],
    ],
)
def test_arrays_of_a_recurrent_unit_that_do_not_fit_are_refused(layers, tmp_path):
    with pytest.raises(
        ParameterError, match=r"write_policy: arrays of the shapes .* or the four arrays of a GRUC"
    ):
        write_policy(tmp_path / "p.onnx", layers)


def test_a_policy_with_memory_plays_in_a_league(tmp_path):
    """It drives faster with each decision, and the same beside other games."""
    layers = [unit(WIDTH, 2, 0.1), (np.ones((2, 2)), np.zeros(2))]
    write_policy(tmp_path / "kept.onnx", layers, task="test/Chase-v0")
    hashes = []
    for stack in (1, 3):
        league = chase_league(tmp_path / "kept.onnx", "rules", games=4)
        results = league.batch.play(executor=InProcess(stack))
        hashes.append(results.runs["state_hash"].to_pylist())
    assert len(hashes[0]) == 4
    assert hashes[0] == hashes[1]


# -- training -------------------------------------------------------------------------------------------------------------------------

torch = pytest.importorskip("torch", reason=NEEDS["torch"].reason)


@pytest.fixture
def trainer_of(tmp_path):
    from tussle.rl.train import Trainer

    before = torch.get_num_threads()
    yield lambda task, name="test/Recall-v0", **values: Trainer(
        task, name, tmp_path / "out", 1, Settings(**{"worlds": 2, "decisions": 8, **values})
    )
    torch.set_num_threads(before)


def train(trainer, n_updates):
    done = []
    trainer.train(1e6, lambda line: done.append(line) or len(done) == n_updates)


@pytest.mark.parametrize("memory", [0, 8])
def test_what_was_seen_is_learned_with_memory_only(memory, trainer_of):
    """Also flown from the file, and by two robots in a world, each of which has seen its own side."""
    trainer = trainer_of(
        Recall(), worlds=32, decisions=2 * DECISIONS, hidden=16, memory=memory, learning_rate=1e-2
    )
    train(trainer, 16)
    returns = trainer.evaluate()
    assert (returns == 2.0).all() if memory else abs(returns.mean()) < 0.6
    if memory:
        (robots,) = Recall.mission.blocks
        policy = Learned(policy=str(trainer.files[""]))
        mission = Recall.mission.replace(blocks=[robots.replace(autonomy=policy)], end_conditions=("none",))
        with Simulation(mission, seeds=range(1, 21)) as simulation:
            simulation.step(DECISIONS)
            drives, stands = (simulation.read(f"robot.{what}")[0] for what in ("vel", "pos"))
            np.testing.assert_array_equal(np.sign(drives[..., 0]), np.sign(stands[..., 1]))


def test_sequences_are_those_that_were_played(trainer_of):
    """Where robots are born, and episodes end, in the middle of a sequence, and where it goes on from the last one."""
    trainer = trainer_of(
        Dispersal(time_limit=20.0), "tussle/Dispersal-v0", memory=5, decisions=30, critic="central", worlds=3
    )
    (role,) = trainer.roles.values()
    for _ in range(2):
        batch = trainer.play()[0][""]
        assert batch.obs.shape[:2] == batch.log_prob.shape == (len(batch.start), 30)
        assert not batch.there.all()
        with torch.no_grad():
            found, _ = role.model.distributions(batch.obs, batch.mask, batch.start, batch.begins)
            values, _ = role.model.value(batch.seen(slice(None)), batch.start, batch.begins)
        log_prob, there = role.model.log_prob(found, batch.actions), batch.there
        torch.testing.assert_close(log_prob[there], batch.log_prob[there])
        assert (batch.begins[:, 1:] & there[:, :-1]).any()
        assert torch.isfinite(values).all()
    assert batch.start.abs().max() > 0.01
    trainer.update(role, batch, 0.0)


def test_minibatches_are_whole_sequences(trainer_of, monkeypatch):
    trainer = trainer_of(Recall(), memory=3, worlds=5, minibatch=27)
    (role,) = trainer.roles.values()
    seen, policy = [], role.model.distributions
    monkeypatch.setattr(
        role.model, "distributions", lambda obs, *a: seen.append(obs.shape) or policy(obs, *a)
    )
    batch = trainer.play()[0][""]
    seen.clear()
    trainer.update(role, batch, 0.0)
    assert seen == [(3, 8, 2), (3, 8, 2), (3, 8, 2), (1, 8, 2)] * trainer.settings.epochs


def test_training_with_memory_goes_on_and_checkpoints_of_former_versions_too(trainer_of, tmp_path):
    first = trainer_of(Recall(), memory=3)
    train(first, 1)
    second = trainer_of(Recall(), memory=3)
    second.resume()
    for one, other in zip(first.model.layers(), second.model.layers(), strict=True):
        for a, b in zip(one, other, strict=True):
            np.testing.assert_array_equal(a, b)
    assert [len(layer) for layer in second.model.layers()] == [2, 4, 2]
    with pytest.raises(ParameterError, match="resume with the same task and settings"):
        trainer_of(Recall(), memory=4).resume()
    (tmp_path / "out" / "checkpoint.pt").unlink()
    plain = trainer_of(Recall())
    train(plain, 1)
    state = torch.load(tmp_path / "out" / "checkpoint.pt", weights_only=True)
    del state["settings"]["memory"]
    torch.save(state, tmp_path / "out" / "checkpoint.pt")
    trainer_of(Recall()).resume()
