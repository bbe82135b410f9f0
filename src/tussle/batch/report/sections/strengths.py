"""How strongly the quantities follow each variable."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tussle.batch.report.parts import Column, Plate, Section, Table
from tussle.batch.report.plots_of_variables import effect_strengths
from tussle.batch.report.subject import Measure, Subject
from tussle.batch.report.words import capital, file_name, sentence
from tussle.batch.sensitivity import Effect

_OTHERS = {
    "interaction": "what variables do only together",
    "seed": "what chance does",
    "interaction and seed": "what variables do only together, and chance",
}

MOST_SHOWN = 20
"""Variables in one plot."""


def strengths(subject: Subject) -> Section:
    """How strongly the quantities follow each variable."""
    if len(subject.variables) == 0:
        return Section("strengths", "Which variables matter")
    plates, rows, every = [], [], []
    for measure in (*subject.wins, *subject.scores, *subject.more):
        found = [e for e in _effects(subject, measure) if _says_something(e)]
        if not found:
            continue
        found.sort(key=lambda e: -_strength(e))
        shown = found[:MOST_SHOWN]
        title = subject.title(measure.expression)
        plates.append(
            Plate(
                f"strengths-{file_name(measure.expression)}",
                f"What {title} depends on",
                "Marks: estimates, the strongest at the top. Bars: their 95 % intervals."
                + (f" The {len(shown)} strongest of {len(found)}." if len(shown) < len(found) else ""),
                lambda shown=shown: effect_strengths(shown),  # type: ignore[misc]
            )
        )
        rows += [(title, *_strength_cells(e)) for e in shown]
        every += shown
    if not plates:
        return Section("strengths", "Which variables matter")
    table = _strength_table(rows, [e.note for e in every if e.note])
    return Section(
        "strengths", "Which variables matter", lead=_how_to_read(every), plates=tuple(plates), tables=(table,)
    )


def _effects(subject: Subject, measure: Measure) -> list[Effect]:
    """Effects as they are shown: with one variable, "with others" says nothing."""
    found = subject.results.sensitivity(measure.expression)
    if len(subject.results.variables) > 1:
        return found
    return [replace(e, total=None, total_low=None, total_high=None) for e in found]


def _strength_table(rows: Sequence[tuple[str, ...]], notes: Sequence[str]) -> Table:
    """The strengths in numbers; kinds of which there are none are left out."""
    heads = [Column("quantity", "text"), Column("variable", "text")]
    for name in ("rank correlation", "alone", "with others"):
        heads += [Column(name), Column("95 % interval")]
    kept = [i for i in range(len(heads)) if i < 2 or any(row[i - i % 2] != "–" for row in rows)]
    return Table(
        "In numbers",
        tuple(heads[i] for i in kept),
        tuple(tuple(row[i] for i in kept) for row in rows),
        sentence("; ".join(dict.fromkeys(part for note in notes for part in note.split("; ")))),
    )


def _says_something(effect: Effect) -> bool:
    return np.isfinite(effect.rank_correlation) or effect.first_order is not None or effect.total is not None


def _strength(effect: Effect) -> float:
    values = [effect.total, effect.first_order, effect.rank_correlation]
    return next((abs(v) for v in values if v is not None and np.isfinite(v)), 0.0)


def _how_to_read(effects: Sequence[Effect]) -> tuple[str, ...]:
    """What the two kinds of numbers say."""
    lead = []
    if any(np.isfinite(e.rank_correlation) for e in effects):
        lead.append(
            "Rank correlation: 1 or −1 where the quantity always rises or falls with the variable, 0 where it does not follow it."
        )
    if any(e.first_order is not None or e.total is not None for e in effects):
        text = "Share of the variance: how much of it would go if the variable were fixed, "
        if any(e.total is not None for e in effects):
            text += "alone, or with all that it does together with others."
        else:
            text += "and nothing else."
        known = {e.variable for e in effects}
        lead.append(
            text + "".join(f" {capital(name)}: {words}." for name, words in _OTHERS.items() if name in known)
        )
    return tuple(lead)


def _strength_cells(effect: Effect) -> tuple[str, ...]:
    cells = [effect.variable]
    for value, low, high in (
        (effect.rank_correlation, effect.rank_low, effect.rank_high),
        (effect.first_order, effect.first_low, effect.first_high),
        (effect.total, effect.total_low, effect.total_high),
    ):
        has_interval = low is not None and bool(np.isfinite(low))
        cells += [_hundredths(value), f"{_hundredths(low)} to {_hundredths(high)}" if has_interval else "–"]
    return tuple(cells)


def _hundredths(value: float | None) -> str:
    if value is None or not np.isfinite(value):
        return "–"
    return f"{round(value, 2) + 0.0:.2f}".replace("-", "−")
