"""`tussle analyze RUN RUN ...`: people who gave orders in recorded games, compared by what they did and by the scores of their games."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import typer
from rich.console import RenderableType
from rich.text import Text

from tussle.batch.schemas import BATCH_FILE
from tussle.batch.statistics import Mean, PairedComparison, mean_of, paired_difference
from tussle.cli.orders import NOBODY, Giver, givers_of, is_run, shown_name
from tussle.cli.tables import Row, estimate, indented, number_tables, title
from tussle.cli.terminal import put, say_note
from tussle.declare.displays import counted
from tussle.errors import ParameterError, RecordError, listed, nearest_name
from tussle.folders import real_path
from tussle.record.run import Run, load_run
from tussle.view.page.access import PageRole

ACTIVITY = ("orders", "orders/min", "first order [s]", "entities")
"""What somebody did in a game, as quantities."""
NOT_RESULTS = ("world", "seed", "team", "end", "steps")
"""Columns of a summary that are no results."""
COMMON = "t"
"""The result that is the same for all teams of a game."""


@dataclass(frozen=True)
class OperatedGame:
    """One world of a recorded run.

    Attributes:
        path: Directory of the run.
        world: Number of the world.
        seed: Its seed.
        condition: Folder in which the run is.
        seconds: How long it took [s].
        results: Team -> result -> value at its end.
        givers: Who gave orders in it.
    """

    path: Path
    world: int
    seed: int
    condition: str
    seconds: float
    results: dict[int, dict[str, float]]
    givers: list[Giver]

    def values(self, givers: Sequence[Giver], team: int | None) -> dict[str, float]:
        """What somebody did, and the results: of their own team, or of each, with its number behind the name.

        Args:
            givers: Who is counted.
            team: The own team; None for none.
        """
        n = sum(giver.names.total() for giver in givers)
        entities = set().union(*(giver.entities for giver in givers))
        first = min(giver.first for giver in givers)
        minutes = self.seconds / 60.0
        activity = (float(n), n / minutes if minutes > 0.0 else math.nan, first, float(len(entities)))
        own = {} if team is None else self.results.get(team, {})
        each = {
            name if name == COMMON else f"{name}[{number}]": value
            for number, row in self.results.items()
            for name, value in row.items()
            if team is None
        }
        return dict(zip(ACTIVITY, activity, strict=True)) | own | each


@dataclass(frozen=True)
class GamePart:
    """A part that an operator, or a condition, has in a game: the game, the own team, and what is measured by name."""

    game: OperatedGame
    team: int | None
    values: dict[str, float]


@dataclass
class OperatorRecord:
    """An operator with all games, or a condition.

    Attributes:
        name: Name of the person, the role of an address without one, or the condition.
        parts: One for each game.
        names: Type of message, or path of a column -> how often it was given.
    """

    name: str
    parts: list[GamePart] = field(default_factory=list)
    names: Counter[str] = field(default_factory=Counter)

    def mean(self, quantity: str) -> Mean:
        """Mean of a quantity over the games; its interval is NaN for fewer than two."""
        return mean_of(quantity, np.array([part.values.get(quantity, math.nan) for part in self.parts]))

    def as_dict(self, quantities: Sequence[str]) -> dict[str, Any]:
        """As JSON, with the means of quantities."""
        means = [mean for mean in map(self.mean, quantities) if mean.n]
        teams = sorted({part.team for part in self.parts if part.team is not None})
        return {
            "name": self.name,
            "games": len(self.parts),
            "teams": teams,
            "names": self.names,
            "means": [asdict(mean) for mean in means],
        }


def is_folder_of_runs(directory: Path) -> bool:
    """Whether a directory, which is neither a run nor a batch, holds recorded runs."""
    return not (directory / BATCH_FILE).exists() and bool(_runs_in(directory))


def _runs_in(folder: Path) -> list[Path]:
    return sorted(filter(is_run, folder.iterdir())) if folder.is_dir() else []


def games_of(directories: Sequence[Path]) -> tuple[str, list[OperatedGame], list[str]]:
    """The name of the mission, and the games of recorded runs and of folders of such, with notes on them.

    Raises:
        ParameterError: A batch or a run is among them that cannot be compared with the others.
        RecordError: A run cannot be read, or is damaged.
    """
    games: list[OperatedGame] = []
    notes: list[str] = []
    first: dict[str, Any] = {}
    seen: dict[Path, Path] = {}
    for directory in directories:
        if (directory / BATCH_FILE).exists():
            raise ParameterError(
                f"{directory} is a batch, which is analyzed alone; the others are recorded runs"
            )
        for path in _runs_in(directory) or [directory]:
            if seen.setdefault(real_path(path), path) is not path:
                raise ParameterError(f"{path} is given twice")
            run = _whole_run(path)
            mission = run.info["mission"]
            _check_mission(path, mission, first)
            if mission != first["mission"]:
                notes.append(f"{path}: the mission has other values than that of {first['path']}")
            notes += [f"{path}: {note}" for note in run.notes]
            games += _games(path, run)
    return str(first["mission"]["name"]), games, notes


def _whole_run(path: Path) -> Run:
    """A run that was closed and has no damage."""
    run = load_run(path, is_mapped=True)
    damage = run.notes[1:] if run.info.get("interrupted") else run.notes
    if damage:
        raise RecordError(f"{path}: {damage[0]}; games are compared when they are whole")
    return run


def _check_mission(path: Path, mission: dict[str, Any], first: dict[str, Any]) -> None:
    """Check that a run has the mission of the first, which is kept in `first`."""
    first.setdefault("path", path)
    was = first.setdefault("mission", mission)
    names = [
        (each["name"], [(block["name"], block["team"]) for block in each["blocks"]])
        for each in (was, mission)
    ]
    if names[0] != names[1]:
        raise ParameterError(
            f"{path} is of another mission ({mission['name']!r}) than {first['path']} ({was['name']!r})"
        )


def _games(path: Path, run: Run) -> list[OperatedGame]:
    """The worlds of a run."""
    start = float(run.info["mission"]["start"])
    rows = run.summary_table.to_pylist()
    found = []
    for world in run.info["worlds"]:
        number = world["world"]
        givers = givers_of(run, number)
        if not givers:
            raise ParameterError(
                f"{path}: nobody gave an order in world {number}; there is nobody to compare"
            )
        results = {row["team"]: _numbers(row) for row in rows if row["world"] == number}
        seconds = float(world["t"]) - start
        found.append(OperatedGame(path, number, world["seed"], str(path.parent), seconds, results, givers))
    return found


def _numbers(row: dict[str, Any]) -> dict[str, float]:
    """The results in a row of a summary."""
    return {
        name: float(value)
        for name, value in row.items()
        if name not in NOT_RESULTS and isinstance(value, (bool, int, float))
    }


def operators_of(games: Sequence[OperatedGame]) -> list[OperatorRecord]:
    """The people who gave orders, in the order of their names, with their games.

    Raises:
        ParameterError: Somebody gave orders in two roles in one game.
    """
    found: dict[str, OperatorRecord] = {}
    for game in games:
        teams = list(game.results)
        for giver in game.givers:
            role = PageRole.of_operator(giver.by)
            name = giver.by if role is None or not role.name else role.name
            team = role.team if role is not None else teams[0] if len(teams) == 1 else None
            player = found.setdefault(name, OperatorRecord(name))
            if player.parts and player.parts[-1].game is game:
                raise ParameterError(
                    f"{game.path}: {shown_name(name)} gave orders in two roles in world {game.world}"
                )
            player.parts.append(GamePart(game, team, game.values([giver], team)))
            player.names += giver.names
    return [found[name] for name in sorted(found)]


def conditions_of(games: Sequence[OperatedGame]) -> list[OperatorRecord]:
    """The conditions, which are the folders in which the runs are; none where there is one only."""
    found: dict[str, OperatorRecord] = {}
    for game in games:
        teams = list(game.results)
        team = teams[0] if len(teams) == 1 else None
        player = found.setdefault(game.condition, OperatorRecord(game.condition))
        player.parts.append(GamePart(game, team, game.values(game.givers, team)))
        for giver in game.givers:
            player.names += giver.names
    return list(found.values()) if len(found) > 1 else []


def quantities_of(players: Sequence[OperatorRecord], asked: Sequence[str]) -> list[str]:
    """The quantities that are measured: what people did, then the results, or those that are asked for.

    Raises:
        ParameterError: There is no such quantity.
    """
    names = dict.fromkeys(name for player in players for part in player.parts for name in part.values)
    for name in asked:
        if name not in names:
            raise ParameterError(f"there is no quantity {name!r}{nearest_name(name, names)}; {listed(names)}")
    return list(asked or names)


def compared(players: Sequence[OperatorRecord], quantities: Sequence[str]) -> list[PairedComparison]:
    """The first player against each other one, paired by seed.

    A game in which both gave orders on one side says nothing of their difference, and is left out.
    """
    found = []
    for other in players[1:]:
        for quantity in quantities:
            a, b = (_by_seed(*pair, quantity) for pair in ((players[0], other), (other, players[0])))
            seeds = sorted(a.keys() & b.keys())
            pairs = (np.array([side[seed] for seed in seeds]) for side in (a, b))
            comparison = paired_difference(quantity, (players[0].name, other.name), *pairs)
            if comparison.n:
                found.append(comparison)
    return found


def _by_seed(player: OperatorRecord, other: OperatorRecord, quantity: str) -> dict[int, float]:
    """Seed -> mean of a quantity over a player's games with it, without those that the other shares on the same side."""
    shared = {id(part.game): part.team for part in other.parts}
    values: dict[int, list[float]] = {}
    for part in player.parts:
        is_shared = id(part.game) in shared and quantity not in ACTIVITY
        is_same = is_shared and (quantity == COMMON or shared[id(part.game)] in (part.team, None))
        value = part.values.get(quantity, math.nan)
        if not is_same and math.isfinite(value):
            values.setdefault(part.game.seed, []).append(value)
    return {seed: float(np.mean(each)) for seed, each in values.items()}


def analyze_operators(directories: Sequence[Path], asked: Sequence[str], as_json: bool) -> None:
    """Compare those who gave orders in recorded games, and print what they did.

    Args:
        directories: Runs, and folders of runs. Runs in different folders are conditions, which are compared, too.
        asked: Quantities; by default all that differ in the games.
        as_json: Print JSON.

    Raises:
        ParameterError: A directory cannot be compared with the others, or there is no such quantity.
        RecordError: A run cannot be read, or is damaged.
    """
    name, games, notes = games_of(directories)
    operators, conditions = operators_of(games), conditions_of(games)
    quantities = quantities_of([*operators, *conditions], asked)
    comparisons = [compared(players, quantities) for players in (operators, conditions)]
    if as_json:
        document = {
            "name": name,
            "games": [_game_entry(game) for game in games],
            "operators": [player.as_dict(quantities) for player in operators],
            "conditions": [player.as_dict(quantities) for player in conditions],
            "comparisons": [asdict(each) for pairs in comparisons for each in pairs],
            "notes": notes,
        }
        typer.echo(json.dumps(_finite(document), indent=1, allow_nan=False))
        return
    n_seeds = len({game.seed for game in games})
    facts = [counted(len(games), "game"), counted(n_seeds, "seed"), counted(len(operators), "operator")]
    parts = [*_tables(operators, quantities, comparisons[0], asked)]
    parts += [*_tables(conditions, quantities, comparisons[1], asked)] if conditions else []
    put("", title(name, " · ".join(facts)), *parts, "")
    for note in notes:
        say_note(note)


def _game_entry(game: OperatedGame) -> dict[str, Any]:
    facts = {"path": str(game.path), "world": game.world, "seed": game.seed, "condition": game.condition}
    return facts | {"seconds": game.seconds, "operators": [giver.by for giver in game.givers]}


def _finite(value: Any) -> Any:
    """The same with None for numbers that are not known."""
    if isinstance(value, dict):
        return {str(key): _finite(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [_finite(inner) for inner in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


# -- tables -----------------------------------------------------------------------------------------------------------------------


def _tables(
    players: Sequence[OperatorRecord],
    quantities: Sequence[str],
    comparisons: Sequence[PairedComparison],
    asked: Sequence[str],
) -> Iterable[RenderableType]:
    """What players did and reached, and how they differ."""
    who = [shown_name(player.name) or NOBODY for player in players]
    rows: list[Row] = [("", ["games", *(f"{len(player.parts)}" for player in players)])]
    shown = [name for name in quantities if asked or name in ACTIVITY or _is_telling(players, name)]
    rows += [
        ("", [shown_name(name), *(_estimate(player.mean(name)) for player in players)]) for name in shown
    ]
    yield _heading("means of a game", "with 95 % intervals")
    yield from number_tables(["", *who], rows)
    kinds = sorted({name for player in players for name in player.names})
    rows = [("", [shown_name(kind), *(f"{p.names[kind] or ''}" for p in players)]) for kind in kinds]
    yield _heading("which orders", "in all games")
    yield from number_tables(["", *who], rows)
    for other in players[1:]:
        pairs = [c for c in comparisons if c.b == other.name and c.quantity in shown]
        if pairs:
            a, b = (shown_name(name) or NOBODY for name in (pairs[0].a, other.name))
            yield _heading(f"{b} against {a}", "paired by seed")
            yield from number_tables(
                ["", "difference", "more", "less", "equal", "p (signs)"], [_row(c) for c in pairs]
            )


def _is_telling(players: Sequence[OperatorRecord], quantity: str) -> bool:
    """Whether a result differs from game to game, and is not the score under another name."""
    name, bracket, team = quantity.partition("[")
    parts = [part for player in players for part in player.parts]
    values = [part.values.get(quantity, math.nan) for part in parts]
    scores = [part.values.get(f"score{bracket}{team}", math.nan) for part in parts]
    return len(set(filter(math.isfinite, values))) > 1 and (name == "score" or values != scores)


def _estimate(mean: Mean) -> str:
    return estimate(mean.value, mean.low, mean.high) if mean.n else ""


def _row(c: PairedComparison) -> Row:
    numbers = (f"{n:,}" for n in (c.n_greater, c.n_less, c.n_equal))
    return "", [shown_name(c.quantity), estimate(c.difference, c.low, c.high), *numbers, f"{c.p:.3f}"]


def _heading(text: str, remark: str) -> RenderableType:
    return indented(Text.assemble((text, "bold cyan"), (f"  {remark}", "dim")))
