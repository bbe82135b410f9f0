"""Specifications that are watched: the alarms are those of the robustness of the whole game, however it is wound, and change nothing."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from guarded_gate import guarded_gate
from page_client import PageClient

from tussle import Recorder, Simulation
from tussle.errors import ParameterError
from tussle.messages import CustomKeyPress
from tussle.mission import read_mission
from tussle.stress import Monitor, RecordedMonitor, Specification
from tussle.view import Live, Recording
from tussle.view.page.compare import Comparison
from tussle.view.page.document import event_rows
from tussle.view.page.recorded import RecordedData, alarm_data
from tussle.view.page.server import Page
from tussle.view.series import CurveName

NEAR = "always (distance(guard, intruder) > 21.5 m)"
GUARDS = "always[2,15] (count(team 1) > 3.5)"
LATE = "eventually (count(team 1) < 3.5)"
AT_END = "lost[2] < 3"
BOTH = f"{NEAR} and {LATE}"
SPECS = [
    NEAR,
    GUARDS,
    LATE,
    AT_END,
    BOTH,
    "always (count(guard) > 0 -> eventually[0,2] (count(intruder) < 6))",
]
MARGIN = 2.5
SEED = 5
PLUGINS = Path(__file__).with_name("guarded_gate.py")


def watched(mission, specs, seed=SEED, **options):
    simulation = Simulation(mission, seed)
    monitors = [Monitor(Specification.parse(text, mission), simulation) for text in specs]
    options = {"is_paused": True, "threaded": False, "margin": MARGIN} | options
    return Live(simulation, specifications=monitors, **options)


def offline(mission, text, seed=SEED):
    """Verdict on the whole game, played alone, the robustness of each step alone, and the hash."""
    with Simulation(mission, seed) as alone:
        monitor = Monitor(Specification.parse(text, mission), alone)
        hash_ = alone.run()[0].state_hash
        return monitor.finish(0), monitor.progress(0)[1], hash_


def expected_alarms(mission, specs, last=math.inf, seed=SEED):
    """Time, kind and specification of each alarm up to a step."""
    found = []
    for text in specs:
        verdict = offline(mission, text, seed)[0]
        near, failed = verdict.first_below(MARGIN), verdict.first_below(0.0)
        if (
            text == AT_END and failed is not None
        ):  # it is decided at the end, which a verdict without signals does not know
            near = failed = 200
        found += [(near, "alarm", text)] if near is not None and near != failed else []
        found += [(failed, "failure", text)] if failed is not None else []
    return sorted((step * mission.dt, kind, text) for step, kind, text in found if step <= last)


def alarms_of(live):
    live.alarms()
    return sorted((e.t, e.kind, e.text) for e in live.events if e.kind in ("alarm", "failure"))


def check(live, mission, specs, last=math.inf, seed=SEED):
    expected = expected_alarms(mission, specs, last, seed)
    assert [alarm[1:] for alarm in alarms_of(live)] == [alarm[1:] for alarm in expected]
    assert np.allclose([t for t, *_ in alarms_of(live)], [t for t, *_ in expected], rtol=0, atol=1e-9)


@pytest.fixture(scope="module")
def some_fail():
    expected = expected_alarms(guarded_gate(), SPECS)
    assert {kind for _, kind, _ in expected} == {"alarm", "failure"}
    assert len({text for *_, text in expected}) < len(SPECS), "some hold"


@pytest.mark.usefixtures("some_fail")
@pytest.mark.parametrize("is_read", [True, False])
def test_alarms_and_hash_are_those_of_the_game_alone(is_read):
    mission = guarded_gate()
    with watched(mission, SPECS) as live:
        for step in range(1, 201):
            live.step()
            if is_read:
                assert all(t <= live.t + 1e-9 for t, *_ in alarms_of(live))
                if step in (60, 108):
                    check(live, mission, [NEAR, GUARDS, LATE, AT_END, BOTH, SPECS[-1]], last=step)
        assert live.is_over
        check(live, mission, SPECS)
        for state in live.alarms():
            verdict, present, alone = offline(mission, state.text)
            assert state.ended == state.least == verdict.robustness
            assert live.simulation.result()[0].state_hash == alone
            curve = live.robustness.get(CurveName(state.text))
            shown = [math.nan if curve is None else curve.at(step) for step in range(201)]
            assert np.array_equal(shown, np.where(np.isfinite(present), present, np.nan), equal_nan=True)


@pytest.mark.usefixtures("some_fail")
def test_after_a_jump_back_the_state_is_that_of_the_moment_and_goes_on_the_same():
    mission = guarded_gate()
    with watched(mission, SPECS, snapshot_every=0.5) as live:
        live.step(150)
        before, there = live.alarms(), alarms_of(live)
        for t in (3.0, 12.0, 0.0):
            live.seek(t)
            assert alarms_of(live) == there, "what comes later stays marked, as events do"
            for state in live.alarms():
                assert state.since is None or state.since <= live.t
                assert state.state in ("holds", "open") or state.since is not None
        live.seek(5.0)
        live.step(100)
        assert str(live.alarms()) == str(before)
        live.step(60)
        check(live, mission, SPECS)


def test_another_course_and_another_seed_have_alarms_of_their_own():
    mission = guarded_gate()
    with watched(mission, SPECS) as live:
        live.step(170)
        assert alarms_of(live)
        live.seek(4.0)
        live.publish(CustomKeyPress, key=";")
        check(live, mission, SPECS, last=39)
        live.step(200)
        check(live, mission, SPECS)
        live.reset(9)
        assert not alarms_of(live)
        live.step(200)
        check(live, mission, SPECS, seed=9)


def test_a_game_that_nobody_looks_at_is_judged_when_somebody_does():
    with watched(guarded_gate(), [NEAR], threaded=True, is_paused=False, pace=None) as live:
        for _ in range(1000):
            if live.is_over:
                break
            live.settle()
        live.alarms()
        live.settle()
        check(live, guarded_gate(), [NEAR])


@pytest.mark.parametrize(
    ("mission", "settings", "text"),
    [
        ("predator_prey", {"prey": 12, "run.end": 20}, "always (distance(team 1, team 2) > 10 m)"),
        ("predator_prey", {"prey": 12, "run.end": 20}, "always (min_speed(all) > 17 m/s) and lost[1] / start[1] < 0.5"),
        ("capture_the_flag", {"run.end": 20}, "always (components(team 1, 300 m) < 2)"),
    ],
)  # fmt: skip
def test_missions_that_ship(mission, settings, text):
    mission = read_mission(mission, settings).mission
    with watched(mission, [text]) as live:
        live.step(90)
        live.alarms()
        live.seek(2.0)
        live.step(300)
        (state,) = live.alarms()
        verdict, _, alone = offline(mission, text)
        assert live.is_over
        assert (state.ended, state.least) == (verdict.robustness, verdict.robustness)
        check(live, mission, [text])
        assert live.simulation.result()[0].state_hash == alone


def test_numbers_of_the_page_and_the_recording_are_not_changed_by_it(tmp_path):
    with (
        watched(guarded_gate(), [NEAR, AT_END], threaded=True, pace=None) as live,
        Recorder(live.simulation, tmp_path / "run"),
        Page(live) as page,
        PageClient(page.url) as client,
    ):
        live.step(120)
        verdict, present, _ = offline(guarded_gate(), NEAR)
        # The alarms of a status may be of a step before its own.
        client.wait(
            lambda: client.status.get("step") == 120 and client.status["alarms"][0]["now"] == present[120]
        )
        near, at_end = client.status["alarms"]
        assert near["unit"] == "m"
        assert near["since"] == pytest.approx(0.1 * verdict.first_below(0.0))
        assert near["state"] == "failed"
        assert (at_end["state"], at_end["now"], at_end["least"]) == ("open", None, None)
        assert math.isfinite(at_end["ended"])
        client.wait(lambda: (NEAR, None, 0) in client.curves)
        client.wait(lambda: ["alarm", 0, 0, NEAR] in [row[1:] for row in client.events])
        live.step(60)
        client.wait(lambda: client.status["step"] == 180 and client.events == event_rows(live.events))
        assert page.error is None


class Undefined:
    """A monitor that cannot say."""

    text, unit = "nothing", ""

    def progress(self, world):
        raise ParameterError("it is no number")


def test_what_cannot_be_computed_is_said_and_stops_nothing():
    with Live(Simulation(guarded_gate(), SEED), threaded=False, specifications=[Undefined()]) as live:
        live.step(10)
        assert [(s.state, s.note) for s in live.alarms()] == [("unknown", "it is no number")]
        assert live.step_number == 10
        assert live.error is None


@pytest.mark.parametrize(
    ("text", "unit"), [(NEAR, "m"), ("always (max_speed(all) < 3)", "m/s"), (GUARDS, ""), (AT_END, ""), (f"{NEAR} and {GUARDS}", "")]
)  # fmt: skip
def test_the_unit_is_that_of_what_is_compared(text, unit):
    assert Specification.parse(text, guarded_gate()).unit == unit


# -- of recorded games ------------------------------------------------------------------------------------------------------------


def replayed(directory, seed=SEED):
    """A recording of the game."""
    with Simulation(guarded_gate(), seed) as alone, Recorder(alone, directory):
        alone.run()
    return Recording(directory, plugin_files=(PLUGINS,))


def test_a_recorded_game_has_the_alarms_of_the_game(tmp_path):
    specs = [text for text in SPECS if text != AT_END]
    run = replayed(tmp_path / "run")
    run.watch([RecordedMonitor(text, run) for text in specs], MARGIN)
    alarms = sorted((e.t, e.kind, e.text) for e in run.events if e.kind in ("alarm", "failure"))
    assert [alarm[1:] for alarm in alarms] == [alarm[1:] for alarm in expected_alarms(guarded_gate(), specs)]
    courses = {each["text"]: each for each in alarm_data(run, 100)}
    for text in specs:
        verdict, present, _ = offline(guarded_gate(), text)
        course = courses[text]
        assert course["id"] == 100
        assert course["t"] == [run.time_of(step) for step in verdict.steps]
        assert course["least"] == [v if math.isfinite(v) else None for v in verdict.levels]
        assert course["failed"] == (
            None if verdict.first_below(0.0) is None else run.time_of(verdict.first_below(0.0))
        )
        curve = run.alarms.series.get(CurveName(text))
        finite = np.isfinite(present)
        assert (curve is None) == (not finite.any())
        if curve is not None:
            shown = [curve.at(step) for step in range(len(present))]
            np.testing.assert_array_equal(shown, np.where(finite, present, np.nan))


def test_two_recorded_games_have_a_curve_each_and_marks(tmp_path):
    runs = [replayed(tmp_path / name, seed) for name, seed in (("a", SEED), ("b", SEED + 1))]
    runs[0].mark(3.5, "lost from here on")
    for run in runs:
        run.watch([RecordedMonitor(NEAR, run)], MARGIN)
    both = Comparison(*runs)
    texts = {event.text for event in both.events if event.kind in ("alarm", "failure")}
    assert texts == {f"A: {NEAR}", f"B: {NEAR}"}
    assert [(e.t, e.text) for e in both.events if e.kind == "mark"] == [(3.5, "lost from here on")]
    data = RecordedData(both, is_file=True)
    assert [each["id"] for each in data.document()["alarms"]] == [0, both.id_shift]
    curves = [each for each in json.loads(data.blob("curves")) if each["name"] == NEAR]
    assert [each["id"] for each in curves] == [0, both.id_shift]
    assert curves[0]["v"] != curves[1]["v"]


def test_what_is_no_number_is_said_in_the_row_of_a_recorded_game(tmp_path):
    run = replayed(tmp_path / "run")
    text = "always (count(team 2) / count(team 2) > 0)"
    run.watch([RecordedMonitor(text, run), RecordedMonitor(NEAR, run)])
    lost, near = alarm_data(run, 0)
    assert "is of no number (NaN)" in lost["note"]
    assert not near["note"]
