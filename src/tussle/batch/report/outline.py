"""What the page says, from top to bottom."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import replace

from tussle.batch.report import story
from tussle.batch.report.page import Head
from tussle.batch.report.parts import Plate, Section
from tussle.batch.report.sections.differences import differences
from tussle.batch.report.sections.effects import effects
from tussle.batch.report.sections.ended import ended
from tussle.batch.report.sections.left import left
from tussle.batch.report.sections.look_at import look_at
from tussle.batch.report.sections.making import making
from tussle.batch.report.sections.maps import maps
from tussle.batch.report.sections.points import points
from tussle.batch.report.sections.scores import scores
from tussle.batch.report.sections.strengths import strengths
from tussle.batch.report.sections.won import won
from tussle.batch.report.subject import Subject

SECTIONS = (won, scores, effects, maps, strengths, differences, points, left, ended, look_at, making)
WITHOUT_GAMES = (look_at, making)


def sections_of(subject: Subject) -> list[Section]:
    """All that is not empty; of a batch in which nothing was played well, what failed and how it was made."""
    made = [section(subject) for section in (SECTIONS if subject.n_good else WITHOUT_GAMES)]
    return list(_with_own_names([section for section in made if not section.is_empty]))


def _with_own_names(sections: Iterable[Section]) -> Iterable[Section]:
    """Sections whose plots have names that differ, also where files do not tell A from a."""
    seen: Counter[str] = Counter()

    def own(plate: Plate) -> Plate:
        seen[plate.name.lower()] += 1
        n = seen[plate.name.lower()]
        return plate if n == 1 else own(replace(plate, name=f"{plate.name}-{n}"))

    for section in sections:
        yield replace(section, plates=tuple(own(plate) for plate in section.plates))


def head_of(subject: Subject) -> Head:
    """The top of the page."""
    results = subject.results
    source = "a batch in memory" if results.path is None else f"the batch {results.path.resolve().name}"
    return Head(
        title=str(results.info.get("name") or "A batch of games"),
        answer=story.answer(subject),
        notes=story.notes(subject),
        headline=story.headline(subject),
        version=str(results.info.get("tussle", "")),
        source=source,
    )
