"""The page on parity is complete and up to date."""

from __future__ import annotations

import os
import re
import tomllib
from pathlib import Path

import pytest
from pages import ROOT
from parameters_page import PAGE as PARAMETERS
from parameters_page import parameters_page
from parity_page import KINDS, PAGE, SECTIONS, differences, parity_page, plugins_of, rows
from scrimmage_parameters import table

from tussle.plugins import historic, stock

STATES = ("works", "works otherwise: ", "dropped: ", "not yet: ")


def exists(test: str) -> bool:
    """Whether there is a test "PATH::NAME"."""
    path, _, name = test.partition("::")
    return f"\ndef {name}(" in (ROOT / "tests" / path).read_text()


def features() -> list[list[str]]:
    """Rows of the tables of features besides plugins: what it is, its state, its test."""
    text = PAGE.read_text().partition("\n## Features besides plugins\n")[2].partition("\n## ")[0]
    lines = [
        line for line in text.splitlines() if line.startswith("| ") and not line.startswith("| SCRIMMAGE ")
    ]
    return [[cell.strip() for cell in line.strip("|").split(" | ")] for line in lines]


def checklist() -> list[list[str]]:
    """The numbered rows of a list of SCRIMMAGE's features, which may lie beside the repository: the cells of each."""
    named = os.environ.get("TUSSLE_CHECKLIST")
    found = [Path(named)] if named else sorted(ROOT.parent.glob("*/parity.md"))
    if not found:
        pytest.skip("needs a list of SCRIMMAGE's features beside the repository, or TUSSLE_CHECKLIST")
    lines = [line for line in found[0].read_text().splitlines() if re.match(r"\| \d+ \|", line)]
    rows = [[cell.strip() for cell in line.strip("|").split(" | ")] for line in lines]
    assert [int(row[0]) for row in rows] == list(range(1, len(rows) + 1))
    return rows


def words(text: str) -> list[str]:
    """What names a feature: the names in its code, else its first word."""
    names = [re.split(r"[^\w.@-]", code.lstrip("<$"))[0] for code in re.findall("`([^`]+)`", text)]
    return [name for name in names if name.strip("-{")] or [re.split(r"\W", text)[0]]


def test_each_feature_has_a_state_and_what_works_a_test():
    for row in features():
        assert len(row) == 3, row
        _, state, test = row
        assert state == "works" or state.startswith(STATES[1:]), row
        assert bool(test) == state.startswith("works"), row
        assert not test or exists(test.strip("`")), row


def test_each_row_of_a_checklist_has_a_row_of_the_page():
    listed = {name for names in differences()["plugins"].values() for name in names}
    others = iter(features())
    for number, name, *_ in checklist():
        if set(name.split(", ")) & listed:
            assert name.split(", ")[0] in listed, number
            continue
        feature = next(others)[0].lower()
        assert all(word.lower() in feature for word in words(name)), (number, name, feature)
    assert next(others, None) is None


def test_the_page_is_what_is_declared_now():
    assert PAGE.read_text() == parity_page(), "python tests/docs/rewrite.py"


def test_the_page_of_parameters_is_what_is_declared_now():
    assert PARAMETERS.read_text() == parameters_page(), "python tests/docs/rewrite.py"
    rows = PARAMETERS.read_text().splitlines()
    for row in table():
        found = [line for line in rows if line.startswith(f"| [{row.plugin}](") and f"`{row.name}`" in line]
        assert found or row.state == "missing", row


def test_each_law_of_scrimmage_has_its_row():
    told = {name for row in rows() if row["compat"].startswith("yes") for name in plugins_of(row)}
    assert set(historic.manifest()) <= told


def test_each_row_is_whole_and_its_test_exists():
    assert set(differences()) == {*SECTIONS, "plugins", "missing"}
    for row in rows():
        assert set(row) <= {"plugin", "theirs", "ours", "reason", "compat", "test"}, row
        assert exists(row["test"]), row["test"]
        assert set(plugins_of(row)) <= set(stock.manifest()), row


def test_each_plugin_of_scrimmage_has_a_state():
    plugins = differences()["plugins"]
    assert set(plugins) == set(KINDS)
    names = [name for kind in KINDS for name in plugins[kind]]
    assert len(set(names)) == len(names)
    missing = set(differences()["missing"])
    assert set(names) - set(stock.manifest()) == missing
    assert not missing & set(stock.manifest())
    unread = ROOT / "src" / "tussle" / "plugins" / "stock" / "historic.toml"
    assert missing == set(tomllib.loads(unread.read_text())["plugins"]["names"])
    assert all(why.startswith(("dropped: ", "not yet: ")) for why in differences()["missing"].values())
