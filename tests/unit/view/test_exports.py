"""What all ways to write a recording have in common: a whole file or none, and one line that says why."""

from __future__ import annotations

import pytest
from recorded_games import hunt, record

from tussle.errors import ParameterError, ViewError
from tussle.scene import Origin, Scene
from tussle.view import Recording
from tussle.view.export.film import FilmOptions, write_film
from tussle.view.export.geographic import write_geographic
from tussle.view.export.html import write_html
from tussle.view.export.mcap_file import write_mcap
from tussle.view.export.rerun_file import write_rerun
from tussle.view.export.rosbag2 import write_rosbag2
from tussle.view.export.tables import write_tables

SMALL = FilmOptions(stop=0.4, speed=1.0, fps=5.0, size=(64, 48), captions=False, trails=0.0)


def film(kind):
    return lambda run, path, **more: write_film(run, **{kind: path}, options=SMALL, **more)


def places(kind):
    return lambda run, path, **more: write_geographic(run, path, kind, **more)


def table(kind):
    return lambda run, path, **more: write_tables(run.path, path, kind, **more)


FILES = {
    **{kind: film(kind) for kind in ("mp4", "gif", "png")}, **{kind: places(kind) for kind in ("geojson", "kml", "czml")},
    **{kind: table(kind) for kind in ("csv", "parquet")}, "html": write_html, "mcap": write_mcap, "rrd": write_rerun,
}  # fmt: skip
ALL = {**FILES, "rosbag2": write_rosbag2}


def ways(*names):
    """The names, as parameters with what they need to write something."""
    marks = {"rrd": pytest.mark.needs("rerun")}
    return pytest.mark.parametrize("name", [pytest.param(name, marks=marks.get(name, ())) for name in names])


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    mission = hunt(n_prey=4, end=1.0).replace(scene=Scene(origin=Origin.from_degrees(-33.9, 18.4, 120.0)))
    return Recording(record(mission, tmp_path_factory.mktemp("runs") / "run"))


@ways(*FILES)
def test_a_file_that_cannot_be_written_is_told_and_leaves_nothing(run, tmp_path, name):
    with pytest.raises(ViewError, match=rf"nowhere/a\.{name}: cannot be written: No such file or directory"):
        FILES[name](run, tmp_path / "nowhere" / f"a.{name}")
    (tmp_path / "folder").mkdir()
    with pytest.raises(ViewError, match="folder: cannot be written: it is a directory"):
        FILES[name](run, tmp_path / "folder")
    assert [path.name for path in tmp_path.rglob("*")] == ["folder"]


@ways("geojson", "kml", "czml", "csv", "parquet", "mcap", "rrd", "rosbag2")
def test_an_interruption_leaves_nothing(run, tmp_path, name):
    if name == "rosbag2":
        pytest.importorskip("rosbags")

    def stop(*_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        ALL[name](run, tmp_path / "a", show=stop)
    assert not list(tmp_path.iterdir())


@ways("mp4", "gif", "png", "html", "mcap", "rrd")
def test_a_run_without_states_is_refused(tmp_path, name):
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "trajectory.arrow").write_bytes(b"")
    with pytest.raises(ViewError, match="holds no states"):
        ALL[name](Recording(tmp_path / "run"), tmp_path / "a")
    assert not (tmp_path / "a").exists()


@ways("geojson", "kml", "czml", "html", "mcap", "rrd", "rosbag2")
@pytest.mark.parametrize("period", [0.0, -1.0, float("nan"), float("inf")])
def test_a_period_is_a_number_of_seconds(run, tmp_path, name, period):
    with pytest.raises(ParameterError, match="takes a number > 0"):
        ALL[name](run, tmp_path / "a", period=period)
    assert not list(tmp_path.iterdir())
