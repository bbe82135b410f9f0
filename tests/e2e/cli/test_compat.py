"""Games by SCRIMMAGE's own laws on the command line: played, checked, described, converted, and played again from a batch."""

from __future__ import annotations

import json

import pytest


def state_hash(folder) -> str:
    info = json.loads((folder / "run.json").read_text())
    assert info["laws"] == "scrimmage"
    return info["worlds"][0]["state_hash"]


@pytest.fixture
def game(folder):
    path = folder / "game.xml"
    path.write_text(
        path.read_text().replace(
            '<motion_model use_pitch="true">Unicycle', "<controller/><motion_model>SimpleAircraft", 1
        )
    )
    path.write_text(
        path.read_text().replace("<controller/>", "<controller>SimpleAircraftControllerPID</controller>")
    )
    return folder


def test_every_way_to_play_a_game_again(tussle, game):
    laws = ("--compat", "scrimmage")
    tussle("run", "game.xml", *laws, "--out", "one")
    expected = state_hash(game / "one")
    tussle("run", "one/mission.xml", "--out", "two")
    tussle("convert", "game.xml", *laws, "--to", "copy.xml")
    tussle("run", "copy.xml", "--out", "three")
    tussle("batch", "game.xml", *laws, "--runs", 1, "--seed", 7, "--out", "batch", "--processes", 1)
    tussle("run", "--from", "batch:0", "--out", "four")
    assert {state_hash(game / name) for name in ("two", "three", "four")} == {expected}
    assert "can be played" in tussle("check", "game.xml", *laws).stdout


def test_what_is_shown_and_refused(tussle, game):
    assert "before a step" in " ".join(
        tussle("describe", "SimpleAircraft", "--compat", "scrimmage").stdout.split()
    )
    assert "before a step" not in " ".join(tussle("describe", "SimpleAircraft").stdout.split())
    refused = tussle("run", "game.xml", "--compat", "scrimage", code=1)
    assert "(did you mean 'scrimmage'?)" in refused.stderr
    refused = tussle("run", "--from", "batch:0", "--compat", "scrimmage", code=2)
    assert "--compat and" in " ".join(refused.stderr.split())
