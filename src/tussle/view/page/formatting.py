"""Formats values of a game for the panels of the page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from tussle.declare import displays
from tussle.declare.units import split_units, unit_of
from tussle.engine.result import WorldResult
from tussle.errors import clipped
from tussle.view.entity import EntityState, Reading, ShownMessage
from tussle.view.feed import TopicTraffic

MAX_ITEMS = 6
"""Largest number of items of a list that are shown."""
MAX_MESSAGES = 8
NARROW = "\N{NO-BREAK SPACE}"
"""Keeps a number with its name and its unit on one line."""
MINUS = "\N{MINUS SIGN}"
Row = tuple[str, str]


def number(value: Any) -> str:
    """Format a number as terminal and reports do, with four digits; of a list the first items."""
    if isinstance(value, (bool, np.bool_)):
        return "yes" if value else "no"
    if isinstance(value, (int, np.integer)):
        return f"{value:,}".replace("-", MINUS)
    if isinstance(value, (float, np.floating)):
        return displays.number(float(value), 4).replace("-", MINUS)
    if isinstance(value, np.ndarray) and value.ndim == 1:
        more = "" if len(value) <= MAX_ITEMS else f" … ({len(value)})"
        return "  ".join(map(number, value[:MAX_ITEMS])) + more
    if isinstance(value, np.ndarray):
        rows = ";  ".join(number(row) for row in value[:MAX_ITEMS])
        return f"{displays.counted(len(value), 'row')}: {rows}" if len(value) else "–"
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
    """Return titles and rows of an entity: body, columns of plugins, what they do before their parameters, and messages."""
    body = [(key, reading(r)) for key, r in state.body.items() if key not in ("force", "torque")]
    plugins = [(name, _column_rows(columns)) for name, columns in state.plugins.items()]
    messages = [
        (title, [_message_row(message) for message in found[-MAX_MESSAGES:]])
        for title, found in (("received", state.received), ("sent", state.sent))
    ]
    return [("", body), *(section for section in (*plugins, *messages) if section[1])]


def _column_rows(columns: Mapping[str, Reading]) -> list[Row]:
    in_order = sorted(columns.items(), key=lambda item: item[1].is_parameter)
    return [(key.replace("_", " "), reading(r)) for key, r in in_order]


def reading(value: Reading) -> str:
    """Format a value in the units of mission files, with the names of its components; a unit that all share is written once."""
    if isinstance(value.value, (str, bool, np.bool_)):
        return number(value.value)
    array = np.asarray(value.value)
    n = max(1, len(value.fields)) if array.ndim != 1 else len(array)
    si = split_units(value.unit, n)
    shown = (
        split_units(value.mission_unit, n) if value.mission_unit else ["deg" if u == "rad" else u for u in si]
    )
    factors = np.array([float(unit_of(unit).factor) for unit in shown])
    numbers = array if (factors == 1.0).all() else array / (factors if array.ndim else factors[0])
    signs, names = [_sign(unit) for unit in shown], _component_names(value.fields)
    is_alike, unit = len(set(signs)) == 1, signs[0]
    if array.ndim != 1 or (not names and is_alike):
        head = f" ({'  '.join(names)})" if names and array.ndim > 1 and len(array) else ""
        return number(numbers[()]).replace(":", f"{head}:", 1) + (
            unit if is_alike and (not array.ndim or len(array)) else ""
        )
    named = [f"{name}{NARROW}" for name in names] or [""] * n
    parts = [
        f"{name}{number(v)}{'' if is_alike else s}" for name, v, s in zip(named, numbers, signs, strict=True)
    ]
    return "  ".join(parts[:MAX_ITEMS]) + (f" … ({n})" if n > MAX_ITEMS else "") + (unit if is_alike else "")


def _sign(unit: str) -> str:
    """A unit as it stands behind a number: "°", " m/s"."""
    return (
        ""
        if unit in ("", "1")
        else unit.replace("deg", "°", 1)
        if unit.startswith("deg")
        else f"{NARROW}{unit}"
    )


def _component_names(fields: Sequence[str]) -> list[str]:
    """Names of components without what all begin with: "velocity_x velocity_y" are "x y"."""
    parts = [name.rpartition("_") for name in fields]
    is_common = len({head for head, _, _ in parts}) == 1 and len(fields) > 1
    return [tail if is_common else name for name, (_, _, tail) in zip(fields, parts, strict=True)]


def feed_rows(topics: Sequence[TopicTraffic]) -> list[tuple[str, int, str]]:
    """Return topic, messages a second and the last message of each."""
    return [(each.topic, each.rate, clipped(_message_row(each.last)[1])) for each in topics]


def _message_row(message: ShownMessage) -> Row:
    fields = "; ".join(f"{name} {number(value)}" for name, value in message.fields.items())
    return message.topic, f"{message.sender or 'world'}: {fields}"
