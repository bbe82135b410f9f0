"""Quantities over the steps of a game: each value is what it is of, whoever watches and however the game is wound."""

import itertools
import json
import math

import numpy as np
import pytest
from guarded_gate import guarded_gate
from page_client import PageClient, browsed
from recorded_games import hunt, record
from watched_plugins import clickable

from tussle import Recorder, Simulation, load_run
from tussle.api import Metric
from tussle.messages import CustomKeyPress
from tussle.view import Live, Recording, timeline
from tussle.view import curves as curves_module
from tussle.view import series as series_module
from tussle.view.curves import numbers_of
from tussle.view.entity import entity_state
from tussle.view.page.compare import Comparison
from tussle.view.page.formatting import differing_settings
from tussle.view.page.recorded import RecordedData
from tussle.view.page.recorded_curves import COLUMNS, column_changes
from tussle.view.series import CurveName, StepSeries


def live_of(mission, seed=5, **options):
    return Live(Simulation(mission, seed), is_paused=True, threaded=False, **options)


def steps_of(mission, seed=5):
    """The result after each step of the game alone, which is not wound."""
    with Simulation(mission, seed) as alone:
        while True:
            yield int(alone.steps[0]), alone.result()[0]
            if alone.is_over:
                return
            alone.step()


def named_results(result):
    """Scores and results of plugins, by name and team."""
    found = {("score", team): n for team, n in result.scores.items()}
    for plugin, named in result.metrics.items():
        for name, value in named.items():
            by_team = value if isinstance(value, dict) else {None: value}
            found |= {(f"{plugin}.{name}", team): v for team, v in by_team.items()}
    return found


def check_world(live, mission, seed=5, last=math.inf):
    """Compare every quantity of the world with the results of the game alone, in each step."""
    series = live.curves.series
    for step, result in steps_of(mission, seed):
        if step > last:
            return
        expected = {CurveName("left", team): n for team, n in result.alive.items()}
        expected |= {CurveName("born", team): n for team, n in result.born.items()}
        expected |= {CurveName(*name): v for name, v in named_results(result).items()}
        assert {quantity: each.at(step) for quantity, each in series.items() if not quantity.id} == expected


@pytest.mark.parametrize("mission", [guarded_gate(), hunt(n_prey=6)])
def test_quantities_of_the_world_are_its_results_in_each_step(mission):
    with live_of(mission) as live:
        live.step(150)
        live.seek(3.0)
        live.step(400)
        assert live.is_over
        check_world(live, mission)


def test_another_course_of_the_game_has_its_own_curves():
    with live_of(guarded_gate()) as live:
        live.step(120)
        live.watch([CurveName("x", None, 1)])
        live.step(5)
        live.seek(4.0)
        live.publish(CustomKeyPress, key=";")
        assert max(each.last for each in live.curves.series.values()) == 40
        check_world(live, guarded_gate(), last=40)
        live.reset(9)
        live.step(60)
        check_world(live, guarded_gate(), seed=9, last=60)


def test_a_game_that_others_step_has_curves_of_the_present_episode():
    simulation = Simulation(guarded_gate(), 5)
    live = Live(simulation, is_followed=True, pace=None)
    for _ in range(70):
        simulation.step()
        live.follow()
    check_world(live, guarded_gate(), last=70)
    simulation.reset([0])
    for _ in range(30):
        simulation.step()
        live.follow()
    assert live.curves.series["left", 2, 0].last == 30


def test_columns_of_an_entity_are_its_state_in_each_step_from_when_they_are_chosen():
    mission = clickable()
    wanted = [
        CurveName("x", None, 2),
        CurveName("speed", None, 2),
        CurveName("GoWhereClicked.velocity.velocity_y", None, 2),
        CurveName("yaw", None, 3),
    ]
    with live_of(mission) as live:
        live.step(20)
        live.watch(wanted)
        live.step(20)
        found = dict(live.curves.series)
        with Simulation(mission, 5) as alone:
            alone.step(20)
            for step in range(20, 41):
                for name, _, who in wanted:
                    assert found[name, None, who].at(step) == numbers_of(entity_state(alone, 0, who))[name][0]
                alone.step()
        assert [found[q].first for q in wanted] == 4 * [20]
        live.watch(wanted[:1])
        assert [q for q in live.curves.series if q.id] == wanted[:1]


def test_a_column_that_was_read_in_parts_is_not_known_between_them(monkeypatch):
    monkeypatch.setattr(timeline, "SNAPSHOT_SHARE", 1e9)
    with live_of(hunt(end=60.0, end_conditions="time"), snapshot_every=0.1) as live:
        live.step(100)
        live.seek(1.0)
        live.watch([CurveName("x", None, 15)])
        live.step(5)
        live.seek(9.0)
        live.step(5)
        x = live.curves.series["x", None, 15]
        assert [x.first, x.last] == [10, 95]
        assert np.isnan([x.at(step) for step in (9, 16, 89)]).all()
        assert np.isfinite([x.at(step) for step in (10, 15, 90, 95)]).all()


def test_columns_of_who_does_not_exist_are_not_known():
    wanted = [CurveName("March.way", None, 5), CurveName("no such", None, 5), CurveName("x", None, 99)]
    with live_of(guarded_gate()) as live:
        live.watch(wanted)
        live.step(79)
        way, *others = (live.curves.series[q] for q in wanted)
        with Simulation(guarded_gate(), 5) as alone:
            for step in range(80):
                state = entity_state(alone, 0, 5)
                number = math.nan if state is None else state.plugins["March"]["way"].value
                assert way.at(step) == pytest.approx(number, nan_ok=True, rel=0, abs=0)
                alone.step()
        assert np.isnan([each.at(79) for each in others]).all()


def test_names_and_units_of_all_numbers_of_an_entity():
    with Simulation(guarded_gate(), 5) as simulation:
        simulation.step(40)
        numbers = numbers_of(entity_state(simulation, 0, 5))
    units = {name: unit for name, (_, unit) in numbers.items()}
    assert [units[n] for n in ("x", "vy", "speed", "quat_w", "omega_z", "yaw")] == [
        "m",
        "m/s",
        "m/s",
        "",
        "rad/s",
        "rad",
    ]
    assert [units[n] for n in ("March.way", "March.goal.x", "March.velocity.velocity_x")] == ["m", "m", "m/s"]
    assert numbers["March.velocity.velocity_x"][0] == -8.0


class Odd(Metric):
    """Results that are no finite numbers."""

    def step(self, w):
        pass

    def result(self, w):
        return {"score": np.array([[math.inf]]), "late": 1.0 / np.where(w.step_count < 3, math.nan, 1.0)}


class Slow(Metric):
    """Results that take longer than a step."""

    def step(self, w):
        pass

    def result(self, w):
        for _ in itertools.repeat(None, 100_000):
            pass
        return {"n": w.step_count.copy()}


def test_what_is_no_finite_number_is_null_on_the_page():
    with browsed(clickable(metrics=[Odd()]), 1, is_paused=True) as (live, _, client):
        live.step(5)
        client.order("want", wanted=[["Odd.late", 0]])
        client.wait(
            lambda: client.curves.get(("Odd.late", None, 0)) == [[0.0, None], [pytest.approx(0.3), 1.0]]
        )
        assert client.curves["score", 1, 0] == [[0.0, None]]
        assert "Odd.late" in client.results


def test_results_that_take_long_are_read_less_often_and_this_is_said(monkeypatch):
    monkeypatch.setattr(curves_module, "READING_SHARE", 1e-9)
    with live_of(clickable(metrics=[Slow()])) as live:
        live.step(30)
        assert len(live.curves.series["Slow.n", None, 0].values) < 30
        assert live.curves.series["left", 1, 0].values == [3]
        assert "reading results takes long: their curves do not have every step" in live.notes


def test_the_memory_of_a_curve_is_bounded_and_what_is_missing_is_said(monkeypatch):
    monkeypatch.setattr(series_module, "MAX_CHANGES", 50)
    with live_of(guarded_gate()) as live:
        live.step(200)
        gone = live.curves.series["Share.gone", None, 0]
        assert len(gone.values) <= 50
        assert all(value == step / 100 for step, value in zip(gone.steps, gone.values, strict=True))
        assert "Share.gone changes often: its curve does not have every change of the past" in live.notes


def test_a_series_has_changes_only():
    series = StepSeries()
    for step, value in enumerate([1.0, 1.0, math.nan, math.inf, 2.0]):
        series = series.add(step, value)
    assert (series.steps, series.last) == ([0, 2, 4], 4)
    assert series.until(3).steps == [0, 2]


def test_a_browser_gets_each_change_once_and_all_when_it_comes_late():
    with browsed(guarded_gate(), 5, is_paused=True, pace=None) as (live, page, client):
        live.step(100)
        client.order("want", wanted=[["Share.gone", 0], ["x", 2], ["Gate.passed", 0]])
        client.wait(lambda: ("x", None, 2) in client.curves)
        live.step(100)
        live.settle()
        client.wait(lambda: len(client.curves["Share.gone", None, 0]) == 201)
        with PageClient(page.url) as late:
            late.wait(lambda: ("left", 2, 0) in late.curves)
            assert late.curves["left", 2, 0] == client.curves["left", 2, 0]
            assert ("Share.gone", None, 0) not in late.curves, "nobody asked for it there"
        series = live.curves.series["Share.gone", None, 0]
        assert client.curves["Share.gone", None, 0] == [
            [live.time_of(step), value] for step, value in zip(series.steps, series.values, strict=True)
        ]
        client.order("want", wanted=[["x", "2"]])
        client.wait(lambda: client.refusals)
        assert "it takes at most 64 pairs of a name and an id" in client.refusals[0]
        client.close()
        live.settle()
        late.wait(lambda: not any(q.id for q in live.curves.series))


# -- recorded runs --------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    base = tmp_path_factory.mktemp("runs")
    gate = guarded_gate()
    return {
        "every step": record(gate, base / "a", (5,)),
        "every second": record(gate, base / "b", (5,), period=1.0),
        "hunt": record(hunt(n_prey=6), base / "c", (3,)),
        "larger hunt": record(hunt(n_prey=8, end=5.0), base / "d", (4,)),
    }


def changes_in(data, name="curves"):
    return {(c["name"], c["team"], c["id"]): (c["t"], c["v"]) for c in json.loads(data.blob(name))}


def value_at(curve, t):
    times, values = curve
    return values[int(np.searchsorted(times, t, side="right")) - 1]


@pytest.mark.parametrize("name", ["every step", "every second", "hunt"])
def test_recorded_curves_are_the_entities_of_each_frame_and_the_events_so_far(runs, name):
    run = Recording(runs[name], is_mapped=True)
    curves = changes_in(RecordedData(run, is_file=False))
    blocks = {
        team: [run.blocks[i] for i, its in enumerate(run.block_teams) if its == team] for team in run.teams
    }
    for i in range(run.n_frames):
        frame = run.frame(i)
        for team in run.teams:
            assert value_at(curves["left", team, 0], frame.t) == (frame.team == team).sum()
            born = [e for e in run.events if e.kind == "birth" and e.text in blocks[team] and e.t <= frame.t]
            assert value_at(curves["born", team, 0], frame.t) == len(born)
    for times, values in curves.values():
        assert (np.diff(times) > 0).all()
        assert (np.diff(values) != 0).all()


@pytest.mark.parametrize("period", [0.7, 5.0, 100.0])
@pytest.mark.parametrize("mission", [guarded_gate(), hunt(n_prey=8, end=15.0)])
def test_recorded_curves_of_who_is_left_do_not_depend_on_the_period(tmp_path, mission, period):
    seldom = Recording(record(mission, tmp_path / "seldom", (5,), period=period))
    often = Recording(record(mission, tmp_path / "often", (5,)))
    curves = changes_in(RecordedData(seldom, is_file=False))
    assert seldom.n_frames < often.n_frames
    for i in range(often.n_frames):
        frame = often.frame(i)
        for team in often.teams:
            assert value_at(curves["left", team, 0], frame.t + 1e-6) == (frame.team == team).sum()
    assert len(curves["left", 1, 0][0]) > 2


def test_recorded_results_are_those_after_each_step_of_every_world(tmp_path):
    seeds, mission = (5, 6), guarded_gate()
    record(mission, tmp_path / "run", seeds, results=True, period=3.0)
    hashes = [world["state_hash"] for world in load_run(tmp_path / "run").info["worlds"]]
    assert hashes == [result.state_hash for result in Simulation(mission, seeds=list(seeds)).run()]
    assert load_run(tmp_path / "run").is_complete
    for world, seed in enumerate(seeds):
        found = Recording(tmp_path / "run", world).results
        for step, result in steps_of(mission, seed):
            assert {key: value_at(curve, result.t) for key, curve in found.items()} == named_results(
                result
            ), step
        assert len(found["Gate.passed", None][0]) == 1 + result.metrics["Gate"]["passed"]
    shown = changes_in(RecordedData(Recording(tmp_path / "run"), is_file=True))
    assert {
        name: [list(part) for part in shown[*name, 0]] for name in [("score", 2), ("Share.gone", None)]
    } == {
        name: [list(part) for part in Recording(tmp_path / "run").results[name]]
        for name in [("score", 2), ("Share.gone", None)]
    }


def test_results_of_a_run_that_is_not_closed_are_there(tmp_path):
    with Simulation(guarded_gate(), 5) as simulation:
        recorder = Recorder(simulation, tmp_path / "run", results=True)
        simulation.step(50)
        recorder.flush()
        run = Recording(tmp_path / "run")
        assert run.results["score", 1][1][-1] == -0.125 * 49
        assert Recording(record(clickable(end=1.0), tmp_path / "none")).results == {}


class NotYet(Metric):
    """Results that cannot be made after a while."""

    def step(self, w):
        pass

    def result(self, w):
        return {"n": 1 / (w.step_count != 5)} if w.step_count[0] != 5 else {"n": 1 // 0}


def test_results_that_fail_end_their_recording_and_not_the_run(tmp_path):
    with (
        Simulation(clickable(end=2.0, metrics=[NotYet()]), 1) as simulation,
        pytest.warns(RuntimeWarning, match="results are recorded no longer"),
        Recorder(simulation, tmp_path / "run", results=True),
    ):
        simulation.run()
    run = Recording(tmp_path / "run")
    assert run.is_complete
    assert run.results["NotYet.n", None] == ([0.0], [1.0])


def test_a_live_game_whose_results_fail_goes_on():
    with live_of(clickable(metrics=[NotYet()])) as live:
        live.step(30)
        assert live.step_number == 30
        assert any("ZeroDivisionError" in note for note in live.notes)


def test_two_runs_have_curves_of_their_own(runs):
    pair = Comparison(Recording(runs["hunt"]), Recording(runs["larger hunt"]))
    curves = changes_in(RecordedData(pair, is_file=False))
    assert {key[1] for key in curves} == {1, 2, 11, 12}
    for key in ("left", "born", "captures"):
        for team in (1, 2):
            alone = [changes_in(RecordedData(run, is_file=False))[key, team, 0] for run in (pair.a, pair.b)]
            assert [curves[key, team, 0], curves[key, team + 10, 0]] == alone
    document = RecordedData(pair, is_file=False).document()
    assert [(team["id"], team["name"]) for team in document["teams"]] == [
        (1, "A prey, late"), (2, "A hunters"), (11, "B prey, late"), (12, "B hunters"),
    ]  # fmt: skip
    assert document["teams"][0]["colour"] != document["teams"][2]["colour"]
    assert [run["teams"] for run in document["runs"]] == [[1, 2], [11, 12]]
    assert sorted(list(row) for row in document["differing"] if row[0] != "seed") == [
        ["prey.count", "6", "8"],
        ["run.end", "6", "5"],
    ]


def test_settings_of_runs_whose_missions_cannot_be_read_are_those_that_are_listed(runs):
    a, b = Recording(runs["every step"]), Recording(runs["hunt"])
    assert a.mission is None or b.mission is None
    rows = {path: (x, y) for path, x, y in differing_settings(a, b)}
    assert rows["run.end"] == ("20", "6")
    assert rows["guard.count"] == ("4", "–")


@pytest.mark.parametrize("name", COLUMNS)
def test_recorded_columns_are_the_values_of_each_frame(runs, name):
    run = Recording(runs["every step"], is_mapped=True)
    for who in (2, 7):
        changes = column_changes(run, who, name)
        for i in range(run.n_frames):
            frame = run.frame(i)
            row, value = frame.row_of(who), value_at((changes.t, changes.values), frame.t)
            if row < 0:
                assert math.isnan(value)
                continue
            w, x, y, z = frame.quat[row]
            expected = {
                **dict(zip(("x", "y", "z"), frame.pos[row], strict=True)),
                **dict(zip(("vx", "vy", "vz"), frame.vel[row], strict=True)),
                "speed": np.linalg.norm(frame.vel[row]), "health": frame.health[row],
                "yaw": math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
                "climb": math.asin(2 * (x * z - w * y)), "roll": math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
            }  # fmt: skip
            assert value == pytest.approx(expected[name], abs=1e-9)


def test_recorded_columns_of_plugins_are_their_values_in_each_step(tmp_path):
    mission = guarded_gate()
    record(mission, tmp_path / "run", (5,), columns=["intruder.March.way", "intruder.March.goal"])
    data = RecordedData(Recording(tmp_path / "run", is_mapped=True), is_file=False)
    units = dict(data.document()["quantities"])
    assert [units[name] for name in ("March.way", "March.goal.x", "x")] == ["m", "m", "m"]
    way = changes_in(data, "column-7-March.way")["March.way", None, 7]
    with Simulation(mission, 5) as alone:
        for step in range(200):
            state = entity_state(alone, 0, 7)
            if state is not None:  # born in the step before: a recording has it there already
                assert value_at(way, step * 0.1) == state.plugins["March"]["way"].value
            alone.step()
    assert changes_in(data, "column-1-March.way")["March.way", None, 1] == ([0.0], [None])


def test_a_column_of_two_runs_is_asked_for_by_name(runs):
    pair = Comparison(Recording(runs["hunt"]), Recording(runs["larger hunt"]))
    data = RecordedData(pair, is_file=False)
    assert list(changes_in(data, "column-2-speed")) == [
        ("speed", None, 2),
        ("speed", None, 2 + pair.id_shift),
    ]
    for wrong in ("column-2-no", "column-x-speed", "column--x", "column-1e3-x"):
        assert data.blob(wrong) is None
    assert RecordedData(pair.a, is_file=True).blob("column-2-speed") is None
