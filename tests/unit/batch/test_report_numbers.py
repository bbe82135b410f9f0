"""The numbers of a report: bins, formats, pictures."""

from __future__ import annotations

from xml.etree import ElementTree as ET

import numpy as np
import pytest

from tussle.batch.report.drawing import blank, house_style, inlined, pictured, printable, shortened
from tussle.batch.report.formatting import (
    number,
)
from tussle.batch.report.plots import edges_for, inside
from tussle.palette import INK

# -- bins of histograms -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["whole", "real", "constant", "two"])
def test_bins_hold_all_values(kind):
    rng = np.random.default_rng(5)
    values = {
        "whole": rng.poisson(9.0, 500) - 6.0,
        "real": rng.normal(2.0, 3.0, 500),
        "constant": np.full(5, 7.0),
        "two": np.array([0.0, 1.0]),
    }[kind]
    edges = edges_for(values)
    assert np.histogram(values, edges)[0].sum() == len(values)
    assert len(edges) <= 70
    assert (np.diff(edges) > 0.0).all()


def test_only_what_would_double_the_axis_is_left_outside():
    values = np.append(np.random.default_rng(7).normal(0.0, 1.0, 1000), [5.0, 1e6])
    assert set(values) - set(inside(values)) == {1e6}


# -- formats ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"), (9.0, "9"), (1234.0, "1,234"), (12.345, "12.3"), (0.042111, "0.0421"), (-3.5, "−3.50"), (1234.6, "1,235"),
        (2.5e9, "2.5e9"), (3.2e-7, "3.2e−7"), (float("nan"), "–"), (float("inf"), "–"),
    ],
)  # fmt: skip
def test_numbers_have_the_digits_that_count(value, text):
    assert number(value) == text


def test_long_names_lose_their_middle_and_wide_letters_count_twice():
    assert shortened("keep") == "keep"
    assert shortened("keep to one prey until it is gone") == "keep to one pre… is gone"
    assert len(shortened("漢" * 40)) < 14
    assert printable("a\n b\x00c\ud800\ufffe") == r"a b\x00c\ud800\ufffe"


# -- pictures ---------------------------------------------------------------------------------------------------------------


def test_a_picture_in_a_page_keeps_its_text_and_gives_up_its_names():
    said = f'id="figure_1" url(#x) {INK} <b> & $x^'
    with house_style():
        figure, axes = blank(1.0)
        axes[0, 0].set_title(said)
        axes[0, 0].plot([0.0, 1.0])
        picture = pictured(figure, "plot-a", "<title>")
    page = ET.fromstring(picture.inline)
    assert said in [node.text for node in page.iter("text")]
    assert page.get("aria-label") == "<title>"
    assert all(node.get("id", "plot-a-").startswith("plot-a-") for node in page.iter())
    assert INK in picture.svg
    assert f"fill: {INK}" not in picture.inline
    assert "var(--ink)" in picture.inline
    assert "http" not in picture.inline


def test_two_pictures_of_one_kind_share_no_name():
    with house_style():
        figure, axes = blank(1.0)
        axes[0, 0].plot([0.0, 1.0])
        picture = pictured(figure, "a", "")
    names = [
        {node.get("id") for node in ET.fromstring(inlined(picture.svg, n, "")).iter()} - {None}
        for n in ("a", "b")
    ]
    assert names[0]
    assert not names[0] & names[1]
