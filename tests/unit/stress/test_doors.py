"""Answers for programs that run checks, and games in tests of Hypothesis."""

from __future__ import annotations

import sys
from types import SimpleNamespace
from xml.etree import ElementTree as ET

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from test_study import EXAMPLE, PLUGIN, TEXT, study

from tussle import Simulation
from tussle.errors import MissingExtraError, ParameterError
from tussle.mission import read_mission
from tussle.stress import Assurance, Monitor, Sample, Specification, given_games
from tussle.stress.confidence import junit_xml


def sample(n_failed, n):
    """Games of which some failed."""
    games = [
        SimpleNamespace(
            game=SimpleNamespace(values=(), seed=i),
            verdict=SimpleNamespace(has_failed=i < n_failed, robustness=float(i)),
        )
        for i in range(n)
    ]
    return Assurance.of(Sample(games, 0.0, 1.0))


def test_the_confidence_of_plain_games_is_exact():
    assert sample(0, 2995).least > 0.999 > sample(0, 2994).least  # 0.999^n < 0.05
    assert sample(0, 10).least == pytest.approx(0.05**0.1)
    assert sample(10, 10).least == 0.0
    assert 0.0 < sample(1, 10).least < sample(0, 10).least


def test_the_confidence_of_splitting_is_the_upper_end():
    found = study().probability(20, 4, processes=1)
    assert Assurance.of(found).least == 1.0 - found.high


def test_junit_tells_what_failed():
    suite = ET.fromstring(junit_xml("pads", "a < 1 & b", sample(0, 3000), 0.999, []))
    assert (suite.get("tests"), suite.get("failures"), suite.find("testcase/failure")) == ("1", "0", None)
    suite = ET.fromstring(junit_xml("pads", "a < 1 & b", sample(3, 3000), 0.999, ["x/0.xml"]))
    assert (suite.get("failures"), suite[0].get("name")) == ("1", "a < 1 & b")
    assert "does not hold with 95 % confidence above 0.999" in suite[0][0].get("message")
    assert suite[0][0].text == "x/0.xml"


GAME = {"plugin_files": [PLUGIN], "settings": {"run.end": 2}}


def test_hypothesis_plays_games_and_shrinks_those_that_fail():
    """The simplest game that fails the test is found, and the file plays it again."""
    failed = []

    @settings(max_examples=15, database=None, derandomize=True)
    @given_games(EXAMPLE / "pads.xml", TEXT, vary={"run.end": st.floats(1, 3)}, **GAME)
    def holds(game):
        failed.append(game)
        assert game.values["run.end"] < 2.0

    with pytest.raises(AssertionError):
        holds()
    game = failed[-1]
    assert (game.seed, game.values) == (0, {"run.end": 2.0})
    file = read_mission(EXAMPLE / "pads.xml", {"run.end": 2}, plugin_files=[PLUGIN])
    sim = Simulation(file.mission, 0)
    monitor = Monitor(Specification.parse(TEXT, file.mission), sim)
    sim.run()
    assert monitor.robustness()[0] == game.robustness
    assert 'end="2' in game.mission_file()


def test_mistakes_are_told_when_the_test_is_defined(monkeypatch):
    with pytest.raises(ParameterError, match="nobody"):
        given_games(EXAMPLE / "pads.xml", "always (distance(left, nobody) > 1 m)", **GAME)
    monkeypatch.setitem(sys.modules, "hypothesis", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'tussle\[property\]'"):
        given_games(EXAMPLE / "pads.xml", TEXT, **GAME)
