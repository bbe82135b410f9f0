"""The tables of docs/parity.md, made from the declared differences to SCRIMMAGE and from the manifests."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from functools import cache
from typing import Any

from pages import ROOT

from tussle.plugins import historic, stock

PAGE = ROOT / "docs" / "parity.md"
FILE = ROOT / "src" / "tussle" / "plugins" / "historic" / "differences.toml"
SECTIONS = ("engine", "placing", "motion", "controller", "autonomy", "sensor", "world")
KINDS = ("motion", "controller", "autonomy", "sensor", "interaction", "metric", "network")
FIELDS = ("plugin", "theirs", "ours", "reason", "compat", "test")
TITLES = {"theirs": "SCRIMMAGE", "ours": "tussle", "compat": "`--compat`"}
MEETS = "conformance/test_stock.py::test_plugin_meets_the_contract"


@cache
def differences() -> dict[str, Any]:
    """The file of differences."""
    return tomllib.loads(FILE.read_text(encoding="utf-8"))


def rows() -> Iterator[dict[str, str]]:
    """Differences of all sections."""
    for section in SECTIONS:
        yield from differences()[section]


def plugins_of(row: dict[str, str]) -> list[str]:
    """Plugins that a difference is about."""
    names = row.get("plugin", "").replace("all networks", "GlobalNetwork, LocalNetwork, SphereNetwork")
    return names.split(", ") if names else []


def table(titles: list[str], lines: Iterator[list[str]]) -> str:
    """A table in Markdown."""
    out = [titles, ["---"] * len(titles), *lines]
    return "".join(f"| {' | '.join(cells)} |\n" for cells in out)


def section_table(section: str) -> str:
    """The differences of a section."""
    fields = FIELDS if section not in ("engine", "placing") else FIELDS[1:]
    found = differences()[section]
    return table(
        [TITLES.get(f, f) for f in fields],
        ([f"`{row[f]}`" if f == "test" else row.get(f, "") for f in fields] for row in found),
    )


def plugin_table() -> str:
    """The state of each plugin of SCRIMMAGE."""
    changed = {name for row in rows() for name in plugins_of(row) if row["compat"] != "the same"}
    lines = []
    for kind in KINDS:
        for name in differences()["plugins"][kind]:
            why = differences()["missing"].get(name)
            state = why or ("works otherwise (below)" if name in changed else "works")
            law = "SCRIMMAGE's law" if name in historic.manifest() else ""
            lines.append([kind, name, state, law])
    new = sorted(set(stock.manifest()) - {line[1] for line in lines})
    return table(["kind", "plugin", "state", "`--compat`"], iter(lines)) + (
        f"\nEach that works meets the contract in `{MEETS}`. New here: {', '.join(new)}.\n"
    )


def parity_page() -> str:
    """The page with its tables as they are declared now."""
    made = {"plugins": plugin_table(), **{name: section_table(name) for name in SECTIONS}}

    def renewed(found: re.Match[str]) -> str:
        return f"{found[1]}\n{made.pop(found[2])}{found[3]}"

    text = re.sub(r"(<!-- table (\w+) -->\n).*?(\n<!-- end -->)", renewed, PAGE.read_text(), flags=re.DOTALL)
    assert not made, f"{PAGE.name} has no place for the tables {', '.join(made)}"
    return text
