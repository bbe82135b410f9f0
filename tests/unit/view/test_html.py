"""The offline page holds what was recorded, as exactly as it says, small, and as nothing but data."""

from __future__ import annotations

import base64
import hashlib
import math
import re
from dataclasses import replace

import numpy as np
import pytest
from page_reader import Bytes, PageReader
from recorded_games import head_on, hunt, record

from tussle import Block, Mission
from tussle.mission import read_mission
from tussle.stock import Boids, Still, Unicycle
from tussle.view import Recording
from tussle.view.export.html import write_html
from tussle.view.page.recorded import kept_frames
from tussle.view.solids import Terrain

HOSTILE = "</script><script>alert(1)</script><!-- {{script}} '\"&amp;\u2028"


@pytest.fixture(scope="module")
def hunted(tmp_path_factory):
    """Two worlds with births, captures and deaths."""
    return record(hunt(n_prey=8, end=20.0), tmp_path_factory.mktemp("runs") / "run", (1, 2))


def angle(one, two):
    """Between attitudes [rad], (n, 4) each."""
    return 2.0 * np.arccos(np.clip(np.abs((one * two).sum(axis=1)), 0.0, 1.0))


def assert_same(page, recording, export, kept=None):
    """Every entity of every frame is where it was, within what the page and its maker say."""
    kept = range(recording.n_frames) if kept is None else kept
    assert len(page.t) == export.n_frames == len(kept)
    assert (page.t == recording.t[kept]).all()
    assert page.document["positionError"] == export.position_error
    assert page.document["angleError"] == export.angle_error
    for i, number in enumerate(kept):
        frame, seen = recording.frame(number), page.frames[i]
        assert sorted(seen) == frame.id.tolist()
        rows = [seen[int(k)] for k in frame.id]
        assert [row.team for row in rows] == frame.team.tolist()
        assert [row.block for row in rows] == frame.block.tolist()
        if rows:
            off = np.linalg.norm(np.array([row.pos for row in rows]) - frame.pos, axis=1)
            # The last bits of positions of some thousand metres.
            assert off.max() <= export.position_error + 1e-11
            assert angle(np.array([row.quat for row in rows]), frame.quat).max() <= export.angle_error
            shares = np.array([row.health for row in rows]) - frame.health
            assert np.abs(shares).max() <= page.chunks[0].full_health / 510 + 1e-12
    assert export.n_states == sum(len(recording.frame(number)) for number in kept)


@pytest.mark.parametrize("world", [0, 1])
def test_the_page_holds_what_was_recorded(hunted, tmp_path, world):
    recording = Recording(hunted, world)
    export = write_html(recording, tmp_path / "page.html")
    page = PageReader(tmp_path / "page.html")
    assert_same(page, recording, export)
    assert export.position_error < 0.01
    assert export.angle_error < math.radians(0.1)
    assert export.n_bytes == (tmp_path / "page.html").stat().st_size
    assert export.n_entities == 14
    assert page.events == [[h.t, h.kind, h.id, h.other, h.text] for h in recording.events]
    assert page.document["nEntities"] == [14]
    assert page.document["isComplete"] is True
    assert {"capture", "birth", "death", "end"} <= {kind for _, kind, *_ in page.events}
    assert dict(page.document["facts"])["World"] == f"{world} of 2"
    assert dict(page.document["facts"])["Seed"] == str(world + 1)


def test_many_pieces_hold_what_one_holds(hunted, tmp_path, monkeypatch):
    recording = Recording(hunted)
    monkeypatch.setattr("tussle.view.page.recorded.FILE_STATES", 1)
    monkeypatch.setattr("tussle.view.page.recorded.FILE_FRAMES", 4)
    export = write_html(recording, tmp_path / "page.html")
    page = PageReader(tmp_path / "page.html")
    assert len(page.chunks) > 10
    assert_same(page, recording, export)


def test_frames_of_a_period_and_the_last_are_kept(hunted, tmp_path):
    recording = Recording(hunted)
    export = write_html(recording, tmp_path / "page.html", period=0.75)
    page = PageReader(tmp_path / "page.html")
    kept = kept_frames(recording.t, 0.75)
    assert_same(page, recording, export, kept)
    assert recording.t[kept][:4] == pytest.approx([0.0, 0.8, 1.5, 2.3])
    assert page.t[-1] == recording.t[-1]
    assert len(page.events) == len(recording.events)
    assert "one every 0.75 s" in dict(page.document["facts"])["Frames"]


def test_times_that_are_a_whole_number_of_periods_are_kept_in_spite_of_rounding():
    t = 3.0 + 0.1 * np.arange(1001)
    assert kept_frames(t, 0.1).tolist() == list(range(1001))
    assert kept_frames(t, 0.5).tolist() == list(range(0, 1001, 5))
    assert kept_frames(t, 1e9).tolist() == [0, 1000]
    assert kept_frames(t[:0], 1.0).tolist() == []


def test_the_same_run_gives_the_same_bytes(hunted, tmp_path):
    for name in ("one", "two"):
        write_html(Recording(hunted), tmp_path / name)
    assert (tmp_path / "one").read_bytes() == (tmp_path / "two").read_bytes()


# -- what a run may have been through -------------------------------------------------------------------------------------------


def test_of_a_run_that_was_cut_short_there_is_what_there_is(tmp_path):
    cut = record(hunt(end=3.0), tmp_path / "cut", flush_every=1e-9)
    (cut / "run.json").unlink()
    trajectory = cut / "trajectory.arrow"
    trajectory.write_bytes(trajectory.read_bytes()[:-300])
    recording = Recording(cut)
    export = write_html(recording, tmp_path / "page.html")
    page = PageReader(tmp_path / "page.html")
    assert_same(page, recording, export)
    assert page.document["isComplete"] is False
    assert page.document["notes"] == list(export.notes)
    assert any("run.json is missing" in note for note in export.notes)
    assert 20 < export.n_frames < 31


def test_who_is_gone_for_good_leaves_frames_without_anybody(tmp_path):
    mission = head_on(blocks=head_on().blocks[:2], end=6.0, end_conditions="time")
    recording = Recording(record(mission, tmp_path / "run"))
    export = write_html(recording, tmp_path / "page.html")
    page = PageReader(tmp_path / "page.html")
    assert_same(page, recording, export)
    assert page.frames[-1] == {}
    assert "collision" in {kind for _, kind, *_ in page.events}


def test_a_game_in_one_point_and_one_across_a_continent_keep_their_places(tmp_path):
    for name, place in (("near", (3.0, -4.0, 5.0)), ("far", (4.1e6, -2.9e6, 1e4))):
        blocks = [
            Block(name="here", team=1, position=(0, 0, 0), motion=Still()),
            Block(name="there", team=2, position=place, heading="200 deg", motion=Still()),
        ]
        recording = Recording(record(Mission(blocks=blocks, end=0.3), tmp_path / name))
        export = write_html(recording, tmp_path / "page.html")
        assert_same(PageReader(tmp_path / "page.html"), recording, export)
        assert export.position_error < (1e-3 if name == "near" else 0.02)


# -- size -------------------------------------------------------------------------------------------------------------------------


def flocks(n, end):
    """Two flocks that nobody leaves: every state is to be told."""
    width = 40.0 * n ** (1.0 / 3.0)
    block = Block(
        name="one", team=1, count=n // 2, position=(0, 0, 300), placement="uniform",
        half_width=(width, width, 0.5 * width), autonomy=Boids(),
        motion=Unicycle(vel_max=30, turn_rate_max=1, pitch_rate_max=1),
    )  # fmt: skip
    return Mission(
        blocks=[block, block.replace(name="two", team=2, position=(width, width, 300))], end=end, dt=0.1
    )


def test_the_page_is_small(tmp_path):
    n, end, most = 110, 250.0, 7.5e6
    recording = Recording(record(flocks(n, end), tmp_path / "run"))
    export = write_html(recording, tmp_path / "page.html")
    assert export.n_states == n * (10 * end + 1)
    assert export.n_bytes < 0.3 * most  # it is well below: 4.5 bytes a state, in base64


# -- nothing but data ---------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def hostile(tmp_path_factory):
    """A run whose names want to be more than names, and its page."""
    folder = tmp_path_factory.mktemp("hostile")
    blocks = [Block(name="a<b>&" + "</script>", team=1, position=(0, 0, 10), motion=Still())]
    directory = record(Mission(blocks=blocks, end=0.5, name=HOSTILE), folder / "run")
    write_html(Recording(directory), folder / "page.html")
    return folder / "page.html"


def test_names_are_data_and_nothing_else(hostile):
    page = PageReader(hostile)
    assert page.document["title"] == HOSTILE
    assert page.document["blocks"][0]["name"].startswith("a<b>&")
    assert "<script>alert" not in page.text
    assert page.text.count("</script>") == len(page.blobs) + 1
    assert not set("<>&") & set(page.blobs["document"])
    [title] = re.findall("<title>(.*)</title>", page.text)
    assert title.startswith("&lt;/script&gt;&lt;script&gt;alert(1)")


def test_the_page_lets_nothing_run_but_its_own_script(hostile):
    text = hostile.read_text(encoding="utf-8")
    [policy] = re.findall('http-equiv="Content-Security-Policy" content="([^"]*)"', text)
    [script] = re.findall(r"<script>(.*?)</script>", text, re.DOTALL)
    [style] = re.findall(r"<style>(.*?)</style>", text, re.DOTALL)
    for kind, body in (("script", script), ("style", style)):
        digest = base64.b64encode(hashlib.sha256(body.encode()).digest()).decode()
        assert f"{kind}-src 'sha256-{digest}'" in policy
    assert policy.startswith("default-src 'none';")
    assert "unsafe" not in policy
    assert not re.search(r"\son\w+=|\sstyle=|javascript:", text)


def test_the_page_names_no_other_place(hostile):
    text = hostile.read_text(encoding="utf-8")
    assert not re.search(
        r"https?:|//[a-z]+\.[a-z]|@import|url\(|\ssrc=|fetch\(|XMLHttpRequest|WebSocket", text
    )
    assert re.findall(r'href="([^"]*)"', text) == ["data:,"]


# -- what stands still --------------------------------------------------------------------------------------------------------------

HARBOUR = """<?xml version="1.0"?>
<runscript name="harbour">
  <run start="0" end="1" dt="0.1"/>
  <background_color>24 40 58</background_color>
  <entity_interaction name="quay" team_id="1" center="0, 0, 60" lengths="500, 400, 120">Boundary</entity_interaction>
  <entity>
    <name>patrol</name><team_id>1</team_id><count>2</count><x>10</x><y>20</y><z>40</z><color>1 2 3</color>
    <base><x>-200</x><y>-120</y><z>5</z><radius>30</radius><opacity>0.5</opacity></base>
    <visual_model>iris</visual_model><visual_scale>0.05</visual_scale>
  </entity>
</runscript>
"""


@pytest.fixture
def harbour(tmp_path):
    (tmp_path / "harbour.xml").write_text(HARBOUR)
    loaded = read_mission(tmp_path / "harbour.xml")
    return Recording(record(loaded.mission, tmp_path / "run", mission_text=loaded.text))


def test_bases_boundaries_and_looks_are_those_of_the_mission(harbour, tmp_path):
    write_html(harbour, tmp_path / "page.html", title="Evening")
    page = PageReader(tmp_path / "page.html")
    scenery, layer = page.document["scenery"], page.document
    assert page.document["title"] == "Evening"
    assert scenery["background"] == [24, 40, 58]
    assert scenery["bases"] == [{"team": 1, "pos": [-200.0, -120.0, 5.0], "radius": 30.0, "opacity": 0.5}]
    [quay] = scenery["regions"]
    assert (quay["name"], quay["team"], quay["isWall"]) == ("quay", 1, False)
    corners = np.array(quay["mesh"]["vertices"]).reshape(-1, 3)
    assert corners.min(axis=0).tolist() == [-250.0, -200.0, 0.0]
    assert len(quay["outline"]) == 12 * 6
    assert scenery["terrain"] is None
    [block] = layer["blocks"]
    assert (block["colour"], block["model"], block["lengths"]) == ([1, 2, 3], "quadrotor", [0.05, 0.05, 0.05])
    assert layer["teams"] == [{"id": 1, "name": "patrol", "colour": [1, 2, 3]}]
    assert set(page.document["models"]) == {"quadrotor", "sphere"}
    # The smallest body is twenty steps long.
    assert page.chunks[0].step <= 0.05 / 20


@pytest.mark.parametrize("n", [7, 70])
def test_the_terrain_is_what_it_was(harbour, tmp_path, monkeypatch, n):
    monkeypatch.setattr("tussle.view.page.document.MAX_HEIGHTS", 300)
    x, y = np.linspace(-100, 100, n), np.linspace(-50, 50, 5)
    hills = Terrain(x, y, 10.0 * np.sin(x / 20.0) + y[:, None] / 7.0)
    harbour.__dict__["scenery"] = replace(harbour.scenery, terrain=hills)
    export = write_html(harbour, tmp_path / "page.html")
    page = PageReader(tmp_path / "page.html")
    said, thin = page.document["scenery"]["terrain"], hills.thinned(300)
    assert len(thin.x) == {7: 7, 70: 35}[n]
    assert said["x"] == pytest.approx(thin.x, abs=1e-3)
    assert said["y"] == pytest.approx(thin.y, abs=1e-3)
    steps = np.cumsum(Bytes(page.blob("terrain")).ints(thin.height.size))
    shown = said["low"] + said["step"] * steps.reshape(thin.height.shape)
    assert np.abs(shown - thin.height).max() <= 0.5 * said["step"] + 1e-9
    is_told = any("the terrain has 70 x 5 heights; 35 x 3 are shown" in note for note in export.notes)
    assert is_told is (n == 70)
