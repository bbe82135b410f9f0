"""What the page says in words and numbers, as HTML in which nothing but what is written here is markup."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import Any

import numpy as np

from tussle.engine.result import WorldResult
from tussle.view.entity import EntityState, Letter, Reading
from tussle.view.frame import Frame, Happening
from tussle.view.looks import Colour, Looks
from tussle.view.page.source import Source

MOST_ITEMS = 6
"""Of a list, in a reading or a message."""
MOST_LETTERS = 8
STYLE = "font-size:0.8em;line-height:1.35;padding:0 0.75em 0.4em;overflow-wrap:anywhere"
DIM = "color:#777"


def speed(warp: float) -> str:
    """A ratio to real time: "10 ×", "0.25 ×", "as fast as possible"."""
    return "as fast as possible" if math.isinf(warp) else f"{warp:,.3g} ×"


def number(value: Any) -> str:
    """A value with the digits that count."""
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
        return (
            f"{len(value)} rows: " + ";  ".join(number(row) for row in value[:MOST_ITEMS])
            if len(value)
            else "–"
        )
    return str(value)


def numbers_html(source: Source, frame: Frame, pushed: float, notes: Sequence[str] = ()) -> str:
    """The live numbers: time, warp, entities by team, metrics so far, frames per second."""
    state = "over" if source.is_over else "paused" if source.is_paused else "playing"
    where = f'<span style="{DIM};font-size:0.7em">step {frame.step:,} · {state}</span>'
    reached = f"reached {source.warp_reached:,.3g} × real time"
    parts = [
        f'<div style="{STYLE}">',
        f'<div style="font-size:1.5em;font-variant-numeric:tabular-nums">t = {frame.t:.2f} s {where}</div>',
        f"<div>wanted {speed(source.warp)}, {reached} · {pushed:.0f} frames/s</div>",
        _teams(source.teams, frame, source.looks),
        _result(source.result()),
        _counts(source.happenings, source.span[0], frame.t),
    ]
    if source.error is not None:
        parts.append(f'<div style="color:#b00020">{escape(str(source.error))}</div>')
    parts += [f'<div style="color:#8a5a00">{escape(note)}</div>' for note in (*source.notes, *notes)]
    return "".join([*parts, "</div>"])


def _teams(teams: Mapping[int, str], frame: Frame, looks: Looks) -> str:
    alive = Counter(frame.team.tolist())
    rows = [
        f"<tr><td>{_square(looks.colour(team))}</td><td>team {team}</td>"
        f'<td style="{DIM}">{escape(teams.get(team, ""))}</td><td style="text-align:right">{alive[team]:,}</td></tr>'
        for team in sorted({*teams, *alive})
    ]
    return f'<table style="width:100%;border-spacing:0.3em 0">{"".join(rows)}</table>'


def _square(colour: Colour) -> str:
    red, green, blue = colour
    return f'<span style="color:rgb({red},{green},{blue})">■</span>'


def _result(result: WorldResult | None) -> str:
    if result is None:
        return ""
    rows = [("score", _by_team(result.scores))] if result.scores else []
    for named in result.metrics.values():
        for name, value in named.items():
            if name != "score":
                rows.append(
                    (name.replace("_", " "), _by_team(value) if isinstance(value, dict) else number(value))
                )
    return _table(rows)


def _by_team(values: Mapping[Any, Any]) -> str:
    return ", ".join(f"{team}: {number(value)}" for team, value in values.items()) or "–"


def _counts(happenings: Iterable[Happening], first: float, t: float) -> str:
    """What has happened before a time [s]; those who were there at the beginning were not born."""
    counts = Counter(h.kind for h in happenings if h.t < t and not (h.kind == "birth" and h.t <= first))
    words = [
        f"{counts[k]:,} {k}{'' if counts[k] == 1 else 's'}"
        for k in ("birth", "death", "capture", "collision")
    ]
    return (
        f'<div style="{DIM}">{", ".join(w for w in words if not w.startswith("0 ")) or "no events yet"}</div>'
    )


def _table(rows: Sequence[tuple[str, str]]) -> str:
    if not rows:
        return ""
    cells = [
        f'<tr><td style="{DIM};vertical-align:top;white-space:nowrap;padding-right:0.6em">{escape(name)}</td>'
        f"<td>{escape(text)}</td></tr>"
        for name, text in rows
    ]
    return f'<table style="border-spacing:0">{"".join(cells)}</table>'


# -- one entity -----------------------------------------------------------------------------------------------------------------


def nobody_html() -> str:
    """What stands where nobody is chosen."""
    return f'<div style="{STYLE};{DIM}">Click an entity, or press ← →.</div>'


def gone_html(name: str) -> str:
    """What stands for an entity that is not there."""
    return f'<div style="{STYLE}"><b>{escape(name)}</b> <span style="{DIM}">is not there at this time.</span></div>'


def entity_html(state: EntityState, name: str) -> str:
    """All that is known of an entity: body, plugins' columns, messages."""
    parts = [
        f'<div style="{STYLE}"><b>{escape(name)}</b> <span style="{DIM}">{escape(state.block)}, team {state.team}</span>',
        _table([(key, _reading(r)) for key, r in state.body.items() if key not in ("force", "torque")]),
    ]
    for plugin, columns in state.plugins.items():
        if columns:
            parts.append(f'<div style="margin-top:0.4em"><b>{escape(plugin)}</b></div>')
            parts.append(_table([(key, _reading(r)) for key, r in columns.items()]))
    for title, letters in (("heard", state.heard), ("said", state.said)):
        if letters:
            parts.append(f'<div style="margin-top:0.4em"><b>{title}</b></div>')
            parts.append(_table([_letter(letter) for letter in letters[-MOST_LETTERS:]]))
    return "".join([*parts, "</div>"])


def _reading(reading: Reading) -> str:
    units = set(reading.unit.split())
    unit = reading.unit if len(units) > 1 else next(iter(units), "")
    return f"{number(reading.value)} {unit}".rstrip()


def _letter(letter: Letter) -> tuple[str, str]:
    fields = "; ".join(f"{name} {number(value)}" for name, value in letter.fields.items())
    return letter.topic, f"{'world' if not letter.sender else letter.sender}: {fields}"
