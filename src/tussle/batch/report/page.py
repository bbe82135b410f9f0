"""The page: one HTML file that asks nobody for anything."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from importlib.resources import files
from itertools import chain, repeat

from tussle.batch.report.drawing import Picture, printable
from tussle.batch.report.parts import Plate, Section, Table

# Says to the browser what the tests say to us: nothing is fetched, and nothing that got in as text can run.
POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"

PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<meta name="generator" content="tussle {version}">
<title>{title}</title>
<style>
{style}</style>
</head>
<body>
<header>
<h1>{title}</h1>
<p class="answer">{answer}</p>
{notes}<dl class="headline">{headline}</dl>
<nav aria-label="Sections">{contents}</nav>
</header>
<main>
{sections}
</main>
<footer>Made by tussle {version} from {source}. This page is whole by itself; the plots lie beside it as SVG and PNG.</footer>
</body>
</html>
"""


@dataclass(frozen=True)
class Head:
    """What stands at the top of the page.

    Args:
        title: Name of the mission.
        answer: What came out.
        notes: What must be known before the rest.
        headline: Names and values of a few numbers.
        version: Of tussle that played the batch.
        source: What the page was made from.
    """

    title: str
    answer: str
    notes: Sequence[str]
    headline: Sequence[tuple[str, str]]
    version: str
    source: str


def page(head: Head, sections: Sequence[Section], pictures: Mapping[str, Picture]) -> str:
    """The whole page.

    Args:
        head: Its top.
        sections: What follows; none of them is empty.
        pictures: Name of a plate -> its picture.
    """
    notes = "".join(f"<li>{text(note)}</li>" for note in head.notes)
    return PAGE.format(
        policy=POLICY,
        version=text(head.version),
        title=text(head.title),
        style=files("tussle.batch.report").joinpath("page.css").read_text(encoding="utf-8"),
        answer=text(head.answer),
        notes=f'<ul class="notes">{notes}</ul>\n' if notes else "",
        headline="".join(
            f"<div><dt>{text(name)}</dt><dd>{text(value)}</dd></div>" for name, value in head.headline
        ),
        contents="".join(f'<a href="#{section.name}">{text(section.title)}</a>' for section in sections),
        sections="\n".join(_section(section, pictures) for section in sections),
        source=text(head.source),
    )


def text(said: str) -> str:
    """A text as it stands in HTML, wherever it comes from."""
    return escape(printable(said))


def _section(section: Section, pictures: Mapping[str, Picture]) -> str:
    parts = [f'<section id="{section.name}">', f"<h2>{text(section.title)}</h2>"]
    parts += [f"<p>{text(sentence)}</p>" for sentence in section.lead]
    if section.plates:
        parts += ['<div class="plates">', *(_plate(p, pictures[p.name]) for p in section.plates), "</div>"]
    if section.facts:
        rows = "".join(f"<dt>{text(name)}</dt><dd>{text(value)}</dd>" for name, value in section.facts)
        parts.append(f'<dl class="facts">{rows}</dl>')
    parts += [_table(table) for table in section.tables]
    return "\n".join([*parts, "</section>"])


def figure_id(name: str) -> str:
    """Identifier of a plate's figure; also begins all identifiers in its picture."""
    return f"plot-{name}"


def _plate(plate: Plate, picture: Picture) -> str:
    links = "".join(f'<a href="{plate.name}.{kind}">{kind.upper()}</a>' for kind in ("svg", "png"))
    return (
        f'<figure id="{figure_id(plate.name)}">\n<h3>{text(plate.title)}</h3>\n{picture.inline}\n'
        f'<figcaption>{text(plate.caption)} <span class="files">{links}</span></figcaption>\n</figure>'
    )


def _table(table: Table) -> str:
    kinds = [column.kind for column in table.columns]
    head = "".join(f'<th scope="col" class="{c.kind}">{text(c.name)}</th>' for c in table.columns)
    rows = []
    for row, colour in zip(table.rows, chain(table.colours, repeat("")), strict=False):
        style = f' style="border-left: 0.3rem solid {colour}"' if colour else ""
        cells = "".join(_cell(cell, kind) for cell, kind in zip(row, kinds, strict=True))
        rows.append(f"<tr{style}>{cells}</tr>")
    caption = f'<p class="caption">{text(table.caption)}</p>\n' if table.caption else ""
    title = f"<h3>{text(table.title)}</h3>\n" if table.title else ""
    body = "\n".join(rows)
    return (
        f'{title}<div class="table" tabindex="0" role="region" aria-label="{text(table.title or "table")}"><table>\n'
        f"<thead><tr>{head}</tr></thead>\n<tbody>\n{body}\n</tbody>\n</table></div>\n{caption}"
    )


def _cell(cell: str, kind: str) -> str:
    inside = f"<code>{text(cell)}</code>" if kind == "code" else text(cell)
    return f'<td class="{kind}">{inside}</td>'
