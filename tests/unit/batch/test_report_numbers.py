"""The numbers of a report: axes of variables, means with intervals, bins, formats, pictures."""

from __future__ import annotations

from xml.etree import ElementTree as ET

import numpy as np
import pytest

from tussle.batch.report.drawing import blank, house_style, inlined, pictured, printable, shortened
from tussle.batch.report.formatting import (
    number,
)
from tussle.batch.report.plots import edges_for, inside
from tussle.batch.report.report_data import axis_of, clustered_mean
from tussle.batch.variables import Choice, Range
from tussle.palette import INK

# -- places of a variable ---------------------------------------------------------------------------------------------------


def test_few_values_are_places_and_many_are_bins_of_equal_number():
    speed = Range("speed", 0.0, 1.0, unit="kt")
    few = axis_of(speed, [{"speed": v} for v in (0.5, 0.0, 1.0, 0.5)])
    assert few.texts == ("0", "0.5", "1")
    assert list(few.index) == [1, 0, 2, 1]
    values = np.random.default_rng(1).random(96) ** 3
    many = axis_of(speed, [{"speed": v} for v in values])
    assert many.texts == ()
    assert list(np.bincount(many.index)) == [8] * 12
    np.testing.assert_allclose(many.position[0], np.sort(values)[:8].mean())
    assert few.place_text(1) == "0.5 kt"
    assert many.place_text(11).startswith("from 0.")


def test_texts_are_places_in_the_order_of_the_choice():
    tactic = Choice("tactic", ("rest", "keep", 3))
    axis = axis_of(tactic, [{"tactic": v} for v in ("keep", "3", "rest", "keep")])
    assert (axis.texts, list(axis.index), axis.is_number) == (("rest", "keep", "3"), [1, 2, 0, 1], False)


def test_bins_of_maps_are_of_equal_width_or_ratio():
    points = [{"gain": v} for v in np.geomspace(0.01, 10.0, 40)]
    plain, by_ratio = (
        axis_of(Range("gain", 0.01, 10.0, is_log=is_log), points, 3, is_even=True) for is_log in (False, True)
    )
    np.testing.assert_allclose(plain.edges, [0.01, 3.34, 6.67, 10.0])
    np.testing.assert_allclose(by_ratio.edges, [0.01, 0.1, 1.0, 10.0])


# -- means ------------------------------------------------------------------------------------------------------------------


def mean(values, seed, draw=None, *, is_share=False):
    return clustered_mean(np.asarray(values, float), np.asarray(seed), draw, is_share=is_share)


def test_independent_runs_have_students_and_wilsons_intervals():
    from scipy.stats import binomtest, t

    values = np.random.default_rng(1).normal(5.0, 2.0, 30)
    expected = t.interval(0.95, 29, values.mean(), values.std(ddof=1) / np.sqrt(30))
    np.testing.assert_allclose(mean(values, np.arange(30)), [values.mean(), *expected])
    for k in (12, 40):
        expected = binomtest(k, 40).proportion_ci(method="wilson")
        found = mean(np.repeat([1.0, 0.0], [k, 40 - k]), np.arange(40), is_share=True)
        np.testing.assert_allclose(found[1:], [expected.low, expected.high], rtol=0.02)


@pytest.mark.parametrize("is_share", [False, True])
def test_games_that_repeat_those_of_their_seed_do_not_narrow_the_interval(is_share):
    rng = np.random.default_rng(2)
    luck = (rng.random(25) < 0.4).astype(float) if is_share else rng.random(25)
    once = mean(luck, np.arange(25), is_share=is_share)
    again = mean(np.tile(luck, 8), np.tile(np.arange(25), 8), is_share=is_share)
    np.testing.assert_allclose(again, once, rtol=0.03 if is_share else 1e-9)


def test_the_interval_over_drawn_points_and_seeds_holds_the_mean_as_often_as_it_says():
    """Means of 30 draws × 20 seeds, whose effects have variance 1 each beside noise of variance 1."""
    rng = np.random.default_rng(3)
    draws, seeds = (found.ravel() for found in np.indices((30, 20)))
    held = []
    for _ in range(200):
        values = rng.normal(size=(30, 1)) + rng.normal(size=(1, 20)) + rng.normal(size=(30, 20))
        _, low, high = mean(values.ravel(), seeds, draws)
        held.append(low <= 0.0 <= high)
    # Of 200 intervals of 95 %, 180 to 198 hold in 99.9 % of cases; variances by few clusters are a little too small.
    assert 0.88 <= np.mean(held) <= 0.995


def test_few_seeds_give_an_interval_over_points_only_and_unknown_runs_are_left_out():
    from scipy.stats import t

    values = np.random.default_rng(4).normal(size=40)
    expected = t.interval(0.95, 39, values.mean(), values.std(ddof=1) / np.sqrt(40))
    np.testing.assert_allclose(mean(values, np.ones(40), np.arange(40))[1:], expected)
    assert np.isnan(mean([3.0, np.nan], [1, 2])[1])
    assert mean([1.0, np.nan, 3.0], [1, 2, 3])[0] == 2.0


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
