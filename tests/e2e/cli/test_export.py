"""tussle export: a recorded run as films, pictures, pages and tables."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import time

import imageio_ffmpeg
import pytest
from cli_process import COMMAND, environment
from mcap.reader import make_reader
from test_terminal import ESCAPE, seen

from tussle import Recorder, Simulation, load_run
from tussle.mission import read_mission

SMALL = ("--size", "96x64", "--fps", "5", "--speed", "1")


@pytest.fixture
def played(tussle, folder):
    """A game of three seconds."""
    tussle("run", "game.xml", "--out", "played")
    return folder / "played"


@pytest.mark.needs("renderer")
def test_all_outputs_at_once_lie_in_the_run(process, played):
    before = {p.name for p in played.iterdir()}
    asked = ("--mp4", "--gif", "--png", "--mcap", "--csv", "--parquet", "--html")
    said = process("export", "played", *asked, *SMALL)
    made = {
        "film.mp4", "film.gif", "picture.png", "run.mcap", "replay.html", "states.csv", "states.events.csv",
        "states.parquet", "states.events.parquet",
    }  # fmt: skip
    assert {p.name for p in played.iterdir()} - before == made
    lines = said.stdout.splitlines()
    assert {line.split(":")[0] for line in lines} == {f"played/{name}" for name in made}
    film = next(line for line in lines if "film.mp4" in line)
    assert re.fullmatch(
        r"played/film.mp4: 16 pictures, 3.2 s at 1 × real time, [\d.]+ pictures/s, [\d.]+ k?B", film
    )
    assert re.fullmatch(r"played/picture.png: 96×64, [\d.]+ k?B", next(x for x in lines if "png" in x))
    assert any(re.fullmatch(r"played/states.csv: 3\d\d states, [\d.]+ kB", line) for line in lines)
    assert all(
        re.match(r"film: \d+/32 pictures, ", line) for line in said.stderr.splitlines()
    )  # on a busy machine
    ffmpeg = imageio_ffmpeg.get_ffmpeg_exe()
    about = subprocess.run(
        [ffmpeg, "-i", str(played / "film.mp4")], check=False, capture_output=True, text=True
    ).stderr
    assert "96x64" in about
    assert "Duration: 00:00:03.20" in about
    assert "<html" in (played / "replay.html").read_text()
    with (played / "run.mcap").open("rb") as file:
        assert make_reader(file).get_summary().statistics.message_count > 60


def test_a_bag_is_a_folder_of_the_run(tussle, played):
    before = {p.name for p in played.iterdir()}
    said = tussle("export", "played", "--rosbag2", "--period", "0.5")
    assert {p.name for p in played.iterdir()} - before == {"rosbag2"}
    assert {p.name for p in (played / "rosbag2").iterdir()} == {"rosbag2.mcap", "metadata.yaml"}
    assert re.fullmatch(r"played/rosbag2/rosbag2.mcap: 7 states, \d+ messages, [\d.]+ k?B\n", said.stdout)


@pytest.mark.needs("renderer")
def test_files_can_be_named(tussle, played, folder):
    said = tussle("export", "played", "--csv", "a.csv", "--png", "b.png", "--size", "96x64", "--at", "1.5 s")
    assert [line.split(":")[0] for line in said.stdout.splitlines()] == ["a.csv", "a.events.csv", "b.png"]
    assert (folder / "a.csv").read_text().startswith('"world","t","step","id"')


@pytest.mark.needs("renderer")
def test_a_part_of_the_game_as_others_see_it(tussle, played):
    said = tussle(
        "export", "played", "--mp4", *SMALL, "--from", "1", "--to", "9", "--follow", "11", "--labels"
    )
    assert "played/film.mp4: 11 pictures, 2.2 s" in said.stdout
    assert said.stderr == "note: the run is recorded until t = 3 s; the film ends there, not at 9 s\n"
    tussle(
        "export", "played", "--mp4", *SMALL, "--camera", "top", "--trails", "0", "--zoom", "2", "--no-caption"
    )


@pytest.mark.needs("renderer")
def test_of_several_worlds_one_is_shown_and_tables_hold_all(tussle, folder):
    simulation = Simulation(read_mission(folder / "game.xml").mission, seeds=[1, 2])
    with Recorder(simulation, folder / "two"):
        simulation.run()
    said = tussle("export", "two", "--png", "--csv", "--size", "96x64")
    assert "note: the run has 2 worlds; world 0 is shown" in said.stderr
    both = (folder / "two" / "states.csv").read_text().splitlines()
    assert {line.split(",")[0] for line in both[1:]} == {"0", "1"}
    said = tussle("export", "two", "--png", "--csv", "--size", "96x64", "--world", "1")
    assert "worlds" not in said.stderr
    one = (folder / "two" / "states.csv").read_text().splitlines()
    assert {line.split(",")[0] for line in one[1:]} == {"1"}
    said = tussle("export", "two", "--png", "--world", "2", code=4)
    assert "there is no world 2; there are worlds 0 to 1" in said.stderr


@pytest.mark.needs("renderer")
def test_a_run_that_was_killed_is_exported_as_far_as_it_goes(tussle, played, folder):
    (played / "run.json").unlink()
    said = tussle("export", "played", "--png", "--mcap", "--csv", "--size", "96x64")
    assert said.stderr.count("note: run.json is") == 2, "once of the run, once of its tables"
    assert len(said.stdout.splitlines()) == 4


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            (),
            "--html, --mp4, --gif, --png, --mcap, --rerun, --rosbag2, --geojson, --kml, --czml, --csv, --parquet",
        ),
        (("--csv", "--camera", "top"), "--camera is allowed with --mp4 or --gif or --png only"),
        (("--png", "--fps", "30"), "--fps is allowed with --mp4 or --gif only"),
        (("--mp4", "--at", "1"), "--at is allowed with --png only"),
        (
            ("--png", "--period", "1"),
            "--period is allowed with --html or --mcap or --rerun or --rosbag2 or --geojson or --kml or --czml only",
        ),
        (("--png", "--camera", "folow"), "did you mean 'follow'?"),
        (("--png", "--camera", "top", "--follow", "3"), "follow = 3 means nothing to camera = 'top'"),
        (("--png", "--size", "big"), "--size 'big' does not have the form WIDTHxHEIGHT"),
        (("--png", "--size", "95x64"), "it takes even numbers of pixels"),
        (("--mp4", "--from", "noon"), "--from: 'noon'"),
        (("--mp4", "--speed", "0"), "speed = 0.0 is not allowed"),
        (("--mcap", "--period", "0"), "--period 0 is not allowed"),
        (("--mcap", "--spec", "always (count(all) > 1)"), "--spec is allowed with --html only"),
        (("other", "--mcap"), "a second run is allowed with --html only"),
        (("--html", "--over"), "a second run is required"),
        (("--html", "--margin", "2"), "--margin is allowed with --spec only"),
    ],
)
def test_what_means_nothing_is_refused(tussle, folder, arguments, message):
    said = tussle("export", "played", *arguments, code=2)
    assert message in " ".join(said.stderr.split())


def test_what_cannot_be_done_is_told_in_one_line(tussle, played, folder):
    (folder / "empty").mkdir()
    for arguments, message in (
        (("nowhere", "--mp4"), "nowhere: it is not a run directory"),
        (("empty", "--csv"), "empty: it is not a run directory"),
        (("game.xml", "--png"), "game.xml: it is not a run directory"),
        (("played", "--mp4", "nowhere/a.mp4"), "nowhere/a.mp4: cannot be written: No such file or directory"),
        (("played", "--csv", "nowhere/a.csv"), "nowhere/a.csv: cannot be written: No such file or directory"),
        (("played", "--mcap", "empty"), "empty: cannot be written: it is a directory"),
        (("played", "--mp4", "--from", "9"), "no film can begin at t = 9 s"),
        (("played", "--png", "--follow", "99"), "entity 99 cannot be followed"),
    ):
        said = tussle("export", *arguments, code=4)
        assert len(said.stderr.splitlines()) == 1
        assert said.stderr.startswith("error: ")
        assert message in said.stderr
        assert said.stdout == ""
    assert not list((folder / "empty").iterdir())
    before = {p.name: p.read_bytes() for p in played.iterdir()}
    asked = {
        "csv": "no/a.csv",
        "parquet": "b",
        "html": "b",
        "kml": "c",
        "mcap": "/",
        "geojson": "played/run.json",
    }
    said = tussle("export", "played", *(f"--{kind}={file}" for kind, file in asked.items()), code=4)
    assert [line.split(":")[0] for line in said.stdout.splitlines()] == ["b", "b.events.parquet"]
    assert [line.removeprefix("error: ") for line in said.stderr.splitlines()] == [
        "no/a.csv: cannot be written: No such file or directory",
        "b: cannot be written: it is a file of --parquet; name another for --html",
        "played/run.json: cannot be written: it is a file of the recording; name another for --geojson",
        "played: the mission has no origin, so the run is nowhere on Earth; set <latitude_origin> and <longitude_origin> in played/mission.xml, or in the mission",  # noqa: E501
        "/: cannot be written: it is a directory",
        "note: not written: --csv, --html, --geojson, --kml, --mcap",
    ]
    assert {p.name: p.read_bytes() for p in played.iterdir()} == before


@pytest.mark.needs("renderer")
def test_a_film_is_written_beside_a_picture_that_cannot_be(tussle, played, folder):
    arguments = "--gif", "a.gif", "--png", "no/a.png", "--size", "96x64", "--fps", "4"
    said = tussle("export", "played", *arguments, code=4)
    assert "no/a.png: cannot be written: No such file or directory" in said.stderr
    assert said.stderr.endswith("note: not written: --png\n")
    assert said.stdout.startswith("a.gif: ")
    assert (folder / "a.gif").stat().st_size


@pytest.mark.needs("renderer")
def test_ctrl_c_leaves_what_was_finished_and_nothing_else(played, folder):
    """In the midst of a film of half an hour."""
    process = subprocess.Popen(
        [*COMMAND, "export", "played", "--csv", "--mp4", "--speed", "0.001"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=folder, env=environment(),
    )  # fmt: skip
    limit = time.monotonic() + 300.0
    while not any(played.glob(".film*part*")):
        assert time.monotonic() < limit
        time.sleep(0.05)
    time.sleep(0.5)
    os.kill(process.pid, signal.SIGINT)
    said = process.communicate(timeout=300.0)
    assert process.returncode == 130, said
    assert "interrupted: " in said[1]
    assert "states.csv" in said[0]
    assert sorted(p.name for p in played.iterdir() if p.suffix == ".part" or p.name.startswith("film")) == []


def test_the_log_says_which_game_it_is(tussle, played):
    tussle("export", "played", "--mcap")
    with (played / "run.mcap").open("rb") as file:
        about = {m.name: m.metadata for m in make_reader(file).iter_metadata()}["run"]
    seed = json.loads((played / "run.json").read_text())["worlds"][0]["seed"]
    assert about == {"mission": "A small game", "world": "0", "seed": str(seed)}


@pytest.mark.needs("renderer")
def test_a_terminal_sees_how_far_it_is(played, folder):
    text, code = seen(folder, "export", "played", "--mp4", *SMALL, "--fps", "60")
    assert code == 0
    bars = [line for line in re.split(r"[\r\n]", ESCAPE.sub("", text)) if "left" in line]
    assert len(bars) >= 2
    for bar in bars:
        assert re.search(r"film \S.* \d+/181 pictures +\d+:\d\d left", bar)
        assert len(bar.rstrip()) <= 80
    assert "181 pictures, 3.0 s at 1 × real time" in ESCAPE.sub("", text)


FLIGHT = """<runscript name="A flock"><run end="3" dt="0.1"/><seed>7</seed><entity><name>flock</name> <team_id>1</team_id>
  <count>5</count> <variance_x>400</variance_x> <variance_y>400</variance_y>
  AUTONOMY <motion_model max_speed="-1">SingleIntegrator</motion_model></entity></runscript>"""
PLAYBACK = '<autonomy enable_playback="1" trajectory_filename="states.csv" remove_at_end="0">TrajectoryRecordPlayback</autonomy>'


def test_a_run_that_plays_a_record_back_flies_as_the_recorded_one(tussle, folder):
    runs = []
    for name, autonomy in (("one", "<autonomy>Boids</autonomy>"), ("two", PLAYBACK)):
        (folder / f"{name}.xml").write_text(FLIGHT.replace("AUTONOMY", autonomy))
        tussle("run", f"{name}.xml", "--out", name)
        runs.append(load_run(folder / name).trajectory.set_index(["id", "t"])[["x", "y", "z"]])
        tussle("export", name, "--csv", "states.csv" if name == "one" else "again.csv")
    one, two = runs
    assert len(one) == len(two) > 5 * 25
    assert abs(one - two).to_numpy().max() < 1e-9
    assert (one.groupby("id").last() - one.groupby("id").first()).abs().to_numpy().max() > 10.0
