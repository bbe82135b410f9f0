"""The robustness of a recorded game is that of the game, and what was not recorded is named."""

from __future__ import annotations

import shutil
from dataclasses import replace

import numpy as np
import pytest
from recorded_games import hunt

from tussle import Block, Mission, Recorder, Simulation
from tussle.errors import ParameterError
from tussle.stock import Boids, Unicycle
from tussle.stress import Monitor, RecordedMonitor, Specification
from tussle.stress.kernels import SWEEP_FROM
from tussle.view import Recording

SPECS = [
    "always (distance(prey, hunters) > 15 m)",
    "always (distance(all, all) > 1 m) and always[1,3] (count(team 1) > 5)",
    "always (max_distance(team 2, point 0 0 200) < 60 m -> min_speed(entity 3) > 10 m/s)",
    "always (min(prey.health) > 0 and max(prey.pos) < 300 and max(hunters.yaw) < 2)",
    "always (max(late.Boids.target) < 400)",
    "eventually[0,4] (count(late) > 2)",
    "always (time < 5 s)",
    "always (components(team 2, 40 m) < 2)",
]


def recorded(mission, directory, text=SPECS[0], **options):
    """The game in a run directory, and what a monitor saw of it."""
    with Simulation(mission, 3) as sim, Recorder(sim, directory, **options):
        monitor = Monitor(Specification.parse(text, mission), sim)
        sim.run()
        seen = monitor.progress(0)
    return Recording(directory), seen


@pytest.mark.parametrize("text", SPECS)
def test_every_step_is_that_of_the_game(tmp_path, text):
    run, seen = recorded(hunt(), tmp_path / "run", text, columns="Boids.target")
    again = RecordedMonitor(text, run)
    for expected, found in zip(seen, again.progress(0), strict=True):
        np.testing.assert_array_equal(found, expected)
    assert (again.text, again.unit) == (text, Specification.parse(text, run.mission).unit)


def test_a_crowd_whose_pairs_are_swept_and_frames_in_several_groups(tmp_path, monkeypatch):
    monkeypatch.setattr("tussle.stress.recorded.MAX_ROWS", 300)
    n = int(SWEEP_FROM**0.5) + 2
    crowd = Block(name="crowd", count=n, variance=(1e4, 1e4, 100), autonomy=Boids(), motion=Unicycle())
    text = "always (distance(crowd, crowd) > 1 m)"
    run, seen = recorded(Mission(blocks=[crowd], end=1), tmp_path / "run", text)
    np.testing.assert_array_equal(RecordedMonitor(text, run).progress(0)[1], seen[1])


def test_steps_that_were_not_recorded_count_with_the_state_before(tmp_path):
    run, seen = recorded(hunt(), tmp_path / "run", period=0.5)
    _, every, _ = seen
    _, some, _ = RecordedMonitor(SPECS[0], run).progress(0)
    held = np.searchsorted(run.steps, np.arange(len(every)), side="right") - 1
    np.testing.assert_array_equal(some, every[run.steps[held]])
    assert (some != every).any()
    run.watch([RecordedMonitor(SPECS[0], run)])
    assert "up to 0.5 s apart" in run.notes[-1]


def test_a_game_that_was_cut_short_is_not_judged_by_its_last_moment(tmp_path):
    text = "always (eventually[0,1] (time < 1 s))"
    mission = hunt(end=20.0, end_conditions="time")
    with Simulation(mission, 3) as sim, Recorder(sim, tmp_path / "run") as recorder:
        monitor = Monitor(Specification.parse(text, mission), sim)
        for _ in range(30):
            sim.step()
        recorder.close("by hand")
        expected = monitor.progress(0)
    found = RecordedMonitor(text, Recording(tmp_path / "run")).progress(0)
    np.testing.assert_array_equal(found[0], expected[0])
    assert found[0][-1] > found[2]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("always (min(prey.Boids.target) > 0)", "'prey.Boids.target' was not recorded, as `tussle run"),
        (
            "always (max(prey.omega) < 1)",
            "prey.omega is no State or Output of an entity's plugin, and others are not recorded",
        ),
        ("always (min(SimpleCaptureMetrics.team_captures) < 1)", "no State or Output"),
        ("always (max(prey.Boids.max_speed) < 99)", "prey.Boids.max_speed is no State or Output"),
        ("lost[1] / start[1] < 0.2", r"lost\[1\] is known at the end of a game"),
        ("always (distance(pray, hunters) > 1 m)", "did you mean 'prey'"),
        ("always (distance(prey, hunters)", "is expected"),
    ],
)
def test_what_a_recording_lacks_is_named(tmp_path, text, says):
    run, _ = recorded(hunt(end=1.0), tmp_path / "run")
    with pytest.raises(ParameterError, match=says):
        RecordedMonitor(text, run)


def test_a_function_of_the_simulation_is_refused(tmp_path):
    run, _ = recorded(hunt(end=1.0), tmp_path / "run")
    (tmp_path / "mine.py").write_text("def gap(sim):\n    return sim.t - 1.0\n")
    with pytest.raises(ParameterError, match=r"gap\(\) is a function of the simulation.*tussle view --from"):
        RecordedMonitor(f"{tmp_path / 'mine.py'}:gap", run)


def test_a_directory_without_its_mission_or_with_another_is_refused(tmp_path):
    recorded(hunt(end=1.0), tmp_path / "run")
    other = hunt(end=1.0)
    other = other.replace(blocks=[*other.blocks[1:], other.blocks[0]])
    recorded(other, tmp_path / "other")
    (tmp_path / "run/mission.xml").unlink()
    with pytest.raises(ParameterError, match=r"needs the mission of the run: mission\.xml is missing"):
        RecordedMonitor(SPECS[0], Recording(tmp_path / "run"))
    shutil.copy(tmp_path / "other/mission.xml", tmp_path / "run/mission.xml")
    (tmp_path / "run/run.json").unlink()
    with pytest.raises(ParameterError, match="the blocks of its mission file are not those of its states"):
        RecordedMonitor(SPECS[0], Recording(tmp_path / "run"))


def test_ids_may_be_large(tmp_path):
    """A table with room for all ids of each of these frames would have a terabyte."""
    run, seen = recorded(hunt(), tmp_path / "run")
    frame = run.frame
    run.frame = lambda i: replace(frame(i), id=frame(i).id + np.int32(2_000_000_000))
    np.testing.assert_array_equal(RecordedMonitor(SPECS[0], run).progress(0)[1], seen[1])


def test_too_many_steps_are_refused(tmp_path, monkeypatch):
    run, _ = recorded(hunt(end=1.0), tmp_path / "run")
    monkeypatch.setattr("tussle.stress.recorded.MAX_STEPS", 5)
    with pytest.raises(ParameterError, match="has 10 steps; a specification is shown of at most 5"):
        RecordedMonitor(SPECS[0], run)
