"""The page on the tests names files that are there, and each folder of tests."""

import re

from pages import ROOT

TESTS = ROOT / "tests"


def test_every_promise_names_tests_and_pages_that_exist():
    text = (TESTS / "README.md").read_text()
    rows = [line for line in text.splitlines() if line.startswith("| ") and ".py`" in line]
    named = {name for row in rows for name in re.findall(r"`([\w/]+(?:\.py|/\w+))[ `]", row)}
    linked = set(re.findall(r"\]\(([^)]+)\)", text))
    assert len(rows) > 15
    missing = [name for name in named if not (TESTS / name).exists() and not (ROOT / name).exists()]
    missing += [name for name in linked if not (TESTS / name).exists()]
    assert not missing


def test_every_folder_is_described():
    described = set(re.findall(r"^\| `(\w+)` \|", (TESTS / "README.md").read_text(), re.MULTILINE))
    assert described == {path.parent.relative_to(TESTS).parts[0] for path in TESTS.rglob("*/test_*")}
