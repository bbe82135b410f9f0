"""Summary of a game: teams, metrics, end condition, speed and state hash."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.console import RenderableType
from rich.padding import Padding
from rich.text import Text

from tussle.cli.progress import times
from tussle.cli.tables import Cell, fact_list, number_tables, title
from tussle.cli.terminal import put
from tussle.declare.displays import number
from tussle.engine.result import WorldResult
from tussle.engine.simulation import Simulation
from tussle.record.event_texts import end_text
from tussle.record.run_file import mission_entry


class Speed:
    """Duration and speed of a game.

    Args:
        process_began: `time.perf_counter` at the start of reading the mission [s].
    """

    def __init__(self, process_began: float) -> None:
        self._process_began = process_began
        self.preparation = self.wall = self.cpu = self.played = 0.0
        self._wall_began = self._cpu_began = self._t_began = 0.0

    def begin(self, t: float) -> None:
        """Start the measurement at simulation time t [s]."""
        self._wall_began, self._cpu_began, self._t_began = time.perf_counter(), time.process_time(), t
        self.preparation = self._wall_began - self._process_began

    def end(self, t: float) -> None:
        """End the measurement at simulation time t [s]."""
        self.wall = time.perf_counter() - self._wall_began
        self.cpu = time.process_time() - self._cpu_began
        self.played = t - self._t_began

    def __str__(self) -> str:
        ready = f"ready after {self.preparation:.1f} s"
        if self.wall <= 0.0 or self.played <= 0.0:
            return ready
        return (
            f"{times(self.played / self.wall)} × real time ({self.wall:.2f} s, {self.cpu:.2f} CPU s), {ready}"
        )


def show_summary(simulation: Simulation, name: str, speed: Speed, directory: Path | None) -> None:
    """Print the result of world 0 of a simulation."""
    result, mission = simulation.result()[0], mission_entry(simulation.mission)
    facts: list[tuple[str, Cell]] = [
        ("speed", str(speed)),
        ("grade", simulation.grade),
        ("hash", result.state_hash),
        ("run", Text(str(directory)) if directory is not None else "not recorded (--no-log)"),
    ]
    head = title(mission["name"] or name, game_facts(result, mission))
    put("", head, *result_tables(result, mission, facts), "")


def game_facts(result: WorldResult, mission: Mapping[str, Any]) -> str:
    """Seed, entities and steps of a game on one line. The mission is as `run.json` has it."""
    n = sum(block["count"] or 0 for block in mission["blocks"])
    entities, steps = "entity" if n == 1 else "entities", "step" if result.steps == 1 else "steps"
    return f"seed {result.seed} · {n} {entities} · {result.steps} {steps} of {mission['dt']:g} s"


def result_tables(
    result: WorldResult, mission: Mapping[str, Any], facts: Sequence[tuple[str, Cell]]
) -> Iterator[RenderableType]:
    """Yield the result of a world: teams, networks that lose messages, and why it ended, with further facts.

    Args:
        result: The result.
        mission: The mission as `run.json` has it.
        facts: Names and values that stand at the end of the list of facts.
    """
    networks = mission.get("networks") or ()
    of_world = (
        (plugin, f"{key} {_number(value)}")
        for plugin, named in result.metrics.items()
        for key, value in named.items()
        if not isinstance(value, dict) and plugin not in networks
    )
    waited = [("births", f"{result.waited} waited for a free position")] if result.waited else []
    ended = ("ended", f"{end_text(result.end)}, at t = {result.t:g} s")
    yield from team_tables(result, mission["blocks"])
    yield from network_tables(result, networks)
    yield fact_list([ended, *waited, *of_world, *facts])


def team_tables(result: WorldResult, blocks: Sequence[Mapping[str, Any]]) -> list[Padding]:
    """Return tables of the teams: names, number of entities that were born and of those left, metrics, score.

    Args:
        result: The result; of recordings by former versions it does not know the births, and the table does without.
        blocks: Blocks of the mission as `run.json` has them.
    """
    columns, has_scores = list(_team_columns(result)), bool(result.scores)
    planned = {team: sum(b["count"] or 0 for b in blocks if b["team"] == team) for team in result.alive}
    comes_later = any(b.get("rate") for b in blocks) or result.born != planned
    head = [
        "team",
        *(["born" if comes_later else "start"] if result.born else []),
        "left",
        *(name for name, _ in columns),
        *(["score", ""] if has_scores else []),
    ]
    rows = []
    for team in sorted(result.alive):
        names = ", ".join(dict.fromkeys(b["name"] for b in blocks if b["team"] == team))
        cells = [f"{team} {names}"]
        if result.born:
            born, of = result.born.get(team, 0), planned[team]
            cells.append(f"{born} of {of}" if born < of else str(born))
        cells.append(str(result.alive[team]))
        cells += [_number(values.get(team, "")) for _, values in columns]
        if has_scores:
            cells += [_number(result.scores.get(team, 0.0)), "won" if team == result.winner else ""]
        rows.append(("green" if team == result.winner else "", cells))
    return number_tables(head, rows)


def network_tables(result: WorldResult, networks: Sequence[str]) -> list[Padding]:
    """Return tables of networks that lose messages: messages to others within reach, those delivered, and lost for each reason."""
    counts = {name: result.metrics[name] for name in networks if name in result.metrics}
    lost = dict.fromkeys(
        k for found in counts.values() for k, n in found.items() if k.startswith("lost_") and n
    )
    columns = ["sent", "delivered", *lost]
    rows = [("", [name, *(str(found.get(k, "")) for k in columns)]) for name, found in counts.items()]
    return number_tables(["network", *(k.replace("_", " ") for k in columns)], rows) if rows else []


def _team_columns(result: WorldResult) -> Iterator[tuple[str, dict[int, Any]]]:
    """Yield column name and values of each metric per team, except for the scores, which have their own column."""
    found = [
        (plugin, name, values)
        for plugin, named in result.metrics.items()
        for name, values in named.items()
        if isinstance(values, dict) and name != "score"
    ]
    names = [name for _, name, _ in found]
    for plugin, name, values in found:
        yield name if names.count(name) == 1 else f"{plugin}.{name}", values


def _number(value: Any) -> str:
    return f"{value:,}" if isinstance(value, int) and not isinstance(value, bool) else number(value)
