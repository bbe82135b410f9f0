"""Formats values of a game for the panels of the page."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from tussle.declare import displays
from tussle.declare.displays import counted, shortened
from tussle.declare.units import split_units, unit_of
from tussle.engine.result import WorldResult
from tussle.errors import clipped
from tussle.mission import Mission
from tussle.mission.paths import values_of
from tussle.record.event_texts import end_text
from tussle.view.entity import EntityState, Reading, ShownMessage
from tussle.view.feed import TopicTraffic
from tussle.view.recording import Recording

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


LEFT_OUT = "run.blocks", "run.scene", "run.limits", "run.name"


def differing_settings(a: Recording, b: Recording) -> list[tuple[str, str, str]]:
    """Return the settings that differ between two runs: path, value of the first, value of the second; "–" where one has no such setting.

    They are those of the missions where both can be read, else those that `run.json` lists.
    """
    one, other = a.mission, b.mission
    if one is not None and other is not None:
        settings = [{**_played(a), **_of_mission(one)}, {**_played(b), **_of_mission(other)}]
    else:
        settings = [{**_played(run), **_listed(run)} for run in (a, b)]
    paths = dict.fromkeys([*settings[0], *settings[1]])
    pairs = [(path, settings[0].get(path, "–"), settings[1].get(path, "–")) for path in paths]
    return [(path, x, y) for path, x, y in pairs if x != y]


def _played(run: Recording) -> dict[str, str]:
    """Seed, and the version that played it."""
    info, worlds = run.run.info, run.run.info.get("worlds", [])
    found = {"seed": str(worlds[run.world]["seed"])} if run.world < len(worlds) else {}
    version = info.get("versions", {}).get("tussle")
    return found | ({"tussle": str(version)} if version else {})


def _of_mission(mission: Mission) -> dict[str, str]:
    """Every value of a mission by its path, as text."""
    return {path: _text(value) for path, value in values_of(mission).items() if path not in LEFT_OUT}


def _text(value: Any) -> str:
    """A value in SI units, or the name of a class."""
    if isinstance(value, type):
        return value.__name__
    if isinstance(value, tuple):
        return " ".join(_text(each) for each in value)
    return "none" if value is None else number(value)


def _listed(run: Recording) -> dict[str, str]:
    """What `run.json` says of the mission."""
    said = run.run.info.get("mission", {})
    found = {
        f"run.{name}": _text(value) for name, value in said.items() if isinstance(value, (int, float, str))
    }
    for block in said.get("blocks", []):
        found |= {f"{block['name']}.{name}": str(block[name]) for name in ("team", "count")}
        found |= {f"{block['name']}.{plugin.partition('(')[0]}": plugin for plugin in block["plugins"]}
    return found | {plugin.partition("(")[0]: plugin for plugin in said.get("world_plugins", [])}


MAX_BLOCKS = 20
"""Blocks that are listed."""
MAX_LENGTH = 400
"""Largest number of characters in the list of a block's plugins."""
Fact = tuple[str, str]


def mission_facts(mission: Mapping[str, Any], teams: Mapping[int, str]) -> list[Fact]:
    """Return names and values of what a mission is.

    Args:
        mission: The mission as `run.json` has it, see `tussle.record.run_file.mission_entry`.
        teams: Number and name of each team.
    """
    facts = [("Mission", str(mission["name"]) or "–"), ("Step", f"{mission['dt']:g} s")]
    if end := _end(mission):
        facts.append(("End", end))
    blocks = mission["blocks"]
    for team, name in teams.items():
        n = sum(block.get("count") or 0 for block in blocks if block["team"] == team)
        facts.append((f"Team {team}", f"{name}: {counted(n, 'entity', 'entities')}" if n else name))
    facts += [(f"Plugins of {block['name']}", _plugins(block["plugins"])) for block in blocks[:MAX_BLOCKS]]
    if len(blocks) > MAX_BLOCKS:
        facts.append(("Plugins", f"of {counted(len(blocks) - MAX_BLOCKS, 'more block')} are not listed"))
    if world := mission.get("world_plugins"):
        facts.append(("Plugins of the world", _plugins(world)))
    return facts


def _plugins(texts: Iterable[str]) -> str:
    return shortened(", ".join(text.partition("(")[0] for text in texts), MAX_LENGTH)


def _end(mission: Mapping[str, Any]) -> str:
    """What ends the game: "500 s, one team is left"."""
    end = float(mission.get("end") or math.inf)
    conditions = mission.get("end_conditions") or ()
    parts = [
        f"{end:g} s" if c == "time" else end_text(c) for c in conditions if c != "time" or math.isfinite(end)
    ]
    return ", or ".join(parts)
