"""What no file of the repository may say, and what the README and the changelog must."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tomllib

import pytest
from tree import ROOT, kept_files, relative

# Written in two pieces, so that this file does not say them either.
FORBIDDEN = {
    "a folder outside the repository": r"(?<![\w/])(?:\.\./)?sha" + r"red/",
    "a path of one machine": r"(?<![\w.:/-])/(?:home|root|wo" + r"rk|opt|mnt)/\w",
    "a package registry's host": "|".join(
        ["py" + r"pi\.(?:org|python)", "python" + r"hosted\.", "conda" + r"\.org", "npm" + r"js\."]
    ),
}
KINDS = [
    kind["directory"]
    for kind in tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["towncrier"]["type"]
]


@pytest.mark.parametrize("what", FORBIDDEN)
def test_no_line_names(what):
    pattern, found = re.compile(FORBIDDEN[what]), []
    for path in kept_files():
        try:
            text = path.read_text()
        except UnicodeDecodeError:
            continue
        found += [
            f"{relative(path)}:{i}: {s}" for i, s in enumerate(text.splitlines(), 1) if pattern.search(s)
        ]
    assert not found, f"{what} in\n" + "\n".join(found)


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("see sha" + "red/x.md", "a folder outside the repository"),
        ("see ../sha" + "red/x.md", "a folder outside the repository"),
        ("cd /wo" + "rk/main", "a path of one machine"),
        ("https://py" + "pi.org/simple", "a package registry's host"),
    ],
)
def test_the_patterns_find_what_they_are_for(text, what):
    assert re.search(FORBIDDEN[what], text)
    assert not re.search(
        FORBIDDEN[what], "threads are not shared / np.shares_memory; https://example.org/work/x ~/.cache/x"
    )


def test_fragments_of_the_changelog_have_a_known_kind():
    for path in (ROOT / "changelog").iterdir():
        if path.name != "README.md":
            assert re.fullmatch(rf"[a-z0-9-]+\.({'|'.join(KINDS)})\.md", path.name), path.name
            assert path.read_text().strip(), f"{path.name} is empty"


def test_release_notes_are_made_of_all_fragments():
    pytest.importorskip("towncrier", reason="needs towncrier: pip install '.[test]'")
    command = [sys.executable, "-m", "towncrier", "build", "--draft"]
    notes = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    listed = "".join(notes.split())
    for path in (ROOT / "changelog").glob("*.*.md"):
        assert "".join(path.read_text().split()) in listed, path.name
    for target in re.findall(r"\]\(([^)#\s]+)", notes):
        assert (ROOT / target).exists(), (
            f"a fragment links to {target}; links are relative to the folder of CHANGELOG.md"
        )


def test_readme_begins_with_the_two_commands_that_the_checks_run():
    blocks = re.findall(
        r"^<!-- ci:(\w+) -->\n```sh\n(.+?)\n```$", (ROOT / "README.md").read_text(), re.MULTILINE | re.DOTALL
    )
    assert [name for name, _ in blocks] == ["run", "test"]
    commands = dict(blocks)
    assert commands["run"].startswith("pip install .")
    assert commands["test"].startswith("pip install '.[test]'")


def test_the_checks_can_be_run():
    for name in ("run", "bare"):
        script = ROOT / ".ci" / name
        assert os.access(script, os.X_OK)
        subprocess.run(["bash", "-n", str(script)], check=True)
