"""Summary of a game: teams, metrics, end condition, speed and state hash."""

from __future__ import annotations

import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from rich import box
from rich.table import Table
from rich.text import Text

from tussle.cli.progress import times
from tussle.cli.terminal import put
from tussle.engine.result import WorldResult
from tussle.engine.simulation import Simulation
from tussle.mission import Mission

ENDS = {
    "time": "end time reached",
    "one_team": "one team is left",
    "all_dead": "no entity is left",
    "error": "a plugin failed",
    "": "interrupted",
}


class Speed:
    """Duration and speed of a game.

    Args:
        process_began: `time.perf_counter` at the start of reading the mission [s].
    """

    def __init__(self, process_began: float) -> None:
        self._process_began = process_began
        self.preparation = self.wall = self.cpu = self.played = 0.0
        self.wall_began = self._cpu_began = self._t_began = 0.0

    def begin(self, t: float) -> None:
        """Start the measurement at simulation time t [s]."""
        self.wall_began, self._cpu_began, self._t_began = time.perf_counter(), time.process_time(), t
        self.preparation = self.wall_began - self._process_began

    def end(self, t: float) -> None:
        """End the measurement at simulation time t [s]."""
        self.wall = time.perf_counter() - self.wall_began
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
    result, mission = simulation.result()[0], simulation.mission
    n = sum(block.count for block in mission.blocks)
    title = mission.name or name
    facts = f"seed {result.seed} · {n} entities · {result.steps} steps of {mission.dt:g} s"
    put(
        "",
        Text.assemble(" ", (title, "bold"), (f"\n {facts}", "dim")),
        teams_table(result, mission),
        _facts(simulation, result, speed, directory),
        "",
    )


def teams_table(result: WorldResult, mission: Mission) -> Table:
    """Build the table of teams: names, number of entities at start and end, metrics."""
    columns = list(_team_columns(result))
    table = Table(box=box.SIMPLE_HEAD, header_style="bold", pad_edge=False, padding=(0, 1))
    table.add_column(" team", overflow="fold")
    table.add_column("start", justify="right")
    table.add_column("left", justify="right")
    for _, short, _ in columns:
        table.add_column(short, justify="right", overflow="fold")
    if result.scores:
        table.add_column("score", justify="right", style="bold")
        table.add_column("")
    for team in sorted(result.alive):
        blocks = [b for b in mission.blocks if b.team == team]
        names = ", ".join(dict.fromkeys(b.name for b in blocks))
        cells = [f" {team} {names}", str(sum(b.count for b in blocks)), str(result.alive[team])]
        cells += [_number(values.get(team, "")) for _, _, values in columns]
        if result.scores:
            cells += [_number(result.scores.get(team, 0.0)), "won" if team == result.winner else ""]
        table.add_row(*cells, style="green" if team == result.winner else "")
    return table


def _team_columns(result: WorldResult) -> Iterable[tuple[str, str, dict[int, Any]]]:
    """Yield plugin, column name and values of each metric per team, except for the scores, which have their own column."""
    found = [
        (plugin, name, values)
        for plugin, named in result.metrics.items()
        for name, values in named.items()
        if isinstance(values, dict) and name != "score"
    ]
    names = [name for _, name, _ in found]
    for plugin, name, values in found:
        yield plugin, name if names.count(name) == 1 else f"{plugin}.{name}", values


def _facts(simulation: Simulation, result: WorldResult, speed: Speed, directory: Path | None) -> Table:
    grid = Table.grid(padding=(0, 2))
    grid.add_column(style="dim", no_wrap=True)
    grid.add_column(overflow="fold")
    why = ENDS.get(result.end, result.end)
    grid.add_row(" ended", f"{why}, at t = {result.t:g} s")
    for plugin, named in result.metrics.items():
        for name, value in named.items():
            if not isinstance(value, dict):
                grid.add_row(f" {plugin}", f"{name} {_number(value)}")
    grid.add_row(" speed", str(speed))
    grid.add_row(" grade", simulation.grade)
    grid.add_row(" hash", result.state_hash)
    grid.add_row(" run", str(directory) if directory is not None else "not recorded (--no-log)")
    return grid


def _number(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, (int, float)) else str(value)
