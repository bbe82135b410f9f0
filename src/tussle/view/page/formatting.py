"""Formats values of a game for the panels of the page."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from tussle.engine.result import WorldResult
from tussle.view.entity import EntityState, Reading, ShownMessage

MOST_ITEMS = 6
"""Of a list, in a reading or a message."""
MOST_LETTERS = 8
Row = tuple[str, str]


def number(value: Any) -> str:
    """Format a number with its significant digits."""
    if isinstance(value, (bool, np.bool_)):
        return "yes" if value else "no"
    if isinstance(value, (int, np.integer)):
        return f"{value:,}"
    if isinstance(value, (float, np.floating)):
        return f"{value:,.4g}"
    if isinstance(value, np.ndarray) and value.ndim == 1:
        more = "" if len(value) <= MOST_ITEMS else f" … ({len(value)})"
        return "  ".join(f"{v:,.4g}" for v in value[:MOST_ITEMS]) + more
    if isinstance(value, np.ndarray):
        rows = ";  ".join(number(row) for row in value[:MOST_ITEMS])
        return f"{len(value)} rows: {rows}" if len(value) else "–"
    return str(value)


def result_rows(result: WorldResult, teams: Mapping[int, str]) -> list[Row]:
    """Return names and values of the results so far, without scores.

    Args:
        result: The results.
        teams: Number -> name of each team.
    """
    return [
        (
            f"{plugin} {name.replace('_', ' ')}",
            _by_team(value, teams) if isinstance(value, dict) else number(value),
        )
        for plugin, named in result.metrics.items()
        for name, value in named.items()
        if name != "score"
    ]


def _by_team(values: Mapping[Any, Any], teams: Mapping[int, str]) -> str:
    texts = [f"{teams.get(team) or f'team {team}'} {number(value)}" for team, value in values.items()]
    return ", ".join(texts) or "–"


def entity_sections(state: EntityState) -> list[tuple[str, list[Row]]]:
    """Return titles and rows of an entity: body, columns of plugins, messages."""
    body = [(key, reading(r)) for key, r in state.body.items() if key not in ("force", "torque")]
    plugins = [
        (name, [(key, reading(r)) for key, r in columns.items()]) for name, columns in state.plugins.items()
    ]
    letters = [
        (title, [_letter(letter) for letter in said[-MOST_LETTERS:]])
        for title, said in (("heard", state.heard), ("said", state.said))
    ]
    return [("", body), *(section for section in (*plugins, *letters) if section[1])]


def reading(value: Reading) -> str:
    """Format a value with its unit; a unit that all fields share is written once."""
    units = set(value.unit.split())
    unit = value.unit if len(units) > 1 else next(iter(units), "")
    return f"{number(value.value)} {unit}".rstrip()


def _letter(letter: ShownMessage) -> Row:
    fields = "; ".join(f"{name} {number(value)}" for name, value in letter.fields.items())
    return letter.topic, f"{letter.sender or 'world'}: {fields}"
