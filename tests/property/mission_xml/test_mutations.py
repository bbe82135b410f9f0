"""Mission files that were damaged somehow: each loads or ends in one of our errors, and never takes long.

TUSSLE_MUTATIONS sets how many are tried; by default a few hundred.
"""

from __future__ import annotations

import contextlib
import os
import re
import time
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tussle import Simulation
from tussle.errors import TussleError
from tussle.mission import read_mission, shipped_missions

EXAMPLES = int(os.environ.get("TUSSLE_MUTATIONS", "300"))
TEXTS = {name: path.read_text(encoding="utf-8") for name, (path, _) in shipped_missions().items()}
TOKEN = re.compile(r"<!--.*?-->|</?[\w:]+|\w+=\"[^\"]*\"|[\w.+-]+|\s+|.", re.DOTALL)
PIECES = [
    *"<>&\"'=/[]}é\0\ud800", "]]>", "<!--", "-->", "<![CDATA[", "&amp;", "&#0;", "&#x110000;", "&x;", "<!DOCTYPE r>",
    "<?xml version='1.0'?>", "${", "${a=", "${end=1}", "-1", "0", "1e308", "-1e308", "1e-320", "nan", "inf", "1e999", "9" * 25,
    "1/0", "true", "5 kt", "12 deg", "[ Boids ]", "Boids", "Unicycle", "JSBSimModel", "<entity/>", "<entity>", "</entity>", "<base/>",
    "<seed>x</seed>", "<network>SphereNetwork</network>", "<sensor>NoisyState</sensor>", "<count>1000000000</count>",
    "<generate_rate>1e300</generate_rate>", "<generate_count>3</generate_count>", "<latitude>1</latitude>", "<health>-0.0</health>",
    '<autonomy behaviors="[ MoveToGoalMS ]">MotorSchemas</autonomy>', ' name="a.b"', ' loop_rate="1e-9"', ' loop_rate="1e308"',
    ' param_common="x"', ' entity_common="predator"', ' dt="1e-9"', ' update="sequential"',
]  # fmt: skip


def change(text: str, kind: str, at: int, other: int, piece: str) -> str:
    """One damage to a text: at one of its tokens."""
    tokens = TOKEN.findall(text)
    i, j = at % len(tokens), other % len(tokens)
    match kind:
        case "drop":
            del tokens[i]
        case "double":
            tokens.insert(i, tokens[i])
        case "swap":
            tokens[i], tokens[j] = tokens[j], tokens[i]
        case "put":
            tokens[i] = piece
        case "insert":
            tokens.insert(i, piece)
        case "cut":
            del tokens[min(i, j) : max(i, j)]
        case "repeat":
            tokens[i:i] = tokens[j : j + 40]
        case "letter":
            tokens[i] = tokens[i][:1] + chr(32 + other % 95) + tokens[i][2:]
    return "".join(tokens)


damage = st.tuples(
    st.sampled_from(["drop", "double", "swap", "put", "insert", "cut", "repeat", "letter"]),
    st.integers(0, 10**6), st.integers(0, 10**6), st.sampled_from(PIECES),
)  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("missions")


def check(folder: Path, text: str, *, plays: bool) -> None:
    path = folder / "mutated.xml"
    path.write_bytes(text.encode("utf-8", "surrogatepass"))
    loaded, said = None, str(path)
    begin = time.process_time()
    try:
        loaded = read_mission(path, strict=len(text) % 2 == 0)
    except TussleError as error:
        said = str(error)
    assert time.process_time() - begin < 5.0
    assert all(line.startswith(str(path)) for line in said.splitlines()), "each line begins with the file"
    if loaded is None:
        return
    mission = loaded.mission
    assert read_mission(path, strict=False).mission == mission
    if plays and sum(block.count for block in mission.blocks) < 2000 and mission.motion_multiplier < 50:
        with contextlib.suppress(TussleError):
            Simulation(mission, seeds=loaded.seed or 1).step()


@settings(max_examples=EXAMPLES, derandomize=EXAMPLES <= 300, suppress_health_check=list(HealthCheck))
@given(name=st.sampled_from(sorted(TEXTS)), damages=st.lists(damage, min_size=1, max_size=4))
def test_damaged_missions_end_in_one_message_or_load(folder, name, damages):
    text = TEXTS[name]
    for one in damages:
        text = change(text, *one) or " "
    check(folder, text, plays=name == "predator_prey")


@settings(max_examples=EXAMPLES, derandomize=EXAMPLES <= 300, suppress_health_check=list(HealthCheck))
@given(st.lists(st.one_of(st.sampled_from(PIECES), st.text(max_size=5)), max_size=30))
def test_any_text_ends_in_one_message(folder, pieces):
    check(folder, "".join(pieces) or " ", plays=False)


VALUES = [
    "", "0", "-1", "1e308", "-1e308", "1e-320", "nan", "inf", "-inf", "1e999", "x", "1 2 3", "5 kt", "90 deg", "true", "1/0", "[ Boids ]",
    "é", "9" * 30, "Unicycle", "uniform",
]  # fmt: skip
NUMBERS = re.compile(r"(?<=>)[^<>\n$]+(?=</)|(?<=\")[^\"<>\n]*(?=\")")


@settings(max_examples=EXAMPLES, derandomize=EXAMPLES <= 300, suppress_health_check=list(HealthCheck))
@given(st.sampled_from(sorted(TEXTS)), st.integers(0, 10**6), st.sampled_from(VALUES))
def test_any_value_anywhere_ends_in_one_message_or_plays(folder, name, at, value):
    places = list(NUMBERS.finditer(TEXTS[name]))
    place = places[at % len(places)]
    text = TEXTS[name][: place.start()] + value + TEXTS[name][place.end() :]
    check(folder, text, plays=name == "predator_prey")
