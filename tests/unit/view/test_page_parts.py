"""What the page is made of, piece by piece: its document, texts, modules and keys."""

import math
import re
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from recorded_games import hunt

from tussle import Simulation
from tussle.mission import read_mission
from tussle.view import Live
from tussle.view.entity import EntityState, Reading, ShownMessage
from tussle.view.page import formatting
from tussle.view.page.assemble import FRAMED, MAIN, SERVED, page_html, script_text
from tussle.view.page.document import game_document, opening_data, reach_of

WEB = files("tussle.view.page").joinpath("web")


@pytest.fixture
def live():
    with Simulation(hunt(), 1) as simulation, Live(simulation, is_paused=True) as live:
        yield live


# -- the document -----------------------------------------------------------------------------------------------------------------


def test_how_far_plugins_reach_is_where_rings_begin():
    assert reach_of(read_mission("predator_prey").mission) == 200.0
    assert reach_of(None) == 0.0


def test_the_missions_camera_is_where_one_begins():
    notes = []
    said = {"mode": "offset", "follow_id": "2", "pos": "0,-100,50", "focal_point": "0 0 10"}
    assert opening_data(said, notes) == {
        "position": [0.0, -100.0, 50.0], "target": [0.0, 0.0, 10.0], "mode": "behind", "follow": 2,
    }  # fmt: skip
    assert opening_data(None, notes) is None
    assert not notes


@pytest.mark.parametrize(
    ("said", "told"),
    [
        ({"pos": "1,2"}, "camera pos '1,2' is not x, y, z in m"),
        ({"focal_point": "a b c"}, "camera focal_point 'a b c' is not x, y, z"),
        ({"mode": "fly"}, "camera mode 'fly' is none of free, follow, offset"),
        ({"follow_id": "all"}, "camera follow_id 'all' is no id"),
        ({"follow_id": "²"}, "camera follow_id '²' is no id"),
    ],
)
def test_a_camera_that_makes_no_sense_is_told_and_left_out(said, told):
    notes = []
    assert opening_data(said, notes) == {"position": None, "target": None, "mode": "free", "follow": 0}
    assert told in notes[0]


def test_the_missions_own_scale_trails_and_title_count(live):
    plain = game_document(live)
    told = game_document(live, viewer={"scale": 3.0, "plot_tracks": True}, title="Evening")
    assert (plain["scale"], plain["hasTrails"], plain["title"]) == (1.0, False, "hunt")
    assert (told["scale"], told["hasTrails"], told["title"]) == (3.0, True, "Evening")
    assert [block["name"] for block in plain["blocks"]] == live.blocks
    assert {block["model"] for block in plain["blocks"]} <= set(plain["models"])


# -- texts ------------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (1234567, "1,234,567"),
        (0.123456, "0.1235"),
        (True, "yes"),
        (np.array([1.0, 2.5]), "1  2.5"),
        (np.arange(20.0), "0  1  2  3  4  5 … (20)"),
        (np.zeros((2, 2)), "2 rows: 0  0;  0  0"),
        (np.zeros((0, 2)), "–"),
        ("text", "text"),
    ],
)
def test_values_as_text(value, text):
    assert formatting.number(value) == text


def test_units_of_fields_that_are_alike_are_said_once():
    assert formatting.reading(Reading(np.zeros(2), "m m")) == "0  0\N{NO-BREAK SPACE}m"
    assert formatting.reading(Reading(np.zeros(2), "m rad")) == "0\N{NO-BREAK SPACE}m  0°"


@pytest.mark.parametrize(
    ("reading", "text"),
    [
        (Reading(math.pi / 3, "rad"), "60°"),
        (Reading(-0.5, "rad/s"), "−0.5 rad/s"),
        (Reading(math.pi / 3, "rad/s", mission_unit="deg/s", is_parameter=True), "60°/s"),
        (Reading(math.pi / 3, "rad", mission_unit="rad", is_parameter=True), "1.047 rad"),
        (Reading(10.0, "m/s", mission_unit="kt", is_parameter=True), "19.44 kt"),
        (
            Reading(np.array([1.0, -2.0, 0.5]), "m", ("velocity_x", "velocity_y", "velocity_z")),
            "x 1  y −2  z 0.5 m",
        ),
        (
            Reading(np.array([1.0, 2.0, math.pi]), "1/s 1 rad", ("p", "i", "limit"), "", "1/s 1 deg", True),
            "p 1 1/s  i 2  limit 180°",
        ),
        (
            Reading(np.array([[3.0, 0.25 * math.pi], [12345.0, 0.0]]), "1 rad", ("id", "bearing")),
            "2 rows (id  bearing): 3  45;  12,345  0",
        ),
        (Reading(np.zeros((0, 2)), "m", ("x", "y")), "–"),
        (Reading("none", "rad"), "none"),
        (Reading(True), "yes"),
        (Reading(7), "7"),
        (Reading(np.arange(8.0), "m", tuple("abcdefgh")), "a 0  b 1  c 2  d 3  e 4  f 5 … (8) m"),
    ],
)
def test_values_have_the_units_of_missions_and_the_names_of_their_components(reading, text):
    assert formatting.reading(reading).replace(formatting.NARROW, " ") == text


def test_what_a_plugin_does_stands_before_what_it_is():
    columns = {
        "gain": Reading(1.0, is_parameter=True),
        "desired_heading": Reading(0.1, "rad"),
        "goal": Reading(2.0, "m"),
    }
    state = EntityState(0.0, 0, 1, 1, "drone", {}, {"Mine": columns})
    assert formatting.entity_sections(state)[1][1] == [
        ("desired heading", "5.73°"),
        ("goal", "2\N{NO-BREAK SPACE}m"),
        ("gain", "1"),
    ]


def test_an_entity_is_told_with_its_plugins_and_messages():
    state = EntityState(
        0.0, 0, 1, 1, "drone", {"pos": Reading(np.zeros(3), "m"), "force": Reading(0.0)},
        {"Mine": {"goal": Reading(2.0, "m")}, "Empty": {}},
        [ShownMessage("Net/Topic", 0, {"x": 1})], [ShownMessage("Net/Topic", 2, {})],
    )  # fmt: skip
    assert formatting.entity_sections(state) == [
        ("", [("pos", "0  0  0\N{NO-BREAK SPACE}m")]),
        ("Mine", [("goal", "2\N{NO-BREAK SPACE}m")]),
        ("received", [("Net/Topic", "world: x 1")]),
        ("sent", [("Net/Topic", "2: ")]),
    ]


# -- modules and keys -------------------------------------------------------------------------------------------------------------


def test_all_modules_are_on_the_page_once_and_after_what_they_import():
    modules = {f.name for f in WEB.iterdir() if f.name.endswith(".js")}
    modules.remove("widget.js")  # of the notebook, around the page
    script = script_text([SERVED, FRAMED, MAIN])
    place = {}
    for name in modules:
        first_line = WEB.joinpath(name).read_text().partition("\n")[0]
        assert script.count(first_line) == 1, name
        place[name] = script.index(first_line)
    for name in modules:
        for other in re.findall(r"^import [^;]*'\./([\w.]+)';", WEB.joinpath(name).read_text(), re.MULTILINE):
            assert place[other] < place[name], f"{name} imports {other}, which comes later"
    declared = re.findall(r"^(?:const|class|function|async function) (\w+)", script, re.MULTILINE)
    assert len(declared) == len(set(declared)), "joined into one script, two modules would share a name"


def test_only_a_page_that_is_served_can_ask_anybody(live):
    document = game_document(live) | {"source": "embedded"}
    asks = re.compile(r"fetch\(|WebSocket|XMLHttpRequest")
    assert asks.search(page_html(document))
    assert "connect-src 'self'" in page_html(document)
    assert not asks.search(page_html(document, {}))
    assert "connect-src 'none'" in page_html(document, {})
    assert not re.search(r"^(import|export) ", page_html(document), re.MULTILINE)


def keys():
    """Keys as the page's table of them has them, and what they do."""
    text = WEB.joinpath("keys.js").read_text()
    table = text[text.index("KEYS = [") : text.index("const NAMES")]
    return [
        (re.findall(r"'((?:[^'\\]|\\.)+)'", pressed), does)
        for pressed, does in re.findall(r"\[\[((?:'[^']+'(?:, )?)+)\], '([^']+)'", table)
    ]


def test_keys_that_do_different_things_are_different():
    pressed = [key for names, _ in keys() for key in names]
    assert len(pressed) > 40
    assert len(set(pressed)) == len(pressed)


def test_the_guide_has_the_same_keys():
    guide = (Path(__file__).parents[3] / "docs" / "view.md").read_text()
    shown = {
        " ": "space",
        "PageDown": "PgDn",
        "PageUp": "PgUp",
        "ArrowRight": "→",
        "ArrowLeft": "←",
        "Escape": "Esc",
        "-": "−",
    }
    for names, does in keys():
        assert f"| {' '.join(f'`{shown.get(key, key)}`' for key in names)} | {does} |" in guide
