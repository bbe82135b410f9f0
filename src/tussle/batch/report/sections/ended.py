"""When and why games ended."""

from __future__ import annotations

import numpy as np

from tussle.batch.report import plots
from tussle.batch.report.parts import Plate, Section
from tussle.batch.report.subject import Subject
from tussle.batch.report.words import capital, count, estimate, number


def ended(subject: Subject) -> Section:
    """When and why games ended."""
    runs = subject.results.runs
    reason, t = np.array(runs["end"].to_pylist()), np.asarray(runs["t"].to_numpy())
    ends = {str(end): t[reason == end] for end in plots.END_WORDS if np.any(reason == end)}
    ends |= {str(e): t[reason == e] for e in sorted({*reason} - {*plots.END_WORDS, "error"})}
    if not ends:
        return Section("ended", "How the games ended")
    every = np.concatenate(list(ends.values()))
    parts = [f"{plots.END_WORDS.get(end, end)} in {count(len(times), 'game')}" for end, times in ends.items()]
    if np.ptp(every) == 0.0:
        why = parts[0].rpartition(" in ")[0] if len(ends) == 1 else "; ".join(parts)
        what = f"All {count(len(every), 'game')}" if len(every) > 1 else "The only game"
        return Section("ended", "How the games ended", lead=(f"{what} lasted {number(every[0])} s: {why}.",))
    return Section(
        "ended",
        "How the games ended",
        plates=(
            Plate(
                "lengths",
                "Length of the games",
                f"Height: number of games. Mean {estimate(every.mean())} s, median {number(float(np.median(every)))} s."
                f" {capital('; '.join(parts))}.",
                lambda: plots.lengths(ends),
            ),
        ),
    )
