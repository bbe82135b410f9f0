"""What the first screen of a report answers, and what is drawn of what varies, for batches of all kinds."""

from __future__ import annotations

import re

import numpy as np
import pyarrow.compute as pc
import pytest
from made_batches import made_batch, with_table
from reported_batches import names_of, texts_of

from tussle.batch.report.answers import _half_lost, answers
from tussle.batch.report.report_data import ReportData
from tussle.batch.report.sections import _means
from tussle.batch.report.variable_sections import _surfaces, effects, maps, strengths
from tussle.batch.results import Results
from tussle.batch.sampling import sample
from tussle.batch.variables import Choice, Range

UAV, TACTIC = Range("uav", 4, 40, is_int=True), Choice("tactic", ("lanes", "random"))
PACE = Range("pace", 5.0, 20.0, unit="m/s")


def study(variables, method, n, n_seeds=10, dead=0, lanes_are_better=0.2, **options):
    """Shares of ten intruders that are seen: more with more UAVs, and more in lanes if there are many."""
    points = sample(variables, method, n, 1) if variables else [{}]
    rng = np.random.default_rng(2)
    uav = np.array([point.get("uav", 15) for point in points], dtype=float)
    in_lanes = np.array([point.get("tactic") == "lanes" for point in points])
    p = 0.7 * (1.0 - np.exp(-uav / 8.0)) + lanes_are_better * in_lanes
    share = rng.binomial(10, np.clip(p, 0.0, 1.0), (n_seeds, len(points))) / 10.0
    alive = {
        run: [
            (1, 0.0, int(uav[run % len(points)])),
            (1, 40.0, int(uav[run % len(points)]) - dead),
            (2, 0.0, 5),
        ]
        for run in range(n_seeds * len(points))
    }
    metrics = {"Guard.share": {None: share}}
    return made_batch(
        {}, variables=variables, points=points, metrics=metrics, alive=alive, sample=method, **options
    )


def asked(stored):
    return {each.question: each.text.replace("\u00a0", " ") for each in answers(ReportData(Results(stored)))}


def numbers_in(text):
    return [float(number) for number in re.findall(r"\d+\.\d+|\d+", text)]


@pytest.mark.parametrize(("method", "n"), [("lhs", 24), ("product", 10), ("grid", None)])
def test_a_study_is_answered_on_the_first_screen(method, n):
    found = asked(study([UAV, TACTIC], method, n, dead=1))
    assert list(found) == [
        "Which tactic?",
        "How many uav?",
        "What matters?",
        "When did it go wrong?",
        "Is it luck?",
    ]
    which = found["Which tactic?"]
    assert re.match(
        r"Guard.share is 0\.\d+ with lanes and 0\.\d+ with random at the same uav: a difference of", which
    )
    assert "more than chance makes" in which
    value, low, high = numbers_in(which.partition("a difference of ")[2])[:3]
    assert low <= value <= high
    assert low <= 0.2 <= high
    many = found["How many uav?"]
    assert re.match(r"Guard.share rises from 0\.\d+ \(0\.\d+ to 0\.\d+\) at \d+ to 0\.\d+ ", many)
    assert re.search(r"nine tenths of that by \d+ with lanes and \d+ with random", many)
    assert re.search(r"uav \d+ %.*, tactic \d+ %|tactic \d+ %.*, uav \d+ %", found["What matters?"])
    assert "Prey lost 1.00 a game, half of them by 40 s." in found["When did it go wrong?"]
    assert "the seed makes" in found["Is it luck?"]


def test_no_difference_is_called_chance():
    found = asked(study([UAV, TACTIC], "lhs", 24, lanes_are_better=0.0))
    assert "which may be chance" in found["Which tactic?"]
    found = asked(study([PACE], "lhs", 12))
    assert "does not visibly follow it" in found["Which pace?"]
    assert re.search(r" at [56]\.\d+ m/s, 0", found["Which pace?"])


def test_seeds_alone_are_answered():
    found = asked(study([], "grid", None, n_seeds=30))
    assert found["What matters?"] == "Nothing was varied; games differ by their seeds alone."
    assert "The mean is known to ±0.0" in found["Is it luck?"]
    least = Results(study([], "grid", None, n_seeds=30)).quantity("Guard.share")
    assert (
        f"is that of run {int(least.argmin())} (seed {int(least.argmin()) + 1})"
        in found["When did it go wrong?"]
    )


def test_one_seed_says_that_luck_is_not_known():
    assert "cannot be told" in asked(study([UAV], "lhs", 12, n_seeds=1))["Is it luck?"]


def test_points_that_are_all_alike_are_told():
    stored = study([UAV], "lhs", 12)
    place = stored.table.schema.names.index("value")
    stored = with_table(stored, stored.table.set_column(place, "value", [[1.0] * stored.table.num_rows]))
    assert (
        asked(stored).get("What matters?") is None or "same at all points" in asked(stored)["What matters?"]
    )


def test_winners_are_tested_against_equal_chances():
    scores = {2: np.arange(40.0)[:, None] % 4, 3: np.full((40, 1), 0.5)}
    assert (
        "Hardly: were keepers and switchers equally good, 30 wins to 10"
        in asked(made_batch(scores))["Is it luck?"]
    )


# -- what is drawn ---------------------------------------------------------------------------------------------------------


def test_a_hypercube_has_a_smooth_line_for_each_choice_and_dots_of_its_points():
    stored = study([UAV, TACTIC], "lhs", 12)
    data = ReportData(Results(stored))
    from tussle.batch.report.drawing import house_style

    with house_style():
        plot = next(p for p in effects(data).plots if p.name == "Guard_share-by-uav")
        figure = plot.draw()
    axes = figure.axes[0]
    smooth = [line for line in axes.get_lines() if len(line.get_xdata()) > 20]
    assert len(smooth) == 2
    for line, tactic in zip(smooth, TACTIC.values, strict=True):
        fit = data.results.response("Guard.share").along(
            "uav", [int(x) for x in line.get_xdata()], {"tactic": tactic}
        )
        np.testing.assert_allclose(line.get_ydata(), fit.value)
    dots = [line for line in axes.get_lines() if line.get_linestyle() == "None"]
    means = data.results.means_by_point("Guard.share")
    drawn = sorted(
        (x, y) for line in dots for x, y in zip(*line.get_data(), strict=True) if len(line.get_xdata()) <= 12
    )
    expected = sorted((float(p["uav"]), m.value) for p, m in zip(data.points, means, strict=True))
    np.testing.assert_allclose(sorted(set(drawn)), sorted(set(expected)))
    assert "Dot: mean of the games of a point, with its 95 % interval over the seeds." in plot.caption
    assert "Line: smooth fit (Gaussian process) for each tactic." in plot.caption


def test_two_numbers_have_points_in_the_colours_of_their_means():
    data = ReportData(Results(study([UAV, PACE, TACTIC], "lhs", 30)))
    (plot,) = maps(data).plots
    assert "Dot: mean of the games of a point." in plot.caption
    measure = data.measures[0]
    panels = _surfaces(data, measure, *(axis for axis in data.axes if axis.is_number))
    assert [panel.name for panel in panels] == ["tactic = lanes", "tactic = random"]
    assert sum(panel.dots.shape[1] for panel in panels) == 30
    means = data.results.means_by_point("Guard.share")
    of_lanes = sorted(m.value for p, m in zip(data.points, means, strict=True) if p["tactic"] == "lanes")
    np.testing.assert_allclose(sorted(panels[0].dots[2]), of_lanes)
    assert np.isfinite(panels[0].value).all(), "no cell is empty"


def test_choices_are_among_the_variables_that_matter():
    data = ReportData(Results(study([UAV, TACTIC], "lhs", 24)))
    assert strengths(data).plots
    shown = {e.variable: e.first_order for e in data.effects(data.measures[0])}
    assert shown["tactic"] > 0.05
    assert shown["uav"] > 0.2


def test_choices_without_points_that_pair_are_compared_by_the_fit():
    said = texts_of(study([UAV, TACTIC], "lhs", 24))
    assert "their differences are those of the fit." in said
    assert "Guard.share tactic=lanes → tactic=random – 0." in said


def test_no_quantity_stands_twice_in_a_table_and_none_is_what_varies():
    score = np.round(10.0 * np.random.default_rng(1).random((6, 12)))
    points = sample([UAV], "lhs", 12, 1)
    metrics = {
        "M.hits": {2: score},
        "M.score": {2: score},
        "M.uav": {None: np.tile([p["uav"] for p in points], (6, 1))},
    }
    stored = made_batch({2: score, 3: 0.0 * score}, variables=[UAV], points=points, metrics=metrics)
    for more in ((), ("score[2]",), ("M.hits", "score[2]")):
        rows = [row[0] for row in _means(ReportData(Results(stored), more)).rows]
        assert len(rows) == 1, rows
    table = texts_of(stored, ["score[2]"])
    assert table.count("games score of keepers") <= 1


def test_with_points_no_quantile_pools_them():
    rows = ReportData(Results(study([UAV], "lhs", 12)))
    columns = [name for name, _ in _means(rows).columns]
    assert columns == ["quantity", "mean", "95 % interval", "sd", "lowest point", "highest point", "games"]
    (row,) = _means(rows).rows
    means = [mean.value for mean in rows.results.means_by_point("Guard.share")]
    assert [float(cell) for cell in row[4:6]] == pytest.approx([min(means), max(means)], abs=5e-4)
    assert not {name for name in names_of(study([UAV], "lhs", 12)) if name.startswith("distribution")}


def wins(n_points, hashes):
    points = [{"paint": p} for p in range(n_points)]
    scores = {2: np.full((30, n_points), 3.0), 3: np.random.default_rng(3).uniform(size=(30, n_points))}
    scores[3][:, [run % n_points for run in hashes]] = 1.0
    options = (
        {"variables": [Choice("paint", tuple(range(n_points)))], "points": points} if n_points > 1 else {}
    )
    return asked(made_batch(scores, hashes=hashes, **options))


@pytest.mark.parametrize("n_points", [1, 3])
def test_copies_of_a_game_are_never_taken_for_skill(n_points):
    found = wins(n_points, {run: f"{run % n_points:016x}" for run in range(30 * n_points)})
    assert found["Is it luck?"].startswith("No: the games")
    assert found["Is it luck?"].endswith("are all alike; their seeds change nothing.")
    assert "differ by their seeds" not in found.get("What matters?", "")


def test_what_is_known_of_a_point_is_told_beside_copies_at_others():
    found = wins(3, dict.fromkeys(range(0, 90, 3), "0" * 16))
    assert re.search(r"the mean of a point is known to ±\d", found["Is it luck?"])


@pytest.mark.parametrize("last", [10.0, 1e4])
@pytest.mark.parametrize("seed", range(4))
def test_half_of_the_losses_had_happened_by_then_however_long_a_game_was(seed, last):
    rng = np.random.default_rng(seed)
    times, alive = [], {}
    for run in range(7):
        own = np.sort(rng.choice(np.arange(1, 40), size=rng.integers(0, 9), replace=False)) / 4.0
        times += own.tolist()
        alive[run] = [(1, 0.0, 20), *((1, t, 19 - i) for i, t in enumerate(own.tolist())), (2, 0.0, 5)]
    alive[6].append((2, last, 4))  # the end of the longest game
    metrics = {"Guard.share": {None: rng.uniform(size=(7, 1))}}
    text = asked(made_batch({}, metrics=metrics, alive=alive))["When did it go wrong?"]
    (half,) = re.findall(r"Prey lost [\d.]+ a game, half of them by ([\d.]+) s\.", text)
    assert float(half) == np.quantile(times, 0.5, method="inverted_cdf")


def test_no_time_is_told_of_losses_that_births_hide():
    """One dies and one is born in the step at 20 s: the number that is left does not tell."""
    alive = {run: [(1, 0.0, 9), (1, 20.0, 9), (1, 30.0, 8), (2, 0.0, 5)] for run in range(3)}
    metrics = {"Guard.share": {None: np.full((3, 1), 0.5)}}
    stored = made_batch({}, metrics=metrics, alive=alive)
    value = pc.if_else(
        pc.and_(pc.equal(stored.table["metric"], "start"), pc.equal(stored.table["team"], 1)),
        10.0,
        stored.table["value"],
    )
    table = stored.table.set_column(stored.table.schema.names.index("value"), "value", value)
    results = Results(with_table(stored, table))
    assert results.means(["lost[1]"])[0].value == 2.0
    assert np.isnan(_half_lost(results, 1))
