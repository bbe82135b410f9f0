"""The report of a batch: one HTML page, and each of its plots as SVG and PNG."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

from tussle.documents import several
from tussle.errors import MissingExtraError, RecordError
from tussle.folders import real_path, whole_file

if TYPE_CHECKING:
    from tussle.batch.report.answers import ShortAnswer
    from tussle.batch.report.drawing import Picture
    from tussle.batch.report.report_data import ReportData
    from tussle.batch.report.sections import Plot, Section
    from tussle.batch.results import Results

INDEX = "index.html"


@dataclass(frozen=True)
class Report:
    """A report that has been written.

    Args:
        index: The page.
        plots: Names of the plots; each lies beside the page as NAME.svg and NAME.png.
        notes: What the reader of the pictures should know.
    """

    index: Path
    plots: tuple[str, ...]
    notes: tuple[str, ...]


def write_report(
    results: Results,
    directory: str | Path,
    quantities: Sequence[str] = (),
    target: str | None = None,
    over: str | None = None,
) -> Report:
    """Write the page `index.html` and its plots; the same batch gives the same bytes.

    Args:
        results: What is reported.
        directory: Where to; made if need be.
        quantities: Expressions that get plots of their own beside wins and scores, such as "score[2]-score[3]".
        target: The page opens with the answer to this question, see `Results.answers`; None for that of the command line.
        over: Name of the variable whose smallest value is searched.

    Raises:
        ParameterError: There is no such quantity.
        MissingExtraError: Matplotlib or Jinja is not installed.
        RecordError: The directory cannot be written.
    """
    from tussle.batch.report.answers import answers, further
    from tussle.batch.report.drawing import house_style, pictured
    from tussle.batch.report.report_data import ReportData

    with house_style():
        data = ReportData(results, several(quantities))
        sections = sections_of(data)
        pictures = {p.name: pictured(p.draw(), f"plot-{p.name}", p.title) for s in sections for p in s.plots}
        asked = answers(data)
    from tussle.batch.report.sections import answer, notes

    question, sentences = results.answers(target, over), list[str]()
    if question is not None:
        sentences = [f"{sentence}." for sentence in question.sentences()]
        asked = [*asked, *further(question, results)]
    page = write_page(
        Path(directory) / INDEX, sections, pictures,
        title=str(results.info.get("name") or "A batch of games"), version=str(results.info.get("tussle", "")),
        source="a batch in memory" if results.path is None else f"the batch {real_path(results.path).name}",
        answer=" ".join([*sentences, answer(data)]), answers=asked, notes=notes(data),
    )  # fmt: skip
    missing = "".join(sorted({letter for picture in pictures.values() for letter in picture.missing}))
    note = f"the font of the PNG files has no {missing}; the page and the SVG files show it"
    return Report(page, tuple(pictures), (note,) if missing else ())


def sections_of(data: ReportData) -> list[Section]:
    """All sections that are not empty; without a game that did not fail, only those that need none."""
    from tussle.batch.report import sections as of_games
    from tussle.batch.report import variable_sections as of_variables

    chosen = [of_games.notable_runs, of_games.making]
    if data.n_good:
        effects = [
            of_variables.effects,
            of_variables.maps,
            of_variables.strengths,
            of_variables.differences,
            of_variables.points,
        ]
        chosen = [
            of_games.won,
            *(effects if data.has_points else []),
            of_games.scores,
            of_games.left,
            of_games.ended,
            of_games.networks,
            *chosen,
        ]
    return _with_own_names([made for section in chosen if not (made := section(data)).is_empty])


def _with_own_names(sections: Sequence[Section]) -> list[Section]:
    """Sections whose plots have different names, also where files do not tell A from a."""
    seen: Counter[str] = Counter()

    def own(plot: Plot) -> Plot:
        seen[plot.name.lower()] += 1
        n = seen[plot.name.lower()]
        return plot if n == 1 else own(replace(plot, name=f"{plot.name}-{n}"))

    return [replace(section, plots=list(map(own, section.plots))) for section in sections]


def write_page(
    path: Path,
    sections: Sequence[Section],
    pictures: Mapping[str, Picture],
    *,
    title: str,
    version: str,
    source: str,
    answer: str,
    answers: Sequence[ShortAnswer] = (),
    notes: Sequence[str] = (),
    needs: str = "The page needs no other file",
) -> Path:
    """Write a page of sections, and its plots beside it. Returns the page.

    Args:
        path: The page.
        sections: Its sections.
        pictures: Each plot by name.
        title: Its heading.
        version: Of tussle.
        source: What it was made from.
        answer: The result, as a sentence under the heading.
        answers: Questions with their answers, under it.
        notes: What the reader should know, one line each.
        needs: What else the page needs, for its last line.

    Raises:
        MissingExtraError: Jinja is not installed.
        RecordError: The directory cannot be written.
    """
    try:
        import jinja2
    except ImportError as error:
        raise MissingExtraError(
            f"the report needs jinja2, which cannot be imported ({error}); pip install 'tussle[batch]' brings it"
        ) from None
    from tussle.batch.report.drawing import printable

    folder = files("tussle.batch.report")
    environment = jinja2.Environment(
        autoescape=True, finalize=lambda value: value if hasattr(value, "__html__") else printable(str(value))
    )
    html = environment.from_string(folder.joinpath("page.html.j2").read_text(encoding="utf-8")).render(
        title=title, version=version, source=source, answer=answer, answers=answers, notes=notes, needs=needs, sections=sections,
        pictures=pictures, style=folder.joinpath("page.css").read_text(encoding="utf-8"),
    )  # fmt: skip
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with ExitStack() as made:  # all of them or none
            for name, picture in pictures.items():
                svg, png = (
                    made.enter_context(whole_file(path.with_name(name + end))) for end in (".svg", ".png")
                )
                svg.write_text(picture.svg, encoding="utf-8")
                png.write_bytes(picture.png)
            made.enter_context(whole_file(path)).write_text(html, encoding="utf-8")
    except OSError as error:
        raise RecordError(
            f"{path.parent}: the report cannot be written: {error.strerror or error}"
        ) from error
    return path
