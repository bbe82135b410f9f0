"""Plays games of a study, in stacks and processes, and keeps what is known of them, so that a study that was stopped goes on."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import reduce
from pathlib import Path
from typing import Any, Self

from tussle.arguments import explained
from tussle.batch import by_value
from tussle.batch.batch import Batch
from tussle.batch.design_points import group_points
from tussle.batch.executors import Executor, InProcess, Processes
from tussle.batch.schemas import SEED
from tussle.batch.store import locked, reported
from tussle.batch.tasks import BatchRun, Finished
from tussle.documents import Document, json_text, read_text
from tussle.errors import BatchError
from tussle.mission import Mission
from tussle.mission.rekeys import BIRTH, Rekey, Rekeys, RekeyTarget, rekeys_text
from tussle.record.run_file import plain, put_whole
from tussle.stress.changes import Change
from tussle.stress.monitor import Verdict, Watching

STUDY_FILE, GAMES_FILE = "stress.json", "games.jsonl"
STUDY = Document(
    "the study",
    1,
    {"fingerprint": str, "name": str, "specification": str, "first_seed": SEED},
    BatchError,
)
"""Fields of `stress.json`."""
MAX_GAMES_FILE = 1 << 32
"""Of the file of games [B]."""
WORTH_PROCESSES = 4.0
"""CPU time of a round [s] below which processes would take longer to start than they save."""


@explained
@dataclass(frozen=True)
class StressGame:
    """One game of a study: what it takes to play it again, beside the mission and its values.

    Attributes:
        seed: Its seed.
        rekeys: Steps from which it has other luck.
        values: Values that are set beside those of all games, (name, value).
        mission: 0 for the mission of the study, 1 for the one that it is compared with.
        change: What the mission lacks, see `tussle.stress.changes`.
    """

    seed: int
    rekeys: Rekeys = ()
    values: tuple[tuple[str, Any], ...] = ()
    mission: int = 0
    change: Change = ()

    @property
    def name(self) -> str:
        """A text that no other game of the study has."""
        values = f"/{json.dumps(self.values)}" if self.values else ""
        change = f"/without {json.dumps(self.change)}" if self.change else ""
        return f"{self.mission}/{self.seed}/{rekeys_text(self.rekeys)}{values}{change}"

    def branch(self, step: int, key: int) -> StressGame:
        """The same game up to the state at the start of a step, and from there on with other luck."""
        return self._with(step, key, [r for r in self.rekeys if r[0] < step or _is_birth(r)])

    def reborn(self, key: int, block: str, number: int) -> StressGame:
        """The same game, in which an entity of a block, from 1, starts elsewhere; what it draws later stays."""
        target = str(RekeyTarget(block, number, BIRTH))
        return self._with(0, key, [r for r in self.rekeys if r[2:] != (target,)], target)

    def _with(self, step: int, key: int, kept: Sequence[Rekey], *target: str) -> StressGame:
        added: Any = (step, key, *target)
        rekeys = tuple(sorted([*kept, added], key=lambda r: (r[0], *r[2:])))
        return StressGame(self.seed, rekeys, self.values, self.mission, self.change)

    def redrawn(self, step: int, key: int, target: str) -> StressGame:
        """The same game, in which the draws of a target alone have another key from a step on."""
        later = [each[0] for each in self.rekeys if each[0] > step and len(each) == 2]
        first = self._with(step, key, self.rekeys, target)
        return reduce(lambda game, each: game._with(each, key, game.rekeys, target), later, first)


def _is_birth(rekey: Rekey) -> bool:
    return len(rekey) == 3 and RekeyTarget.parse(rekey[2]).plugin == BIRTH


@dataclass(frozen=True)
class Played:
    """A game that has been played.

    Attributes:
        game: The game.
        verdict: How far it was from failure.
        t: Its length [s].
        cpu_s: CPU time [s].
        state_hash: Hash of the state at its end.
    """

    game: StressGame
    verdict: Verdict
    t: float
    cpu_s: float
    state_hash: str

    def entry(self) -> dict[str, Any]:
        """As a line of the file of games."""
        return {
            "game": self.game.name,
            "robustness": repr(self.verdict.robustness),
            "steps": self.verdict.steps,
            "levels": list(map(repr, self.verdict.levels)),
            "t": self.t,
            "cpu_s": self.cpu_s,
            "state_hash": self.state_hash,
        }

    @classmethod
    def of_entry(cls, game: StressGame, entry: Mapping[str, Any]) -> Played:
        """The game of a line.

        Raises:
            ValueError: The line has other values; likewise KeyError and TypeError.
        """
        steps, levels = list(map(int, entry["steps"])), list(map(float, entry["levels"]))
        if len(steps) != len(levels) or levels != sorted(set(levels), reverse=True):
            raise ValueError("the levels do not fall at their steps")
        verdict = Verdict(float(entry["robustness"]), steps, levels)
        return cls(game, verdict, float(entry["t"]), float(entry["cpu_s"]), str(entry["state_hash"]))


class Ledger:
    """The directory of a study: what is studied, and each game that has been played, one per line.

    Args:
        path: The directory; made if need be.
        info: What is studied.

    Attributes:
        entries: Name of a game -> its line.

    Raises:
        BatchError: It holds another study or something else, it is damaged, or another process works there.
        RecordError: It cannot be written.
    """

    def __init__(self, path: Path, info: Mapping[str, Any]) -> None:
        self.path = path
        with reported(path):
            path.mkdir(parents=True, exist_ok=True)
            if not (path / STUDY_FILE).exists() and any(p.name != "lock" for p in path.iterdir()):
                raise BatchError(f"{path}: holds something that is no study; choose another directory")
        self._lock = locked(path, "at this study")
        try:
            self._agree(dict(plain(info)))
            self.entries = self._read()
        except BaseException:
            self._lock.close()
            raise

    def _agree(self, info: dict[str, Any]) -> None:
        file = self.path / STUDY_FILE
        if not file.exists():
            with reported(self.path):
                put_whole(file, json_text(info))
            return
        before = STUDY.read(file)
        if before["fingerprint"] != info["fingerprint"]:
            differing = [k for k in info if before.get(k) != info[k] and k != "fingerprint"]
            what = f"in {differing[0]}" if differing else "in the mission or a plugin file"
            raise BatchError(
                f"{self.path}: holds another study, which differs {what}; choose another directory, or remove it"
            )

    def _read(self) -> dict[str, Any]:
        """All games; a line that a killed process has cut is removed."""
        file = self.path / GAMES_FILE
        if not file.exists():
            return {}
        text = read_text(file, BatchError, MAX_GAMES_FILE)
        whole = text[: text.rfind("\n") + 1]
        if whole != text:
            os.truncate(file, len(whole.encode()))
        found = {}
        for number, line in enumerate(whole.splitlines(), 1):
            try:
                entry = json.loads(line)
                Played.of_entry(StressGame(0), entry)
                found[str(entry["game"])] = entry
            except (ValueError, KeyError, TypeError):
                raise BatchError(
                    f"{file}: line {number} is damaged; remove it, and its game is played again"
                ) from None
        return found

    def add(self, played: Played) -> None:
        """Append a game."""
        entry = played.entry()
        self.entries[played.game.name] = entry
        with reported(self.path), (self.path / GAMES_FILE).open("a") as file:
            file.write(json.dumps(entry) + "\n")

    def close(self) -> None:
        """Let other processes work there."""
        self._lock.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class GamePlayer:
    """Plays games and watches a specification; games that are in the ledger are not played again.

    Args:
        batch: The batch whose mission is played by games without values.
        watching: Makes the monitors.
        ledger: Keeps the games; None for memory only.
        executor: Plays; None chooses for each round.
        processes: How many; None is one per core, or none for short rounds.
        stack: Worlds side by side in each.
        on_game: Called after each game that is played.
        missions: Makes the missions of games with values, and of those of another mission.

    Attributes:
        game_s: Length of all games [s], those of the ledger too.
        cpu_s: Their CPU time [s].
    """

    def __init__(
        self,
        batch: Batch,
        watching: Watching,
        ledger: Ledger | None = None,
        executor: Executor | None = None,
        processes: int | None = None,
        stack: int | None = None,
        on_game: Callable[[Played], None] = lambda _: None,
        missions: Callable[[Sequence[StressGame]], Sequence[Mission]] | None = None,
    ) -> None:
        self.batch, self.ledger, self.executor, self.missions = batch, ledger, executor, missions
        self.processes, self.stack, self.on_game = processes, stack, on_game
        self.package = replace(batch.package, watch=by_value.dumps(watching))
        self.game_s = self.cpu_s = 0.0
        self._cost = math.inf  # CPU time of a game of the round before [s]

    def play(self, games: Sequence[StressGame]) -> list[Played]:
        """Play games; equal ones once.

        Raises:
            BatchError: A game has failed with an error.
            TussleError: The mission cannot be played.
        """
        known = {} if self.ledger is None else self.ledger.entries
        found = {game: Played.of_entry(game, known[game.name]) for game in games if game.name in known}
        missing = [game for game in dict.fromkeys(games) if game not in found]
        if missing:
            self._play(missing, found)
        for played in (found[game] for game in dict.fromkeys(games)):
            self.game_s += played.t
            self.cpu_s += played.cpu_s
        return [found[game] for game in games]

    def _play(self, games: Sequence[StressGame], found: dict[StressGame, Played]) -> None:
        points, package = self.batch.design_points * len(games), self.package
        if self.missions is not None and any(game.values or game.mission or game.change for game in games):
            points, grouped = group_points(self.missions(games))
            package = replace(package, missions=grouped.missions)
        runs = [
            BatchRun(i, point.group, game.seed, point.params, game.rekeys)
            for i, (game, point) in enumerate(zip(games, points, strict=True))
        ]
        spent = 0.0
        with closing(self._executor(len(games)).play(package, runs)) as messages:
            for message in messages:
                if not isinstance(message, Finished):
                    continue
                game = games[message.number]
                if message.error:
                    values = "".join(f", {name}={value}" for name, value in game.values)
                    raise BatchError(f"the game with seed {game.seed}{values} failed: {message.error}")
                played = Played(game, message.watched, message.t, message.cpu_s, message.state_hash)
                found[game] = played
                spent += message.cpu_s
                if self.ledger is not None:
                    self.ledger.add(played)
                self.on_game(played)
        self._cost = spent / len(games)

    def _executor(self, n: int) -> Executor:
        """This process for a short round; no result depends on it."""
        if self.executor is not None:
            return self.executor
        if math.isinf(self._cost) and self.processes is None:
            return self.batch.executor(None, self.stack, n)
        if self.processes == 1 or self._cost * n < WORTH_PROCESSES:
            return InProcess(self.stack)
        return Processes(self.processes, self.stack)
