"""Why a game failed: causes that were planted are named, and no others."""

from __future__ import annotations

import json

import numpy as np
import pytest

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, Field, Interaction, Message, Output, Param, Publish, State, Subscribe
from tussle.errors import ParameterError
from tussle.mission import read_mission
from tussle.stock import ActuatorFault, FailingRadio, RandomAttrit, SingleIntegrator, Still
from tussle.stress import RecordedMonitor, Stress
from tussle.view import Recording


class Cruise(Autonomy):
    """Flies at a constant speed, in gusts."""

    grade = "portable"
    speed = Param(0.0, unit="m/s")
    gust = Param(0.0, unit="m/s")
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def step(self, g):
        self.velocity[1] = self.speed
        self.velocity[0] = self.gust * g.normal("gust")


def flight(name, y, speed=0.0, gust=0.0, count=1, **more):
    """Entities at one place."""
    pilot, place = Cruise(speed=speed, gust=gust), {"position": (0, y, 0), "variance": (0, 0, 0)}
    return Block(name=name, count=count, autonomy=pilot, motion=SingleIntegrator(), **place, **more)


def explained(mission, text, games=400, **how):
    """The answer for the worst of some games."""
    study = Stress(mission, text)
    worst = study.sample(games, processes=1).failures[0]
    return study, study.why(worst, **{"processes": 1, **how})


def row(why, kind, name, at=0):
    """One of the rows of a thing."""
    return [each for each in why.rows if (each.kind, each.name) == (kind, name)][at]


GUSTY = "always (max_distance(left, point 0 0 0) < 1 m)"


def gusty():
    """One drone in gusts that fail seldom, one in gusts that do not matter, and one without."""
    blocks = [flight("left", 0.0, gust=1.2), flight("crowd", 50.0, gust=3.0, count=3), flight("calm", 90.0)]
    return Mission(blocks=blocks, end=3, dt=0.1)


def test_the_gusts_of_one_drone():
    study, why = explained(gusty(), GUSTY)
    assert set(why.causes) == {"luck left", "luck left//Cruise/gust"}
    assert why.needed == ["left"]
    assert (row(why, "luck", "crowd").n_failed, row(why, "luck", "calm").n_failed) == (50, 50)
    assert min(row(why, "entity", "crowd").n_failed, row(why, "entity", "calm").n_failed) > 42
    assert not [
        each for each in why.rows if each.name.startswith("crowd/") and each.name[6].isdigit()
    ]  # a block that does not matter
    assert all(each.low <= each.value <= each.high for each in why.rows)
    assert why.open_step < why.lost_step
    again = study.why(why.failed, stack=3, processes=1)
    assert again.entry() == why.entry()


def test_the_nearest_passing_game_is_a_mission(tmp_path):
    study = Stress(gusty(), GUSTY)
    worst = study.sample(400, directory=tmp_path, processes=1).failures[0]
    why = study.why(worst, directory=tmp_path, processes=1)
    result = json.loads((tmp_path / "result.json").read_text())
    assert result["why"]["saved"] == "failures/0-saved.xml"
    assert result["why"]["rows"] == [vars(each) for each in why.rows]
    assert not why.saved.verdict.has_failed
    failed, saved = (
        Simulation(loaded.mission, loaded.seed)
        for loaded in (
            read_mission(tmp_path / "failures" / name, plugin_files=[__file__])
            for name in ("0.xml", "0-saved.xml")
        )
    )
    monitor = study.watching(saved)
    for sim in (failed, saved):
        sim.step(why.saved_step)
    assert failed.state_hash() == saved.state_hash()
    assert (failed.run()[0].state_hash, saved.run()[0].state_hash) == (worst.state_hash, why.saved.state_hash)
    assert monitor.robustness()[0] >= 0.0
    text = (tmp_path / "result.json").read_text()
    n_games = (tmp_path / "games.jsonl").read_text().count("\n")
    (tmp_path / "games.jsonl").write_text(
        "\n".join((tmp_path / "games.jsonl").read_text().splitlines()[:700])[:-9]
    )
    again = Stress(gusty(), GUSTY)
    worst = again.sample(400, directory=tmp_path, processes=1).failures[0]
    assert again.why(worst, directory=tmp_path, processes=1).entry() == why.entry()
    assert (tmp_path / "result.json").read_text() == text
    assert (tmp_path / "games.jsonl").read_text().count("\n") == n_games


def test_both_games_are_recorded_with_what_the_specification_reads(tmp_path, monkeypatch):
    text = "always (max(left.Cruise.velocity) < 3.5)"
    for folder, most, stride in (("all", 2_000_000, 1), ("some", 60, 3)):
        monkeypatch.setattr("tussle.stress.results.MAX_STATES", most)
        study = Stress(gusty(), text)
        for games in (100, 200):  # the second study finds the recordings of the first
            worst = study.sample(games, directory=tmp_path / folder, processes=1).failures[0]
            why = study.why(worst, moments=2, branches=10, directory=tmp_path / folder, processes=1)
        for name, game in (("0", why.failed), ("0-saved", why.saved)):
            run = Recording(tmp_path / folder / "failures" / name, plugin_files=(__file__,))
            assert run.run.info["worlds"][0]["state_hash"] == game.state_hash
            assert list(np.diff(run.steps)) == [stride] * (30 // stride)
            known, _, robustness = RecordedMonitor(text, run).progress(0)
            assert len(known) == 31
            if stride == 1:
                assert robustness == game.verdict.robustness


def test_a_motor_that_is_stuck_at_a_known_time():
    """Nothing is random: no luck undoes it, no branch passes, and it was lost from the beginning."""
    stuck = ActuatorFault(start_after=1.0)
    harmless = ActuatorFault(fault="bias", value=0.01, name="Harmless")
    blocks = [
        flight("left", 0.0, -1.0, controller=stuck),
        flight("right", 5.0, -1.0),
        flight("far", 500.0, controller=harmless),
    ]
    _, why = explained(
        Mission(blocks=blocks, end=8, dt=0.1), "always (distance(left, right) > 1 m)", 1, branches=20
    )
    assert why.causes == ["plugin left.ActuatorFault"]
    assert row(why, "plugin", "far.Harmless").n_failed == 20
    assert (why.open_step, why.lost_step, why.saved, why.saved_step) == (None, 0, None, None)
    assert why.needed == ["left", "right"]


class Kicks(Interaction):
    """Kicks entities at random, each by itself."""

    grade = "portable"
    chance = Param(0.004)

    def step(self, w):
        lot = w.uniform_by("lot", w.world, w.id, np.zeros(w.n, np.int64))
        rows = np.flatnonzero(lot < self.chance[w.world])
        w.move(rows, pos=w.pos[:, rows] + np.array([[0.0], [0.0], [30.0]]))


def test_an_interaction_that_befalls_one_entity_of_a_block():
    """A cause of another kind: draws of the world, keyed by the entity."""
    swarm = flight("swarm", 0.0, count=4).replace(variance=(9, 9, 0))
    mission = Mission(blocks=[swarm, flight("far", 900.0)], interactions=[Kicks()], end=3, dt=0.1)
    _, why = explained(mission, "always (max_distance(swarm, point 0 0 0) < 25 m)", 30)
    causes = set(why.causes)
    who = {name for name in causes if name.startswith("luck swarm/")}
    assert len(who) == 1
    assert causes == {"luck swarm", *who, "luck Kicks///lot", "plugin Kicks"}
    assert why.needed == ["swarm", *(name.removeprefix("luck ") for name in who)]


class Stop(Message):
    """Stop."""

    number = Field(dtype=int)


class Tower(Autonomy):
    """Orders all to stop, once."""

    grade = "portable"
    orders = Publish(Stop, network="FailingRadio")

    def step(self, g):
        rows = np.flatnonzero(g.step_count == 10)
        self.orders.publish(rows, number=np.zeros(len(rows), np.int64))


class Obey(Autonomy):
    """Flies until it is told to stop."""

    grade = "portable"
    has_heard = State(dtype=bool)
    heard = Subscribe(Stop, network="FailingRadio")
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def step(self, g):
        rows, _ = self.heard.pairs()
        self.has_heard[rows] = True
        self.velocity[1] = np.where(self.has_heard, 0.0, 1.0)


def test_a_message_that_was_lost():
    blocks = [
        Block(name="tower", position=(0, -9, 0), autonomy=Tower(), motion=Still()),
        Block(name="drone", autonomy=Obey(), motion=SingleIntegrator()),
    ]
    radio = FailingRadio(failure_rate=0.05, outage=1.0)
    mission = Mission(blocks=blocks, networks=[radio], end=6, dt=0.1)
    _, why = explained(mission, "always (max_distance(drone, point 0 0 0) < 4 m)", 60)
    assert "messages FailingRadio reach all" in why.causes
    assert row(why, "messages", "FailingRadio reach none").n_failed == 50
    luck = [name for name in why.causes if name.startswith("luck")]
    assert "luck FailingRadio///outage" in luck
    assert len(luck) == 2  # and that of whose radio was out
    assert why.open_step <= 10 < why.lost_step
    assert why.saved_step <= 10


def test_losses_of_a_team():
    blocks = [flight("swarm", 0.0, count=5), flight("far", 99.0)]
    blocks = [b.replace(team=1 if b.name == "swarm" else 2) for b in blocks]
    losses = [RandomAttrit(team=1, start_after=1.0, duration=20.0, leave_alive=())]
    mission = Mission(blocks=blocks, interactions=losses, end=12, dt=0.1)
    _, why = explained(mission, "always (count(team 1) > 3.5)", 1, branches=20)
    assert why.causes == ["plugin RandomAttrit"]
    assert row(why, "luck", "RandomAttrit///lot").n_failed == 20


class Needs(Interaction):
    """Fails with an error, sometimes, where a block is missing; looks on otherwise."""

    grade = "portable"

    def step(self, w):
        is_short = np.bincount(w.world, minlength=w.n_worlds) < 5
        if (is_short & (w.t > 2.5) & (w.uniform("trouble") > 0.99)).any():
            raise ValueError("an entity is missing")


def test_what_ends_with_an_error_has_no_row():
    mission = gusty().replace(interactions=[Needs()], end=4)
    study = Stress(mission, GUSTY)
    played = study.sample(600, processes=1).games
    early = next(p for p in played if p.verdict.has_failed and p.verdict.first_below(0.0) < 20)
    why = study.why(early, branches=20, processes=1)
    assert not [each for each in why.rows if (each.kind, each.name) == ("entity", "crowd")]
    assert row(why, "plugin", "Needs").n_failed >= 17
    assert "luck left" in why.causes


def test_what_is_not_explained():
    study = Stress(gusty(), GUSTY)
    good = next(p for p in study.sample(5, processes=1).games if not p.verdict.has_failed)
    with pytest.raises(ParameterError, match="did not fail, so nothing is to be explained"):
        study.why(good)
    with pytest.raises(ParameterError, match="branches"):
        study.why(good, branches=1)
