"""Plots show what was recorded, are the same bytes each time, and say what cannot be plotted."""

from __future__ import annotations

import shutil
import sys
import warnings
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from recorded_games import head_on, hunt, record

from tussle import Block, Mission
from tussle.errors import MissingExtraError, ParameterError, ViewError
from tussle.stock import Still
from tussle.view import Recording
from tussle.view.plots import (
    KINDS,
    Selection,
    Trajectories,
    altitude,
    captures,
    column,
    column_of_runs,
    density,
    distance,
    left,
    maps,
    plot_style,
    runs_of,
    speed,
    trajectory,
    trajectory3d,
    write_plots,
)

COLOURS = {1: "#0072b2", 2: "#d55e00"}
MISSION = """\
<?xml version="1.0"?>
<runscript>
  <run start="0" end="1" dt="0.1"/>
  <latitude_origin>35.721025</latitude_origin> <longitude_origin>-120.767925</longitude_origin>
  <entity_interaction name="near" id="1" type="cuboid" lengths="40, 20, 10" center="0, 0, 0">Boundary</entity_interaction>
  <entity_interaction name="far" id="2" type="sphere" radius="5" center="900, 0, 0">Boundary</entity_interaction>
  <entity>
    <name>watch</name> <team_id>2</team_id> <count>1</count> <motion_model>Still</motion_model>
    <base> <latitude>35.721025</latitude> <longitude>-120.767925</longitude> <altitude>300</altitude> <radius>25</radius> </base>
    <base> <latitude>35.731</latitude> <longitude>-120.767925</longitude> <altitude>300</altitude> <radius>25</radius> </base>
  </entity>
</runscript>
"""


@pytest.fixture(scope="module")
def hunted(tmp_path_factory):
    """Two worlds in which prey are born and caught."""
    return record(hunt(n_prey=25, end=20.0), tmp_path_factory.mktemp("runs") / "hunt", seeds=(1, 2))


@pytest.fixture(scope="module")
def collided(tmp_path_factory):
    """Two that fly into each other at one height, and one that flies by."""
    return record(head_on(), tmp_path_factory.mktemp("runs") / "head")


@pytest.fixture(autouse=True)
def _styled():
    with plot_style():
        yield


def legend_of(figure):
    (legend,) = figure.legends
    return [text.get_text() for text in legend.get_texts()]


def lines_by_colour(axes):
    """Curves with more than a few points: the first of each colour."""
    found = {}
    for line in axes.lines:
        if len(line.get_xdata()) > 3:
            found.setdefault(line.get_color(), line)
    return found


# -- what is chosen -----------------------------------------------------------------------------------------------------------


def test_tracks_hold_the_states_of_the_chosen_by_entity_and_time(hunted):
    recording = Recording(hunted, 1)
    tracks = Trajectories(recording, Selection(teams=(1,), start=3.0, end=5.0))
    assert tracks.teams == {1: "prey, late"}
    assert (tracks.frame_times[0], tracks.frame_times[-1]) == (pytest.approx(3.0), pytest.approx(5.0))
    pos = tracks.pos()
    seen = 0
    for i, t in enumerate(tracks.frame_times):
        frame = recording.at(t)
        rows = frame.team == 1
        mine = tracks.frame == i
        ids = np.repeat(tracks.who, np.diff(tracks.first))[mine]
        np.testing.assert_array_equal(ids, frame.id[rows])
        np.testing.assert_array_equal(pos[mine], frame.pos[rows])
        np.testing.assert_allclose(tracks.speed[mine], np.linalg.norm(frame.vel[rows], axis=1), rtol=1e-12)
        seen += mine.sum()
    assert seen == len(pos)
    for _, _, rows in tracks.each():
        assert (np.diff(tracks.frame[rows]) == 1).all()
    assert tracks.is_breaking.sum() == len(tracks)


@pytest.mark.parametrize(
    ("selection", "said"),
    [
        (Selection(entities=(400,)), r"there is no entity 400; there are 1 to \d+$"),
        (Selection(teams=(3,)), r"there is no team 3; there are: 1 \(prey, late\), 2 \(hunters\)"),
        (
            Selection(start=50.0),
            "nothing was recorded from 50 s",
        ),
        (Selection(start=9.0, end=8.0), "nothing was recorded from 9 s to 8 s"),
        (Selection(entities=(1,), teams=(2,)), "entity 1 is of team 1, which is not selected"),
        (Selection(entities=(29,), end=0.2), r"entity 29 does not exist to 0.2 s; it does from [0-9.]+ s to [0-9.]+ s"),
    ],
)  # fmt: skip
def test_who_or_when_there_is_nobody_is_told(hunted, selection, said):
    with pytest.raises(ParameterError, match=said):
        Trajectories(Recording(hunted), selection)


def test_of_ids_with_gaps_the_nearest_are_told(hunted, tmp_path):
    recording = Recording(hunted)
    table = recording.run.trajectory_table
    ids = np.asarray(table["id"])
    recording.run.trajectory_table = table.filter((ids < 5) | (ids > 9))
    recording.events = [h for h in recording.events if not 5 <= h.id <= 9]
    with pytest.raises(ParameterError, match="there is no entity 6"):
        Trajectories(recording, Selection(entities=(6,)))


def test_a_team_that_has_gone_is_told(tmp_path):
    late = Block(name="late", team=2, count=1, rate=1.0, first_birth=4.0, motion=Still())
    first = Block(name="first", team=1, motion=Still())
    run = record(Mission(blocks=[first, late], end=6.0, end_conditions="time"), tmp_path / "run")
    with pytest.raises(ParameterError, match="there are no entities of team 2 to 3 s"):
        Trajectories(Recording(run), Selection(teams=(2,), end=3.0))


def test_a_run_without_states_is_told(collided, tmp_path):
    cut = tmp_path / "cut"
    shutil.copytree(collided, cut)
    data = (cut / "trajectory.arrow").read_bytes()
    (cut / "trajectory.arrow").write_bytes(data[:1000])  # in the first batch, which is lost
    with pytest.raises(ViewError, match="cut: nothing was recorded"):
        Trajectories(Recording(cut))


# -- maps ---------------------------------------------------------------------------------------------------------------------


def drawn_ways(axes):
    """Lines of a map by colour, without those of the scenery."""
    from matplotlib.collections import LineCollection
    from matplotlib.colors import to_hex

    return {
        to_hex(c.get_color()[0], keep_alpha=False): c.get_segments()
        for c in axes.collections
        if isinstance(c, LineCollection) and c.get_linestyle() == [(0.0, None)]
    }


def test_ways_from_above_go_through_where_each_was_and_are_not_joined(hunted):
    tracks = Trajectories(Recording(hunted))
    figure = trajectory(tracks)
    (axes,) = figure.axes
    ways = drawn_ways(axes)
    assert set(ways) == set(COLOURS.values())
    n = {team: int((tracks.team == team).sum()) for team in COLOURS}
    assert {team: len(ways[COLOURS[team]]) for team in COLOURS} == pytest.approx(
        n, abs=3
    )  # the first died at once
    cell = (
        max(axes.get_xlim()[1] - axes.get_xlim()[0], axes.get_ylim()[1] - axes.get_ylim()[0]) / maps.N_CELLS
    )
    ends = {tuple(np.round(p, 6)) for p in tracks.pos("xy")[[*tracks.first[:-1], *tracks.last]]}
    for lines in ways.values():
        for line in lines:
            assert {tuple(np.round(line[0], 6)), tuple(np.round(line[-1], 6))} <= ends
            steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
            assert steps.max() <= 35.0 * 0.1 + 1.5 * cell
    assert axes.get_aspect() == 1.0
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("east [m]", "north [m]")
    assert legend_of(figure) == ["prey, late", "hunters", "first", "last", "died"]


def test_each_mark_stands_where_somebody_began_stayed_or_died(hunted):
    tracks = Trajectories(Recording(hunted), Selection(teams=(1,)))
    (axes,) = trajectory(tracks).axes
    from matplotlib.collections import PathCollection

    marks = [np.asarray(c.get_offsets()) for c in axes.collections if isinstance(c, PathCollection)]
    first, alive, dead = marks
    has_died = np.isin(tracks.who, list(tracks.deaths))
    assert has_died.sum() == len(dead) > 0
    pos = tracks.pos("xy")
    np.testing.assert_array_equal(first, pos[tracks.first[:-1]])
    np.testing.assert_array_equal(alive, pos[tracks.last[~has_died]])
    np.testing.assert_array_equal(dead, pos[tracks.last[has_died]])


def test_of_very_many_some_ways_are_drawn_and_it_is_said(hunted, tmp_path, monkeypatch):
    for module in ("tussle.view.plots.maps", "tussle.view.plots.files"):
        monkeypatch.setattr(f"{module}.MAX_TRAJECTORIES", 10)
    tracks = Trajectories(Recording(hunted))
    assert len(tracks) > 20
    assert sum(map(len, drawn_ways(trajectory(tracks).axes[0]).values())) <= 10
    written = write_plots(Recording(hunted), tmp_path, ["trajectory"])
    assert f"10 of {len(tracks)} trajectories are drawn" in written.notes[-1]


def test_many_points_become_pixels_in_an_svg(hunted, tmp_path, monkeypatch):
    write_plots(Recording(hunted), tmp_path, ["trajectory"], form="svg")
    lines = (tmp_path / "trajectory.svg").read_text()
    monkeypatch.setattr(maps, "MAX_POINTS", 10)
    write_plots(Recording(hunted), tmp_path, ["trajectory"], form="svg")
    pixels = (tmp_path / "trajectory.svg").read_text()
    assert "<image" not in lines
    assert "<image" in pixels
    assert ">east [m]<" in pixels


def test_bases_and_boundaries_of_the_mission_stand_in_the_map(tmp_path):
    from matplotlib.collections import LineCollection
    from matplotlib.patches import Circle

    from tussle.mission import read_mission

    file = tmp_path / "game.xml"
    file.write_text(MISSION)
    loaded = read_mission(file)
    run = record(loaded.mission, tmp_path / "run", mission_text=loaded.text)
    figure = trajectory(Trajectories(Recording(run)))
    (axes,) = figure.axes
    (circle,) = [p for p in axes.patches if isinstance(p, Circle)]
    assert circle.radius == 25.0
    fence, _ = [
        c for c in axes.collections if isinstance(c, LineCollection)
    ]  # the second is the way of the watch
    corners = np.concatenate(fence.get_segments())
    assert (corners.min(axis=0).tolist(), corners.max(axis=0).tolist()) == ([-20.0, -10.0], [20.0, 10.0])
    assert legend_of(figure) == ["watch", "first", "last", "base", "boundary"]


def test_heights_are_exaggerated_where_all_is_flat_and_the_plot_says_so(hunted, collided):
    flat = trajectory3d(Trajectories(Recording(collided)))
    assert flat.axes[0].get_zlabel() == "up [m]"
    assert flat.legends[0].get_title().get_text().startswith("Trajectories in space, heights times 100")
    deep = trajectory3d(Trajectories(Recording(hunted)))
    assert deep.legends[0].get_title().get_text().startswith("Trajectories in space · hunt")


@pytest.mark.parametrize(
    "place", [(0.0, 0.0, 0.0), (2500.0, 0.0, 60.0), (0.0, 90000.0, 10.0), (3.0, 3.0, 900.0)]
)
def test_all_of_a_scene_in_space_lies_on_the_figure(hunted, tmp_path, place):
    far = Block(name="far", team=3, position=place, motion=Still())
    near = Block(name="near", team=4, position=(0, 0, 1), motion=Still())
    run = record(Mission(blocks=[near, far], end=0.2), tmp_path / "run") if any(place) else hunted
    figure = trajectory3d(Trajectories(Recording(run)))
    figure.draw_without_rendering()
    axes = figure.axes[0]
    boxes = [axis.get_tightbbox() for axis in (axes.xaxis, axes.yaxis, axes.zaxis)]
    assert min(box.y0 for box in boxes) >= 0.0 <= min(box.x0 for box in boxes)
    assert max(box.x1 for box in boxes) <= figure.bbox.width
    assert max(box.y1 for box in boxes) <= figure.legends[0].get_window_extent().y0


@pytest.mark.parametrize("selection", [Selection(), Selection(start=3.0, end=11.0)])
@pytest.mark.parametrize("period", [None, 0.7, 5.0])
def test_the_maps_of_where_they_were_hold_all_the_time_they_were_there(tmp_path, period, selection):
    """From the first recorded state of the span to the last, however far these are apart; none is counted beyond."""
    run = record(hunt(n_prey=25, end=20.0), tmp_path / "hunt", period=period)
    tracks = Trajectories(Recording(run), selection)
    figure = density(tracks)
    images = [axes.images[0] for axes in figure.axes if axes.images]
    assert [axes.get_title(loc="left") for axes in figure.axes[:2]] == ["prey, late", "hunters"]
    for image, team in zip(images, (1, 2), strict=True):
        is_mine = np.repeat(tracks.team == team, np.diff(tracks.first))
        n = np.bincount(tracks.frame[is_mine], minlength=len(tracks.frame_times))
        lived = float((n[:-1] * np.diff(tracks.frame_times)).sum())
        assert np.ma.sum(image.get_array()) == pytest.approx(lived, rel=1e-9)
        assert lived <= n.max() * (tracks.frame_times[-1] - tracks.frame_times[0]) * (1.0 + 1e-9)


def test_very_many_teams_share_one_map(tmp_path, monkeypatch, hunted):
    monkeypatch.setattr(maps, "MAX_MAPS", 1)
    figure = density(Trajectories(Recording(hunted)))
    assert len([axes for axes in figure.axes if axes.images]) == 1
    assert figure.axes[0].get_title(loc="left") == "all 2 teams"


# -- over time ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("plot", "column"), [(speed, 3), (altitude, 2)])
def test_few_are_lines_and_many_are_a_band_around_their_median(hunted, plot, column):
    recording = Recording(hunted)
    tracks = Trajectories(recording)
    figure = plot(tracks)
    lines = lines_by_colour(figure.axes[0])
    values = tracks.speed if plot is speed else tracks.column("z")
    median = lines[COLOURS[1]]
    for t, v in list(zip(median.get_xdata(), median.get_ydata(), strict=True))[::20]:
        frame = recording.at(t)
        of_team = frame.team == 1
        seen = np.linalg.norm(frame.vel[of_team], axis=1) if plot is speed else frame.pos[of_team, 2]
        assert v == pytest.approx(np.median(seen), rel=1e-12)
    hunters = [line for line in figure.axes[0].lines if line.get_color() == COLOURS[2]]
    assert len(hunters) == 3
    (_, _, rows), *_ = [e for e in tracks.each() if e[1] == 2]
    np.testing.assert_array_equal(hunters[0].get_ydata(), values[rows])
    assert "half of a team" in legend_of(figure)
    assert figure.axes[0].get_ylabel() == ("speed [m/s]" if plot is speed else "altitude [m]")


@pytest.fixture(scope="module")
def thinking(tmp_path_factory):
    """Ten runs with columns of plugins."""
    base = tmp_path_factory.mktemp("runs")
    mission = hunt(n_prey=20, end=4.0)
    return [record(mission, base / f"{i}", (i,), columns="*.target,*.Boids.speed") for i in range(1, 11)]


def test_a_column_of_a_plugin_is_plotted_for_the_teams_that_have_it(thinking):
    recording = Recording(thinking[0])
    figure = column(recording, "Boids.target")
    assert [axes.get_ylabel() for axes in figure.axes] == [f"Boids.target.{axis} [m]" for axis in "xyz"]
    assert legend_of(figure)[0] == "prey, late"
    assert "hunters" not in legend_of(figure)
    median = lines_by_colour(figure.axes[1])[COLOURS[1]]
    for t, v in list(zip(median.get_xdata(), median.get_ydata(), strict=True))[::10]:
        values = recording.values(recording.index_at(t), "Boids.target")[:, 1]
        assert v == pytest.approx(np.median(values.compressed()), rel=1e-12)


def test_a_component_and_chosen_entities_and_columns_of_whole_numbers(thinking):
    recording = Recording(thinking[0])
    who = int(recording.frame(0).id[-1])
    figure = column(recording, "Predator.target", Selection(entities=(who,)))
    (line,) = figure.axes[0].lines
    frames = range(recording.n_frames)
    expected = [recording.values(i, "Predator.target")[recording.frame(i).row_of(who), 0] for i in frames]
    assert line.get_ydata().tolist() == expected
    assert figure.axes[0].get_ylabel() == "Predator.target"
    assert len(column(recording, "Boids.target.z").axes) == 1
    assert column(recording, "vx").axes[0].get_ylabel() == "vx [m/s]"


def mean_at(recording, i):
    return recording.values(i, "Boids.speed").compressed().mean()


def test_two_runs_have_a_line_each(thinking):
    runs = [Recording(path) for path in thinking[:2]]
    figure = column_of_runs(runs, "Boids.speed")
    assert legend_of(figure) == ["1", "2"]
    for recording, line in zip(runs, figure.axes[0].lines, strict=True):
        for t, v in list(zip(line.get_xdata(), line.get_ydata(), strict=True))[::40]:
            assert v == pytest.approx(mean_at(recording, recording.index_at(t)), rel=1e-12)
    assert "seed" not in figure.legends[0].get_title().get_text()


def test_many_runs_have_the_median_and_bands_of_their_means(thinking, tmp_path):
    (tmp_path / "runs").mkdir()
    (tmp_path / "batch.json").touch()
    with pytest.raises(ViewError, match="no run of the batch is recorded; tussle batch --record-runs"):
        runs_of(tmp_path)
    for i, path in enumerate(thinking):
        shutil.copytree(path, tmp_path / "runs" / f"{i:06d}")
    runs = [Recording(path) for path in runs_of(tmp_path)]
    figure = column_of_runs(runs, "Boids.speed")
    assert legend_of(figure) == ["prey, late, median", "half of the runs", "90 % of them"]
    (median,) = figure.axes[0].lines
    t, v = median.get_xdata()[200], median.get_ydata()[200]
    assert v == pytest.approx(np.median([mean_at(run, run.index_at(t)) for run in runs]), rel=1e-12)


def test_a_run_that_has_ended_has_no_values_afterwards(thinking, tmp_path):
    short = Recording(record(hunt(n_prey=20, end=2.0), tmp_path / "short", columns="*.Boids.speed"))
    figure = column_of_runs([Recording(thinking[0]), short], "Boids.speed")
    line = figure.axes[0].lines[1]
    ends = line.get_xdata()[np.isfinite(line.get_ydata())][-1]
    assert ends == pytest.approx(2.0, abs=0.02)


def test_chosen_entities_have_lines_of_their_own(hunted):
    tracks = Trajectories(Recording(hunted), Selection(entities=(2, 27, 26)))
    figure = speed(tracks)
    assert [name.partition(" ")[0] for name in legend_of(figure)][:3] == ["2", "26", "27"]
    assert len(lines_by_colour(figure.axes[0])) == 3


def test_a_line_is_broken_where_the_entity_was_not_there(hunted):
    recording = Recording(hunted)
    step = np.asarray(recording.run.trajectory_table["step"])
    who = np.asarray(recording.run.trajectory_table["id"])
    gone = (who == 2) & (step > 20) & (step < 30)
    recording.run.trajectory_table = recording.run.trajectory_table.filter(~gone)
    tracks = Trajectories(recording, Selection(entities=(2,)))
    (line,) = lines_by_colour(speed(tracks).axes[0]).values()
    assert np.isnan(line.get_ydata()).sum() == 1
    assert len(drawn_ways(trajectory(tracks).axes[0])[COLOURS[1]]) == 2


def test_the_distance_of_two_is_that_of_their_positions_with_its_least(collided):
    recording = Recording(collided)
    figure = distance(recording, 2, 1)
    line = figure.axes[0].lines[0]
    for t, v in zip(line.get_xdata(), line.get_ydata(), strict=True):
        frame = recording.at(t)
        assert v == pytest.approx(np.linalg.norm(frame.pos[0] - frame.pos[1]), rel=1e-12)
    least = line.get_ydata().min()
    assert legend_of(figure) == [
        f"least: {least:.3g} m at {line.get_xdata()[-1]:g} s",
        "2 died: collision",
        "1 died: collision",
    ]
    assert figure.axes[0].get_ylim()[0] == 0.0
    later = distance(recording, 1, 2, Selection(start=1.0)).axes[0].lines[0]
    assert later.get_xdata()[0] == pytest.approx(1.0)


def test_two_that_have_no_distance_are_told(hunted, tmp_path):
    with pytest.raises(ParameterError, match="from entity 3 to itself"):
        distance(Recording(hunted), 3, 3)
    recording = Recording(hunted)
    dead = next(h for h in recording.events if h.kind == "death")
    late = next(h for h in recording.events if h.kind == "birth" and h.t > dead.t)
    with pytest.raises(
        ParameterError,
        match=f"entities {dead.id} and {late.id} never exist at the same time: {dead.id} exists",
    ):
        distance(recording, dead.id, late.id)


# -- counts -------------------------------------------------------------------------------------------------------------------


def test_who_is_left_is_counted_in_each_frame_and_deaths_are_marked_on_the_curve(hunted):
    recording = Recording(hunted)
    figure = left(Trajectories(recording))
    curves = lines_by_colour(figure.axes[0])
    for team, colour in COLOURS.items():
        t, n = curves[colour].get_data()
        assert list(n) == [int((recording.at(x).team == team).sum()) for x in t]
    crosses = [line for line in figure.axes[0].lines if line.get_marker() == "x"]
    deaths = [h for h in recording.events if h.kind == "death"]
    assert len(crosses) == len(deaths) > 0
    for cross, death in zip(crosses, sorted(deaths, key=lambda h: h.t), strict=True):
        (t,), (n,) = cross.get_data()
        assert n == (recording.at(t).team == 1).sum()
        assert t == death.t
    assert legend_of(figure)[-1] == "captured"


@pytest.mark.parametrize(
    ("period", "selection"),
    [
        (0.7, Selection(start=4.0, end=17.0)),
        (5.0, Selection()),
        (5.0, Selection(teams=(1,))),
        (100.0, Selection()),
    ],
)
def test_who_is_left_does_not_depend_on_how_often_states_were_recorded(tmp_path, hunted, period, selection):
    """All events are recorded, whatever the period: births and deaths are on the curve when they happen."""
    seldom = Recording(record(hunt(n_prey=25, end=20.0), tmp_path / "hunt", seeds=(1, 2), period=period))
    often = Recording(hunted)
    tracks = Trajectories(seldom, selection)
    low, high = tracks.frame_times[0], tracks.frame_times[-1]
    known = left(Trajectories(often, Selection(selection.teams, (), low, high)))
    found = left(tracks)
    for one, other in zip(known.axes[0].lines, found.axes[0].lines, strict=True):
        assert one.get_marker() == other.get_marker()
        if one.get_marker() == "x":
            assert one.get_xydata().tolist() == other.get_xydata().tolist()
        else:
            x, y = other.get_data()
            at = np.searchsorted(x, one.get_xdata() + 1e-6, side="right") - 1
            np.testing.assert_array_equal(np.asarray(y)[at], one.get_ydata())
    assert legend_of(known) == legend_of(found)


def test_one_that_lived_between_two_recorded_states_is_named(hunted):
    recording = Recording(hunted)
    table = recording.run.trajectory_table
    recording.run.trajectory_table = table.filter(np.asarray(table["id"]) != 5)
    assert Trajectories(recording).team_of[5] == 1
    with pytest.raises(ParameterError, match="no state of entity 5 was recorded; it lived between"):
        Trajectories(recording, Selection(entities=(5,)))


def test_captures_are_counted_for_who_made_them_and_collisions_for_all(hunted, collided):
    recording = Recording(hunted)
    figure = captures(Trajectories(recording))
    caught = [h.t for h in recording.events if h.kind == "capture"]
    (curve,) = lines_by_colour(figure.axes[0]).values()
    assert (curve.get_color(), curve.get_ydata()[-1]) == (COLOURS[2], len(caught))
    np.testing.assert_array_equal(curve.get_xdata()[1:-1], caught)
    assert legend_of(figure) == [f"hunters: {len(caught)}"]
    late = captures(Trajectories(recording, Selection(start=5.0)))
    assert legend_of(late) == [f"hunters: {sum(t >= 5.0 for t in caught)}"]
    met = captures(Trajectories(Recording(collided)))
    assert met.axes[0].get_ylabel() == "collisions so far"
    assert met.axes[0].lines[0].get_ydata()[-1] == 1
    with pytest.raises(ParameterError, match="there are no captures and no collisions"):
        captures(Trajectories(recording, Selection(teams=(1,))))


# -- files --------------------------------------------------------------------------------------------------------------------


def test_what_shows_something_is_written_and_the_rest_is_said(hunted, collided, tmp_path):
    written = write_plots(Recording(hunted), tmp_path / "a")
    assert [f.name for f in written.files] == [
        f"{name}.png"
        for name in ("trajectory", "trajectory3d", "speed", "altitude", "left", "captures", "density")
    ]
    assert all(f.read_bytes().startswith(b"\x89PNG") for f in written.files)
    flat = write_plots(Recording(collided), tmp_path / "b")
    assert [f.stem for f in flat.files] == ["trajectory", "speed", "left", "captures", "density"]
    assert any("all are at 100 m" in note for note in flat.notes)
    one = write_plots(Recording(hunted, 1), tmp_path / "c", selection=Selection(entities=(2,)))
    assert [f.stem for f in one.files] == [
        f"{name}-world-1" for name in ("trajectory", "trajectory3d", "speed", "altitude", "density")
    ]
    two = write_plots(Recording(hunted), tmp_path / "d", between=(26, 27))
    assert [f.name for f in two.files] == ["distance-26-27.png"]


@pytest.mark.parametrize("form", ["png", "svg", "pdf"])
def test_the_same_run_gives_the_same_bytes(hunted, tmp_path, form):
    kinds = KINDS if form == "svg" else ("trajectory", "density")  # what is drawn does not depend on the form
    for folder in ("a", "b"):
        write_plots(
            Recording(hunted),
            tmp_path / folder,
            kinds,
            form=form,
            between=(26, 27) if form == "svg" else None,
        )
    files = sorted((tmp_path / "a").iterdir())
    assert len(files) == len(kinds)
    for file in files:
        data = file.read_bytes()
        assert data == (tmp_path / "b" / file.name).read_bytes()
        if form == "svg":
            ET.fromstring(data)


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"kinds": ["sped"]}, r"there is no plot 'sped' \(did you mean 'speed'\?\); there are: trajectory, "),
        ({"form": "pgn"}, r"there is no format 'pgn' \(did you mean 'png'\?\); there are: png, svg, pdf"),
        ({"kinds": ["distance"]}, "'distance' is of two entities, and none are given"),
        ({"kinds": ["speed"], "between": (1, 2)}, "'distance' is not among the plots: speed"),
        (
            {"columns": ["Boids.goal"]},
            "there is no column 'Boids.goal'; there are: x, y.*tussle run --record-columns records",
        ),
        ({"columns": ["vxx"]}, r"there is no column 'vxx' \(did you mean 'vx'\?\)"),
    ],
)
def test_what_cannot_be_asked_for_is_told(hunted, tmp_path, asked, said):
    with pytest.raises(ParameterError, match=said):
        write_plots(Recording(hunted), tmp_path / "plots", **asked)
    assert not (tmp_path / "plots").exists()


def test_what_cannot_be_plotted_of_columns_is_told(thinking, tmp_path):
    runs = [Recording(path) for path in thinking[:2]]
    with pytest.raises(ParameterError, match="of several runs only columns are plotted"):
        write_plots(runs[0], tmp_path / "plots", others=runs[1:])
    with pytest.raises(ParameterError, match="of several runs only columns are plotted"):
        write_plots(runs[0], tmp_path / "plots", ["speed"], columns=["Boids.speed"], others=runs[1:])
    with pytest.raises(ParameterError, match=r"the selected entities have no values of 'Boids\.speed'"):
        column(runs[0], "Boids.speed", Selection(teams=(2,)))
    written = write_plots(runs[0], tmp_path / "plots", columns=["Boids.speed"], others=runs[1:])
    assert [file.name for file in written.files] == ["Boids.speed.png"]


def test_a_place_that_cannot_be_written_is_told(collided, tmp_path):
    (tmp_path / "taken").write_text("a file")
    with pytest.raises(ViewError, match="taken: the plots cannot be written: "):
        write_plots(Recording(collided), tmp_path / "taken")
    (tmp_path / "speed.png").mkdir()
    with pytest.raises(ViewError, match=r"speed\.png: cannot be written: it is a directory"):
        write_plots(Recording(collided), tmp_path, ["speed"])


def test_letters_that_the_font_lacks_are_said(tmp_path):
    game = Mission(blocks=[Block(name="漢 $x^2$", team=1, motion=Still())], end=1.0, end_conditions="time")
    run = record(game, tmp_path / "run")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        written = write_plots(Recording(run), tmp_path / "plots", ["left"], form="svg")
    assert written.notes[-1] == "the font has no 漢"
    assert "漢 $x^2$: 1, then 1" in (tmp_path / "plots" / "left.svg").read_text()


def test_a_cut_run_is_plotted_as_far_as_it_goes_and_it_is_said(tmp_path):
    cut = record(hunt(n_prey=25, end=5.0), tmp_path / "cut", flush_every=1e-9)  # a batch for each step
    (cut / "run.json").unlink()
    data = (cut / "trajectory.arrow").read_bytes()
    (cut / "trajectory.arrow").write_bytes(data[: len(data) * 2 // 3])
    written = write_plots(Recording(cut), tmp_path / "plots")
    assert 2.0 < Trajectories(Recording(cut)).frame_times[-1] < 4.5
    assert len(written.files) == 7
    assert any("run.json is missing" in note for note in written.notes)
    assert any("trajectory.arrow" in note for note in written.notes)


def test_without_matplotlib_the_extra_is_named(monkeypatch, collided, tmp_path):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(
        MissingExtraError, match=r"tussle plot draws with matplotlib.*pip install 'tussle\[view\]'"
    ):
        write_plots(Recording(collided), tmp_path / "plots")
    assert not (tmp_path / "plots").exists()


def test_a_legend_lists_what_is_drawn_only(tmp_path):
    mission = hunt(end=4.0, end_conditions="time")
    still = Block(name="still", team=7, count=2, position=(60, 0, 200), motion=Still())
    run = Recording(record(mission.replace(blocks=[*mission.blocks, still]), tmp_path / "run"))
    tracks = Trajectories(run)
    figure = trajectory(tracks)
    assert legend_of(figure) == ["prey, late", "hunters", "still", "first", "last", "died"]
    handles = dict(zip(legend_of(figure), figure.legends[0].legend_handles, strict=True))
    assert handles["still"].get_marker() == "s", "nobody of it has moved: there is no line"
    assert handles["hunters"].get_linestyle() == "-"
    dead = tuple(h.id for h in run.events if h.kind == "death")
    chosen = Trajectories(run, Selection(entities=dead))
    lines = [name for name in chosen.teams.values() if name != "still"]
    assert [name for name in legend_of(trajectory(chosen)) if name != "still"] == [*lines, "first", "died"]
    assert "died" in legend_of(altitude(Trajectories(run, Selection(entities=dead[:2]))))
    living = tuple(set(tracks.who.tolist()) - set(dead))
    assert "died" not in legend_of(altitude(Trajectories(run, Selection(entities=living))))


def test_a_long_name_stands_in_the_title_in_full(tmp_path):
    name = "Do four guards find eight intruders in the night, or do they need more of them? " * 2
    run = Recording(record(hunt(end=1.0, name=name), tmp_path / "run"))
    for plot in (trajectory, trajectory3d, altitude):
        figure = plot(Trajectories(run))
        figure.draw_without_rendering()
        title = figure.legends[0].get_title()
        assert "".join(title.get_text().split()).endswith("".join(f"{name}".split()) + ",seed1")
        box = title.get_window_extent()
        assert box.x0 >= 0.0
        assert box.x1 <= figure.bbox.width
        assert box.y1 <= figure.bbox.height
