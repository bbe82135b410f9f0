"""What a first batch meets: misspelt tags, whole numbers, notes, and games that nobody can win."""

from __future__ import annotations

import json

import numpy as np
import pytest
from made_batches import made_batch, write_batch

from tussle.batch import Batch, Choice, InProcess, load_batch
from tussle.batch.analysis import analyse
from tussle.batch.results import Results
from tussle.batch.search.optimization import Optimization
from tussle.errors import MissionError

TEXT = """<runscript name="flock"><run end="0.2" dt="0.1" time_warp="${warp=1}"/><seed>${luck=3}</seed>
<entity><team_id>1</team_id><name>uav</name>
<count>${count=20}</count>
<x>${x=20}</x><generate_start_time>${late=1}</generate_start_time>
<autonomy max_speed="${speed=20}">Boids</autonomy><controller>DirectController</controller>
<motion_model use_pitch="true">Unicycle</motion_model></entity></runscript>"""


@pytest.fixture
def mission(tmp_path):
    path = tmp_path / "flock.xml"
    path.write_text(TEXT)
    return path


@pytest.mark.parametrize("name", ["warp", "luck", "late"])
def test_a_variable_that_the_game_does_not_depend_on_is_an_error(mission, name):
    line = {"warp": 1, "luck": 1, "late": 4}[name]
    with pytest.raises(
        MissionError, match=rf"{name} has no effect on the game: \$.* stands in .*flock\.xml:{line}"
    ):
        Batch(mission, vary=[f"{name}=1,2"], runs=1)


def test_a_variable_in_a_misspelt_tag_is_an_error_that_names_the_right_one(mission):
    mission.write_text(TEXT.replace("count>", "cuont>"))
    with pytest.raises(MissionError, match="'cuont' is unknown"):
        Batch(mission, vary=["count=5,10,20"], runs=1)
    with pytest.raises(
        MissionError, match=r"count has no effect on the game: .*flock\.xml:3: .*did you mean 'count'"
    ):
        Batch(mission, vary=["count=5,10,20"], runs=1, strict=False)


def test_an_effect_at_some_of_the_points_is_enough(mission):
    mission.write_text(TEXT.replace("<x>", "${rate=}<x>"))
    mission.write_text(
        TEXT.replace("<x>", "<generate_rate>${rate=0}</generate_rate><generate_count>1</generate_count><x>")
    )
    batch = Batch(mission, vary=["rate=0,2", "late=1,2"], runs=1)
    assert len(batch.missions) == 4
    with pytest.raises(MissionError, match="late has no effect on the game"):
        Batch(mission, vary=["late=1,2"], runs=1)


@pytest.mark.parametrize("name", ["count", "uav.count", "uav.team_id"])
def test_ranges_of_what_is_a_whole_number_are_of_whole_numbers(mission, name):
    batch = Batch(mission, vary=[f"{name}=5:30"], samples=9, runs=1)
    assert batch.variables[0].is_int
    assert all(isinstance(point[name], int) for point in batch.plan.points)
    assert Batch(mission, vary={name: (5, 30)}, samples=9, runs=1).variables[0].is_int


@pytest.mark.parametrize("name", ["speed", "x", "uav.x", "uav.Boids.max_speed", "run.end"])
def test_whole_defaults_and_bounds_do_not_make_numbers_whole(mission, name):
    batch = Batch(mission, vary=[f"{name}=5:30"], samples=9, runs=1)
    assert not batch.variables[0].is_int
    assert any(not float(point[name]).is_integer() for point in batch.plan.points)


def test_searches_draw_whole_numbers_too(mission):
    assert Optimization(mission, "t", vary=["count=5:30"]).variables[0].is_int


def test_notes_on_the_mission_are_kept_and_repeated(mission, tmp_path):
    mission.write_text(TEXT.replace("<x>", "<id>3</id><x>"))
    Batch(mission, vary=["count=2,3"], runs=1).play(tmp_path / "out", InProcess(2))
    note = f"{mission}:4: <id> is ignored: ids count up from 1 in the order of the file"
    assert json.loads((tmp_path / "out/batch.json").read_text())["mission"]["notes"] == [note]
    results = load_batch(tmp_path / "out")
    assert note in results.notes
    assert note in analyse(results).notes


def test_batches_without_kept_notes_load(tmp_path):
    path = write_batch(made_batch({}, metrics={"Cap.hits": {None: np.ones((3, 1))}}), tmp_path / "old")
    assert load_batch(path).notes == []


# -- what is looked at ----------------------------------------------------------------------------------------------------

COUNTS = {"variables": [Choice("count", (5, 10, 20))], "points": [{"count": n} for n in (5, 10, 20)]}


def test_without_scores_what_is_measured_comes_first_and_nobody_wins():
    hits = np.arange(12.0).reshape(4, 3)
    results = Results(
        made_batch({}, metrics={"Cap.hits": {None: hits}, "Cap.same": {None: hits * 0.0}}, **COUNTS)
    )
    assert results.defaults.leading == ["Cap.hits"]
    alive = [name for name in results.defaults.all if name.startswith("alive")]
    assert alive == ["alive[1]"], "nobody died of the others"
    assert results.shares() == []


def test_one_team_with_a_score_cannot_win():
    results = Results(made_batch({1: np.arange(12.0).reshape(4, 3)}, **COUNTS))
    assert results.shares() == []
    assert results.defaults.leading[0] == "score[1]"


def test_intervals_over_points_have_none_of_their_differences():
    hits = np.tile([5.0, 10.0, 20.0], (4, 1))
    for more in ({}, {"independent": True}):
        results = Results(made_batch({}, metrics={"Cap.hits": {None: hits}}, **COUNTS, **more))
        mean = results.means(["Cap.hits"])[0]
        assert mean.value == mean.low == mean.high == pytest.approx(35 / 3)
        assert np.isnan(results.survival(1).low).all(), "no interval over points"
        assert np.isfinite(results.survival(1, 0).low).all()


def test_one_seed_has_no_interval_over_points():
    one = Results(made_batch({1: np.zeros((1, 3)), 2: np.array([[1.0, 1.0, -1.0]])}, **COUNTS))
    assert np.isnan(one.means(["score[2]"])[0].low)
    assert all(np.isnan([share.low, share.high]).all() for share in one.shares())
    assert one.shares()[1].value == pytest.approx(2 / 3)


def test_comparisons_over_points_have_none_of_their_differences():
    points = [{"n": n, "tactic": t} for n in (5, 10) for t in ("keep", "switch")]
    variables = [Choice("n", (5, 10)), Choice("tactic", ("keep", "switch"))]
    hits = np.tile([0.0, 1.0, 0.0, 9.0], (3, 1))  # the tactic adds 1 to one and 9 to the other
    for more in ({}, {"independent": True}):
        batch = made_batch({}, metrics={"Cap.hits": {None: hits}}, variables=variables, points=points, **more)
        found = Results(batch).compare("Cap.hits", "tactic=keep", "tactic=switch")
        assert found.difference == found.low == found.high == pytest.approx(5.0)
