"""tussle view, replay and export on a map, and exports for other maps."""

from __future__ import annotations

import json
from xml.etree import ElementTree as ET

import pytest
from PIL import Image

ORIGIN = "<latitude_origin>52.2</latitude_origin><longitude_origin>13.3</longitude_origin>"
BOUNDS = ("--map-bounds", "13.2,52.1,13.4,52.3")


@pytest.fixture
def field(folder):
    """A game with an origin, and a picture."""
    mission = (folder / "game.xml").read_text()
    (folder / "field.xml").write_text(mission.replace("<seed>", f"{ORIGIN}<seed>"))
    Image.new("RGB", (300, 200), (200, 30, 30)).save(folder / "photo.png")
    return folder


def test_an_exported_page_holds_the_map(tussle, field):
    tussle("run", "field.xml", "--out", "played", "--end", "1")
    tussle("export", "played", "--html", "plain.html")
    tussle("export", "played", "--html", "mapped.html", "--map", "photo.png", *BOUNDS)
    plain, mapped = ((field / name).read_text() for name in ("plain.html", "mapped.html"))
    assert '"hasTexture":true' not in plain
    assert '"hasTexture":true' in mapped


@pytest.mark.parametrize(
    ("options", "text"),
    [
        (("--map", "photo.png"), "--map-bounds"),
        (("--map", "none.png", *BOUNDS), "none.png"),
        (("--map", "photo.png", "--map-bounds", "1,2,3"), "four numbers"),
        (("--map", "photo.png", "--map-bounds", "13.4,52.1,13.2,52.3"), "swapped"),
        (("--map", "photo.png", "--map-bounds", "3.2,52.1,3.4,52.3"), "outside the mission's area"),
    ],
)
def test_what_has_no_place_is_one_error_of_each_command(tussle, field, options, text):
    tussle("run", "field.xml", "--out", "played", "--end", "0.2")
    page = ("--no-browser", "--port", "8999")
    for command in (
        ("view", "field.xml", *page),
        ("replay", "played", *page),
        ("export", "played", "--html"),
    ):
        said = tussle(*command, *options, code=1).stderr
        assert text in " ".join(said.split())
        assert "Traceback" not in said
    assert not (field / "played/replay.html").exists()


def test_a_mission_without_an_origin_and_bounds_without_a_map(tussle, field):
    done = tussle("view", "game.xml", "--no-browser", "--map", "photo.png", *BOUNDS, code=1)
    assert "no origin" in done.stderr
    assert "latitude_origin" in done.stderr
    assert "--map only" in tussle("view", "field.xml", *BOUNDS, code=2).stderr
    tussle("run", "game.xml", "--out", "played", "--end", "0.2")
    assert "--map is allowed with" in tussle("export", "played", "--csv", "--map", "photo.png", code=2).stderr


def test_a_map_of_the_mission_is_shown_and_goes_with_the_run(tussle, field):
    mission = (field / "field.xml").read_text()
    tag = '<map bounds="13.2, 52.1, 13.4, 52.3">photo.png</map>'
    (field / "field.xml").write_text(mission.replace("<seed>", f"{tag}<seed>"))
    tussle("check", "field.xml")
    tussle("run", "field.xml", "--out", "played", "--end", "1")
    (field / "photo.png").unlink()
    tussle("export", "played", "--html")
    assert '"hasTexture":true' in (field / "played/replay.html").read_text()
    (field / "played/photo.png").unlink()
    said = tussle("export", "played", "--html").stderr
    assert "there is no photo.png, so there is no map" in " ".join(said.split()).replace("'", "")
    assert '"hasTexture":false' not in (field / "played/replay.html").read_text()  # no terrain at all


@pytest.mark.parametrize(
    ("tag", "code", "text"),
    [
        ("<map>photo.mbtiles</map>", 1, "is no picture"),
        ("<map>../photo.png</map>", 1, "only files in the mission's folder"),
        ('<map bound="1">photo.png</map>', 1, "did you mean 'bounds'"),
        ("<map>photo.png</map>", 0, "--map-bounds W,S,E,N; the mission's map is not shown"),
        ('<map bounds="1, 2, 3">photo.png</map>', 0, "not four numbers"),
        ('<map bounds="3.2, 52.1, 3.4, 52.3">photo.png</map>', 0, "outside the mission's area"),
    ],
)
def test_a_map_of_the_mission_that_cannot_be_shown(tussle, field, tag, code, text):
    mission = (field / "field.xml").read_text()
    (field / "field.xml").write_text(mission.replace("<seed>", f"{tag}<seed>"))
    Image.new("RGB", (3, 2)).save(field.parent / "photo.png")
    done = tussle("run", "field.xml", "--strict", "--out", "played", "--end", "0.2", code=code)
    if not code:
        done = tussle("export", "played", "--html")
    assert text in " ".join(done.stderr.split())


def test_a_run_is_written_for_other_maps(tussle, field):
    tussle("run", "field.xml", "--out", "played", "--end", "1")
    asked = (
        "--geojson",
        "--kml",
        "--czml",
        "cesium.czml",
        "--epoch",
        "2026-05-04T11:30:00+02:00",
        "--period",
        "0.5",
    )
    lines = tussle("export", "played", *asked).stdout.splitlines()
    assert [line.split(", 0 areas")[0] for line in lines] == [
        f"{name}: 12 tracks" for name in ("played/tracks.geojson", "played/tracks.kml", "cesium.czml")
    ]
    assert len(json.loads((field / "played/tracks.geojson").read_text())["features"]) == 12
    when = ET.parse(field / "played/tracks.kml").find(".//{http://www.opengis.net/kml/2.2}when")
    assert when.text == "2026-05-04T09:30:00.000000Z"
    packets = json.loads((field / "cesium.czml").read_text())
    assert packets[0]["clock"]["interval"] == "2026-05-04T09:30:00.000000Z/2026-05-04T09:30:01.000000Z"


def test_a_run_without_an_origin_has_no_place_on_other_maps(tussle, folder):
    tussle("run", "game.xml", "--out", "played", "--end", "0.2")
    for kind in ("geojson", "kml", "czml"):
        done = tussle("export", "played", f"--{kind}", code=4)
        assert "set <latitude_origin> and <longitude_origin>" in done.stderr
        assert not (folder / f"played/tracks.{kind}").exists()
    assert (
        "--epoch is allowed with" in tussle("export", "played", "--geojson", "--epoch", "2026", code=2).stderr
    )
    assert "is no date" in tussle("export", "played", "--kml", "--epoch", "noon", code=1).stderr


def test_a_run_is_read_in_the_folder_of_the_mission_with_its_own_terrain(tussle, field):
    mission = (field / "field.xml").read_text()
    (field / "hills.asc").write_text("ncols 3\nnrows 3\ncellsize 10\n" + "1 2 3\n" * 3)
    (field / "field.xml").write_text(mission.replace("<seed>", "<terrain>hills.asc</terrain><seed>"))
    tussle("run", "field.xml", "--out", "played", "--end", "0.2")
    assert "cannot be read" not in tussle("export", "played", "--html").stderr
    assert '"hasTexture":false' in (field / "played/replay.html").read_text()


def test_bounds_in_the_west_begin_with_a_minus(tussle, field):
    mission = (field / "field.xml").read_text().replace("<longitude_origin>13.3", "<longitude_origin>-13.3")
    (field / "west.xml").write_text(mission)
    tussle("run", "west.xml", "--out", "played", "--end", "0.2")
    tussle("export", "played", "--html", "--map", "photo.png", "--map-bounds", "-13.4,52.1,-13.2,52.3")
    assert '"hasTexture":true' in (field / "played/replay.html").read_text()
