"""tussle analyze of a recorded game: who gave which orders."""

from __future__ import annotations

import json

import pytest

from tussle import Block, Mission, Recorder, Simulation
from tussle.messages import RemoveEntity, Waypoint
from tussle.record import given_by
from tussle.record.inputs import GIVER
from tussle.stock import Boids, SingleIntegrator


@pytest.fixture
def steered(folder):
    """A run of two people, and of a program that does not say who it is."""
    robots = Block(name="robots", count=4, variance=(90, 90, 0), autonomy=Boids(), motion=SingleIntegrator())
    mission = Mission(name="orders", blocks=[robots], end=3.0, dt=0.1)
    with Simulation(mission, 1) as sim, Recorder(sim, folder / "steered"):
        for step in range(10):
            with given_by("Ada" if step % 2 else "Ben"):
                sim.publish(Waypoint, pos=(float(step), 0.0, 0.0))
            sim.step()
        with given_by("Ada"):
            sim.publish(RemoveEntity, entity=3, why="order")
        sim.write("robots.Boids.max_speed", 5.0)
        sim.run()
    return folder / "steered"


def test_each_has_a_row_with_what_they_gave(tussle, steered):
    lines = [line.split() for line in tussle("analyze", steered).stdout.splitlines()]
    assert ["Ada", "6", "1", "0.1", "1"] in lines
    assert ["Ben", "5", "0", "0", "0.8"] in lines
    assert ["(not", "said)", "1", "0", "1", "1"] in lines
    assert ["Waypoint", "5", "5"] in lines


def test_json(tussle, steered):
    found = json.loads(tussle("analyze", steered, "--json").stdout)["orders"]
    assert [(each["by"], each["orders"]) for each in found] == [("", 1), ("Ada", 6), ("Ben", 5)]
    assert found[1]["names"] == {"Waypoint": 5, "RemoveEntity": 1}


def test_a_run_without_orders_and_options_of_batches(tussle, folder, steered):
    with Simulation(Mission(blocks=[], end=1.0), 1) as sim, Recorder(sim, folder / "quiet"):
        sim.run()
    said = tussle("analyze", folder / "quiet").stdout
    assert "from outside" not in said
    assert "end time reached, at t = 1 s" in said
    refused = tussle("analyze", steered, "--by-point", code=1)
    assert "is a recorded run, and --by-point is for batches" in " ".join(refused.stderr.split())


def test_the_result_is_what_the_command_printed_that_played_the_game(tussle, folder):
    """Also of missions with births, networks that lose messages, and metrics of the whole world."""
    for mission in ("predator_prey", "convoy", "boundary_defense"):
        words = ("run", mission, "--end", "40", "--out", folder / mission)
        played = tussle(*words).stdout.splitlines()
        told = tussle("analyze", folder / mission).stdout.splitlines()
        kept = [line.split() for line in played if line.split() and line.split()[0] not in ("speed", "grade")]
        assert [line.split() for line in told if line.split()] == kept


def test_recordings_of_former_versions_and_of_others(tussle, folder):
    """Births were not written, and names and metrics may be anything."""
    robots = [
        Block(name=name, team=i, count=2, autonomy=Boids(), motion=SingleIntegrator())
        for i, name in enumerate(("[b]a", "b" * 99))
    ]
    with Simulation(Mission(blocks=robots, end=1.0), range(6)) as sim, Recorder(sim, folder / "odd"):
        sim.run()
    file = folder / "odd" / "run.json"
    info = json.loads(file.read_text())
    del info["checksum"]
    for world in info["worlds"]:
        del world["born"], world["waited"]
        world["metrics"] = {"\x1b[2J": {"a\nb": {"0": "nan", "1": None}, "c": "inf", "d": {"x": 1}}, "e": 3}
        world["error"] = "it failed\n" * 999
    file.write_text(json.dumps(info))
    told = tussle("analyze", folder / "odd")
    lines = [line.split() for line in told.stdout.splitlines()]
    assert lines.count(["0", "[b]a", "2", "nan"]) == 4
    assert "start" not in told.stdout
    assert "\x1b" not in told.stdout
    assert "2 more worlds" in told.stderr


def test_names_in_a_recording_of_others_are_shown_on_one_line(tussle, folder):
    robot = Block(name="robot", count=1, autonomy=Boids(), motion=SingleIntegrator())
    with Simulation(Mission(blocks=[robot], end=1.0), 1) as sim, Recorder(sim, folder / "odd"):
        for by in ("[bold]x[/nope]", "\x1b[2J\n" * 9, "y" * 5000):
            token = GIVER.set(by)
            sim.publish(Waypoint, pos=(1.0, 0.0, 0.0))
            GIVER.reset(token)
    text = tussle("analyze", folder / "odd").stdout
    assert "[bold]x[/nope]" in text
    assert "\x1b[2J" not in text
    assert len(text) < 5000
