"""tussle batch: many games as a user asks for them."""

from __future__ import annotations

import math
import re
import shutil
import signal
import sys
from pathlib import Path

import gambles
import pytest
from cli_process import call
from test_terminal import ESCAPE, seen

from tussle import load_run
from tussle.batch import InProcess, load_batch

PLUGINS = ("--plugin-path", "plugins.py")


@pytest.fixture
def folder(tmp_path):
    """Where the command runs: a game of chance, and its plugins."""
    (tmp_path / "chance.xml").write_text(gambles.MISSION)
    shutil.copy(gambles.THIS, tmp_path / "plugins.py")
    return tmp_path


@pytest.fixture
def here(folder, monkeypatch):
    """Calls the command in this process: exit code, output and messages."""
    monkeypatch.chdir(folder)

    def run(*arguments):
        done = call(*arguments)
        return done.returncode, done.stdout, told(done.stderr)

    return run


def told(messages):
    """Messages but for what a slow machine, or one that has never played this, says besides."""
    passing = re.compile(r"(?!note|error)[^:]*: [\d,/]+ runs, |compil(ing|ed) ")
    return "".join(line for line in messages.splitlines(keepends=True) if not passing.match(line))


# -- as a user types it ---------------------------------------------------------------------------------------------------------


def test_a_batch_is_played_counted_and_gone_on_with(process, tussle, folder):
    command = ("batch", "chance.xml", "--vary", "odds=0.1,0.3", *PLUGINS)
    done = process(*command, "--runs", 9, "--processes", 2)
    (path,) = (folder / "batches").iterdir()
    assert re.fullmatch(r"chance-[0-9a-f]{8}", path.name)
    assert told(done.stderr) == ""
    lines = done.stdout.splitlines()
    assert all(len(line) <= 80 and line == line.rstrip() for line in lines)
    assert lines[1:3] == [" A game of chance", " 18 runs · 2 points · seeds 1 to 9"]
    heads = [line.split()[0] for line in lines if line.startswith(" ") and line.split()]
    assert heads[-5:] == ["played", "batch", "next", "tussle", "tussle"]
    assert f" batch   batches/{path.name}" in lines
    assert re.search(r"\n played  18 runs in \d+:\d\d \(\S+ runs/s\), \S+ CPU s in all\n", done.stdout)
    again = tussle(*command, "--runs", 9)
    assert told(again.stderr) == f"note: 18 of 18 runs were there already, in batches/{path.name}\n"
    assert "played" not in again.stdout
    more = tussle(*command, "--runs", 12, "--processes", 1)
    assert told(more.stderr) == f"note: 18 of 24 runs were there already, in batches/{path.name}\n"
    assert " 24 runs · 2 points · seeds 1 to 12\n" in more.stdout
    assert re.search(r"\n played  6 runs in", more.stdout)


def test_all_options_reach_the_batch(here, folder):
    code, out, err = here(
        "batch", "chance.xml", "reds=2", "--set", "health=1", "--runs", 2, "--vary", "odds=0.1:0.3", "--vary", "how=never,step",
        "--sample", "product", "--samples", 3, "--sample-seed", 4, "--seed", 7, "--independent", "--end", "0.5", "--out", "out",
        "--processes", 1, "--stack", 3, "--strict", *PLUGINS,
    )  # fmt: skip
    assert code == 5
    assert re.fullmatch(
        r"note: [123] of 12 runs failed and are not counted above; tussle analyze lists them\n", err
    )
    results = load_batch(folder / "out")
    info = results.info
    assert (info["sample"], info["sample_seed"], info["first_seed"], info["independent"]) == (
        "product",
        4,
        7,
        True,
    )
    assert (info["n_points"], info["n_seeds"], info["end"]) == (6, 2, 0.5)
    assert info["mission"]["settings"] == {"reds": "2", "health": "1", "run.end": "0.5"}
    assert info["command"][0] == Path(sys.argv[0]).name
    assert set(results.failed()["seed"].to_pylist()) <= {8, 13, 18}
    assert "seeds 7 to 18" in out


def test_a_sweep_file_says_what_varies_and_the_command_line_comes_before_it(here, folder):
    (folder / "sweep.toml").write_text(
        "runs = 2\nfirst_seed = 5\n\n[vary]\nodds = [0.1, 0.2, 0.3]\nreds = [2, 3]\n"
    )
    assert (
        here("batch", "chance.xml", "--sweep", "sweep.toml", "--out", "a", "--processes", 1, *PLUGINS)[0] == 0
    )
    assert len(load_batch(folder / "a").points) == 6
    assert (
        here(
            "batch",
            "chance.xml",
            "--sweep",
            "sweep.toml",
            "--vary",
            "odds=0.4,0.5",
            "--runs",
            1,
            "--out",
            "b",
            *PLUGINS,
        )[0]
        == 0
    )
    results = load_batch(folder / "b")
    assert {p["odds"] for p in results.points} == {0.4, 0.5}
    assert results.runs["seed"].to_pylist() == [5, 5, 5, 5]


def test_it_stops_when_enough_is_known(here, folder):
    command = ("batch", "chance.xml", "--until", "score[1]:0.6", "--out", "out", *PLUGINS)
    code, out, _ = here(*command, "--processes", 1)
    assert code == 0
    n = load_batch(folder / "out").info["n_seeds"]
    assert f" stopped  score[1]:0.6 is reached with {n} seeds\n" in out
    assert f" {n} runs · seeds 1 to {n}\n" in out
    assert here(*command)[2] == f"note: {n} of {n} runs were there already, in out\n"


def test_runs_are_recorded_in_full_on_demand(here, folder):
    command = ("batch", "chance.xml", "--runs", 6, "--out", "out", "--processes", 1, *PLUGINS)
    assert here(*command, "--record-runs", "4,0:1")[0] == 0
    assert sorted(p.name for p in (folder / "out" / "runs").iterdir()) == ["000000", "000001", "000004"]
    first = folder / "out" / "runs" / "000000" / "run.json"
    before = first.stat().st_mtime_ns
    shutil.rmtree(folder / "out" / "runs" / "000004")
    assert here(*command, "--record-runs", "0,4")[0] == 0
    assert first.stat().st_mtime_ns == before
    assert (folder / "out" / "runs" / "000004" / "trajectory.arrow").exists()


COUNTING = '''\
from tussle.api import Autonomy, State


class Counting(Autonomy):
    """Counts steps, by twice its id."""

    count = State(doc="The count.")
    seen = State(dtype=bool)

    def step(self, g):
        self.count += 2.0 * g.id
        self.seen[:] = True
'''
COUNTED = """<runscript><run end="0.3" dt="0.1"/><entity><team_id>1</team_id><count>2</count><autonomy>Counting</autonomy></entity>
<entity><team_id>2</team_id></entity></runscript>"""


def test_columns_of_plugins_are_recorded_and_analysed(here, folder):
    (folder / "counting.py").write_text(COUNTING)
    (folder / "counted.xml").write_text(COUNTED)
    command = (
        "batch",
        "counted.xml",
        "--runs",
        4,
        "--out",
        "out",
        "--processes",
        1,
        "--plugin-path",
        "counting.py",
    )
    code, _, err = here(*command, "--record-runs", "0:2", "--record-columns", "*.cuont")
    assert code == 1
    assert "columns = '*.cuont' is no State or Output of a plugin" in err
    assert not (folder / "out").exists()
    assert here(*command, "--record-columns", "*.count")[0] == 2
    assert here(*command, "--record-runs", "0:2")[0] == 0
    assert load_run(folder / "out/runs/000001").columns == {}
    assert here(*command, "--record-runs", "0:2", "--record-columns", "*.count,*.seen")[0] == 0
    first = folder / "out/runs/000001/run.json"
    before = first.stat().st_mtime_ns
    assert list(load_run(first.parent).columns) == ["Counting.count", "Counting.seen"]
    assert here(*command, "--record-runs", "0:2", "--record-columns", "*.count,*.seen")[0] == 0
    assert here(*command, "--record-runs", "0:2")[0] == 0
    assert first.stat().st_mtime_ns == before
    results = load_batch(folder / "out")
    assert results.quantity("Counting.count[1]").tolist()[:3] == pytest.approx([4.5] * 3)
    assert math.isnan(results.quantity("Counting.count[1]")[3])
    assert results.quantity("Counting.count / 2 + t").tolist()[0] == pytest.approx(2.55)
    assert results.quantity("Counting.seen").tolist()[0] == 0.75
    code, out, err = here("analyze", "out", "--quantity", "Counting.count[1]")
    assert code == 0
    assert re.search(r"Counting.count\[1\].* 4\.5 ", out)
    assert "columns of plugins are known of 3 runs" in err
    assert here("analyze", "out", "--quantity", "Counting.cuont")[0] == 1


# -- one of its runs again ------------------------------------------------------------------------------------------------------


def test_a_run_of_a_batch_is_played_again_whatever_became_of_its_files(here, folder):
    include = '<xi:include xmlns:xi="http://www.w3.org/2001/XInclude" href="parts/metrics.xml"/>'
    (folder / "parts").mkdir()
    (folder / "parts" / "metrics.xml").write_text("<metrics>Chips</metrics>")
    (folder / "chance.xml").write_text(gambles.MISSION.replace("<metrics>Chips</metrics>", include))
    command = (
        "batch", "chance.xml", "reds=5", "--vary", "odds=0.1:0.4", "--vary", "mood=never,decide", "--samples", 2, "--runs", 3,
    )  # fmt: skip
    assert here(*command, "--end", "0.7", "--out", "out", *PLUGINS)[0] == 5  # of those that cannot decide
    for changed in (True, False):
        for name in ("chance.xml", "plugins.py", "parts/metrics.xml"):
            if changed:
                (folder / name).write_text("something else")
            else:
                (folder / name).unlink()
        for number in (0, 5):
            code, out, err = here("run", "--from", f"out:{number}", "--no-log")
            assert code == 0
            assert f"out:{number}" in err
            assert "the same state hash" in err
            assert "A game of chance" in out
    code, _, err = here("run", "--from", "out:9", "--out", "again")  # seed 3 with a mood to fail
    assert code == 3
    assert "RuntimeError: it cannot decide" in err
    assert (folder / "again" / "run.json").exists()


def test_a_run_that_comes_out_otherwise_is_told(here, folder):
    assert here("batch", "chance.xml", "--runs", 3, "--out", "out", *PLUGINS)[0] == 0
    copy = folder / "out" / "mission" / "plugins" / "0" / "plugins.py"
    copy.write_text(copy.read_text().replace("luck < self.odds", "luck > self.odds"))
    code, _, err = here("run", "--from", "out:1", "--no-log", "--trust")
    assert code == 4
    note, _, err = err.partition("\n")
    assert "out/mission/plugins/0/plugins.py" in note
    assert err.startswith("error: run out:1 ended otherwise than in its batch: state hash ")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("out", "--from 'out' is not allowed; it takes a batch directory and the number of a run, DIR:417"),
        ("out:x", "--from 'out:x' is not allowed"),
        ("out:²", "--from 'out:²' is not allowed"),
        ("out:3", "out: there is no run 3; the batch has runs 0 to 2"),
        ("nowhere:1", "nowhere: there is no such batch directory"),
    ],
)
def test_a_run_that_is_not_there_is_told(here, folder, text, words):
    assert here("batch", "chance.xml", "--runs", 3, "--out", "out", *PLUGINS)[0] == 0
    code, _, err = here("run", "--from", text)
    assert code in (1, 4)
    assert err.startswith("error: ")
    assert err.count("\n") == 1
    assert words in err


def test_a_batch_that_was_made_in_python_is_replayed_there(here, folder):
    from tussle.batch import Batch

    Batch(gambles.game(), runs=2).play(folder / "out", InProcess())
    code, _, err = here("run", "--from", "out:1")
    assert code == 4
    assert "`Batch(...).simulation(1)` is the game of this run" in err


# -- what goes wrong ------------------------------------------------------------------------------------------------------------

WRONG = {
    "no mission": (["nothing.xml"], 1, "'nothing.xml' is neither a file nor a shipped mission"),
    "unknown placeholder": (["chance.xml", "--vary", "odd=0.1:0.3"], 1, "(did you mean 'odds'?)"),
    "unknown block": (["chance.xml", "--vary", "red.count=1,2"], 1, "(did you mean 'reds'?)"),
    "unknown plugin": (["chance.xml", "--vary", "reds.Nervos.how=a,b"], 1, "(did you mean 'Nervous'?)"),
    "unknown parameter": (["chance.xml", "--vary", "Roulette.ods=0.1:0.3"], 1, "(did you mean 'odds'?)"),
    "low above high": (["chance.xml", "--vary", "odds=0.3:0.1"], 1, "odds: the low bound 0.3 is above the high bound 0.1"),
    "out of bounds": (["chance.xml", "--vary", "odds=0.1,1.3"], 1, "point 1 (odds=1.3): chance.xml:5: "),
    "no such motion model": (["chance.xml", "--vary", "reds.motion_model=Still,Stil"], 1, "(did you mean 'Still'?)"),
    "nobody steers": (["chance.xml", "--vary", "reds.motion_model=Still,Unicycle"], 1, "block 'reds': no plugin writes channel"),
    "fewer than none": (["chance.xml", "--vary", "reds.count=-1,2"], 1, "point 0 (reds.count=-1): "),
    "end before start": (["chance.xml", "--end", "0"], 1, "value set from outside: end = 0 s is not allowed; with start = 0 s and dt = "),
    "end is no time": (["chance.xml", "--end", "soon"], 1, "--end: 'soon' is not a number"),
    "no such method": (["chance.xml", "--vary", "odds=0.1:0.3", "--sample", "lsh"], 1, "(did you mean 'lhs'?)"),
    "until without width": (["chance.xml", "--until", "score[1]"], 1, "until 'score[1]': 'score[1]' is no number"),
    "until nothing": (["chance.xml", "--until", "score[9]:1"], 1, "there is no 'score[9]'"),
    "log out of range": (["chance.xml", "--record-runs", "3,12", "--runs", "12"], 1, "--record-runs '12' is not allowed"),
    "log is no number": (["chance.xml", "--record-runs", "a"], 1, "--record-runs 'a' is not allowed; it takes numbers of runs"),
    "former name of an option": (["chance.xml", "--log", "3"], 2, "--log; it is now called --record-runs"),
    "sweep is not there": (["chance.xml", "--sweep", "sweep.toml"], 1, "sweep.toml"),
    "too many seeds": (["chance.xml", "--runs", "2", "--seed", str(2**64 - 1)], 1, "begin with a smaller one"),
    "runs": (["chance.xml", "--runs", "0"], 2, "Invalid value for '--runs'"),
    "samples": (["chance.xml", "--vary", "odds=0.1:0.3", "--samples", "0"], 2, "Invalid value for '--samples'"),
    "processes": (["chance.xml", "--processes", "0"], 2, "Invalid value for '--processes'"),
    "stack": (["chance.xml", "--stack", "0"], 2, "Invalid value for '--stack'"),
    "seed": (["chance.xml", "--seed", str(2**64)], 2, "Invalid value for '--seed'"),
    "two places": (["chance.xml", "--scheduler", "tcp://a:1", "--slurm", "2"], 2, "are two places to play"),
    "processes elsewhere": (["chance.xml", "--scheduler", "tcp://a:1", "--processes", "2"], 2, "--processes counts those of this machine"),
    "setting": (["chance.xml", "--set", "odds"], 2, "'odds' does not have the form NAME=VALUE"),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_what_cannot_be_is_told_in_one_message_and_nothing_is_written(here, folder, name):
    arguments, code, words = WRONG[name]
    found, out, err = here("batch", *arguments, "--out", "out", *PLUGINS)
    assert (found, out) == (code, "")
    if code == 1:
        assert err.startswith("error: ")
        assert err.count("\n") == 1
    assert words in re.sub(r"\s*\n[│ ]*", " ", err) if code == 2 else words in err
    assert len(err) < 2000
    assert sorted(p.name for p in folder.iterdir() if p.suffix != ".pyc") == ["chance.xml", "plugins.py"]


def test_a_directory_that_is_of_another_batch_or_none_is_refused(here, folder):
    assert here("batch", "chance.xml", "--runs", 2, "--out", "out", *PLUGINS)[0] == 0
    code, _, err = here("batch", "chance.xml", "--runs", 2, "--seed", 5, "--out", "out", *PLUGINS)
    assert code == 4
    assert err == (
        "error: out: holds another batch: it differs in first_seed (there 1, now 5); choose another directory, or remove it\n"
    )
    code, _, err = here("batch", "chance.xml", "--out", ".", *PLUGINS)
    assert (code, err) == (
        4,
        "error: .: holds something that is no batch (chance.xml); choose another directory\n",
    )
    code, _, err = here("batch", "chance.xml", "--out", "chance.xml", *PLUGINS)
    assert (code, err) == (4, "error: chance.xml: cannot be written: File exists; finished runs are kept\n")


def test_commands_that_come_next_can_be_pasted(here, folder):
    code, out, _ = here("batch", "chance.xml", "--runs", 1, "--out", "a [b] & c", *PLUGINS)
    assert code == 0
    commands = [line[9:] for line in out.splitlines() if " tussle " in line]
    assert commands == [
        "tussle analyze 'a [b] & c'",
        "tussle report 'a [b] & c'",
        "tussle run --from 'a [b] & c:0'",
    ]


def test_runs_that_fail_are_counted_and_if_all_fail_it_is_an_error(here):
    code, out, err = here("batch", "chance.xml", "how=step", "--runs", 6, "--out", "some", *PLUGINS)
    assert (code, err) == (
        5,
        "note: 1 of 6 runs failed and are not counted above; tussle analyze lists them\n",
    )
    assert " 6 runs · seeds 1 to 6\n" in out
    for again in (False, True):
        code, out, err = here(
            "batch", "chance.xml", "how=step", "--runs", 1, "--seed", 3, "--out", "all", *PLUGINS
        )
        assert code == 3
        assert " 1 run · seed 3\n" in out
        last = err.splitlines()[-1]
        assert last.startswith("error: all runs failed; the first: Trouble, step 2: plugins.py:")
        assert last.endswith("RuntimeError: this seed goes wrong")
        assert len(err.splitlines()) == 1 + again


def test_a_game_that_takes_longer_than_it_may_is_given_up(here):
    code, _, err = here(
        "batch", "chance.xml", "how=sleep", "--runs", 1, "--seed", 3, "--run-timeout", 1, "--out", "out", *PLUGINS,
    )  # fmt: skip
    assert (code, err) == (
        3,
        "error: all runs failed; the first: it took longer than the 1.0 s that a run may\n",
    )
    code, _, err = here(
        "batch", "chance.xml", "--run-timeout", 1, "--scheduler", "tcp://127.0.0.1:9", *PLUGINS
    )
    assert code == 2


@pytest.mark.slow
def test_a_plugin_that_kills_the_command_kills_it_only_once(process, folder):
    command = ("batch", "chance.xml", "how=crash", "--runs", 4, "--stack", 1, "--out", "out", *PLUGINS)
    process(*command, code=-signal.SIGSEGV)  # so few are played in the process itself
    assert load_batch(folder / "out").runs["seed"].to_pylist() == [1, 2]
    done = process(*command, code=5)
    assert told(done.stderr).splitlines() == [
        "note: 2 of 4 runs were there already, in out",
        "note: 1 of 4 runs failed and are not counted above; tussle analyze lists them",
    ]
    failed = load_batch(folder / "out").failed().to_pylist()
    assert [(row["seed"], row["error"]) for row in failed] == [
        (3, "the process that played it died: signal 11, Segmentation fault")
    ]


# -- on a terminal --------------------------------------------------------------------------------------------------------------


def test_a_bar_tells_how_far_it_is_and_lines_do_not_break(folder):
    command = [
        "batch", "chance.xml", "--runs", "300", "--stack", "20", "--processes", "1", "--vary", "odds=0.1,0.3", *PLUGINS,
    ]  # fmt: skip
    text, code = seen(folder, *command)
    assert code == 0
    lines = [line.rstrip() for line in re.split(r"[\r\n]", ESCAPE.sub("", text))]
    bars = [line for line in lines if "runs/s" in line and line.startswith("chance ")]
    assert len(bars) >= 5
    for bar in bars[1:]:
        assert re.fullmatch(r"chance \S+ +[\d,]+/600 runs [\d.,]+ runs/s( (\d+:)?\d+:\d\d left)?", bar), bar
    results = [line for line in lines if re.match(r"reds \d+\.\d % ±", line)]
    assert results
    assert all(
        re.fullmatch(r"reds [\d.]+ % ±[\d.]+, blues [\d.]+ % ±[\d.]+(, ties [\d.]+ %)?", line)
        for line in results
    )
    assert max(map(len, lines)) <= 80
    assert "\x1b[?25h" in text  # the cursor is back
