"""A team has one colour in the viewer, in films, plots and reports: that of its mission, else one of the palette by its number."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tussle import Recorder, Simulation
from tussle.batch import Batch, load_batch
from tussle.batch.report import write_report
from tussle.batch.report.report_data import ReportData
from tussle.mission import read_mission, shipped_missions
from tussle.palette import PAPER, TEAM_COLOURS, colour_of, hex_of, luminance, on_paper, rgb_of, team_colours
from tussle.view import Live, Recording
from tussle.view.page.document import game_document
from tussle.view.plots import maps, sheet
from tussle.view.plots.selection import Trajectories

FLOCK = """<?xml version="1.0"?>
<runscript>
  <run start="0" end="1" dt="0.1"/>
  <metrics>SimpleCollisionMetrics</metrics>
  <entity_common name="all"><count>2</count><autonomy>Boids</autonomy><motion_model>SingleIntegrator</motion_model></entity_common>
  <entity entity_common="all"><name>plain</name><team_id>4</team_id></entity>
  <entity entity_common="all"><name>pale</name><team_id>9</team_id><color>250, 250, 240</color></entity>
  <entity entity_common="all"><name>dark</name><team_id>9</team_id><color>1 2 3</color></entity>
  <entity entity_common="all"><name>wrong</name><team_id>2</team_id><color>green</color></entity>
</runscript>
"""


def recording(loaded, path) -> Recording:
    """The start of a mission with few entities."""
    mission = replace(
        loaded.mission, blocks=[replace(b, count=min(b.count, 2)) for b in loaded.mission.blocks]
    )
    with Simulation(mission, 1) as simulation, Recorder(simulation, path, mission_text=loaded.text):
        pass
    return Recording(path)


@pytest.mark.parametrize("name", shipped_missions())
def test_a_shipped_mission_has_its_colours_everywhere(name, tmp_path):
    loaded = read_mission(name)
    run = recording(loaded, tmp_path / "run")
    wanted = team_colours(
        (b.team, loaded.viewer["entities"].get(b.name, {}).get("color")) for b in loaded.mission.blocks
    )
    assert {t: hex_of(run.style.colour(t)) for t in run.teams} == wanted  # the viewer and films
    assert {t["id"]: hex_of(t["colour"]) for t in game_document(run)["teams"]} == wanted
    tracks = Trajectories(run)
    with sheet.plot_style():
        legend = maps.trajectory(tracks).legends[0]
    drawn = [handle.get_color() for handle in legend.legend_handles[: len(tracks.teams)]]
    assert (
        drawn
        == [on_paper(wanted[team]) for team in tracks.teams]
        == [tracks.colours[team] for team in tracks.teams]
    )
    assert Batch(name, runs=1).info()["colours"] == wanted  # reports


def test_a_batch_keeps_the_colours_for_its_report(tmp_path):
    Batch("predator_prey", runs=2, settings={"end": "200", "prey": "10"}).play(tmp_path / "batch")
    results = load_batch(tmp_path / "batch")
    assert results.colours == {1: "#4d4dff", 2: "#ff0000", 3: "#ffa000"}
    data = ReportData(results)
    assert [(m.team, m.colour) for m in data.scores] == [(2, "#ff0000"), (3, "#ffa000")]
    text = write_report(results, tmp_path / "report").index.read_text()
    assert "#ffa000" in text
    assert not [colour for colour in TEAM_COLOURS if colour in text]
    del results.info["colours"], results.__dict__["colours"]  # of an earlier version
    assert results.colours == {team: on_paper(TEAM_COLOURS[team - 1]) for team in (1, 2, 3)}


def test_a_stranger_s_mission_has_its_colours_and_the_palette_s(tmp_path):
    path = tmp_path / "flock.xml"
    path.write_text(FLOCK)
    loaded = read_mission(path)
    with (
        Simulation(loaded.mission, 1) as simulation,
        Live(simulation, viewer=loaded.viewer, threaded=False) as live,
    ):
        seen = {t: hex_of(live.style.colour(t)) for t in live.teams}
    assert (
        seen
        == {2: TEAM_COLOURS[1], 4: TEAM_COLOURS[3], 9: "#fafaf0"}
        == Batch(path, runs=1).info()["colours"]
    )
    tracks = Trajectories(recording(loaded, tmp_path / "run"))
    assert tracks.colours == {2: TEAM_COLOURS[1], 4: TEAM_COLOURS[3], 9: on_paper("#fafaf0")}


@pytest.mark.parametrize("colour", ["#ffffff", "#000000", "#fafaf0", "#ffff00", "#000060"])
def test_a_colour_that_is_not_seen_on_a_page_becomes_a_shade_of_it(colour):
    shade = on_paper(colour)
    assert 0.05 <= luminance(shade) <= 0.79 < luminance(PAPER)
    assert (
        np.argsort(rgb_of(shade), kind="stable").tolist()
        == np.argsort(rgb_of(colour), kind="stable").tolist()
    )


@pytest.mark.parametrize("colour", [*TEAM_COLOURS, "#ff0000", "#00ff00", "#0000ff", "#00ffff", "#ffa000"])
def test_a_colour_that_is_seen_stays(colour):
    assert on_paper(colour) == colour


@given(
    st.lists(st.tuples(st.integers(-3, 10**6), st.sampled_from([None, "10 20 30", "0 114 178"])), max_size=12)
)
def test_teams_differ_while_the_palette_lasts(blocks):
    found = team_colours(blocks)
    written = dict.fromkeys(team for team, text in blocks if text)
    free = [team for team in found if team not in written]
    own = {found[team] for team in free}
    assert len(own) >= min(len(free), len(TEAM_COLOURS) - 1)
    if len(free) < len(TEAM_COLOURS):
        assert not own & {found[team] for team in written}
    assert team_colours(reversed(blocks)).keys() == found.keys()
    for team in free:  # who comes first with its number keeps the colour of its number
        taken = {found[t] for t in written} | {colour_of(t) for t in free if t < team}
        assert colour_of(team) in taken or found[team] == colour_of(team)
