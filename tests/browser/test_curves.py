"""Curves and numbers of the page in a real browser, compared with what they are of."""

import numpy as np
import pytest
from guarded_gate import guarded_gate
from recorded_games import hunt, record
from served import UNHURRIED, Watched

from tussle import Recorder, Simulation
from tussle.batch import Batch, InProcess
from tussle.stress import Monitor, Specification
from tussle.view import Live, Recording
from tussle.view.entity import entity_state
from tussle.view.page.compare import Comparison
from tussle.view.page.server import Page

SEED = 5


@pytest.fixture(scope="module")
def alive():
    """Team -> time and number of each row of a batch's `alive.parquet`, of the same game."""
    rows = Batch(guarded_gate(), runs=1, first_seed=SEED).play(executor=InProcess()).alive.to_pylist()
    return {team: [[r["t"], r["alive"]] for r in rows if r["team"] == team] for team in (1, 2)}


def test_a_browser_that_comes_late_and_comes_back_shows_the_curves_of_the_batch(chromium, alive):
    with (
        Simulation(guarded_gate(), SEED) as simulation,
        Live(simulation, is_paused=True, pace=None) as live,
        Page(live, viewer=UNHURRIED) as page,
    ):
        live.step(90)
        live.settle()
        late = Watched(chromium, page)
        late.wait("player.frame === 90")
        check(late, alive, 9.0)
        late.close()
        live.step(60)
        live.settle()
        back = Watched(chromium, page)
        back.wait("player.frame === 150")
        check(back, alive, 15.0)
        live.seek(4.0)
        live.settle()
        back.wait("player.frame === 40")
        check(back, alive, 15.0)
        live.step(200)
        live.settle()
        back.wait("player.status.isOver && player.frame === 200")
        check(back, alive, 20.0)
        back.close()
        assert not late.trouble + back.trouble


def check(watched, alive, until):
    """Compare the curves with the rows up to a time [s]. The batch has a row at the end, too, where nothing changes."""
    for team, rows in alive.items():
        shown = watched.tab.evaluate("(team) => player.curve('left', team)", team)
        changes = [
            row for i, row in enumerate(rows) if row[0] <= until and (i == 0 or row[1] != rows[i - 1][1])
        ]
        assert shown == changes


def text(watched, selector):
    return watched.tab.locator(selector).all_inner_texts()


def test_the_numbers_of_a_live_game_are_what_tussle_run_prints_at_that_step(chromium):
    with (
        Simulation(guarded_gate(), SEED) as simulation,
        Live(simulation, is_paused=True, pace=None) as live,
        Page(live, viewer=UNHURRIED) as page,
    ):
        watched = Watched(chromium, page, {"width": 1200, "height": 800})
        for step in (0, 25, 108, 200, 60):
            live.seek(0.1 * step)
            live.settle()
            watched.wait(f"player.frame === {step} && player.isDrawn && player.status.step === {step}")
            with Simulation(guarded_gate(), SEED) as alone:
                alone.step(step)
                result = alone.result()[0]
            watched.wait(
                f"document.querySelector('#metrics').textContent.includes('Share gone{result.metrics['Share']['gone']:,.4g}')"
            )
            assert [row.split() for row in text(watched, "#teams .team > span:nth-of-type(2)")] == [
                [str(result.alive[team]), "/", str(result.born[team])] for team in (1, 2)
            ]
            scores = [float(row.replace("−", "-")) for row in text(watched, "#scores .score b")]
            assert scores == pytest.approx(list(result.scores.values()), rel=1e-3)
            assert dict(zip(text(watched, "#metrics dt"), text(watched, "#metrics dd"), strict=True)) == {
                "Gate stopped": str(result.metrics["Gate"]["stopped"]),
                "Gate passed": str(result.metrics["Gate"]["passed"]),
                "Share gone": f"{result.metrics['Share']['gone']:,.4g}",
            }
        watched.close()
        assert not watched.trouble


def test_a_specification_shows_its_robustness_and_a_click_goes_to_its_alarm(chromium):
    text_of_spec, mission = "always (distance(guard, intruder) > 21.5 m)", guarded_gate()
    with Simulation(mission, SEED) as alone:
        monitor = Monitor(Specification.parse(text_of_spec, mission), alone)
        alone.run()
        (_, present, _), verdict = monitor.progress(0), monitor.finish(0)
    near, failed = verdict.first_below(2.0), verdict.first_below(0.0)
    with Simulation(mission, SEED) as simulation:
        monitors = [Monitor(Specification.parse(text_of_spec, mission), simulation)]
        with (
            Live(simulation, is_paused=True, pace=None, specifications=monitors, margin=2.0) as live,
            Page(live, viewer=UNHURRIED) as page,
        ):
            watched = Watched(chromium, page, {"width": 1200, "height": 800})
            row = "document.querySelector('#alarms .spec')"
            shown = {}
            for step in (near - 1, near, failed + 5):
                live.step(step - live.step_number)
                live.settle()
                watched.wait(
                    f"player.frame === {step} && player.isDrawn && player.status.step === {step} && {row}"
                )
                watched.wait(
                    f"{row}.children[1].innerText.includes('now {present[step]:.4g}'.replace('-', '−'))"
                )
                shown[step] = watched.tab.evaluate(f"() => [{row}.className, {row}.innerText]")
            assert f"s: failed: {text_of_spec}" in watched.tab.locator("#said").inner_text()
            states = ["spec is-holds", "spec is-near", "spec is-failed"]
            assert [name for name, _ in shown.values()] == states
            assert f"near since {0.1 * near:.1f} s" in shown[near][1]
            assert f"failed since {0.1 * failed:.1f} s" in shown[failed + 5][1]
            assert text_of_spec in shown[near][1]
            events = watched.wait("player.events.filter(({ text }) => text.startsWith('always')).map(({ t, kind }) => [t, kind])"
                                  ".length === 2 && player.events.filter(({ text }) => text.startsWith('always'))")  # fmt: skip
            assert [(e["kind"], round(10 * e["t"])) for e in events] == [("alarm", near), ("failure", failed)]
            watched.tab.locator("#alarms .spec").click()
            watched.until(lambda: live.step_number == failed)
            watched.wait(f"player.frame === {failed}")
            watched.tab.locator("#ticker button", has_text="near failure").click()
            watched.until(lambda: live.step_number == near)
            watched.wait(f"player.frame === {near} && {row}.className === 'spec is-near'")
            curve = watched.tab.evaluate("(name) => player.curve(name)", text_of_spec)
            values = {round(10 * t): value for t, value in curve}
            assert values[failed] == pytest.approx(present[failed])
            assert values[near] == pytest.approx(present[near])
            watched.close()
            assert not watched.trouble


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    base = tmp_path_factory.mktemp("runs")
    for name, n_prey in (("a", 6), ("b", 9)):
        mission = hunt(n_prey=n_prey, end=20.0, end_conditions="time")
        with Simulation(mission, 3) as simulation, Recorder(simulation, base / name):
            simulation.run()
    return [Recording(base / name, is_mapped=True) for name in "ab"]


@pytest.mark.parametrize("is_over", [True, False])
def test_two_runs_are_counted_and_named_apart(chromium, runs, is_over):
    with Page(Comparison(*runs, is_over_each_other=is_over), is_paused=True) as page:
        watched = Watched(chromium, page, {"width": 1200, "height": 800})
        for t in (0.0, 3.0, 19.0):
            watched.tab.locator("#time").evaluate(
                "(s, t) => { s.value = String(t); s.dispatchEvent(new Event('input')); }", t
            )
            watched.wait(f"Math.abs(player.t - {t}) < 1e-6 && player.isDrawn")
            expected = []
            for name, run in zip("AB", runs, strict=True):
                for team, of_team in run.teams.items():
                    n = int((run.at(t).team == team).sum())
                    blocks = [run.blocks[i] for i, its in enumerate(run.block_teams) if its == team]
                    born = sum(e.kind == "birth" and e.t <= t and e.text in blocks for e in run.events)
                    caught = sum(e.kind == "capture" and e.t <= t for e in run.events) if team == 2 else 0
                    expected.append([f"{name} {of_team}", f"{n} / {born}", str(caught)])
            names = text(watched, "#teams .team > span:nth-of-type(1)")
            assert [list(row) for row in zip(names, text(watched, "#teams .team > span:nth-of-type(2)"),
                                             text(watched, "#scores .score b"), strict=True)] == expected  # fmt: skip
        n_entities = [len({e.id for e in run.events if e.kind == "birth"}) for run in runs]
        assert "{} and {} entities".format(*n_entities) in watched.tab.locator("#subtitle").inner_text()
        frame, row = runs[1].at(19.0), -1
        who = int(frame.id[row])
        watched.tab.locator("#quantities #ids").evaluate(
            "(field, id) => { field.value = String(id); field.dispatchEvent(new Event('change')); }",
            who + page.game.id_shift,
        )
        watched.wait(f"player.chosen === {who + page.game.id_shift} && player.isDrawn")
        facts = dict(zip(text(watched, "#chosen > dl dt"), text(watched, "#chosen > dl dd"), strict=True))
        assert facts["Team"] == f"B {runs[1].teams[int(frame.team[row])]}"
        for name, coordinate in zip(("East", "North", "Up"), frame.pos[row], strict=True):
            assert float(facts[name].removesuffix(" m").replace("−", "-")) == pytest.approx(
                coordinate, abs=0.06
            )
        assert text(watched, "#teams h3") == ["A: a", "B: b"]
        assert "prey.count 6 and 9" in watched.tab.locator("#lead").inner_text()
        watched.close()
        assert not watched.trouble


def add(watched, name, ids=""):
    """Add a quantity to the panel, of these entities."""
    if ids:
        watched.tab.locator("#ids").fill(ids)
        watched.tab.locator("#ids").press("Tab")
    watched.wait(
        f"[...document.querySelectorAll('#quantity option')].some((o) => o.value.endsWith('\\n' + '{name}'))"
    )
    value = watched.tab.evaluate(
        "(name) => [...document.querySelectorAll('#quantity option')].find((o) => o.value.endsWith('\\n' + name)).value",
        name,
    )
    watched.tab.locator("#quantity").select_option(value)


def legend(watched, title):
    """Label -> value of each line of a plot."""
    plot = watched.tab.locator("#plots .plot", has=watched.tab.locator("h3", has_text=title))
    lines = plot.locator("li:visible").all()
    return {line.locator("span").inner_text(): line.locator("b").inner_text() for line in lines}


def drawn_shares(watched, title, heights):
    """Share of the columns of a plot that have pixels of a line at some heights, given as shares of its axis."""
    canvas = watched.tab.locator("#plots .plot", has=watched.tab.locator("h3", has_text=title)).locator(
        "canvas"
    )
    return canvas.evaluate(
        """(canvas, heights) => {
            const { width } = canvas;
            const ratio = canvas.height / canvas.clientHeight;
            const { data } = canvas.getContext('2d').getImageData(0, 0, width, canvas.height);
            return heights.map((height) => {
                const row = Math.round(ratio * (canvas.clientHeight - 16 - height * (canvas.clientHeight - 24)));
                const opacity = (x) => Math.max(...[row - 1, row].map((y) => data[4 * (y * width + x) + 3]));
                return Array.from({ length: width }, (_, x) => opacity(x)).filter((value) => value > 150).length / width;
            });
        }""",
        heights,
    )


def amount(value):
    """A number as the page writes it: four digits."""
    return f"{value:.4g}".replace("-", "−")


def test_any_quantity_of_a_live_game_is_shown_over_time_for_several_entities(chromium):
    with (
        Simulation(guarded_gate(), SEED) as simulation,
        Live(simulation, is_paused=True, pace=None) as live,
        Page(live, viewer=UNHURRIED) as page,
    ):
        live.step(60)
        live.settle()
        watched = Watched(chromium, page, {"width": 1200, "height": 800})
        watched.press("q")
        add(watched, "March.way", "7 8")
        add(watched, "yaw")
        add(watched, "Share.gone")
        add(watched, "Gate.stopped")
        add(watched, "score")
        watched.wait("player.curve('March.way', null, 7).length")
        live.step(24)
        live.settle()
        watched.wait("player.frame === 84 && player.isDrawn")
        with Simulation(guarded_gate(), SEED) as alone:
            alone.step(60)
            ways = {7: [], 8: []}
            for step in range(60, 85):
                for who, way in ways.items():
                    way.append([step * 0.1, entity_state(alone, 0, who).plugins["March"]["way"].value])
                if step < 84:
                    alone.step()
            result = alone.result()[0]
        for who, way in ways.items():
            watched.wait(f"player.curve('March.way', null, {who}).length === 25")
            assert watched.tab.evaluate("(who) => player.curve('March.way', null, who)", who) == [
                [pytest.approx(t), value] for t, value in way
            ]
        watched.wait("player.isDrawn")
        assert legend(watched, "March.way [m]") == {
            f"intruder {who}": amount(way[-1][1]) for who, way in ways.items()
        }
        assert set(legend(watched, "yaw [°]")) == {"intruder 7", "intruder 8"}
        assert legend(watched, "Share.gone") == {"Share.gone": amount(result.metrics["Share"]["gone"])}
        assert legend(watched, "Gate.stopped") == {"Gate.stopped": str(result.metrics["Gate"]["stopped"])}
        assert legend(watched, "score") == {
            "guard": amount(result.scores[1]),
            "intruder": amount(result.scores[2]),
        }
        # One step, at 7.1 s of 8.4 s, and no slope.
        low, middle, high = drawn_shares(watched, "Gate.stopped", [0.0, 0.5, 1.0])
        assert low > 0.7
        assert middle < 0.06
        assert 0.1 < high < 0.25
        watched.tab.locator("#plots .plot button").first.click()
        assert watched.tab.locator("#plots .plot").count() == 4
        watched.until(lambda: not any(name.name == "March.way" for name in live.curves.series))
        watched.close()
        assert not watched.trouble


def test_columns_of_recorded_entities_are_shown_over_time_for_both_runs(chromium, runs):
    with Page(Comparison(*runs), is_paused=True) as page:
        watched = Watched(chromium, page, {"width": 1200, "height": 800})
        watched.press("q")
        for name in ("speed", "yaw", "left"):
            add(watched, name, "2 5")
        watched.wait("player.curve('yaw', null, 5).length")
        watched.press("End")
        for t in (0.0, 3.0):
            watched.tab.locator("#time").evaluate(
                "(s, t) => { s.value = String(t); s.dispatchEvent(new Event('input')); }", t
            )
            watched.wait(f"Math.abs(player.t - {t}) < 1e-6 && player.isDrawn")
            speeds = {}
            for name, run in zip("AB", runs, strict=True):
                frame = run.at(t)
                for who in (2, 5):
                    row = frame.row_of(who)
                    value = amount(float(np.linalg.norm(frame.vel[row]))) if row >= 0 else "–"
                    block = next(e.text for e in run.events if e.kind == "birth" and e.id == who)
                    speeds[f"{name} {block} {who}"] = value
            assert legend(watched, "speed [m/s]") == speeds
            assert list(legend(watched, "entities left")) == [
                "A prey, late",
                "A hunters",
                "B prey, late",
                "B hunters",
            ]
        watched.close()
        assert not watched.trouble


def test_recorded_results_of_two_runs_are_shown_as_they_stood(chromium, tmp_path):
    seeds = (SEED, SEED + 1)
    for seed in seeds:
        record(guarded_gate(), tmp_path / str(seed), (seed,), results=True)
    pair = Comparison(*(Recording(tmp_path / str(seed)) for seed in seeds))
    with Page(pair, is_paused=True) as page:
        watched = Watched(chromium, page, {"width": 1200, "height": 800})
        watched.press("q")
        add(watched, "Gate.stopped")
        for step in (79, 200):
            watched.tab.locator("#time").evaluate(
                "(s, t) => { s.value = String(t); s.dispatchEvent(new Event('input')); }", 0.1 * step
            )
            watched.wait(f"Math.abs(player.t - {0.1 * step}) < 1e-6 && player.isDrawn")
            results = []
            for seed in seeds:
                with Simulation(guarded_gate(), seed) as alone:
                    alone.step(step)
                    results.append(alone.result()[0])
            scores = [amount(score) for result in results for score in result.scores.values()]
            assert text(watched, "#scores .score b") == scores
            stopped, passed = (
                [result.metrics["Gate"][name] for result in results] for name in ("stopped", "passed")
            )
            shown = dict(zip(text(watched, "#metrics dt"), text(watched, "#metrics dd"), strict=True))
            assert shown["Gate stopped"] == "A {}, B {}".format(*stopped)
            assert shown["Gate passed"] == "A {}, B {}".format(*passed)
            assert legend(watched, "Gate.stopped") == dict(zip("AB", map(str, stopped), strict=True))
        watched.close()
        assert not watched.trouble
