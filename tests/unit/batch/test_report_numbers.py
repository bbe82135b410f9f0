"""What stands behind the plots of a report: places of a variable, means with intervals, bins, numbers in words, pictures in pages."""

from __future__ import annotations

from xml.etree import ElementTree as ET

import numpy as np
import pytest
from scipy.stats import binomtest, t

from tussle.batch.report.binning import even_lane, grouped_means, lane_of, place_in_words
from tussle.batch.report.drawing import (
    GRID,
    INK,
    MUTED,
    PALETTE,
    PAPER,
    blank,
    colour_of,
    house_style,
    inlined,
    pictured,
    printable,
    shortened,
)
from tussle.batch.report.plots import edges_for, inside
from tussle.batch.report.words import (
    count,
    estimate,
    file_name,
    number,
    p_value,
    percent,
    seconds,
    sentence,
    signed,
)
from tussle.batch.variables import Choice, Range

# -- places of a variable ---------------------------------------------------------------------------------------------------


def test_few_values_are_places_and_many_are_bins_of_equal_number():
    speed = Range("speed", 0.0, 1.0, unit="kt")
    few = lane_of(speed, [{"speed": v} for v in (0.5, 0.0, 1.0, 0.5)])
    assert few.texts == ("0", "0.5", "1")
    assert list(few.index) == [1, 0, 2, 1]
    values = np.random.default_rng(1).random(96) ** 3
    many = lane_of(speed, [{"speed": v} for v in values])
    assert many.texts == ()
    assert list(np.bincount(many.index)) == [8] * 12
    np.testing.assert_allclose(many.position[0], np.sort(values)[:8].mean())
    assert place_in_words(few, 1) == "0.5 kt"
    assert place_in_words(many, 11).endswith(" to 0.989 kt") or place_in_words(many, 11).startswith("from 0.")


def test_texts_are_places_in_the_order_of_the_choice():
    tactic = Choice("tactic", ("rest", "keep", 3))
    lane = lane_of(tactic, [{"tactic": v} for v in ("keep", "3", "rest", "keep")])
    assert (lane.texts, list(lane.index), lane.is_number) == (("rest", "keep", "3"), [1, 2, 0, 1], False)


def test_numbers_to_choose_from_lie_on_an_axis_by_ratio_where_they_are_far_apart():
    near, far = (
        lane_of(Choice("n", values), [{"n": v} for v in values]) for values in ((1, 2, 4), (1, 10, 100))
    )
    assert (near.is_number, near.is_log) == (True, False)
    assert far.is_log


def test_bins_of_maps_are_of_equal_width_or_ratio():
    points = [{"gain": v} for v in np.geomspace(0.01, 10.0, 40)]
    plain, by_ratio = (
        even_lane(lane_of(Range("gain", 0.01, 10.0, is_log=is_log), points), points, 3)
        for is_log in (False, True)
    )
    np.testing.assert_allclose(plain.edges, [0.01, 3.34, 6.67, 10.0])
    np.testing.assert_allclose(by_ratio.edges, [0.01, 0.1, 1.0, 10.0])
    assert np.bincount(by_ratio.index).sum() == 40


# -- means ------------------------------------------------------------------------------------------------------------------


def means(values, group, draw, seed, **options):
    return grouped_means(
        np.asarray(values, float), np.asarray(group), int(np.max(group)) + 1, np.asarray(draw), np.asarray(seed), **options
    )  # fmt: skip


def test_one_point_for_each_group_has_students_interval():
    values = np.random.default_rng(1).normal(5.0, 2.0, 30)
    seed = np.arange(30)
    found = means(values, np.zeros(30, int), np.zeros(30, int), seed, is_share=False, is_sampled=False)
    low, high = t.interval(0.95, 29, values.mean(), values.std(ddof=1) / np.sqrt(30))
    np.testing.assert_allclose([found.mean[0], found.low[0], found.high[0]], [values.mean(), low, high])


def test_shares_of_independent_games_have_wilsons_interval():
    won = np.repeat([1.0, 0.0], [12, 28])
    found = means(won, np.zeros(40, int), np.zeros(40, int), np.arange(40), is_share=True, is_sampled=False)
    expected = binomtest(12, 40).proportion_ci(method="wilson")
    np.testing.assert_allclose([found.low[0], found.high[0]], [expected.low, expected.high])


def test_a_team_that_always_wins_has_an_interval_all_the_same():
    found = means(
        np.ones(20), np.zeros(20, int), np.zeros(20, int), np.arange(20), is_share=True, is_sampled=False
    )
    expected = binomtest(20, 20).proportion_ci(method="wilson")
    np.testing.assert_allclose([found.low[0], found.high[0]], [expected.low, expected.high])


@pytest.mark.parametrize("is_share", [False, True])
def test_games_that_repeat_what_others_of_their_seed_say_do_not_narrow_the_interval(is_share):
    rng = np.random.default_rng(2)
    luck = rng.random(25) if not is_share else (rng.random(25) < 0.4).astype(float)
    once = means(
        luck, np.zeros(25, int), np.zeros(25, int), np.arange(25), is_share=is_share, is_sampled=False
    )
    again = means(
        np.tile(luck, 8), np.zeros(200, int), np.repeat(np.arange(8), 25), np.tile(np.arange(25), 8),
        is_share=is_share, is_sampled=False,
    )  # fmt: skip
    # Of shares a little wider, since it counts as known from 25 seeds, not as 25 games.
    np.testing.assert_allclose(
        [again.low[0], again.high[0]], [once.low[0], once.high[0]], rtol=0.03 if is_share else 1e-9
    )
    assert again.high[0] - again.low[0] >= (once.high[0] - once.low[0]) * (1.0 - 1e-9)


def test_the_interval_over_drawn_points_and_seeds_holds_the_mean_as_often_as_it_says():
    """4,000 means of 30 draws × 20 seeds, whose effects have variance 1 each beside noise of variance 1."""
    rng = np.random.default_rng(3)
    n_sets, n_draws, n_seeds = 400, 30, 20
    values = (
        rng.normal(size=(n_sets, n_draws, 1))
        + rng.normal(size=(n_sets, 1, n_seeds))
        + rng.normal(size=(n_sets, n_draws, n_seeds))
    )
    sets, draws, seeds = np.indices(values.shape)
    held = []
    for i in range(n_sets):
        mine = sets == i
        found = means(
            values[i].ravel(),
            np.zeros(mine.sum(), int),
            draws[mine],
            seeds[mine],
            is_share=False,
            is_sampled=True,
        )
        held.append(found.low[0] <= 0.0 <= found.high[0])
    # Of 400 intervals of 95 %, 361 to 395 hold in 99.9 % of cases; variances by few clusters are a little too small.
    assert 0.90 <= np.mean(held) <= 0.99


def test_shares_of_few_drawn_points_are_not_known_better_than_these_tell():
    won = np.array([1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0])
    zeros, draws = np.zeros(8, int), np.repeat(np.arange(4), 2)
    found = means(won, zeros, draws, np.tile([1, 2], 4), is_share=True, is_sampled=True)
    free = means(won, zeros, np.arange(8), np.tile([1, 2], 4), is_share=True, is_sampled=True)
    assert found.low[0] < free.low[0] < 0.5 < free.high[0] < found.high[0]
    even = means(np.tile([1.0, 0.0], 4), zeros, draws, np.tile([1, 2], 4), is_share=True, is_sampled=True)
    np.testing.assert_allclose(
        [even.low[0], even.high[0]], list(binomtest(4, 8).proportion_ci(method="wilson"))
    )


def test_one_seed_at_all_points_gives_an_interval_over_points_only():
    values = np.random.default_rng(4).normal(size=40)
    found = means(values, np.zeros(40, int), np.arange(40), np.ones(40), is_share=False, is_sampled=True)
    low, high = t.interval(0.95, 39, values.mean(), values.std(ddof=1) / np.sqrt(40))
    np.testing.assert_allclose([found.low[0], found.high[0]], [low, high])


def test_what_is_not_known_is_left_out():
    found = means(
        [1.0, np.nan, 3.0, 9.0], [0, 0, 0, 1], [0, 0, 0, 1], [1, 2, 3, 1], is_share=False, is_sampled=False
    )
    assert list(found.n) == [2, 1]
    assert list(found.mean) == [2.0, 9.0]
    assert np.isnan(found.low[1])


# -- bins of histograms -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("is_about_zero", [False, True])
@pytest.mark.parametrize("kind", ["whole", "real", "constant", "two"])
def test_bins_hold_all_values(kind, is_about_zero):
    rng = np.random.default_rng(5)
    values = {
        "whole": rng.poisson(9.0, 500) - 6.0,
        "real": rng.normal(2.0, 3.0, 500),
        "constant": np.full(5, 7.0),
        "two": np.array([0.0, 1.0]),
    }[kind]
    edges = edges_for(values, is_about_zero=is_about_zero)
    assert np.histogram(values, edges)[0].sum() == len(values)
    assert len(edges) <= 70
    assert (np.diff(edges) > 0.0).all()


def test_bins_of_whole_numbers_hold_equally_many_of_them():
    edges = edges_for(np.arange(0.0, 200.0))
    width = np.diff(edges)
    assert np.allclose(width, width[0])
    assert width[0] == round(width[0])
    assert (edges % 1.0 == 0.5).all()


def test_bins_about_zero_part_who_is_ahead():
    edges = edges_for(np.random.default_rng(6).integers(-40, 90, 500).astype(float), is_about_zero=True)
    middle = np.searchsorted(edges, 0.0)
    np.testing.assert_allclose(edges[middle - 1], -edges[middle])


def test_only_what_would_double_the_axis_is_left_outside():
    values = np.append(np.random.default_rng(7).normal(0.0, 1.0, 1000), [5.0, 1e6])
    assert set(values) - set(inside(values)) == {1e6}


# -- words ------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"), (9.0, "9"), (1234.0, "1,234"), (12.345, "12.3"), (0.042111, "0.0421"), (-3.5, "−3.50"), (1234.6, "1,235"),
        (2.5e9, "2.5e9"), (3.2e-7, "3.2e−7"), (float("nan"), "–"), (float("inf"), "–"),
    ],
)  # fmt: skip
def test_numbers_have_the_digits_that_count(value, text):
    assert number(value) == text


def test_other_words():
    assert estimate(9.0) == "9.00"
    assert percent(0.593).replace("\u00a0", " ") == "59.3 %"
    assert percent(float("nan")) == "–"
    assert [signed("3"), signed("−3"), signed("–"), signed("0")] == ["+3", "−3", "–", "0"]
    assert [count(1000), count(1, "game"), count(2000, "game")] == ["1,000", "1 game", "2,000 games"]
    assert [p_value(0.0004), p_value(0.0123), p_value(0.5), p_value(float("nan"))] == [
        "< 0.001",
        "0.012",
        "0.50",
        "–",
    ]
    assert [seconds(s).replace("\u00a0", " ") for s in (0.42, 12.0, 200.0, 20000.0)] == [
        "0.4 s",
        "12 s",
        "3.3 min",
        "5.6 h",
    ]
    assert seconds(float("nan")) == "–"
    assert [sentence("so it is"), sentence(" Is it so? ")] == ["So it is.", "Is it so?"]
    assert [file_name("score[2]-t"), file_name("…"), len(file_name("x" * 99))] == ["score_2_t", "x", 40]


def test_long_names_lose_their_middle_and_wide_letters_count_twice():
    assert shortened("keep") == "keep"
    assert shortened("keep to one prey until it is gone") == "keep to one pre… is gone"
    assert len(shortened("漢" * 40)) < 14
    assert printable("a\n b\x00c\ud800\ufffe") == r"a b\x00c\ud800\ufffe"


# -- pictures ---------------------------------------------------------------------------------------------------------------


def test_teams_have_colours_of_their_own_up_to_eight():
    assert len({colour_of(team) for team in range(1, 9)}) == 8
    assert colour_of(1) == "#0072b2"
    assert not {GRID, MUTED, PAPER} & set(PALETTE)


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
