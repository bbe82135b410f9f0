"""Pages of commands, typed as they stand: every file is written, every command runs, and prints what the page shows."""

import os
import re
import shutil
import subprocess
import sys

import pytest
from pages import FENCE, ROOT

PAGES = {"getting-started": 8, "study": 5}
"""Pages, and the number of commands on them at least."""
FILE = re.compile(r"`(\w+\.(?:py|xml))`")
SETUP = ("python -m venv", "pip install")


@pytest.fixture
def environment(tmp_path):
    """Commands of the page, from this very interpreter."""
    bin_ = tmp_path / "bin"
    bin_.mkdir()
    for name, module in (("tussle", "tussle.cli"), ("pytest", "pytest -p no:cacheprovider"), ("python", "")):
        call = f'exec "{sys.executable}" {f"-m {module}" if module else ""} "$@"\n'
        (bin_ / name).write_text(f"#!/bin/sh\n{call}")
        (bin_ / name).chmod(0o755)
    path = os.pathsep.join(p for p in sys.path if p)
    return {**os.environ, "PYTHONPATH": path, "PATH": f"{bin_}{os.pathsep}{os.environ['PATH']}"}


def comparable(text):
    """Lines without the times that differ from machine to machine, nor blanks at their ends."""
    timed = (" speed", " played")
    lines = [re.sub(r"[\d.,:]+", "#", s) if s.startswith(timed) else s.rstrip() for s in text.splitlines()]
    return [line for line in lines if line]


@pytest.mark.parametrize("page", PAGES)
def test_what_a_page_tells_one_to_type_works(tmp_path, environment, page):
    folder = tmp_path / "work"
    folder.mkdir()
    text, printed = (ROOT / "docs" / f"{page}.md").read_text(), ""
    n_commands = 0
    for fence in FENCE.finditer(text):
        language, body = fence[1], fence[2]
        if language in ("py", "xml"):
            name = FILE.findall(text[: fence.start()])[-1]
            (folder / name).write_text(body)
        elif language == "sh":
            lines = [line for line in body.splitlines() if not line.startswith(SETUP)]
            done = subprocess.run(
                ["sh", "-e", "-c", "\n".join(lines)],
                check=False, capture_output=True, text=True, cwd=folder, env=environment, timeout=300,
            )  # fmt: skip
            assert done.returncode == 0, (lines, done.stdout, done.stderr)
            printed = done.stdout
            n_commands += len(lines)
        elif language == "text":
            shown, found = comparable(body), comparable(printed)
            if shown[-1].strip() == "...":  # the page leaves out what follows
                shown, found = shown[:-1], found[: len(shown) - 1]
            assert found == shown
    assert n_commands >= PAGES[page]
    shutil.rmtree(folder)
