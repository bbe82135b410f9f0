"""tussle view, replay and export on a map."""

from __future__ import annotations

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
