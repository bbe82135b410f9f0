"""Training: roles, masks, critics that see the world, settings and evaluations."""

from __future__ import annotations

import csv
from dataclasses import asdict

import numpy as np
import pytest
from flee import Flee
from needs import NEEDS

from tussle import Simulation, load_run
from tussle.errors import ParameterError, RecordError
from tussle.rl import (
    Computed,
    Dispersal,
    NearOrigin,
    Own,
    PredatorsAndPrey,
    PreyEscape,
    Term,
    alive,
    register,
)
from tussle.rl.evaluation import FIRST_SEED, record_extremes
from tussle.rl.settings import Settings, read_training
from tussle.stock import Learned

# -- settings -------------------------------------------------------------------------------------------------------------------------


def test_settings_are_read_from_files_and_texts(tmp_path):
    file = tmp_path / "ppo.toml"
    file.write_text("learning_rate = 3e-4\nworlds = 4\ncritic = 'central'\n")
    settings = Settings().replaced(read_training(file), str(file)).replaced({"worlds": "8"}, "--set")
    assert settings == Settings(learning_rate=3e-4, worlds=8, critic="central")
    assert Settings().replaced(asdict(settings), "again") == settings


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"learning_rat": 1.0}, r"there is no setting 'learning_rat' \(did you mean 'learning_rate'\?\)"),
        ({"worlds": 2.5}, "worlds = 2.5 is not allowed; it takes a whole number"),
        ({"worlds": "many"}, "worlds = 'many' is not allowed; it takes a whole number"),
        ({"clip": True}, "clip = True is not allowed; it takes a number"),
        ({"memory": -1}, "memory = -1 is not allowed; it takes a number from 0"),
        ({"worlds": 0}, "worlds = 0 is not allowed; it takes a number from 1"),
        ({"discount": 1.5}, "discount = 1.5 is not allowed; it takes a number from 0 to 1"),
        ({"learning_rate": "nan"}, "learning_rate = nan is not allowed"),
        ({"critic": "centre"}, "critic = 'centre' is not allowed"),
        ({"hidden": [3]}, r"hidden = \[3\] is not allowed"),
    ],
)
def test_settings_that_cannot_be_are_refused(values, message):
    with pytest.raises(ParameterError, match=f"^here: {message}"):
        Settings().replaced(values, "here")


def test_files_of_settings_that_cannot_be_read_are_refused(tmp_path):
    file = tmp_path / "ppo.toml"
    for text in ("worlds = ", "a = " + "[" * 100_000):
        file.write_text(text)
        with pytest.raises(ParameterError, match=r"ppo\.toml: "):
            read_training(file)
    with pytest.raises(ParameterError, match=r"none\.toml"):
        read_training(tmp_path / "none.toml")


# -- trainers -------------------------------------------------------------------------------------------------------------------------

torch = pytest.importorskip("torch", reason=NEEDS["torch"].reason)


@pytest.fixture
def trainer_of(tmp_path):
    from tussle.rl.train import Trainer

    before = torch.get_num_threads()
    yield lambda task, name="mine", **values: Trainer(
        task, name, tmp_path / "out", 1, Settings(**{"worlds": 2, "decisions": 8, **values})
    )
    torch.set_num_threads(before)


def test_training_shows_a_bar_in_a_notebook(trainer_of, monkeypatch):
    shown = []
    monkeypatch.setattr("tussle.notebook_bar.MIN_DURATION", 0.0)
    monkeypatch.setattr(
        "tussle.notebook_bar._publisher", lambda: lambda data, **_: shown.append(data["text/plain"])
    )
    trainer_of(PredatorsAndPrey(time_limit=3.0)).train(1e-9, lambda line: False)
    assert any(text.startswith("training: ") and "min, return" in text for text in shown)
    assert shown[-1] == ""


def test_each_role_has_a_policy_that_flies(trainer_of):
    trainer = trainer_of(PredatorsAndPrey(time_limit=20.0), "tussle/PredatorsAndPrey-v0")
    assert list(trainer.roles) == ["prey", "keepers", "switchers"]
    before = {name: role.model.layers()[0][0].copy() for name, role in trainer.roles.items()}
    trainer.train(1e-9, lambda line: False)
    for name, role in trainer.roles.items():
        assert (role.model.layers()[0][0] != before[name]).any()
    with pytest.raises(ParameterError, match="has several policies"):
        _ = trainer.model
    task = PredatorsAndPrey()
    fly = {name: Learned(policy=str(path), block=name) for name, path in trainer.files.items()}
    blocks = [b.replace(autonomy=fly[b.name]) for b in task.given.blocks]
    with Simulation(task.given.replace(blocks=blocks), seeds=[1]) as simulation:
        simulation.step(3)
        for name in fly:
            assert np.isfinite(simulation.read(f"{name}.pos")[0]).any()


def test_a_role_sees_its_own_columns_and_sets_its_own_actions(trainer_of, monkeypatch):
    """Of a task of one's own: two roles that observe and decide in different forms."""

    class Both(Flee):
        learners = "prey hunters"
        observation = {"prey": Own("vel pos"), "hunters": Own("pos")}  # noqa: RUF012
        action = {"prey": Flee.action, "hunters": Flee.action[:1]}  # noqa: RUF012

    trainer = trainer_of(Both())
    seen = []
    step = trainer.swarm.step
    monkeypatch.setattr(trainer.swarm, "step", lambda actions: seen.append(actions.copy()) or step(actions))
    batches, _, _ = trainer.play()
    assert {name: batch.obs.shape[1] for name, batch in batches.items()} == {"prey": 6, "hunters": 3}
    assert {name: batch.actions.shape[1] for name, batch in batches.items()} == {"prey": 2, "hunters": 1}
    assert all((actions[:, 6:, 1] == 0.0).all() and (actions[:, 6:, 0] != 0.0).all() for actions in seen)
    first = batches["hunters"].actions[:4].numpy().reshape(2, 2, 1)
    np.testing.assert_array_equal(seen[0][:, 6:, :1], first)


def test_levels_that_are_masked_are_not_drawn(trainer_of, monkeypatch):
    trainer = trainer_of(Dispersal(time_limit=30.0), critic="central", decisions=40)
    drawn = []
    step, swarm = trainer.swarm.step, trainer.swarm

    def checked(actions):
        drawn.append(np.take_along_axis(swarm.masks, actions, axis=2)[swarm.alive].all())
        return step(actions)

    monkeypatch.setattr(swarm, "step", checked)
    batch = trainer.play()[0][""]
    assert len(drawn) == 40
    assert all(drawn)
    assert batch.seen(torch.arange(5)).shape == (5, 14 + 36)
    assert not batch.mask.all()
    np.testing.assert_array_equal(batch.states[batch.place].sum(1) <= 20, True)
    trainer.update(trainer.roles[""], batch, 0.0)


def test_a_central_critic_sees_the_world_of_its_agent(trainer_of):
    def number(simulation):
        return np.arange(1.0, simulation.n_worlds + 1.0)[:, None]

    own = Computed(1, lambda simulation: np.repeat(number(simulation)[:, None], 6, axis=1))
    trainer = trainer_of(Flee(state=Computed(1, number), observation=own), worlds=3, critic="central")
    batch = trainer.play()[0][""]
    seen = batch.seen(slice(None))
    np.testing.assert_array_equal(seen[:, 0], seen[:, 1])
    assert set(seen[:, 0].tolist()) == {1.0, 2.0, 3.0}
    with_roles = trainer_of(PredatorsAndPrey(time_limit=3.0), critic="central")
    for role, part in with_roles.play()[0].items():
        assert (
            part.seen(slice(None)).shape[1] == part.obs.shape[1] + with_roles.swarm.central_state.shape[1]
        ), role


def test_evaluations_have_intervals_and_do_not_change_the_training(trainer_of, tmp_path):
    register("mine/Near-v0", NearOrigin)
    lines = []
    trainer = trainer_of(NearOrigin(), "mine/Near-v0", evaluate_every=2, evaluate_episodes=30)
    trainer.train(10.0, lambda line: lines.append(line) or len(lines) == 6)
    weights = trainer.model.layers()[0][0].copy()
    told = [line for line in lines if "evaluated" in line]
    assert len(told) == 3
    with (tmp_path / "out" / "evaluations.csv").open() as file:
        table = list(csv.DictReader(file))
    returns = trainer.evaluate()
    assert len(returns) == 30
    assert float(table[-1]["episode_return"]) == pytest.approx(returns.mean())
    half = 2.0452 * returns.std(ddof=1) / 30**0.5
    assert float(table[-1]["low"]) == pytest.approx(returns.mean() - half, abs=1e-3)
    assert told[-1]["high"] == float(table[-1]["high"])
    n = []
    plain = trainer_of(NearOrigin(), "mine/Near-v0")
    plain.settings = Settings(worlds=2, decisions=8)
    plain.train(10.0, lambda line: n.append(line) or len(n) == 6)
    np.testing.assert_allclose(plain.model.layers()[0][0], weights, atol=1e-4)


@pytest.mark.parametrize("memory", [0, 5])
@pytest.mark.parametrize("task", [PreyEscape(time_limit=4.0), Dispersal(time_limit=20.0)])
def test_the_best_and_the_worst_episode_are_those_of_the_evaluation(task, memory, trainer_of, tmp_path):
    """To the last bit, though they are played alone: with actions in ranges, and with levels and masks, where all games are alike."""
    trainer = trainer_of(task, evaluate_episodes=7, memory=memory)
    trainer.train(1e-9, lambda line: False)
    returns = trainer.evaluate()
    assert len(set(returns)) == (1 if task.has_mask else 7)
    found = record_extremes(task, trainer.decide, returns, tmp_path, "5")
    assert found == {tmp_path / "best-5": returns.max(), tmp_path / "worst-5": returns.min()}
    assert load_run(tmp_path / "best-5").summary["seed"][0] - FIRST_SEED == returns.argmax()
    with pytest.raises(RecordError, match="best-5"):
        record_extremes(task, trainer.decide, returns, tmp_path, "5")


@pytest.mark.parametrize("content", [b"", b"hello", b"PK\x03\x04"])
def test_a_damaged_checkpoint_is_refused(content, trainer_of, tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "checkpoint.pt").write_bytes(content)
    with pytest.raises(
        ParameterError, match=r"checkpoint.pt is damaged or no checkpoint; remove it, and train"
    ):
        trainer_of(NearOrigin()).resume()


@pytest.mark.parametrize(
    ("values", "what"),
    [
        ({"observation": Own("pos", scale=1e-45)}, "an observation"),
        ({"reward": {"huge": Term(alive, 1e30)}}, "the loss"),
    ],
)
def test_numbers_that_are_not_finite_are_not_learned(values, what, trainer_of, tmp_path):
    trainer = trainer_of(Flee(**values))
    with pytest.raises(
        ParameterError, match=f"^{what} is not a finite number of single precision; scale obs"
    ):
        trainer.train(1e-9, lambda line: False)
    assert not list((tmp_path / "out").iterdir())
    assert all(torch.isfinite(each).all() for each in trainer.model.parameters)


@pytest.mark.parametrize("rate", [1e30, np.inf])
def test_weights_that_are_not_finite_are_told_as_steps_that_are_too_large(rate, trainer_of):
    with pytest.raises(ParameterError, match=r"^a weight is not a finite number.*lower learning_rate"):
        trainer_of(Flee(), learning_rate=rate).train(1e-9, lambda line: False)


def test_a_folder_that_cannot_be_written_is_told_before_the_training(trainer_of, tmp_path):
    (tmp_path / "out").write_text("")
    with pytest.raises(RecordError, match="out: cannot be written: File exists"):
        trainer_of(NearOrigin()).train(1e-9, lambda line: pytest.fail("it has been trained"))


def test_training_goes_on_from_a_checkpoint_of_all_roles(trainer_of):
    task = PredatorsAndPrey(time_limit=10.0)
    first = trainer_of(task)
    first.train(1e-9, lambda line: False)
    second = trainer_of(task)
    second.resume()
    for name, role in second.roles.items():
        np.testing.assert_array_equal(role.model.layers()[0][0], first.roles[name].model.layers()[0][0])
    assert second.n_decisions == first.n_decisions
