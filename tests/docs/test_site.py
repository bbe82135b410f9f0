"""The documentation site: what is in it, and that the sources read the same on the site and on a code host."""

from __future__ import annotations

import html
import re
import zlib
from pathlib import Path

import pytest
from pages import FENCE, ROOT
from reference import PARTS, inherited, members_with_docs, public

NAV = (ROOT / "mkdocs.yml").read_text().split("\nnav:\n")[1]
INDEX = (ROOT / "docs" / "index.md").read_text()
ITEM = re.compile(r" *(?:[-*]|\d+\.) \S")


def test_navigation_and_start_page_list_the_same_pages():
    sections = dict(re.findall(r"^  - ([\w-]+):\n((?:      - \S+\n)+)", NAV, re.MULTILINE))
    assert len(sections) == 4
    for title, entries in sections.items():
        listed = re.search(rf"^## {title}\n(.*?)^## ", INDEX, re.MULTILINE | re.DOTALL)
        assert listed, title
        links = re.findall(r"^\| \[[^]]+\]\(([^)]+)\)", listed[1], re.MULTILINE)
        made = ["reference.md", "plugins/index.md"] if title == "Reference" else []
        assert links == made + re.findall(r"- (\S+)", entries), title


@pytest.mark.parametrize(
    "page",
    [*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("tests/*.md")],
    ids=lambda page: page.name,
)
def test_a_list_follows_an_empty_line(page):
    """Without it, a code host shows a list, and the site the items in one line."""
    before = ""
    for line in FENCE.sub("", page.read_text()).splitlines():
        follows = not before.strip() or ITEM.match(before) or before.startswith("  ")
        assert follows or not ITEM.match(line), f"{page.name}: {before!r} {line!r}"
        before = line


@pytest.mark.needs("mkdocs")
@pytest.mark.parametrize("module", [module for module in PARTS if module != "tussle.stock"])
def test_every_public_name_is_on_the_page_of_its_module(built_site, module):
    known = inventory(built_site)
    for name, value in public(module).items():
        full = f"{module}.{name}"
        assert known[full] == f"reference/{module}/#$", full
        own = dict(members_with_docs(value)) if isinstance(value, type) else {}
        for name_in_class in (*own, *inherited(value)):
            assert f"{full}.{name_in_class}" in known


def inventory(site: Path) -> dict[str, str]:
    """Names of the site's list of Python objects, and where they are."""
    packed = (site / "objects.inv").read_bytes().split(b"\n", 4)[4]
    lines = zlib.decompress(packed).decode().splitlines()
    return {name: place for name, _, _, place, _ in (line.split(" ", 4) for line in lines)}


@pytest.mark.needs("mkdocs")
def test_parameters_have_types_and_attributes_units(built_site):
    batch = shown(built_site, "reference/tussle.batch")
    assert re.search(r"run_timeout \(float \| None, default: None \) – Wall time .* \[s\]", batch)
    assert re.search(
        r"pos ¶ pos Position \[m\], \(3,\), world frame", shown(built_site, "reference/tussle.api")
    )
    assert re.search(r"Raises: ParameterError", batch)


@pytest.mark.needs("mkdocs")
def test_files_outside_the_documents_have_pages(built_site):
    assert "class SharingChaser" in shown(built_site, "files/examples/02_your_own_chaser.py")
    assert 'href="02_your_own_chaser.py/"' in (built_site / "files/examples/index.html").read_text()
    assert 'href="../../write-a-plugin/"' in (built_site / "files/CONTRIBUTING/index.html").read_text()


def shown(site: Path, page: str) -> str:
    """Text of a page, with single spaces."""
    text = html.unescape(re.sub(r"<[^>]+>", "", (site / page / "index.html").read_text()))
    return " ".join(text.split())


@pytest.mark.needs("mkdocs")
def test_a_site_that_mike_builds_has_a_switch_of_versions(monkeypatch):
    from mkdocs.config import load_config
    from site_hooks import on_config

    assert "version" not in on_config(load_config(str(ROOT / "mkdocs.yml"))).extra
    monkeypatch.setenv("MIKE_DOCS_VERSION", "0.2")
    assert on_config(load_config(str(ROOT / "mkdocs.yml"))).extra["version"] == {"provider": "mike"}
