"""Fits of quantities over what varies, held against functions that are known."""

from __future__ import annotations

import numpy as np
import pytest
from made_batches import made_batch

from tussle.batch.gaussian_process import Covariance, Observed, Posterior, distances, evidence_slopes
from tussle.batch.response import MIN_POINTS, fitted, point_means
from tussle.batch.results import Results
from tussle.batch.sampling import sample
from tussle.batch.variables import Choice, Range
from tussle.errors import ParameterError

UAV, TACTIC = Range("uav", 4, 40, is_int=True), Choice("tactic", ("lanes", "random"))
PACE = Range("pace", 5.0, 20.0)


def truth(uav, tactic, pace=10.0):
    """Share of intruders that are seen."""
    reach = 9.0 if tactic == "lanes" else 12.0
    return 1.0 - np.exp(-np.asarray(uav) / reach) - 0.004 * (pace - 10.0)


def played(points, n_seeds, seed, *, n_each=10, shared=0.0):
    """Shares of ten intruders, by seed and point; with luck of the seeds that all points share."""
    rng = np.random.default_rng(seed)
    p = np.array([truth(**{k.replace("-", ""): v for k, v in point.items()}) for point in points])
    luck = rng.normal(0.0, shared, (n_seeds, 1))
    return rng.binomial(n_each, np.clip(p + luck, 0.0, 1.0)) / n_each


@pytest.mark.parametrize(
    ("variables", "method", "n"),
    [([UAV, TACTIC], "lhs", 24), ([UAV, TACTIC, PACE], "sobol", 48), ([UAV, TACTIC], "grid", None)],
)
def test_bands_contain_the_truth(variables, method, n):
    at, n_inside, n_all = np.linspace(4, 40, 10), 0, 0
    for seed in range(6):
        points = sample(variables, method, n, seed)
        fit = fitted(variables, points, played(points, 8, seed, shared=0.02), is_share=True)
        for tactic in TACTIC.values:
            found = fit.along("uav", at, {"tactic": tactic})
            paces = [p["pace"] for p in points] if PACE in variables else [10.0]
            true = np.mean([truth(at, tactic, pace) for pace in paces], axis=0)
            assert ((found.low >= 0.0) & (found.low < found.value) & (found.value < found.high)).all()
            assert (found.high <= 1.0).all()
            n_inside += int(((found.low <= true) & (true <= found.high)).sum())
            n_all += len(at)
    assert n_inside / n_all > 0.88


def test_differences_of_choices_need_no_points_that_agree_otherwise():
    points = sample([UAV, TACTIC], "lhs", 24, 1)
    fit = fitted([UAV, TACTIC], points, played(points, 10, 1, shared=0.05), is_share=True)
    true = np.mean([truth(p["uav"], "random") - truth(p["uav"], "lanes") for p in points])
    value, low, high = fit.difference("tactic", "lanes", "random")
    assert low < true < high < 0.0
    back = fit.difference("tactic", "random", "lanes")
    assert back == pytest.approx((-value, -high, -low))
    wide = fit.at([{"uav": 20, "tactic": "lanes"}])
    assert high - low < 1.5 * (wide.high[0] - wide.low[0]), "what the seeds add to both cancels"


def test_the_luck_that_all_points_share_stays_in_the_band():
    points = sample([UAV], "lhs", 12, 0)
    rng = np.random.default_rng(0)
    slope = np.array([p["uav"] for p in points])
    own, shared = rng.normal(0.0, 1.0, (10, 12)), rng.normal(0.0, 5.0, (10, 1))
    common, apart = (fitted([UAV], points, slope + own + luck) for luck in (shared, 0.0 * shared))
    widths = [
        float(np.mean(f.high - f.low)) for f in (each.along("uav", [10, 20, 30]) for each in (common, apart))
    ]
    assert widths[0] > 4.0 * widths[1]
    assert point_means(slope + own + shared).common == pytest.approx(25.0 / 10.0, rel=0.7)
    assert point_means(slope + own + shared, has_own_seeds=True).common == 0.0


def test_a_smooth_function_is_found_between_its_points():
    variables = [Range("x", 0.0, 1.0), Range("y", 1.0, 1000.0, is_log=True)]
    points = sample(variables, "lhs", 60, 2)
    x, y = (np.array([p[name] for p in points]) for name in ("x", "y"))
    values = (np.sin(5.0 * x) + np.log10(y) * x)[None, :]
    fit = fitted(variables, points, values)
    found = fit.at([{"x": 0.4, "y": 30.0}, {"x": 0.8, "y": 300.0}])
    true = [np.sin(2.0) + np.log10(30.0) * 0.4, np.sin(4.0) + np.log10(300.0) * 0.8]
    np.testing.assert_allclose(found.value, true, atol=0.05)
    plane = fit.plane("x", "y", [0.4, 0.8], [30.0, 300.0])
    assert plane.shape == (2, 2)
    np.testing.assert_allclose(plane.diagonal(), true, atol=0.05)


def test_parts_of_the_variance_are_those_of_the_function():
    variables = [Range("x", 0.0, 1.0), Range("y", 0.0, 1.0), Choice("tactic", ("a", "b", "c"))]
    points = sample(variables, "lhs", 90, 3)
    x = np.array([p["x"] for p in points])
    shift = np.array([{"a": 0.0, "b": 1.0, "c": -1.0}[p["tactic"]] for p in points])
    rng = np.random.default_rng(4)
    # Variances of 1/12 * 36 = 3, of 0, of 2/3, and of the noise 1.
    values = 6.0 * x + shift + rng.normal(0.0, 1.0, (6, 90))
    parts = fitted(variables, points, values).parts()
    whole = 3.0 + 2.0 / 3.0 + 1.0
    for (first, total), true in zip(parts, (3.0 / whole, 0.0, 2.0 / 3.0 / whole, 1.0 / whole), strict=True):
        assert first[0] == pytest.approx(true, abs=0.05)
        assert total[0] == pytest.approx(true, abs=0.05)
        assert first[1] <= first[0] <= first[2]


def test_values_of_batches_are_fitted():
    points = sample([UAV, TACTIC], "product", 8, 1)
    share = played(points, 5, 1)
    fit = Results(
        made_batch({}, variables=[UAV, TACTIC], points=points, metrics={"G.s": {None: share}})
    ).response("G.s")
    assert fit.is_share
    mean, covariance = fit.joint(points)
    assert mean.shape == (len(points),)
    assert (np.linalg.eigvalsh(covariance) > -1e-6).all()
    assert np.abs(1.0 / (1.0 + np.exp(-mean)) - share.mean(axis=0)).max() < 0.2


def test_what_cannot_be_fitted_is_told():
    points = sample([UAV], "lhs", 3, 0)
    with pytest.raises(ParameterError, match=f"3 points have runs, and a fit takes {MIN_POINTS}"):
        fitted([UAV], points, np.ones((2, 3)))
    with pytest.raises(ParameterError, match="nothing that varies"):
        fitted([], [{}], np.ones((9, 1)))
    points = sample([UAV, TACTIC], "lhs", 9, 0)
    fit = fitted([UAV, TACTIC], points, played(points, 3, 0))
    with pytest.raises(ParameterError, match=r"'uaf' does not vary \(did you mean 'uav'\?\)"):
        fit.along("uaf", [3])
    with pytest.raises(ParameterError, match=r"tactic was never 'lane' \(did you mean 'lanes'\?\)"):
        fit.along("uav", [3], {"tactic": "lane"})


def test_a_quantity_that_does_not_vary_is_a_flat_line():
    points = sample([UAV, TACTIC], "lhs", 9, 0)
    fit = fitted([UAV, TACTIC], points, np.full((5, 9), 7.0))
    found = fit.along("uav", [5, 20])
    for values in (found.value, found.low, found.high):
        np.testing.assert_array_equal(values, 7.0)
    assert fit.difference("uav", 5, 20) == (0.0, 0.0, 0.0)
    ones = fitted([UAV, TACTIC], points, np.ones((5, 9)), is_share=True).along("uav", [5, 20])
    assert (ones.low < 1.0).all()
    assert (ones.value > 0.95).all()


@pytest.mark.parametrize("unit", [1e-9, 1e-3, 1e6])
@pytest.mark.parametrize(
    "kind", ["means differ", "means are equal", "all runs are equal", "one run of each point"]
)
def test_a_band_is_in_the_unit_of_the_quantity(unit, kind):
    points = sample([UAV, TACTIC], "lhs", 9, 0)
    values = {
        "means differ": played(points, 5, 0),
        "means are equal": np.repeat([[1.0], [2.0]], 9, axis=1),
        "all runs are equal": np.full((5, 9), 0.25),
        "one run of each point": np.full((1, 9), 0.25),
    }[kind]
    one, other = (fitted([UAV, TACTIC], points, k * values).along("uav", [5, 20]) for k in (1.0, unit))
    for name in ("value", "low", "high"):
        np.testing.assert_allclose(getattr(other, name), unit * getattr(one, name), rtol=1e-4)


@pytest.mark.parametrize("is_share", [False, True])
@pytest.mark.parametrize("theta", [(0.3, -2.0, -0.5, 0.2, 0.7), (-1.0, -5.0, 1.5, 0.2, -0.7)])
def test_slopes_of_the_evidence_are_its_differences(is_share, theta):
    rng = np.random.default_rng(1)
    x = np.c_[rng.uniform(size=(60, 2)), rng.integers(0, 3, 60)]
    mean = np.sin(5.0 * x[:, 0]) + 0.3 * rng.normal(size=60)
    if is_share:
        mean = rng.binomial(5, 1.0 / (1.0 + np.exp(-2.0 * mean))) / 5.0
    observed = Observed(mean, rng.uniform(5.0, 15.0, 60), 0.0, 0.0, 1.0, is_share, None)

    def kernel(theta):
        amplitude, noise, long, wide, choice = theta
        shape = (np.exp(long), np.exp(wide), 1.0 / (1.0 + np.exp(-choice)))
        return Covariance(np.exp(amplitude), shape, (True, True, False), np.exp(noise))

    def evidence(theta):
        return Posterior(kernel(theta), x, observed).evidence

    varying = kernel(theta).varying(distances(x, x))
    slopes = evidence_slopes(Posterior(kernel(theta), x, observed), observed, distances(x, x), varying)
    steps = 1e-3 * np.eye(5)
    assert slopes == pytest.approx([(evidence(theta + h) - evidence(theta - h)) / 2e-3 for h in steps], rel=1e-3, abs=1e-3)  # fmt: skip
