"""`tussle analyze RUN`: the result of a recorded game, and who gave which orders in it."""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import typer
from rich.console import RenderableType
from rich.text import Text

from tussle.cli.summary import game_facts, result_tables
from tussle.cli.tables import Row, fact_list, indented, number_tables, title
from tussle.cli.terminal import put, say_note
from tussle.declare.displays import counted
from tussle.documents import Team
from tussle.engine.result import WorldResult
from tussle.errors import clipped
from tussle.record.input_table import inputs_of
from tussle.record.inputs import ExternalInput
from tussle.record.run import Run, load_run
from tussle.record.schema import RUN_FILE, SUMMARY_FILE, TRAJECTORY_FILE

NOBODY = "(not said)"
"""Shown for inputs of which nobody said who gave them."""
MAX_NAME_SHOWN = 40
"""Characters of a name in a table."""
MAX_ERROR_SHOWN = 400
"""Characters of the error that ended a world."""
MAX_WORLDS = 4
"""Worlds of a recording whose results are shown."""


def is_run(directory: Path) -> bool:
    """Whether a directory is that of a recorded run."""
    return any((directory / name).is_file() for name in (TRAJECTORY_FILE, RUN_FILE))


@dataclass
class Giver:
    """What somebody gave into the game.

    Attributes:
        by: Who.
        first: Time of the first input [s].
        last: Time of the last [s].
        names: Type of message, or path of a column -> how often.
        entities: (world, id) of the entities that messages were for.
    """

    by: str
    first: float
    last: float
    names: Counter[str] = field(default_factory=Counter)
    entities: set[tuple[int, int]] = field(default_factory=set)

    def add(self, world: int, t: float, given: ExternalInput) -> None:
        """Count an input."""
        self.first, self.last = min(self.first, t), max(self.last, t)
        self.names[given.name] += 1
        entity = given.values.get("entity") if isinstance(given.values, dict) else None
        ids = (*given.to, entity) if isinstance(entity, int) else given.to
        self.entities.update((world, who) for who in ids)

    def as_dict(self) -> dict[str, Any]:
        """As JSON."""
        n, entities = self.names.total(), len(self.entities)
        return {
            "by": self.by,
            "orders": n,
            "entities": entities,
            "first": self.first,
            "last": self.last,
            "names": self.names,
        }


def givers_of(run: Run, world: int | None = None) -> list[Giver]:
    """Who gave what in one world of a run, or in all, in the order of the names.

    Raises:
        RecordError: An input is damaged.
    """
    found: dict[str, Giver] = {}
    table = run.inputs_table
    times = dict(zip(table["step"].to_pylist(), table["t"].to_pylist(), strict=True))
    worlds = sorted(set(table["world"].to_pylist())) if world is None else [world]
    for number in worlds:
        for given in inputs_of(table, number):
            t = times[given.step]
            found.setdefault(given.by, Giver(given.by, t, t)).add(number, t, given)
    return [found[by] for by in sorted(found)]


def analyze_run(directory: Path, as_json: bool) -> None:
    """Print the result of a recorded game, and who gave which orders in it.

    Args:
        directory: Directory of the run.
        as_json: Print JSON.

    Raises:
        RecordError: The run cannot be read.
    """
    run = load_run(directory, is_mapped=True)
    givers, name = givers_of(run), str(run.info.get("mission", {}).get("name", "") or directory.name)
    worlds = run.info.get("worlds", [])
    if as_json:
        orders = [giver.as_dict() for giver in givers]
        document = {"name": name, "path": str(directory), "worlds": worlds, "orders": orders}
        typer.echo(json.dumps(document, indent=1))
        return
    n = sum(giver.names.total() for giver in givers)
    orders_given = [f"{counted(n, 'order')} from outside"] if n else []
    mission = recorded_mission(run.info["mission"]) if worlds else {}
    put("", title(clipped(name), *orders_given))
    for world in worlds[:MAX_WORLDS]:
        result = recorded_result(world)
        head = f"world {result.world} · " if len(worlds) > 1 else ""
        put(indented(head + game_facts(result, mission)))
        error = clipped(" ".join((world["error"] or "").split()), MAX_ERROR_SHOWN)
        put(*result_tables(result, mission, [("error", error), ("hash", shown_name(result.state_hash))]))
    put(fact_list([("run", Text(str(directory)))]))
    put(*(_tables(givers) if givers else ()), "")
    if len(worlds) > MAX_WORLDS:
        say_note(f"{counted(len(worlds) - MAX_WORLDS, 'more world')}: {directory / SUMMARY_FILE}")
    for note in run.notes:
        say_note(note)


def recorded_mission(entry: Mapping[str, Any]) -> dict[str, Any]:
    """The mission as `run.json` has it, with names that can be shown."""
    return {**entry, "blocks": [{**block, "name": shown_name(block["name"])} for block in entry["blocks"]]}


def recorded_result(world: Mapping[str, Any]) -> WorldResult:
    """The result of a world as `run.json` has it, with those metrics that are a value or one for each team."""

    def by_team(values: Mapping[str, Any]) -> dict[int, Any]:
        return {int(team): float(n) if isinstance(n, str) else n for team, n in values.items()}

    def shown(value: Any) -> Any:
        return value if isinstance(value, (int, float)) else shown_name(str(value))

    metrics: dict[str, dict[str, Any]] = {}
    named = world.get("metrics")
    for plugin, found in named.items() if isinstance(named, dict) else ():
        for name, value in found.items() if isinstance(found, dict) else ():
            each = value if isinstance(value, dict) else {}
            if all(re.fullmatch(Team, team) for team in each):
                teams = {int(team): shown(one) for team, one in each.items()}
                metrics.setdefault(shown_name(plugin), {})[shown_name(name)] = (
                    teams if isinstance(value, dict) else shown(value)
                )
    return WorldResult(
        world["world"], world["seed"], shown_name(world["end"]), world["steps"], world["t"], by_team(world["alive"]), metrics,
        by_team(world["scores"]), world["state_hash"], born=by_team(world.get("born") or {}), waited=world.get("waited") or 0,
    )  # fmt: skip


def _tables(givers: Sequence[Giver]) -> Iterable[RenderableType]:
    who = [shown_name(giver.by) or NOBODY for giver in givers]
    rows: list[Row] = []
    for by, giver in zip(who, givers, strict=True):
        numbers = (
            f"{giver.names.total():,}",
            f"{len(giver.entities):,}",
            f"{giver.first:.4g}",
            f"{giver.last:.4g}",
        )
        rows.append(("", [by, *numbers]))
    yield indented(Text("who gave orders", "bold cyan"))
    yield from number_tables(["", "orders", "entities", "first [s]", "last [s]"], rows)
    names = sorted({name for giver in givers for name in giver.names})
    counts: list[Row] = [
        ("", [shown_name(name), *(f"{g.names[name] or ''}" for g in givers)]) for name in names
    ]
    yield indented(Text("which", "bold cyan"))
    yield from number_tables(["", *who], counts)


def shown_name(name: str) -> str:
    """A name from a file, on one line and not long."""
    return clipped(" ".join(name.split()), MAX_NAME_SHOWN)
