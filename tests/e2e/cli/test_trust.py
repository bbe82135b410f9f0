"""Code in a batch directory is run where it is the user's own or the user says so, and never by another command."""

from __future__ import annotations

import json
import os
import pty
import py_compile
import shutil
import subprocess
import sys
from pathlib import Path

import gambles
import pytest
from cli_process import COMMAND, environment
from typer.testing import CliRunner

from tussle.batch import Batch, InProcess, trust
from tussle.cli.app import app

PLUGINS = ("--plugin-path", "plugins.py")
BATCH = ("batch", "chance.xml", "--runs", 3, "--out", "out", "--processes", 1, *PLUGINS)
AGAIN = ("run", "--from", "out:1", "--no-log")


@pytest.fixture
def here(tmp_path, monkeypatch):
    """Calls the command in this process: exit code and messages; a user's own batch lies in out."""
    (tmp_path / "chance.xml").write_text(gambles.MISSION)
    shutil.copy(gambles.THIS, tmp_path / "plugins.py")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))

    def call(*arguments):
        done = CliRunner().invoke(app, [str(a) for a in arguments])
        assert done.exception is None or isinstance(done.exception, SystemExit), done.exception
        return done.exit_code, done.stderr

    assert call(*BATCH)[0] == 0
    return call


@pytest.fixture
def ran(tmp_path):
    """A file that hostile code makes."""
    return tmp_path / "ran"


def evil(ran):
    """The plugins of the game, and code that nobody asked for."""
    return f"{Path(gambles.THIS).read_text()}\nimport pathlib\npathlib.Path({str(ran)!r}).touch()\n"


def said(change):
    """Change what batch.json says of the mission."""
    file = Path("out/batch.json")
    info = json.loads(file.read_text())
    change(info["mission"])
    info.pop("checksum", None)  # else it is damaged
    file.write_text(json.dumps(info))


COPY = Path("out/mission/plugins/0/plugins.py")


def test_what_the_user_has_made_is_played_again_without_a_question(here, tmp_path):
    assert here(*AGAIN)[0] == 0
    shutil.move("out", "moved")
    assert here("run", "--from", "moved:1", "--no-log")[0] == 0
    assert (tmp_path / "state" / "tussle").stat().st_mode & 0o777 == 0o700


def test_a_batch_that_was_stopped_is_the_users_own_too(here, tmp_path):
    class Killed(BaseException):
        pass

    def stop(progress):
        if progress.n_done == 2:
            raise Killed

    def batch():
        return Batch("chance.xml", runs=4, plugin_files=["plugins.py"])

    with pytest.raises(Killed):
        batch().play("cut", InProcess(1), on_progress=stop)
    assert here("run", "--from", "cut:0", "--no-log")[0] == 0
    assert here("run", "--from", "cut:3", "--no-log")[0] == 0
    assert batch().play("cut", InProcess(1)).n_runs == 4
    assert here("run", "--from", "cut:3", "--no-log")[0] == 0


def test_code_of_others_is_refused_without_a_terminal_and_run_when_trusted(here, ran):
    COPY.write_text(evil(ran))
    code, err = here(*AGAIN)
    assert code == 4
    assert "out/mission/plugins/0/plugins.py" in err
    assert "--trust" in err
    assert not ran.exists()
    code, err = here(*AGAIN, "--trust")
    assert code == 0
    assert err.startswith(
        "note: plugin code of out, which is not known to be yours, has all your rights: out/mission/plugins/0/"
    )
    assert ran.exists()


@pytest.mark.parametrize(("answer", "is_run"), [("y", True), ("n", False), ("\4", False)])
def test_on_a_terminal_it_is_asked(here, ran, tmp_path, answer, is_run):
    COPY.write_text(evil(ran))
    ours, its = pty.openpty()
    process = subprocess.Popen(
        [*COMMAND, *AGAIN],
        stdin=its,
        stdout=its,
        stderr=its,
        cwd=tmp_path,
        env=environment(),
        start_new_session=True,
    )
    os.close(its)
    text = b""
    while b"[y/N]" not in text:
        text += os.read(ours, 65536)
    assert not ran.exists()
    assert b"out/mission/plugins/0/plugins.py" in text
    os.write(ours, answer.encode() + (b"\n" if answer.isalpha() else b""))
    try:
        while os.read(ours, 65536):
            pass
    except OSError:  # the last one who held the terminal has gone
        pass
    os.close(ours)
    assert process.wait(timeout=30) == (0 if is_run else 4)
    assert ran.exists() == is_run


@pytest.mark.parametrize("way", ["relative", "absolute", "link", "folder"])
def test_no_file_outside_of_the_directory_is_run_even_when_trusted(here, ran, tmp_path, way):
    outside = tmp_path / "outside.py"
    outside.write_text(evil(ran))
    if way in ("relative", "absolute"):
        name = "../../../outside.py" if way == "relative" else str(outside)
        said(lambda about: about.update(plugin_files=[name]))
    elif way == "link":
        COPY.unlink()
        COPY.symlink_to(outside)
    else:
        shutil.move("out/mission", "elsewhere")
        Path("elsewhere/plugins/0/plugins.py").write_text(evil(ran))
        Path("out/mission").symlink_to("../elsewhere")
    for more in ((), ("--trust",)):
        code, err = here(*AGAIN, *more)
        assert code in (1, 4)
        assert any(
            words in err
            for words in (
                "is outside of the batch directory",
                "there is no such plugin file",
                "inside the directory",
            )
        )
    assert not ran.exists()


def test_bytecode_that_lies_beside_a_plugin_file_is_not_run(here, ran, tmp_path):
    (tmp_path / "evil.py").write_text(evil(ran))
    cached = COPY.parent / "__pycache__" / f"plugins.{sys.implementation.cache_tag}.pyc"
    py_compile.compile(
        "evil.py", str(cached), invalidation_mode=py_compile.PycInvalidationMode.UNCHECKED_HASH
    )
    assert here(*AGAIN)[0] == 0
    assert not ran.exists()


@pytest.mark.parametrize(
    ("option", "value"), [("search", ["/"]), ("allow_large", True), ("plugin_files", ["/x.py"]), ("debug", 1)]
)
def test_a_directory_widens_nothing(here, option, value):
    said(lambda about: about["options"].update({option: value}))
    code, err = here(*AGAIN, "--trust")
    assert code == 4
    assert (
        f"error: out: a batch directory cannot set the option '{option}'" in err
        or f"mission.options.{option} is not allowed" in err
    )


def test_what_a_directory_cannot_grant_is_granted_on_the_command_line(here):
    command = (
        "batch", "chance.xml", "--runs", 2, "--out", "large", "--processes", 1, *PLUGINS, "--allow-large",
    )  # fmt: skip
    assert here(*command, "--record-runs", "1")[0] == 0
    assert here("run", "--from", "large:1", "--no-log")[0] == 4
    assert here("run", "--from", "large:1", "--no-log", "--allow-large")[0] == 0


def test_a_mission_file_outside_of_the_directory_is_not_read(here, tmp_path):
    for name in ("../../chance.xml", str(tmp_path / "chance.xml"), "nothing\0.xml"):
        said(lambda about, name=name: about.update(file=name))
        code, err = here(*AGAIN, "--trust")
        assert code in (1, 4)
        assert any(w in err for w in ("outside of the batch directory", "is no file", "inside the directory"))
    said(lambda about: about.update(file=3, plugin_files=None))
    code, err = here(*AGAIN)
    assert (code, err) == (4, "error: out/batch.json: mission.file = 3 is not allowed; it takes a text\n")


def test_the_note_of_what_is_own_counts_only_where_nobody_else_writes(here, tmp_path):
    folder = tmp_path / "state" / "tussle"
    folder.chmod(0o777)
    assert here(*AGAIN)[0] == 4
    assert "it cannot be noted that these plugin files are yours" in here(*BATCH)[1]
    folder.chmod(0o700)
    assert here(*AGAIN)[0] == 0
    (note,) = folder.iterdir()
    note.chmod(0o666)
    assert here(*AGAIN)[0] == 4


def test_a_batch_that_is_gone_on_with_runs_the_users_files_and_not_those_of_the_directory(here, ran):
    """The directory holds a batch of the same fingerprint, but other code."""
    COPY.write_text(evil(ran))
    assert here(*BATCH)[0] == 0
    code, err = here(*BATCH, "--record-runs", "1")
    assert code == 4
    assert "not known to be yours" in err
    assert here(*AGAIN)[0] == 4
    assert not ran.exists()


@pytest.mark.parametrize("command", [("analyze", "out"), ("analyze", "out", "--json"), ("report", "out")])
def test_looking_at_a_batch_runs_nothing_of_it(here, ran, command):
    COPY.write_text(evil(ran))
    for name in ("sitecustomize.py", "plugins.py", "pandas.py", "conftest.py"):
        (Path("out") / name).write_text(evil(ran))
    assert here(*command)[0] == 0
    assert not ran.exists()


@pytest.mark.parametrize(
    "command",
    [("plot", "played"), ("export", "played", "--csv"), ("export", "played", "--html")],
    ids="-".join,
)
def test_looking_at_a_run_runs_nothing_of_it(here, ran, command):
    assert here("run", "chance.xml", "--out", "played", *PLUGINS)[0] == 0
    for name in ("plugins.py", "Roulette.py", "plugins/0/plugins.py"):
        file = Path("played") / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(evil(ran))
    file = Path("played/run.json")
    info = json.loads(file.read_text())
    file.write_text(
        json.dumps({**info, "plugin_files": ["plugins.py"], "options": {"plugin_files": ["plugins.py"]}})
    )
    assert here(*command)[0] == 0
    assert not ran.exists()


def test_trust_is_of_a_directory(here):
    assert here("run", "chance.xml", "--trust", *PLUGINS)[0] == 2
    assert trust.DirectoryCode(Path("x"), ()).is_own


# -- run directories ------------------------------------------------------------------------------------------------------------

RUN = ("run", "chance.xml", "--out", "kept", *PLUGINS)


def test_a_run_keeps_the_plugins_with_which_it_is_shown_and_played_again(here):
    assert here(*RUN)[0] == 0
    Path("plugins.py").unlink()
    code, err = here("run", "--from", "kept", "--no-log")
    assert (code, "the end is that of the recording: the same state hash" in err) == (0, True)
    for command in (("plot", "kept"), ("export", "kept", "--html")):
        code, err = here(*command)
        assert code == 0
        assert "cannot be read" not in err
    assert here("check", "kept")[0] == 0
    code, err = here("run", "--from", "kept:1", "--no-log")
    assert (code, "world 1 cannot be played again; it has worlds 0 to 0" in err) == (4, True)


def test_a_run_whose_plugins_are_of_others_is_shown_without_them_and_played_only_when_trusted(here, ran):
    assert here(*RUN)[0] == 0
    Path("kept/plugins/0-plugins/plugins.py").write_text(evil(ran))
    code, err = here("export", "kept", "--html")
    assert (code, "not known to be yours, so it is not run" in err) == (0, True)
    code, err = here("run", "--from", "kept", "--no-log")
    assert (code, "--trust runs it" in err) == (4, True)
    assert not ran.exists()
    assert here("run", "--from", "kept", "--no-log", "--trust")[0] == 0
    assert ran.exists()


@pytest.mark.parametrize("name", ["plugins/0-plugins/plugins.py", "mission.xml"])
def test_no_file_outside_of_a_run_directory_is_played(here, ran, tmp_path, name):
    assert here(*RUN)[0] == 0
    outside = tmp_path / f"outside{Path(name).suffix}"
    outside.write_text(evil(ran) if name.endswith(".py") else Path("kept", name).read_text())
    Path("kept", name).unlink()
    Path("kept", name).symlink_to(outside)
    code, err = here("run", "--from", "kept", "--no-log", "--trust")
    assert code == 4
    assert "out of the run directory" in err or "outside of the run directory" in err
    assert not ran.exists()


def test_a_run_that_was_killed_cannot_be_played_again(here):
    assert here(*RUN)[0] == 0
    Path("kept/run.json").unlink()
    code, err = here("run", "--from", "kept", "--no-log")
    assert (code, "it has no run.json, as it was killed or goes on" in err) == (4, True)
