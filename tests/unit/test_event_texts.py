"""Sentences for events, the same in Python and on the page."""

import json
import re
from importlib.resources import files

import pytest

from tussle.record.event_texts import END_TEXTS, EVENT_TEXTS, end_text, event_text


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("birth", "prey 3", "", "prey"), "prey 3 was born"),
        (("capture", "hunters 1", "prey 3"), "hunters 1 captured prey 3"),
        (("collision", "a", "b"), "a and b collided"),
        (("collision", "a", "", "terrain"), "a hit the terrain"),
        (("collision", "a"), "a hit the ground"),
        (("death", "a", "b", "captured"), "a died: captured (b)"),
        (("death", "a"), "a died"),
        (("end", "", "", "time"), f"the game ended: {end_text('time')}"),
        (("end", "", "", "all found"), "the game ended: all found"),
        (("landing", "a", "", "{b}"), "landing a {b}"),
    ],
)
def test_the_sentence_uses_what_is_known(arguments, sentence):
    assert event_text(*arguments) == sentence


def test_the_page_has_the_same_sentences():
    text = files("tussle.view.page").joinpath("web", "event_texts.js").read_text(encoding="utf-8")
    tables = [json.loads(found) for found in re.findall(r"= (\{.*?\});", text, re.DOTALL)]
    assert tables == [EVENT_TEXTS, END_TEXTS]
