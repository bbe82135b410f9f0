"""The smallest failing game: what is left out, what stays, and that its file fails alone."""

from __future__ import annotations

import pytest
from test_study import PLUGIN

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, Output, Param
from tussle.errors import ParameterError
from tussle.mission import read_mission, to_xml
from tussle.stock import CPA, GPS, ActuatorFault, SingleIntegrator
from tussle.stress import Monitor, Specification, Stress
from tussle.stress.changes import absent

TEXT = "always (distance(left, right) > 1 m)"


class Cruise(Autonomy):
    """Flies north at a constant speed."""

    grade = "portable"
    speed = Param(0.0, unit="m/s")
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def step(self, g):
        self.velocity[1] = self.speed


def crossing(**more):
    """Two that meet, with a crowd and plugins that have no part in it."""
    fault = ActuatorFault(fault="bias", value=0.1, start_after="inf", failure_rate=0.5, duration=0.2)
    blocks = [
        Block(
            name="left",
            autonomy=Cruise(speed=1.0123),
            motion=SingleIntegrator(),
            sensor=GPS(),
            controller=fault,
        ),
        Block(
            name="right", position=(0, 5.0321, 0), autonomy=Cruise(speed=-1.0456), motion=SingleIntegrator()
        ),
        Block(name="crowd", count=6, position=(500, 0, 0), autonomy=Cruise(), motion=SingleIntegrator()),
    ]
    return Mission(blocks=blocks, end=10, dt=0.1, metrics=[CPA()], **more)


def failing(mission):
    """A study and its first game."""
    study = Stress(mission, TEXT)
    return study, study.sample(1, processes=1).games[0]


def test_what_has_no_part_in_a_failure_is_left_out():
    study, game = failing(crossing())
    found = study.smallest(game)
    left, right = found.mission.blocks
    assert (left.name, right.name, found.mission.metrics, found.is_smallest) == ("left", "right", (), True)
    assert (left.sensor, left.controller) == ((), ())
    assert (left.autonomy[0].speed, right.autonomy[0].speed, right.position) == (1.0, -1.0, (0.0, 5.0, 0.0))
    assert found.mission.end == pytest.approx(2.1)  # 5 m less 1 m at 2 m/s, and a step
    assert -0.2 < found.robustness < 0.0


def crowds():
    """Two rows that fly through each other, with places at random."""
    crowd = {"count": 8, "placement": "uniform", "scatter_first": True, "motion": SingleIntegrator()}
    blocks = [
        Block(name="north", position=(0, -6, 0), half_width=(15, 3, 0), autonomy=Cruise(speed=1.0), **crowd),
        Block(name="south", position=(0, 6, 0), half_width=(15, 3, 0), autonomy=Cruise(speed=-1.0), **crowd),
    ]
    return Mission(blocks=blocks, end=10, dt=0.1)


def test_of_two_crowds_the_two_that_meet_are_left():
    """Where they start and what they draw depends on those that are left out."""
    study = Stress(crowds(), "always (distance(north, south) > 0.3 m)")
    game = next(p for p in study.sample(20, processes=1).games if p.verdict.has_failed)
    found = study.smallest(game)
    assert found.is_smallest
    assert [b.count - len(absent(found.mission, b)) for b in found.mission.blocks] == [1, 1]
    sim = Simulation(found.mission, found.seed)
    sim.step()
    whole = Simulation(study.mission, found.seed)
    for name in ("north", "south"):
        place, is_there = sim.read(f"{name}.pos")
        assert (
            whole.read(f"{name}.pos")[0][0, :, 0] == place[is_there][0, 0]
        ).sum() == 1  # it starts where it did
    assert to_xml(found.mission, found.seed).count("Absence") <= 2


def test_a_fault_that_the_failure_needs_stays():
    """Without its dead actuator the left one would fly away in time."""
    mission = crossing()
    left = mission.blocks[0].replace(
        autonomy=Cruise(speed=-1.0456), controller=ActuatorFault(start_after=1.0), position=(0, 0, 0)
    )
    study, game = failing(mission.replace(blocks=[left, *mission.blocks[1:]]))
    small = study.smallest(game).mission
    assert [type(c).__name__ for c in small.blocks[0].controller] == ["ActuatorFault"]
    assert len(small.blocks) == 2


def test_the_file_fails_alone(tmp_path):
    """A game that failed on the way, with other luck from some step on."""
    file = tmp_path / "pads.xml"
    file.write_text((PLUGIN.parent / "pads.xml").read_text().replace("<y>8</y>", "<y>8.0321</y>"))
    text = "always (distance(left, right) > 3 m)"
    study = Stress(file, text, plugin_files=[PLUGIN], settings={"run.end": 6})
    worst = study.probability(20, 4, processes=1).failures[0]
    found = study.smallest(worst)
    small = tmp_path / "small.xml"
    small.write_text(to_xml(found.mission, found.seed))
    loaded = read_mission(small, plugin_files=[PLUGIN])
    sim = Simulation(loaded.mission, loaded.seed)
    monitor = Monitor(Specification.parse(text, loaded.mission), sim)
    sim.run()
    assert monitor.robustness()[0] == found.robustness < 0.0
    assert found.mission.end < 6.0
    assert len(found.mission.rekeys) <= len(worst.game.rekeys)
    assert found.mission.blocks[0].position != found.mission.blocks[1].position


def test_the_search_ends_after_some_games_and_refuses_good_ones():
    study, game = failing(crossing())
    found = study.smallest(game, max_games=3)
    assert (found.n_games, found.is_smallest) == (3, False)
    good, passed = failing(crossing().replace(end=1.0))
    with pytest.raises(ParameterError, match="the game with seed 1 did not fail, so nothing can be shrunk"):
        good.smallest(passed)
    with pytest.raises(ParameterError, match="max_games"):
        study.smallest(game, max_games=0)
