"""The report of a batch: what it says, that it is whole, safe and the same each time."""

from __future__ import annotations

import re
import sys
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from made_batches import made_batch, write_batch
from reported_batches import choices, noise, ranges, scores_of_the_paper

from tussle.batch import load_batch
from tussle.batch.report import INDEX, write_report
from tussle.batch.results import Results
from tussle.batch.sampling import sample
from tussle.batch.variables import Choice
from tussle.errors import MissingExtraError, RecordError

VOID = {"meta", "br", "hr", "img", "link", "input"}
PIXELS = b"\x89PNG\r\n"


class Page(HTMLParser):
    """A page as a browser sees it: its text, its tags, and whether each is closed."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.words: list[str] = []
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self._open: list[str] = []
        self.feed(html)
        self.close()
        assert self._open == []

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self._open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        assert self._open.pop() == tag

    def handle_data(self, data):
        if "style" not in self._open:
            self.words.append(data)

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.words).split())

    def all(self, name: str) -> list[str]:
        """Values of an attribute."""
        return [values[name] or "" for _, values in self.tags if name in values]


def written(stored, place: Path, **options) -> tuple[Page, str]:
    report = write_report(Results(stored), place / "report", **options)
    html = report.index.read_text(encoding="utf-8")
    return Page(html), html


@pytest.fixture(scope="module")
def of_paper(tmp_path_factory):
    """The directory of a batch without variables and its page."""
    batch = write_batch(made_batch(scores_of_the_paper()), tmp_path_factory.mktemp("place") / "paper")
    write_report(load_batch(batch), batch / "report")
    html = (batch / "report" / INDEX).read_text(encoding="utf-8")
    return batch, Page(html), html


@pytest.fixture(scope="module")
def of_ranges(tmp_path_factory):
    return written(ranges(), tmp_path_factory.mktemp("ranges"))


@pytest.fixture(scope="module")
def of_choices(tmp_path_factory):
    place = tmp_path_factory.mktemp("choices")
    return place / "report", *written(choices(), place)


# -- that it is whole, and safe ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("which", ["of_paper", "of_ranges", "of_choices"])
def test_the_page_asks_nobody_for_anything(which, request):
    *_, page, html = request.getfixturevalue(which)
    assert "http://" not in html
    assert "https://" not in html
    assert "@import" not in html
    assert not {"script", "link", "img", "iframe", "object"} & {tag for tag, _ in page.tags}
    assert all(
        re.fullmatch(r"#[\w-]+|[\w-]+\.(svg|png)|data:image/png;base64,[\sA-Za-z0-9+/=]+", link)
        for link in page.all("href")
    )
    assert not page.all("src")
    assert {found[:1] for found in re.findall(r"url\((.{0,80})", html)} <= {"#"}
    (policy,) = [v["content"] for tag, v in page.tags if tag == "meta" and "http-equiv" in v]
    assert policy.startswith("default-src 'none'")


@pytest.mark.parametrize("which", ["of_paper", "of_ranges", "of_choices"])
def test_identifiers_are_unique_and_all_that_are_named_are_there(which, request):
    *_, page, html = request.getfixturevalue(which)
    ids = page.all("id")
    assert len(set(ids)) == len(ids)
    named = {link[1:] for link in page.all("href") if link.startswith("#")} | set(
        re.findall(r"url\(#([\w-]+)\)", html)
    )
    assert named <= set(ids)


def test_every_plot_lies_beside_the_page_and_has_a_caption(of_paper):
    batch, page, html = of_paper
    names = [link.removesuffix(".svg") for link in page.all("href") if link.endswith(".svg")]
    assert names
    files = {file.name for file in (batch / "report").iterdir()}
    assert files == {INDEX} | {f"{name}.{kind}" for name in names for kind in ("svg", "png")}
    for name in names:
        assert (batch / "report" / f"{name}.png").read_bytes().startswith(PIXELS)
        ET.parse(batch / "report" / f"{name}.svg")
    assert html.count("<figcaption>") == len(names)


def test_the_page_answers_and_has_its_sections(of_paper, of_choices):
    _, page, _ = of_paper
    assert "keepers won 593 of 1,000 games (59.3 %, 95 % interval 56.2 to 62.3)" in page.text
    assert {"won", "plot-wins", "plot-margin", "left", "plot-left-1"} <= set(page.all("id"))
    _, page, _ = of_choices
    assert "score of keepers tactic=keep → tactic=switch 40 " in page.text


HOSTILE = "</title><script>alert(0)</script> & {braces} %s $x^"


@pytest.fixture(scope="module")
def hostile(tmp_path_factory):
    """Texts of all kinds that try to be more than text."""
    values = (
        "<img src=x onerror=alert(1)>",
        "$\\frac{",
        'id="wins" #20252b',
        "\x00\x07ctl",
        "_under",
        "\ud800half",
    )
    variable = Choice("tac<b>tic", values)
    points = sample([variable])
    stored = made_batch(
        {1: noise(6, 8, 3.0), 2: noise(6, 8, 5.0, 1), 3: noise(6, 8, 4.0, 2)},
        variables=[variable], points=[{"tac<b>tic": v.encode(errors="replace").decode()} for p in points for v in p.values()],
        failed={3: "</td><script src=http://evil.example/x></script>"},
    )  # fmt: skip
    stored.info.update(
        name=HOSTILE,
        teams={"1": "$x^_<script>", "2": '_hidden & "quoted"', "3": "漢字" * 20},
        command=["tussle", "batch", "x y;$(rm)", "<b>"],
        stopped_by="<i>",
    )
    report = write_report(Results(stored), tmp_path_factory.mktemp("hostile"))
    return report, report.index.read_text(encoding="utf-8")


def test_hostile_texts_stay_texts(hostile):
    report, html = hostile
    page = Page(html)
    assert not {"script", "img", "b", "i"} & {tag for tag, _ in page.tags}
    assert "</title><script>alert(0)</script> & {braces} %s $x^" in page.text
    assert "<img src=x onerror=alert(1)>" in page.text
    assert "tussle batch 'x y;$(rm)' '<b>'" in page.text
    assert "\x00" not in html
    for name in report.plots:
        ET.parse(report.index.parent / f"{name}.svg")


def test_letters_that_the_pictures_cannot_draw_are_told(hostile):
    report, html = hostile
    assert report.notes == ("the font of the PNG files has no 字漢; the page and the SVG files show it",)
    assert "漢字漢字" in html


# -- that it is the same --------------------------------------------------------------------------------------------------------


def contents(folder: Path) -> dict[str, bytes]:
    return {file.name: file.read_bytes() for file in folder.iterdir()}


def test_the_same_batch_gives_the_same_bytes_whatever_the_user_has_set(of_choices, tmp_path):
    import matplotlib as mpl

    with mpl.rc_context(
        {"font.size": 20.0, "axes.facecolor": "red", "svg.hashsalt": None, "savefig.dpi": 50}
    ):
        write_report(Results(choices()), tmp_path / "b")
        assert mpl.rcParams["font.size"] == 20.0
    assert contents(of_choices[0]) == contents(tmp_path / "b")
    assert "matplotlib.pyplot" not in sys.modules or not sys.modules["matplotlib.pyplot"].get_fignums()
    assert not re.search(rb"\d\d:\d\d:\d\d|<dc:date>", (tmp_path / "b" / "wins.svg").read_bytes())


# -- that it stays small, and what it cannot do ------------------------------------------------------------------------------------


@pytest.mark.parametrize("package", ["matplotlib", "jinja2"])
def test_without_a_package_the_extra_is_named(monkeypatch, tmp_path, package):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(MissingExtraError, match=rf"{package.partition('.')[0]}.*tussle\[batch\]"):
        write_report(Results(choices()), tmp_path)


def test_a_directory_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "taken").write_text("a file")
    with pytest.raises(RecordError, match="taken"):
        write_report(Results(choices()), tmp_path / "taken")
