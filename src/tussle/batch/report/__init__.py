"""The report of a batch: one HTML page, and each of its plots as SVG and PNG."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from tussle.errors import RecordError

if TYPE_CHECKING:
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


def write_report(results: Results, directory: str | Path, quantities: Sequence[str] = ()) -> Report:
    """Write the page `index.html` and its plots; the same batch gives the same bytes.

    Args:
        results: What is reported.
        directory: Where to; made if need be.
        quantities: Expressions that get plots of their own beside wins and scores, such as "score[2]-score[3]".

    Raises:
        ParameterError: There is no such quantity.
        MissingExtraError: Matplotlib is not installed.
        RecordError: The directory cannot be written.
    """
    from tussle.batch.report.drawing import house_style, pictured
    from tussle.batch.report.outline import head_of, sections_of
    from tussle.batch.report.page import figure_id, page
    from tussle.batch.report.subject import Subject

    subject = Subject(results, quantities)
    with house_style():
        sections = sections_of(subject)
        plates = [plate for section in sections for plate in section.plates]
        pictures = {
            plate.name: pictured(plate.draw(), figure_id(plate.name), plate.title) for plate in plates
        }
    assert len(pictures) == len(plates), "two plots have one name"
    html = page(head_of(subject), sections, pictures)
    place = Path(directory)
    try:
        place.mkdir(parents=True, exist_ok=True)
        for name, picture in pictures.items():
            (place / f"{name}.svg").write_text(picture.svg, encoding="utf-8")
            (place / f"{name}.png").write_bytes(picture.png)
        (place / INDEX).write_text(html, encoding="utf-8")
    except OSError as error:
        raise RecordError(f"{place}: the report cannot be written: {error.strerror or error}") from error
    missing = "".join(sorted({letter for picture in pictures.values() for letter in picture.missing}))
    notes = (
        (f"the font of the PNG files has no {missing}; the page and the SVG files show it",)
        if missing
        else ()
    )
    return Report(place / INDEX, tuple(pictures), notes)
