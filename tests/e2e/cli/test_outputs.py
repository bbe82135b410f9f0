"""Whatever file a command is asked to write is there completely or not at all, and replaces nothing but a file."""

from __future__ import annotations

import os
import resource
import sys
from contextlib import contextmanager
from inspect import signature
from pathlib import Path
from typing import get_args

import pytest
from typer.main import get_command

from tussle.cli.app import app

LIMIT = 512
"""Bytes that a file may have on the disk that is full: fewer than any output takes."""
OUTPUTS = {
    "html": ("export", "played", "--html", "out"),
    "csv": ("export", "played", "--csv", "out"),
    "parquet": ("export", "played", "--parquet", "out"),
    "mcap": ("export", "played", "--mcap", "out"),
    "rerun": ("export", "played", "--rerun", "out"),
    "geojson": ("export", "played", "--geojson", "out"),
    "plot": ("plot", "played", "--kind", "left", "--out", "."),
    "convert": ("convert", "game.xml", "--to", "out.xml"),
    "new": ("new", "autonomy", "Left", "--out", "."),
    "report": ("report", "games", "--out", "."),
}
"""Command for each kind of file."""
FILES = {"convert": "out.xml", "plot": "left.png", "new": "left.py", "report": "index.html"}
"""Its name, where it is not "out"."""


@pytest.fixture
def recorded(tussle, folder):
    """A run and a batch."""
    text = (folder / "game.xml").read_text()
    (folder / "game.xml").write_text(text.replace("<seed>", "<latitude_origin>50</latitude_origin><seed>"))
    tussle("run", "game.xml", "--out", "played", "--end", "0.3")
    tussle("batch", "game.xml", "--out", "games", "--runs", "2", "--end", "0.3", "--processes", "1")


@contextmanager
def full_disk(monkeypatch):
    """No file grows beyond a limit; Python would cut the modules that it keeps compiled."""
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (LIMIT, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.slow
@pytest.mark.needs("rerun")
def test_outputs_on_a_full_disk_leave_nothing_and_over_a_pipe_or_a_link_leave_that(
    tussle, folder, recorded, monkeypatch
):
    before = sorted(folder.rglob("*"))
    for kind, command in OUTPUTS.items():
        with full_disk(monkeypatch):
            said = tussle(*command, code=1 if kind in ("convert", "new") else 4).stderr
        assert "cannot be written: " in said, kind
        assert "bug" not in said, said
        assert sorted(folder.rglob("*")) == before, kind
        target = folder / FILES.get(kind, "out")
        for put in (os.mkfifo, lambda path: path.symlink_to("/dev/full")):
            put(target)
            found = target.lstat()
            said = tussle(*command, code=1 if kind in ("convert", "new") else 4).stderr
            assert (
                "it is no regular file" if kind not in ("convert", "new") else "exists already"
            ) in said, kind
            assert os.path.samestat(target.lstat(), found), kind
            target.unlink()
    assert Path("/dev/full").is_char_device()


def test_an_empty_path_of_any_command_is_refused(tussle, folder):
    """That of a variable of the shell which is not set would be the present folder."""
    before = sorted(folder.iterdir())
    n_refused = 0
    for command in get_command(app).commands.values():
        asked = signature(command.callback).parameters
        for option in command.params:
            if (
                "Path" not in str(get_args(asked[option.name].annotation)[0])
                if option.name in asked
                else True
            ):
                continue
            for words in (
                ([option.opts[0], ""], [f"{option.opts[0]}="]) if option.opts[0].startswith("-") else ([""],)
            ):
                said = tussle(command.name, *words, code=2)
                assert "is empty; it takes a path" in said.stderr, (command.name, words, said)
                n_refused += 1
    assert n_refused > 60
    assert sorted(folder.iterdir()) == before
