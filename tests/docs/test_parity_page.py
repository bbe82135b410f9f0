"""The page on parity is complete and up to date."""

from __future__ import annotations

import tomllib

from pages import ROOT
from parity_page import KINDS, PAGE, SECTIONS, differences, parity_page, plugins_of, rows

from tussle import historic, stock


def test_the_page_is_what_is_declared_now():
    assert PAGE.read_text() == parity_page(), "python tests/docs/rewrite.py"


def test_each_law_of_scrimmage_has_its_row():
    told = {name for row in rows() if row["compat"].startswith("yes") for name in plugins_of(row)}
    assert set(historic.manifest()) <= told


def test_each_row_is_whole_and_its_test_exists():
    assert set(differences()) == {*SECTIONS, "plugins", "missing"}
    for row in rows():
        assert set(row) <= {"plugin", "theirs", "ours", "reason", "compat", "test"}, row
        path, _, name = row["test"].partition("::")
        assert f"\ndef {name}(" in (ROOT / "tests" / path).read_text(), row["test"]
        assert set(plugins_of(row)) <= set(stock.manifest()), row


def test_each_plugin_of_scrimmage_has_a_state():
    plugins = differences()["plugins"]
    assert set(plugins) == set(KINDS)
    names = [name for kind in KINDS for name in plugins[kind]]
    assert len(set(names)) == len(names)
    missing = set(differences()["missing"])
    assert set(names) - set(stock.manifest()) == missing
    assert not missing & set(stock.manifest())
    unread = ROOT / "src" / "tussle" / "stock" / "historic.toml"
    assert missing == set(tomllib.loads(unread.read_text())["plugins"]["names"])
    assert all(why.startswith(("dropped: ", "not yet: ")) for why in differences()["missing"].values())
