"""Files are opened only where they are files, and documents believed only where they keep their schema."""

from __future__ import annotations

import json
import os
import time
import tracemalloc

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from tussle.documents import (
    MAX_BYTES,
    POSITIVE,
    Checked,
    Document,
    Either,
    Inside,
    Map,
    Maybe,
    Real,
    Team,
    Whole,
    check_argument,
    is_count,
    problem,
    read_text,
    size_of,
)
from tussle.errors import ParameterError, RecordError
from tussle.folders import real_path

THING = Document(
    "the thing",
    3,
    {
        "name": str,
        "kind": ("red", "green"),
        "is_good": bool,
        "n": Whole(1, 10),
        "x": Real(0.0, 5.0),
        "end": Real(is_any=True),
        "file": Inside,
        "teams": Map({"size": Whole()}, Team),
        "parts": [{"name": str}],
        "value": Either((bool, str), "a text, or true or false"),
        "until": Maybe(str),
        "even": Checked(Whole(), lambda value, where: f"{where} is odd" if value % 2 else ""),
    },
    RecordError,
)
GOOD = {
    "format": 3, "name": "a", "kind": "red", "is_good": True, "n": 3, "x": 2, "end": "inf", "file": "a/b.xml", "even": 4, "value": "v",
    "teams": {"-1": {"size": 2}}, "parts": [{"name": "p", "more": 1}], "unknown": [1],
}  # fmt: skip


@pytest.fixture
def thing(tmp_path):
    def read(text):
        (tmp_path / "thing.json").write_text(text)
        return THING.read(tmp_path / "thing.json")

    return read


def test_a_document_that_keeps_its_schema_is_read(thing):
    assert thing(json.dumps(GOOD)) == GOOD
    assert thing(json.dumps(GOOD | {"until": None})) == GOOD | {"until": None}


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"format": 2}, "the thing has format 2"),
        ({"format": True}, "the thing has format True"),
        ({"name": 1}, "name = 1 is not allowed; it takes a text"),
        ({"name": "\ud800"}, r"name = '\ud800' is not allowed; it takes a text"),
        ({"kind": "grin"}, "kind = 'grin' is not allowed (did you mean 'green'?); there are: 'red', 'green'"),
        ({"kind": []}, "kind = [] is not allowed; there are: 'red', 'green'"),
        ({"is_good": 1}, "is_good = 1 is not allowed; it takes true or false"),
        ({"n": 11}, "n = 11 is not allowed; it takes a whole number from 1 to 10"),
        ({"n": 2.0}, "n = 2.0 is not allowed"),
        ({"n": True}, "n = True is not allowed"),
        ({"n": 10**200}, "n = a number of more than 80 digits is not allowed"),
        ({"x": "2"}, "x = '2' is not allowed; it takes a number from 0 to 5"),
        ({"x": -1}, "x = -1 is not allowed"),
        ({"end": "infinite"}, "end = 'infinite' is not allowed"),
        ({"end": [1, 2]}, "end = a list of 2 is not allowed"),
        ({"file": "../a"}, "file = '../a' is not allowed; it takes a path inside the directory"),
        ({"file": "/a"}, "file = '/a' is not allowed"),
        ({"file": "a\0"}, r"file = 'a\x00' is not allowed"),
        ({"teams": []}, "teams = [] is not allowed; it takes an object"),
        ({"teams": {"one": {"size": 1}}}, "teams: the name 'one' is not allowed"),
        ({"teams": {"1": {"size": -1}}}, "teams.1.size = -1 is not allowed"),
        ({"parts": {}}, "parts = {} is not allowed; it takes a list"),
        ({"parts": [{"name": "p"}, {}]}, "parts[1] lacks name"),
        ({"parts": [None]}, "parts[0] = None is not allowed; it takes an object"),
        ({"value": 1}, "value = 1 is not allowed; it takes a text, or true or false"),
        ({"until": 1}, "until = 1 is not allowed; it takes a text"),
        ({"even": 3}, "even is odd"),
        ({"even": "x" * 1000}, "even = '" + "x" * 79 + "... is not allowed"),
    ],
)
def test_a_document_that_breaks_its_schema_is_refused_with_the_field(thing, tmp_path, change, said):
    with pytest.raises(RecordError) as caught:
        thing(json.dumps(GOOD | change))
    assert str(caught.value).startswith(f"{tmp_path / 'thing.json'}: {said}")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "cannot be read"),
        ("[1]", "the thing has format None"),
        ('{"format": 3}', "lacks name, kind"),
        ("[" * 100_000, "nested too deeply"),
        ('{"format": NaN}', "NaN is not a JSON number"),
        ('{"format": 3, "n": ' + "9" * 5000 + "}", "cannot be read"),
    ],
)
def test_what_is_no_document_is_refused(thing, text, said):
    with pytest.raises(RecordError, match=said):
        thing(text)


def test_only_regular_files_of_bounded_size_are_opened(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "device").symlink_to("/dev/zero")
    (tmp_path / "itself").symlink_to("itself")
    (tmp_path / "folder").mkdir()
    (tmp_path / "long").touch()
    os.truncate(tmp_path / "long", MAX_BYTES + 1)
    (tmp_path / "bytes").write_bytes(b"\xff")
    began = time.monotonic()
    for name, said in {
        "pipe": "it is not a regular file", "device": "it is not a regular file", "folder": "it is not a regular file",
        "itself": "Too many levels of symbolic links", "nowhere": "No such file", "bytes": "'utf-8' codec",
        "long": "its size is 33,554,433 bytes; the limit is 33,554,432",
    }.items():  # fmt: skip
        with pytest.raises(RecordError, match=f"{name}: cannot be read: {said}"):
            read_text(tmp_path / name, RecordError)
    assert time.monotonic() - began < 60.0
    assert size_of(tmp_path / "bytes") == 1


@pytest.mark.parametrize("value", ["a", ["x"], [], {}, None, 1, float("nan")])
def test_a_tuple_of_one_value_allows_that_value_and_nothing_else(value):
    assert problem("x", ("x",)) == ""
    assert "is not allowed" in problem(value, ("x",), "field")


@pytest.mark.parametrize("value", [1e-300, np.float64(2.0), np.int64(3), 5])
def test_a_positive_number_of_any_kind_is_taken(value):
    check_argument("period", value, POSITIVE)


@pytest.mark.parametrize(
    "value", [0.0, -1, np.float64(-2.0), float("inf"), float("nan"), True, "1", None, [1.0], np.zeros(2)]
)
def test_all_else_is_refused_with_the_name_and_the_rule(value):
    with pytest.raises(ParameterError, match=r"period = .* is not allowed; it takes a number > 0"):
        check_argument("period", value, POSITIVE)


@given(st.one_of(st.text(), st.text(st.characters(categories=("Nd", "No"))), st.integers().map(str)))
@example("²")
@example("9" * 5000)
def test_a_text_counts_where_it_is_a_whole_number_of_64_bits(text):
    if is_count(text):
        assert 0 <= int(text) < 2**63
        assert f"{int(text):0{len(text)}}" == text
    else:
        assert text not in map(str, range(1000))


def test_a_limit_of_four_gigabytes_takes_no_memory(tmp_path):
    (tmp_path / "small").write_text("small")
    tracemalloc.start()
    try:
        assert read_text(tmp_path / "small", RecordError, 1 << 32) == "small"
        assert tracemalloc.get_traced_memory()[1] < 1 << 20
    finally:
        tracemalloc.stop()


def test_links_are_followed_and_a_loop_of_them_cannot_be_opened(tmp_path):
    for name, to in (("a", "b"), ("b", "a"), ("c", "real")):
        (tmp_path / name).symlink_to(to)
    (tmp_path / "real").write_text("here")
    assert real_path(tmp_path / "c") == real_path(tmp_path) / "real"
    with pytest.raises(OSError, match="symbolic links"):
        real_path(tmp_path / "a").open()
    with pytest.raises(RecordError, match="a: cannot be read: Too many levels"):
        read_text(tmp_path / "a", RecordError)
