"""Searches find planted failures, keep different ones, replay them, and compare missions; nothing depends on how games are played."""

from __future__ import annotations

import json
import runpy
from pathlib import Path

import numpy as np
import pytest
from test_shrink import crowds

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, Output, Param
from tussle.batch import Processes
from tussle.errors import BatchError, MissionError, ParameterError
from tussle.mission import read_mission
from tussle.stock import SingleIntegrator
from tussle.stress import Monitor, Specification, Stress
from tussle.stress.blame import blame
from tussle.stress.search import different

ROOT = Path(__file__).parents[3]
EXAMPLE = ROOT / "examples/stress"
PLUGIN = EXAMPLE / "hover.py"
VARY = {"left.Hover.gain": (0.3, 1.0), "left.Hover.gust": (1.0, 12.0)}
NEAR = "always (distance(left, right) > 3 m)"


def pads(text=NEAR, **more):
    given = {"settings": {"run.end": 3}, "vary": VARY, "plugin_files": [PLUGIN]}
    return Stress(EXAMPLE / "pads.xml", text, **given | more)


def verdicts(found):
    return [(g.values, g.played.game, g.played.verdict, g.played.state_hash) for g in found.games]


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    path = tmp_path_factory.mktemp("search") / "out"
    study = pads()
    return study, study.search(256, directory=path, processes=1), path


@pytest.mark.parametrize("number", [3, pytest.param(8, marks=pytest.mark.slow)])
def test_a_planted_failure_is_found(number):
    """Random games fail once in 20,000; the benchmark plays ten of these missions."""
    made = runpy.run_path(str(ROOT / "benchmarks/stress_search.py"))
    mission, text, share = made["planted"](number)
    assert 0.0 < share <= 1e-4
    study = Stress(mission, text, vary=made["VARY"])
    result = study.search(2000, failures=1, processes=1)
    assert result.first is not None
    assert len(result.games) < 2000


def test_the_worst_failures_come_first_and_differ(found):
    study, result, _ = found
    worst = [game.robustness for game in result.failures]
    assert worst[0] == result.nearest.robustness < 0.0
    assert worst == sorted(worst)
    assert different(result.failures, study.variables, study.mission.steps) == result.failures
    assert len(result.failures) < result.n_failed
    assert len(result.failures) > 1


def test_failures_of_others_at_the_same_time_are_different():
    """By the pair that is too near at the moment of failure, as all distances of that moment say."""
    study = Stress(
        crowds(), "always (distance(north, south) > 0.3 m)", vary={"north.Cruise.speed": (0.99, 1.01)}
    )
    result = study.search(24, "random", processes=1)
    who = [blame(study.mission_of(g.played.game), g.played, study.specification) for g in result.failures]
    assert len(set(who)) > len(different(result.failures, study.variables, study.mission.steps)) > 1
    for game, (text,) in zip(result.failures[:3], who, strict=False):
        sim = Simulation(study.mission_of(game.played.game), game.played.game.seed)
        sim.step(game.played.verdict.first_below(0.0))
        north, south = (sim.read(f"{name}.pos")[0][0] for name in ("north", "south"))
        apart = np.linalg.norm(north[:, None] - south[None], axis=2)
        i, j = np.unravel_index(apart.argmin(), apart.shape)
        assert text == f"distance(north, south) of north/{i + 1}, south/{j + 1}"


def test_what_and_who_fails_is_known_of_all_signals():
    """Of parts of a specification, of the slowest, and of counts, for which nobody in particular is to blame."""
    study = Stress(crowds(), "always (max_speed(north) < 0.5) and always (count(all) > 99 and time > 5)")
    (game,) = study.sample(1, processes=1).games
    assert blame(study.mission, game, study.specification) == ("count(all)", "time()")
    fast = study.mission.replace(blocks=[study.mission.blocks[0], study.mission.blocks[1].replace(count=1)])
    own = Stress(fast, "always (max_speed(south) < 0.5)")
    (game,) = own.sample(1, processes=1).games
    assert blame(fast, game, own.specification) == ("max_speed(south) of south/1",)


def test_a_failure_is_a_mission_that_fails_when_it_is_played(found):
    _, result, path = found
    listed = json.loads((path / "result.json").read_text())["failures"]
    for entry, game in zip(listed, result.failures, strict=False):
        loaded = read_mission(path / entry["file"], plugin_files=[PLUGIN])
        with Simulation(loaded.mission, loaded.seed) as sim:
            monitor = Monitor(Specification.parse(NEAR, loaded.mission), sim)
            sim.run()
            assert monitor.robustness()[0] == game.robustness == entry["robustness"]
            assert sim.result()[0].state_hash == entry["state_hash"]


def test_a_search_goes_on_where_it_was_stopped_and_does_not_depend_on_processes(found, tmp_path):
    _, result, _ = found
    n = 0

    def stop(_):
        nonlocal n
        n += 1
        if n == 100:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        pads().search(256, directory=tmp_path / "out", processes=1, stack=5, on_game=stop)
    again = pads().search(256, directory=tmp_path / "out", executor=Processes(2, 4))
    assert verdicts(again) == verdicts(result)


def test_a_mission_that_is_edited_meanwhile_ends_the_search(tmp_path):
    file = tmp_path / "pads.xml"
    file.write_text((EXAMPLE / "pads.xml").read_text())
    study = Stress(file, NEAR, vary=VARY, settings={"run.end": 2}, plugin_files=[PLUGIN])
    edited = file.read_text().replace("<y>8</y>", "<y>9</y>")
    with pytest.raises(BatchError, match="changed during the search"):
        study.search(64, processes=1, on_game=lambda _: file.write_text(edited))


def test_samplers_differ_and_repeat():
    games = {name: verdicts(pads().search(64, name, processes=1)) for name in ("cmaes", "tpe", "random")}
    assert len({str(g) for g in games.values()}) == 3
    for name, before in games.items():
        assert verdicts(pads().search(64, name, processes=1)) == before
    assert verdicts(pads().search(64, "tpe", sample_seed=1, processes=1)) != games["tpe"]


class Creep(Autonomy):
    """Moves east."""

    grade = "portable"
    speed = Param(1.0, unit="m/s", ge=0.0)
    factor = Param(1.0, ge=0.0)
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def step(self, g):
        self.velocity[:] = 0.01 * g.normal("luck", 3)
        self.velocity[0] += self.factor * self.speed


def creep(**values):
    block = Block(name="one", team=1, autonomy=Creep(**values), motion=SingleIntegrator())
    return Mission(blocks=[block], end=2, dt=0.1)


REACH = "always (max_distance(one, point 0 0 0) < 3 m)"


def test_choices_and_whole_numbers_are_searched():
    study = Stress(creep(), REACH, vary={"one.Creep.factor": [1, 2], "one.Creep.speed": (0.5, 1.6)})
    found = study.search(200, processes=1)
    kinds = {game.values["one.Creep.factor"] for game in found.failures}
    assert kinds == {1, 2}  # the slower one fails above 1.5 m/s only


def test_games_that_fail_only_in_one_of_two_missions():
    study = Stress(creep(), REACH, vary={"one.Creep.speed": (0.5, 3.0)}, against={"one.Creep.factor": 2})
    assert study.search(100, processes=1).n_failed == 0  # the other is faster, and fails first
    study = Stress(creep(factor=2), REACH, vary={"one.Creep.speed": (0.5, 3.0)}, against=creep())
    found = study.search(100, processes=1)
    assert found.n_failed
    for game in found.games:
        assert game.other.game.seed == game.played.game.seed
        speed = game.values["one.Creep.speed"]
        if abs(speed - 0.75) > 0.02 and abs(speed - 1.5) > 0.02:
            assert game.has_failed == (0.75 < speed < 1.5)
            assert (game.robustness < 0.0) == game.has_failed


def test_values_that_cannot_be_played_are_left_out_and_told():
    found = pads(vary={"left.Hover.gain": (-0.5, 1.0)}).search(64, processes=1)
    assert len(found.games) == 64
    assert found.refused
    assert all(values["left.Hover.gain"] < 0.0 and ">= 0" in error for values, error in found.refused)
    with pytest.raises(ParameterError, match=r"with left.Hover.gain=.*>= 0"):
        pads(vary={"left.Hover.gain": (-2.0, -1.0)}).search(64)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"vary": {}}, "nothing varies"),
        ({"vary": {"left.Hover.gian": (0.1, 1.0)}}, "did you mean 'gain'"),
        ({"vary": {"run.end": (1.0, 2.0)}}, "is set and varies"),
        ({"sampler": "cma-es"}, "did you mean 'cmaes'"),
        ({"games": 0}, "games"),
        ({"vary": {"left.color": ["red", "blue"]}}, "left.color"),
    ],
)  # fmt: skip
def test_what_cannot_be_searched_is_refused(change, message):
    how = {name: change.pop(name) for name in ("sampler", "games") if name in change}
    with pytest.raises((ParameterError, MissionError), match=message):
        pads(**change).search(**how)


def test_a_study_with_values_is_searched_only(tmp_path):
    for play in (lambda: pads().sample(10), lambda: pads().probability(10, 2)):
        with pytest.raises(ParameterError, match="use `search`"):
            play()
    pads().search(32, directory=tmp_path, processes=1)
    with pytest.raises(BatchError, match="variables"):
        pads(vary={"left.Hover.gain": (0.3, 1.0)}).search(32, directory=tmp_path, processes=1)
