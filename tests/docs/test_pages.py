"""Every block of Python in the README and the guide runs, in order, and prints what the page says it prints."""

import re

import needs
import pytest
from pages import FENCE, PAGES, ROOT, examples, namespace, run

from tussle.mission import shipped_missions

IDS = [page.name for page in PAGES]
SLOW = ("cluster.md", "optimize.md", "six-degrees.md")
"""Pages that start a cluster, search, or compile a whole aircraft."""

NEEDED = {"planning.md": "ompl"}


@pytest.mark.parametrize(
    "page",
    [pytest.param(page, marks=pytest.mark.slow if page.name in SLOW else (), id=page.name) for page in PAGES],
)
def test_the_code_of_a_page_runs_and_prints_what_it_shows(page):
    if page.name in NEEDED:
        needs.require(NEEDED[page.name])
    module = namespace(page)
    for example in examples(page):
        printed = run(example, page, module)
        if example.output is not None:
            assert printed == example.output, (
                f"{page.name}:{example.line}; if meant: python tests/docs/rewrite.py"
            )


@pytest.mark.parametrize("page", PAGES, ids=IDS)
def test_links_between_pages_lead_somewhere(page):
    text = FENCE.sub("", page.read_text())
    for target in re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", text):
        if "://" not in target:
            assert (page.parent / target).exists(), f"{page.name} links to {target}"


def test_every_page_of_the_guide_can_be_reached_from_its_index():
    index = (ROOT / "docs" / "index.md").read_text()
    for page in (ROOT / "docs").glob("*.md"):
        assert page.name == "index.md" or f"({page.name})" in index, page.name


def test_the_table_of_missions_has_each_with_all_its_placeholders():
    text = (ROOT / "docs" / "mission-format.md").read_text()
    table = text.split("| mission | game |")[1].split("\n\n")[0]
    rows = [line.split("|") for line in table.splitlines() if line.startswith("| `")]
    words = [(re.findall(r"`(\w+)`", row[1]), re.findall(r"`(\w+)`", row[-2])) for row in rows]
    told = {name: sorted(placeholders) for names, placeholders in words for name in names}
    assert told == {
        name: sorted(set(re.findall(r"\$\{(\w+)=", path.read_text())))
        for name, (path, _) in shipped_missions().items()
    }


def test_a_wrong_output_is_noticed(tmp_path):
    page = tmp_path / "wrong.md"
    page.write_text("```python\nprint(1 + 1)\n```\n\n```text\n3\n```\n")
    (example,) = examples(page)
    assert run(example, page, namespace(page)) != example.output


def test_an_error_that_the_page_does_not_show_is_raised(tmp_path):
    page = tmp_path / "raises.md"
    page.write_text(
        "```python\n1 / 0\n```\n\n```text\nZeroDivisionError: division by zero\n```\n\n```python\nx\n```\n"
    )
    shown, hidden = examples(page)
    assert run(shown, page, namespace(page)) == shown.output
    with pytest.raises(NameError):
        run(hidden, page, namespace(page))


def test_lines_of_an_error_are_those_of_the_page(tmp_path):
    page = tmp_path / "lines.md"
    page.write_text("# Title\n\ntext\n\n```python\nx = 1\n\nraise ValueError('here')\n```\n")
    with pytest.raises(ValueError, match="here") as error:
        run(examples(page)[0], page, namespace(page))
    assert error.traceback[-1].lineno + 1 == 8
