"""Recorded runs, served, in a real browser: the same page as the offline one, fed chunk by chunk."""

import math

import pytest
from recorded_games import hunt
from served import Watched
from watched_plugins import clickable

from tussle import Recorder, Simulation
from tussle.stress import RecordedMonitor
from tussle.view import Recording
from tussle.view.page import recorded as recorded_data
from tussle.view.page.compare import Comparison
from tussle.view.page.server import Page


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    base = tmp_path_factory.mktemp("runs")
    for name, seed in (("a", 3), ("b", 4)):
        mission = hunt(n_prey=6, end=20.0, end_conditions="time")
        with Simulation(mission, seed) as simulation, Recorder(simulation, base / name):
            simulation.run()
    return [Recording(base / name, is_mapped=True) for name in "ab"]


def test_a_recorded_run_plays_jumps_and_shows_what_was_recorded(chromium, runs, monkeypatch):
    monkeypatch.setattr(recorded_data, "SERVED_STATES", 60)
    with Page(runs[0], is_paused=True) as page:
        watched = Watched(chromium, page)
        watched.wait("player.t === 0 && !player.isPlaying && player.isDrawn")
        watched.button("Play")
        watched.wait("player.t > 0.3")
        watched.button("Pause")
        watched.wait("!player.isPlaying")
        for t in (15.0, 2.0, 9.5):
            watched.tab.locator("#time").evaluate(
                "(s, t) => { s.value = String(t); s.dispatchEvent(new Event('input')); }", t
            )
            watched.wait(f"Math.abs(player.t - {t}) < 1e-6 && player.isDrawn")
            frame = runs[0].at(t)
            assert sorted(watched.tab.evaluate("() => player.ids")) == frame.id.tolist()
            for row, who in enumerate(frame.id.tolist()):
                pos = watched.tab.evaluate("(id) => player.stateOf(id).pos", who)
                assert math.dist(pos, frame.pos[row]) < 0.01
        watched.press("Home")
        first = min(event.t for event in runs[0].events if event.t > 0.0)
        watched.press("PageDown")
        watched.wait(f"player.t === {first!r}")
        watched.close()
        assert not watched.trouble, "\n".join(watched.trouble)


def test_each_browser_has_its_own_time_of_a_recorded_run(chromium, runs):
    with Page(runs[0], is_paused=True) as page:
        one, other = Watched(chromium, page), Watched(chromium, page)
        one.press("End")
        one.wait("player.t > 19")
        assert other.tab.evaluate("() => player.t") == 0.0
        one.close()
        other.close()


def test_two_runs_are_seen_together_from_where_they_differ(chromium, runs):
    with Page(Comparison(*runs, is_over_each_other=True), is_paused=True) as page:
        watched = Watched(chromium, page)
        watched.wait("player.isDrawn")
        assert "they differ first at t = 0 s" in watched.tab.locator("#lead").inner_text()
        assert len(watched.tab.evaluate("() => player.ids")) == sum(len(run.frame(0)) for run in runs)
        watched.press("ArrowRight")
        watched.wait("player.chosen > 0 && player.isDrawn")
        assert watched.tab.locator("#chosen h2").inner_text() == "A prey 1"
        watched.press("ArrowLeft")
        watched.wait("player.chosen > 1 && player.isDrawn")
        assert watched.tab.locator("#chosen h2").inner_text().startswith("B hunters ")
        watched.close()
        assert not watched.trouble, "\n".join(watched.trouble)


def test_shapes_that_plugins_drew_are_seen_again(chromium, tmp_path):
    with (
        Simulation(clickable(), 1) as simulation,
        Recorder(simulation, tmp_path / "run", shapes=True),
    ):
        simulation.run()
    with Page(Recording(tmp_path / "run"), is_paused=True) as page:
        watched = Watched(chromium, page)
        watched.wait("player.isDrawn")
        assert watched.tab.evaluate("() => player.shapes") == []
        watched.press(".")
        watched.wait("player.frame === 1 && player.shapes.some(([kind, n]) => kind === 'arrows' && n === 3)")
        watched.press("End")
        watched.wait("player.frame === 80 && player.shapes.length === 1")
        watched.close()
        assert not watched.trouble, "\n".join(watched.trouble)


def test_columns_of_plugins_are_shown_beside_the_entity(chromium, tmp_path, monkeypatch):
    monkeypatch.setattr(recorded_data, "SERVED_STATES", 60)
    mission = hunt(n_prey=6, end=20.0, end_conditions="time")
    with (
        Simulation(mission, 3) as simulation,
        Recorder(simulation, tmp_path / "run", columns="*.target,*.speed,*.Unicycle.x"),
    ):
        simulation.run()
    recording = Recording(tmp_path / "run")
    with Page(recording, is_paused=True) as page:
        watched = Watched(chromium, page)
        watched.wait("player.isDrawn")
        watched.press("ArrowRight")
        for frame in (30, 3):
            watched.tab.locator("#time").evaluate(
                "(s, t) => { s.value = String(t); s.dispatchEvent(new Event('input')); }", recording.t[frame]
            )
            watched.wait(f"player.frame === {frame} && player.isDrawn")
            watched.wait("document.querySelectorAll('#sections section').length === 2")
            who = watched.tab.evaluate("() => player.chosen")
            row = recording.frame(frame).row_of(who)
            titles = watched.tab.locator("#sections h3").all_inner_texts()
            assert titles == ["Boids", "Unicycle"]
            target = recording.values(frame, "Boids.target")[row]
            shown = watched.tab.locator("#sections dd").all_inner_texts()
            assert shown[0].endswith(" m")
            assert [float(part.replace(",", "")) for part in shown[0][:-2].split()] == [
                pytest.approx(value, rel=1e-3) for value in target
            ]
            assert shown[2].endswith("m m m rad rad")
        assert watched.tab.locator("#sections dt").first.get_attribute("title") == "Current goal."
        watched.close()
        assert not watched.trouble, "\n".join(watched.trouble)


def test_a_specification_of_two_runs_has_a_curve_of_each_over_the_time_line(chromium, runs):
    spec = "always (distance(prey, hunters) > 21 m)"
    shown = [Recording(run.path, is_mapped=True) for run in runs]
    shown[0].mark(12.0, "lost from here on")
    for run in shown:
        run.watch([RecordedMonitor(spec, run)], 3.0)
    both = Comparison(*shown)
    with Page(both, is_paused=True) as page:
        watched = Watched(chromium, page)
        watched.wait("player.isDrawn")
        watched.press("End")
        watched.wait("player.t >= 19.9 && player.isDrawn")
        rows = [row.inner_text() for row in watched.tab.locator("#alarms .spec").all()]
        for name, run, row in zip("AB", shown, rows, strict=True):
            (course,) = run.alarms.courses
            assert f"failed since {course.failed:.1f} s" in row
            assert f"{name}: {spec}" in row
            assert f"least {course.least[-1]:.4g}".replace("-", "\u2212") in row
        for id_, run in ((0, shown[0]), (both.id_shift, shown[1])):
            (series,) = run.alarms.series.values()
            curve = watched.tab.evaluate("([name, id]) => player.curve(name, null, id)", [spec, id_])
            assert [t for t, _ in curve] == pytest.approx([run.time_of(step) for step in series.steps])
            assert [v for _, v in curve] == pytest.approx(series.values, nan_ok=True)
        mark = watched.tab.evaluate("() => player.events.find(({ kind }) => kind === 'mark')")
        assert (mark["t"], mark["text"]) == (12.0, "lost from here on")
        box = watched.tab.locator("#course").bounding_box()
        watched.tab.mouse.click(box["x"] + box["width"] / 2, box["y"] + 20)
        watched.wait("Math.abs(player.t - 10) < 0.1 && player.isDrawn")
        assert watched.tab.evaluate(DRAWN) > 1000
        watched.close()
        assert not watched.trouble, "\n".join(watched.trouble)


DRAWN = """() => {
  const canvas = document.querySelector('#course canvas');
  return canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data.filter(Boolean).length;
}"""
