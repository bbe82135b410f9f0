"""`tussle run`: what it shows, what it writes, and what each option does."""

from __future__ import annotations

import datetime as dt
import json
import re
import shlex
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from cli_process import COMMAND, environment

from tussle.cli.play import _new_directory
from tussle.record import load_run


def hash_of(done):
    return re.search(r"^ hash +([0-9a-f]{32,})$", done.stdout, re.MULTILINE)[1]


def info_of(folder, name="out"):
    return json.loads((folder / name / "run.json").read_text())


def test_it_shows_what_came_of_the_game_and_where_it_is_recorded(process, folder):
    done = process("run", "game.xml")
    (run,) = (folder / "runs").iterdir()
    assert re.fullmatch(r"game-7-\d{8}-\d{6}", run.name)
    info = info_of(folder, run.relative_to(folder))
    assert info["is_complete"]
    assert info["worlds"][0]["seed"] == 7
    assert info["worlds"][0]["state_hash"] == hash_of(done)
    lines = done.stdout.splitlines()
    assert " A small game" in lines
    assert " seed 7 · 12 entities · 30 steps of 0.1 s" in lines
    scores = info["worlds"][0]["scores"]
    for team, name, start in (("1", "prey", "10"), ("2", "hunters", "2")):
        (line,) = (line.split() for line in lines if line.startswith(f" {team} {name}"))
        assert line[2:4] == [start, str(info["worlds"][0]["alive"][team])]
        assert line[6] == f"{scores[team]:g}"
    for label in (" ended  end time reached, at t = 3 s", " grade  portable", f" run    runs/{run.name}"):
        assert label in lines
    assert re.search(
        r"^ speed  \S+ × real time \(\S+ s, \S+ CPU s\), ready after \S+ s$", done.stdout, re.MULTILINE
    )
    assert max(map(len, lines)) <= 80
    assert not any(line != line.rstrip() for line in lines)
    assert not done.stderr


def test_the_run_directory_opens(tussle, folder):
    tussle("run", "game.xml", "--out", "out")
    run = load_run(folder / "out")
    assert run.is_complete
    assert len(run.trajectory) >= 12 * 25
    assert sorted(p.name for p in (folder / "out").iterdir()) == [
        "events.arrow", "mission.xml", "run.json", "summary.csv", "trajectory.arrow",
    ]  # fmt: skip


def test_it_is_the_same_again_and_another_with_another_seed(tussle, folder):
    first = tussle("run", "game.xml", "--no-log")
    again = tussle("run", "game.xml", "--out", "out")
    other = tussle("run", "game.xml", "--no-log", "--seed", "8")
    assert hash_of(first) == hash_of(again) != hash_of(other)
    kept = tussle("run", "out/mission.xml", "--no-log")
    assert hash_of(kept) == hash_of(first)


def test_a_converted_mission_plays_the_same_game(tussle, folder):
    played = tussle("run", "game.xml", "--no-log", "--end", "2", "prey.count=3")
    for name in ("other.xml", "game.py"):
        done = tussle("convert", "game.xml", "--to", name, "--end", "2", "prey.count=3")
        assert f"{name} plays the same game" in done.stdout
    assert hash_of(tussle("run", "other.xml", "--no-log")) == hash_of(played)
    script = subprocess.run(
        [sys.executable, "game.py"], cwd=folder, capture_output=True, text=True, check=True
    )
    assert hash_of(played) in script.stdout


@pytest.mark.parametrize(
    ("to", "code", "words"),
    [
        ("game.xml", 1, "game.xml: exists already"),
        ("no/game.py", 1, "cannot be written"),
        ("game.txt", 2, "ends in .xml or .py"),
    ],
)
def test_a_conversion_overwrites_nothing(tussle, to, code, words):
    done = tussle("convert", "game.xml", "--to", to, code=code)
    assert words in done.stderr


def test_without_log_nothing_is_written(tussle, folder):
    done = tussle("run", "game.xml", "--no-log")
    assert " run    not recorded (--no-log)" in done.stdout.splitlines()
    assert [p.name for p in folder.iterdir()] == ["game.xml"]


def test_a_shipped_mission_is_played_by_its_name(tussle, folder):
    done = tussle("run", "predator_prey", "--end", "1", "--set", "prey=20")
    assert " seed 1 · 30 entities · 10 steps of 0.1 s" in done.stdout.splitlines()
    assert next((folder / "runs").iterdir()).name.startswith("predator_prey-1-")


def test_set_reaches_placeholders_parameters_with_units_and_whole_plugins(tussle, folder):
    settings = ["n=5", "prey.Boids.max_speed=36 km/h", "SimpleCapture.capture_range=100"]
    tussle("run", "game.xml", "--out", "out", *(a for s in settings for a in ("--set", s)))
    info = info_of(folder)
    assert info["parameters"] == dict(s.split("=", 1) for s in settings)
    prey = info["mission"]["blocks"][0]
    assert prey["count"] == 5
    assert "Boids(max_speed=10.0)" in prey["plugins"]
    assert "SimpleCapture(capture_range=100.0)" in info["mission"]["world_plugins"]
    plugins = "prey.motion_model=SingleIntegrator", "prey.controller=SingleIntegratorControllerSimple"
    tussle("run", "game.xml", "--out", "flat", "--set", *plugins)
    assert "SingleIntegrator()" in info_of(folder, "flat")["mission"]["blocks"][0]["plugins"]


def test_end_takes_a_unit_and_ends_a_mission_that_has_no_such_end(tussle, folder):
    text = (folder / "game.xml").read_text().replace("<seed>", "<end_condition>none</end_condition><seed>")
    (folder / "endless.xml").write_text(text)
    done = tussle("run", "endless.xml", "--no-log", "--end", "0.05 min")
    assert " ended  end time reached, at t = 3 s" in done.stdout.splitlines()
    assert hash_of(done) == hash_of(tussle("run", "game.xml", "--no-log"))


def test_log_period_thins_the_trajectory_and_changes_nothing(tussle, folder):
    dense = tussle("run", "game.xml", "--out", "dense")
    thin = tussle("run", "game.xml", "--out", "thin", "--log-period", "1")
    assert hash_of(dense) == hash_of(thin)
    steps = [set(load_run(folder / name).trajectory["t"].round(6)) for name in ("dense", "thin")]
    assert len(steps[0]) == 31
    assert steps[1] == {0.0, 1.0, 2.0, 3.0}


def test_results_are_recorded_where_they_are_asked_for(tussle, folder):
    tussle("run", "game.xml", "--out", "plain")
    assert not (folder / "plain" / "results.arrow").exists()
    tussle("run", "game.xml", "--out", "with", "--results")
    run = load_run(folder / "with")
    last = {row["team"]: row["value"] for row in run.results_table.to_pylist() if row["name"] == "score"}
    assert {str(team): score for team, score in last.items()} == info_of(folder, "with")["worlds"][0][
        "scores"
    ]


def test_shapes_are_recorded_where_they_are_asked_for(tussle, folder):
    (folder / "drawing.py").write_text(
        '"""Draws."""\n\nfrom tussle.stock import Predator\n\n\nclass Drawing(Predator):\n    """Draws where it is."""\n\n'
        "    def step(self, g):\n        super().step(g)\n        g.draw.sphere(pos=g.pos)\n"
    )
    plugin = ("--plugin-path", "drawing.py", "--set", "mind=Drawing")
    plain = tussle("run", "game.xml", "--out", "plain", *plugin)
    drawn = tussle("run", "game.xml", "--out", "drawn", *plugin, "--shapes")
    tussle("run", "game.xml", "--out", "none", "--shapes")
    assert hash_of(plain) == hash_of(drawn)
    runs = [load_run(folder / name) for name in ("plain", "drawn", "none")]
    assert all(run.is_complete for run in runs)
    assert [run.shapes_table.num_rows for run in runs] == [0, 30, 0]


def test_columns_of_plugins_are_recorded_where_they_are_asked_for(tussle, folder):
    plain = tussle("run", "game.xml", "--out", "plain")
    told = tussle("run", "game.xml", "--out", "told", "--record-columns", "prey.Boids.target,*.Unicycle.*")
    assert hash_of(plain) == hash_of(told)
    runs = [load_run(folder / name) for name in ("plain", "told")]
    assert [list(run.columns) for run in runs] == [[], ["Boids.target", "Unicycle.x"]]
    assert all(run.is_complete for run in runs)
    wrong = tussle("run", "game.xml", "--record-columns", "prey.Boids.tarrget", code=1)
    assert "did you mean 'prey.Boids.target'?" in wrong.stderr
    assert len(wrong.stderr.splitlines()) == 1
    assert not (folder / "runs").exists()


def test_pace_takes_its_time_and_changes_nothing(tussle, folder):
    fast = tussle("run", "game.xml", "--out", "fast", "--end", "2")
    slow = tussle("run", "game.xml", "--out", "slow", "--end", "2", "--pace", "2")
    assert hash_of(fast) == hash_of(slow)
    walls = [info_of(folder, name)["timings"]["wall_s"] for name in ("fast", "slow")]
    assert walls[1] > 0.85  # 18 steps of 0.1 s between the first and the last, at twice their pace


def test_start_from_places_everybody_as_recorded(tussle, folder):
    tussle("run", "game.xml", "--out", "first", "--seed", "3")
    tussle("run", "game.xml", "--out", "again", "--seed", "4", "--start-from", "first")
    tables = [load_run(folder / name).trajectory for name in ("first", "again")]
    begin = [t[t["t"] == 0.0].set_index("id")[["x", "y", "z"]] for t in tables]
    assert (begin[0] == begin[1]).all().all()


def test_a_plugin_of_ones_own_is_played(tussle, folder):
    (folder / "mine.py").write_text(
        '"""Mine."""\n\nfrom tussle.stock import Predator\n\n\nclass Mine(Predator):\n    """A predator."""\n'
    )
    done = tussle("run", "game.xml", "--plugin-path", "mine.py", "--set", "mind=Mine", "--out", "out")
    assert "Mine(max_speed=35.0)" in info_of(folder)["mission"]["blocks"][1]["plugins"]
    assert done.stdout


def test_unknown_names_are_errors_unless_they_are_read_leniently(tussle, folder):
    text = (folder / "game.xml").read_text().replace("<seed>", "<sed>1</sed><seed>")
    (folder / "typo.xml").write_text(text)
    strict = tussle("run", "typo.xml", "--no-log", code=1)
    assert strict.stderr.startswith("error: typo.xml:4: tag 'sed' is unknown (did you mean 'seed'?)")
    assert "--lenient (strict=False) ignores them" in strict.stderr
    lax = tussle("run", "typo.xml", "--lenient", "--out", "lax")
    note = "typo.xml:4: tag 'sed' is unknown (did you mean 'seed'?); it is ignored"
    assert lax.stderr == f"note: {note}\n"
    assert json.loads((folder / "lax/run.json").read_text())["mission_notes"] == [note]
    old = text.replace("<sed>", "<stream_port>50051</stream_port><sed>")
    (folder / "typo.xml").write_text(old)
    assert note in tussle("run", "typo.xml", "--no-log").stderr
    assert "'sed' is unknown" in tussle("run", "typo.xml", "--no-log", "--strict", code=1).stderr


FAILING = '''\
"""Fails."""

from tussle.stock import Predator


class Fails(Predator):
    """Fails in step 10."""

    def step(self, g):
        if (g.step_count == 10).any():
            raise RuntimeError("out of fuel")
        super().step(g)
'''


def test_a_plugin_that_fails_ends_the_game_and_what_was_played_is_kept(tussle, folder):
    (folder / "fails.py").write_text(FAILING)
    arguments = ["run", "game.xml", "--plugin-path", "fails.py", "--set", "mind=Fails", "--out", "out"]
    done = tussle(*arguments, code=3)
    (line,) = done.stderr.splitlines()
    assert re.fullmatch(r"error: Fails, .*step 10: fails\.py:11: RuntimeError: out of fuel", line)
    assert " ended  a plugin failed, at t = 1 s" in done.stdout.splitlines()
    run = load_run(folder / "out")
    assert not run.is_complete
    assert run.trajectory["t"].max() >= 1.0
    arguments[-1] = "out2"
    assert "Traceback" in tussle(*arguments, "--debug", code=3).stderr


@pytest.mark.parametrize(
    ("arguments", "code", "text"),
    [
        (["run"], 2, "MISSION"),
        (["run", "game.xml", "--sed", "1"], 2, "--sed"),
        (["run", "game.xml", "--seed", "-1"], 2, "--seed"),
        (["run", "game.xml", "--set", "n"], 2, "'n' does not have the form NAME=VALUE"),
        (["run", "game.xml", "--set", "n=1", "n=2"], 2, "n is set twice, to '1' and to '2'"),
        (["run", "game.xml", "--pace", "0"], 2, "--pace 0 is not allowed"),
        (["run", "game.xml", "--log-period", "nan"], 2, "--log-period nan is not allowed"),
        (["run", "game.xml", "--no-log", "--out", "x"], 2, "--no-log"),
        (["run", "game.xml", "--no-log", "--record-columns", "*"], 2, "--no-log"),
        (["run", "nothing.xml"], 1, "nothing.xml"),
        (["run", "predator_pray"], 1, "did you mean 'predator_prey'?"),
        (["run", "game.xml", "--set", "m=3"], 1, "the mission has no setting 'm'"),
        (["run", "game.xml", "--set", "prey.Boids.max_sped=3"], 1, "did you mean 'max_speed'?"),
        (["run", "game.xml", "--set", "prey.Boids.max_speed=3 kg"], 1, "kg"),
        (["run", "game.xml", "--set", "pry.Boids.max_speed=3"], 1, "did you mean 'prey'?"),
        (["run", "game.xml", "--end", "-3"], 1, "end = -3 s is not allowed; with start = 0 s and dt = 0.1 s it takes a time > 0.05 s"),
        (["run", "game.xml", "--end", "soon"], 1, "--end: 'soon'"),
        (["run", "game.xml", "--plugin-path", "no.py"], 1, "no.py: there is no such plugin file"),
        (["run", "game.xml", "--plugin-path", "."], 1, ".: it is a folder; a plugin file is one Python file; in the folder there are"),
        (["run", "game.xml", "--start-from", "no.csv"], 4, "no.csv"),
        (["run", "game.xml", "--out", "game.xml"], 4, "game.xml"),
        (["check", "game.xml", "--set", "prey.motion_model=SimpleAircraft"], 1, "game.xml:7: block 'prey': no plugin writes"),
        (["describe", "Boid"], 1, "did you mean 'Boids'?"),
        (["fly"], 2, "fly"),
        (["run", "game.xml", "--out", "L\udcfcufe"], 2, r"'L\udcfcufe' is not UTF-8 text; rename the file"),
        (["export", "b\udcfc", "--csv"], 2, r"'b\udcfc' is not UTF-8 text; rename the file"),
        (["check", "game.xml", "--data-path", "no"], 1, "--data-path no: there is no such folder"),
        (["batch", "game.xml", "--sweep", "no.toml"], 1, "error: no.toml: cannot be read: No such file"),
        (["batch", "game.xml", "--vary", "seed=1,2"], 1, "the tables of a batch have columns run, point, seed"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said_once_with_an_exit_code_and_nothing_is_written(
    tussle, folder, arguments, code, text
):
    done = tussle(*arguments, code=code)
    assert text in done.stderr
    assert "Traceback" not in done.stderr
    assert not done.stdout
    assert [p.name for p in folder.iterdir()] == ["game.xml"]


def test_a_width_that_is_not_known_hides_nothing(tussle, monkeypatch):
    shown = tussle("plugins").stdout
    monkeypatch.setenv("COLUMNS", "0")
    assert tussle("plugins").stdout == shown


def test_a_run_that_was_killed_is_intact_as_far_as_it_goes(tussle, folder):
    tussle("run", "game.xml", "--out", "out", "--end", "0.2")
    assert tussle("check", "out").stdout == "out is intact\n"
    (folder / "out" / "run.json").unlink()
    said = "out is intact as far as it goes: it has no run.json, since the run was killed or goes on\n"
    assert tussle("check", "out").stdout == said


@pytest.mark.parametrize("unbuffered", ["", "1"])
@pytest.mark.parametrize(
    "line", ["run game.xml --no-log", "run --help", "--help", "--version", "plugins", "schema", "--show-completion bash"]
)  # fmt: skip
def test_a_full_disk_is_told(folder, unbuffered, line):
    with open("/dev/full", "w") as full:  # noqa: PTH123 - a device
        done = subprocess.run(
            [*COMMAND, *line.split()],
            check=False, stdout=full, stderr=subprocess.PIPE, text=True, cwd=folder, timeout=600,
            env=environment() | {"PYTHONUNBUFFERED": unbuffered},
        )  # fmt: skip
    assert done.returncode == 4
    assert done.stderr == "error: the output cannot be written: No space left on device\n"


def test_output_that_nobody_reads_is_no_error(folder):
    script = f"{shlex.join(COMMAND)} describe Boids | head -n 2; echo"
    done = subprocess.run(
        ["sh", "-c", script],
        check=False,
        capture_output=True,
        text=True,
        cwd=folder,
        env=environment(),
        timeout=600,
    )
    assert done.stdout == "\n Boids\n\n"
    assert not done.stderr


def test_files_of_the_user_where_a_run_is_recorded_are_left_alone(tussle, folder):
    (folder / "hills.asc").write_text("ncols 3\nnrows 3\ncellsize 10\n" + "1 2 3\n" * 3)
    text = (folder / "game.xml").read_text().replace("<seed>", "<terrain>hills.asc</terrain><seed>")
    (folder / "game.xml").write_text(text)
    (folder / "lone.py").write_text(
        "from tussle.api import Metric\nclass Lone(Metric):\n    grade = 'portable'\n"
    )
    for own in ("taken/hills.asc", "used/plugins/0-lone/lone.py"):
        out = folder / own.partition("/")[0]
        (folder / own).parent.mkdir(parents=True)
        (folder / own).write_text("mine")
        asked = ("run", "game.xml", "--plugin-path", "lone.py", "--end", "0.1", "--out", out.name)
        name = own.partition("/")[2]
        assert f"{out.name}: holds another file {name!r}" in tussle(*asked, code=4).stderr
        assert [p for p in out.rglob("*") if p.is_file()] == [folder / own]
        assert (folder / own).read_text() == "mine"
    before = (folder / "hills.asc").read_bytes()
    tussle("run", "game.xml", "--end", "0.1", "--out", ".")
    assert (folder / "hills.asc").read_bytes() == before
    assert tussle("check", ".").stdout == ". is intact\n"
    tussle("run", "--from", ".", "--no-log")


def test_a_directory_that_holds_a_run_is_left_alone(tussle, folder):
    tussle("run", "game.xml", "--out", "out")
    before = {p: p.read_bytes() for p in (folder / "out").iterdir()}
    assert "holds a run already" in tussle("run", "game.xml", "--out", "out", "--seed", "9", code=4).stderr
    assert {p: p.read_bytes() for p in (folder / "out").iterdir()} == before


def test_runs_that_begin_in_one_second_have_a_directory_each(folder, monkeypatch):
    class Clock(dt.datetime):
        @classmethod
        def now(cls, tz=None):
            return cls(2026, 1, 2, 3, 4, 5)

    monkeypatch.chdir(folder)
    monkeypatch.setattr("tussle.cli.play.dt.datetime", Clock)
    # All have looked before one has made it: nobody is told that it is there.
    monkeypatch.setattr(Path, "exists", lambda path: False)
    with ThreadPoolExecutor(4) as pool:
        made = list(pool.map(lambda _: _new_directory("game", 7), range(4)))
    assert sorted(path.name for path in made) == [
        f"game-7-20260102-030405{n}" for n in ("", "-2", "-3", "-4")
    ]
    assert all(path.is_dir() for path in made)


GROWING = """\
<runscript>
  <run start="0" end="8" dt="2"/>
  <entity><name>crowd</name><team_id>1</team_id><count>199998</count></entity>
  <entity><name>one</name><team_id>1</team_id>
    <autonomy generate_entities="true" template="one">Straight</autonomy>
    <controller>UnicyclePID</controller><motion_model>Unicycle</motion_model></entity>
</runscript>
"""


def test_a_mission_that_outgrows_its_limit_in_play_needs_allow_large(tussle, folder):
    (folder / "growing.xml").write_text(GROWING)
    ended = tussle("run", "growing.xml", "--no-log", code=3)
    assert " 2 more entities" in ended.stderr
    tussle("run", "growing.xml", "--no-log", "--allow-large")


def test_the_run_of_an_example_is_named_after_its_plugin(process, folder):
    process("run", "SingleIntegrator", "--end", "1")
    (run,) = (folder / "runs").iterdir()
    assert re.fullmatch(r"SingleIntegrator-1-\d{8}-\d{6}", run.name)
