"""A study of a mission's failures: how often it breaks a specification, in plain games and by splitting."""

from __future__ import annotations

import hashlib
import json
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import asdict
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from tussle.arguments import checked, explained
from tussle.batch import by_value
from tussle.batch.batch import Batch
from tussle.batch.design_points import check_variables, with_whole_numbers
from tussle.batch.points import settings_of
from tussle.batch.statistics import wilson
from tussle.batch.variables import Variable
from tussle.batch.varied import as_variables, variable_entry
from tussle.documents import Whole, check_argument, several
from tussle.engine.simulation import Simulation
from tussle.errors import BatchError, ParameterError, TussleError
from tussle.mission import Mission, to_xml
from tussle.mission.effects import exactly
from tussle.record.run_file import versions
from tussle.stress.blame import blame
from tussle.stress.chances import Chance, chances
from tussle.stress.changes import changed
from tussle.stress.distributions import Distribution, with_distributions
from tussle.stress.estimates import Probability, Sample, worst_first
from tussle.stress.games import GamePlayer, Ledger, Played, StressGame
from tussle.stress.importance import ImportanceEstimate, entry, estimate
from tussle.stress.monitor import Watching
from tussle.stress.results import record_game, write_result, write_why
from tussle.stress.search import FailureSearch, label, search, searcher
from tussle.stress.shrink import MAX_SHRINK_GAMES, SmallestGame, shrink
from tussle.stress.specification import Function, Specification, columns_of
from tussle.stress.splitting import BEFORE, NO_REDRAWS, Redraws, Repetition, interval, split
from tussle.stress.why import Explanation, Why

MANY = 0.5
"""Part of the games that a round of splitting may replace before a note says so."""
MIN_ANCESTORS = 5
MAX_MADE = 4096
"""Missions of games with values that are kept."""


@explained
class Stress:
    """A mission and a specification that its games must keep.

    Methods that play games take `directory`, where they are kept and from where the same study goes on, or None for memory only, and
    `executor`, `processes`, `stack` and `on_game` as of `GamePlayer`. They raise BatchError if a game fails with an error, or if the
    directory holds another study.

    Args:
        mission: A mission file, the name of one that ships, or a `Mission`.
        specification: What must hold: a text as of `Specification.parse`, or a function of the simulation that returns one number per
            world, positive at all steps of a good game.
        functions: Signals that the text calls as name(): functions like that.
        guide: For `probability`: a specification that games break on their way to a failure. Splitting goes by it until it is broken.
        first_seed: Seeds of the games count up from here.
        settings: Values that are set, as for `read_mission` or by path.
        plugin_files: Python files whose plugins the mission file may name.
        ends_by_time: The game ends at its end time whatever the mission says.
        run_timeout: Wall time that a game may take [s], as for `Batch`.
        vary: What `search` varies, as for `Batch`; or distributions for `importance`, as "normal(10, 2)".
        against: Another mission, or values by name: a game fails only if the same game of that mission, with the same seed, does not.
            For `search` only.
        options: Further options of `read_mission`.

    Raises:
        ParameterError: The specification is none, or names what the mission does not have.
        MissionError: The mission cannot be read.
    """

    @checked("specification", "ends_by_time")
    def __init__(
        self,
        mission: str | Path | Mission,
        specification: str | Function,
        *,
        functions: Mapping[str, Function] | None = None,
        guide: str = "",
        first_seed: int = 1,
        settings: Mapping[str, Any] | None = None,
        plugin_files: Sequence[str | Path] = (),
        ends_by_time: bool = False,
        run_timeout: float | None = None,
        vary: Mapping[str, Any] | Iterable[str | Variable | Distribution] = (),
        against: str | Path | Mission | Mapping[str, Any] | None = None,
        **options: Any,
    ) -> None:
        check_argument("first_seed", first_seed, Whole(0, 2**64 - 1))
        self.first_seed = first_seed
        given = dict(settings or {})
        sources = [(mission, given)]
        if isinstance(against, Mapping):
            sources.append((mission, {**given, **against}))
        elif against is not None:
            sources.append((against, given))
        self.batch, *others = (
            Batch(
                source, runs=1, first_seed=first_seed, settings=values, plugin_files=plugin_files,
                ends_by_time=ends_by_time, run_timeout=run_timeout, **options,
            )
            for source, values in sources
        )  # fmt: skip
        self.others = tuple(others)
        self.distributions, others_vary = with_distributions(vary)
        self.variables = tuple(as_variables(others_vary))
        for variable in (*self.variables, *self.distributions):
            if variable.name in given:
                raise ParameterError(f"{variable.name} is set and varies; say one of the two")
        if isinstance(mission, (str, Path)):
            reading = {**options, "plugin_files": several(plugin_files)}
            self.variables = tuple(with_whole_numbers(mission, given, self.variables, **reading))
        self._made: dict[StressGame, Mission] = {}
        self._written: tuple[Path, dict[str, Any]] | None = None  # the result that was written last
        self.watching = Watching(specification, dict(functions or {}), guide)
        self.specification: Specification = self.watching.specification(self.mission)
        self.guide = self.watching.guide(self.mission)

    @property
    def mission(self) -> Mission:
        """The mission."""
        return self.batch.mission

    @cached_property
    def info(self) -> dict[str, Any]:
        """The content of `stress.json`."""
        code = (
            ""
            if isinstance(self.watching.given, str) and not self.watching.functions
            else by_value.dumps(self.watching).hex()
        )
        contents = {
            "tussle": versions()["tussle"],
            "name": self.batch.name,
            "mission": self.batch.info()["mission"],
            "specification": str(self.specification),
            "first_seed": self.first_seed,
        }
        if self.guide is not None:
            contents["guide"] = str(self.guide)
        if self.variables:
            contents["variables"] = list(map(variable_entry, self.variables))
        if self.distributions:
            contents["distributions"] = list(map(asdict, self.distributions))
        if self.others:
            contents["against"] = [self.others[0].info()["mission"], self.others[0].fingerprint]
        text = json.dumps([contents, self.batch.fingerprint, code], default=str)
        return {
            "format": 1,
            "fingerprint": hashlib.blake2b(text.encode(), digest_size=16).hexdigest(),
            **contents,
        }

    def default_directory(self) -> Path:
        """The directory of this study unless another is given; the same for the same study."""
        stem = self.batch.default_directory().name.rpartition("-")[0]
        return Path("stress") / f"{stem}-{self.info['fingerprint'][:8]}"

    def check(self) -> None:
        """Begin a game, and look for the quantities of the specification.

        Raises:
            TussleError: The mission cannot be played.
            ParameterError: A game has no such quantity, or a signal cannot be computed.
        """
        self.batch.check()
        with Simulation(self.mission, self.first_seed) as sim:
            monitor = self.watching(sim)
            sim.step()
            self.specification.check(columns_of(sim.result(is_hashed=False)[0]))
            monitor.finish(0)

    def sample(self, games: int = 1000, directory: str | Path | None = None, **how: Any) -> Sample:
        """Play games, and see how many fail.

        Args:
            games: How many.
        """
        check_argument("games", games, Whole(1, 10**9))
        self._check_plain("sample")
        self.check()
        with self._ledger(directory) as ledger:
            player = self._player(ledger, how)
            played = player.play([StressGame((self.first_seed + i) % 2**64) for i in range(games)])
            n_failed = len([p for p in played if p.verdict.has_failed])
            found = Sample(played, *wilson(n_failed, games))
            self._write(
                ledger,
                found.failures,
                {"games": games, "failed": n_failed, "low": found.low, "high": found.high},
            )
        return found

    def search(
        self,
        games: int = 1000,
        sampler: str = "cmaes",
        per_round: int = 32,
        sample_seed: int = 0,
        failures: int | None = None,
        directory: str | Path | None = None,
        **how: Any,
    ) -> FailureSearch:
        """Search for values and seeds with which games fail; with `against`, while the same game of the other mission does not.

        Args:
            games: How many are played, of each mission.
            sampler: Proposes the values: cmaes, tpe (Optuna), or random.
            per_round: Games that are proposed and played together.
            sample_seed: Seed of what is proposed.
            failures: End after the round in which so many games have failed; None for never.

        Raises:
            BatchError: The mission file has changed meanwhile.
            MissingExtraError: Optuna or cmaes is not installed.
            ParameterError: Nothing varies, no values can be played, or an argument is not allowed.
        """
        check_argument("games", games, Whole(1, 10**6))
        check_argument("per_round", per_round, Whole(4, 10**4))
        check_argument("sample_seed", sample_seed, Whole(0, 2**32 - 1))
        if self.guide is not None:
            raise ParameterError("a guide is for `probability`; a search goes by the specification alone")
        if self.distributions:
            raise ParameterError("a search takes ranges, as 20:30; distributions are for `importance`")
        if not self.variables and not self.others:
            raise ParameterError(
                "nothing varies, so there is nothing to search; vary a value, or use `probability`"
            )
        by = searcher(sampler, self.variables, sample_seed, per_round)
        self.check()
        self._check_effects()
        with self._ledger(directory) as ledger:
            player = self._player(ledger, how)

            def play(games: Sequence[StressGame]) -> list[Played]:
                if any(
                    exactly(b.missions_at([{}])[0]) != exactly(b.mission) for b in (self.batch, *self.others)
                ):
                    raise BatchError(
                        f"{self.batch.name}: the mission has changed during the search; games before are kept"
                    )
                return player.play(games)

            found = search(
                play, self._refusal, self.variables, by, games, math.inf if failures is None else failures,
                self.first_seed, self.mission.steps, bool(self.others),
                lambda failed: blame(self.mission_of(failed.game), failed, self.specification),
            )  # fmt: skip
            tried = {"games": len(found.games), "failed": found.n_failed, "refused": len(found.refused)}
            self._write(ledger, [game.played for game in found.failures], tried)
        return found

    def _refusal(self, values: Mapping[str, Any]) -> str:
        """Why the missions cannot be played with some settings; "" if they can."""
        try:
            for mission in range(1 + len(self.others)):
                self.mission_of(StressGame(0, (), tuple(values.items()), mission))
        except TussleError as error:
            return re.sub(r"^point 0 \(.*?\): ", "", str(error))
        return ""

    def _check_effects(self) -> None:
        """Read the mission file with low, middle and high values, and check that each makes a difference.

        Raises:
            MissionError: A value has no effect.
        """
        if not isinstance(self.batch.source, (str, Path)) or not (self.variables or self.distributions):
            return
        points = [
            settings_of({v.name: v.value_at(share) for v in self.variables}, self.variables)
            | self._settings([2.0 * share - 1.0] * len(self.distributions))
            for share in (0.5, 0.0, 1.0)
        ]
        playable = [point for point in points if not self._refusal(point)]
        if playable:
            check_variables(self.batch.source, self.batch.settings, playable, **self.batch.reading)

    def _check_plain(self, name: str) -> None:
        if self.variables or self.others or self.distributions:
            raise ParameterError(
                f"{name} plays one mission with one set of values; to vary or compare, use `search`, or `importance` for distributions"
            )

    def probability(
        self,
        particles: int = 100,
        repetitions: int = 20,
        replaced: float = 0.25,
        redraws: int = 0,
        directory: str | Path | None = None,
        **how: Any,
    ) -> Probability:
        """Estimate the probability that a game fails by adaptive multilevel splitting.

        Args:
            particles: Games at a time, of each repetition.
            repetitions: Independent repetitions, from which the interval follows.
            replaced: Part of the games that a round replaces.
            redraws: How often, at some levels, each game is tried with another start of a few entities, see `tussle.stress.splitting`.

        Raises:
            ParameterError: The mission has no randomness, or a number is not allowed.
        """
        self._check_plain("probability")
        check_argument("particles", particles, Whole(2, 10**6))
        check_argument("repetitions", repetitions, Whole(2, 10**4))
        check_argument("redraws", redraws, Whole(0, 10**3))
        if not 0.0 < replaced < 1.0:
            raise ParameterError(f"replaced = {replaced!r} is not allowed; it takes a number between 0 and 1")
        self.check()
        with self._ledger(directory) as ledger:
            player = self._player(ledger, how)
            n_replaced = max(1, round(replaced * particles))
            before, moves = list[Repetition](), NO_REDRAWS

            def play(games: Sequence[StressGame]) -> list[Played]:
                is_first, played = player.game_s == 0.0, player.play(games)
                if is_first and len({p.state_hash for p in played}) == 1:
                    raise ParameterError(
                        f"all of {len(games):,} games with different seeds are equal: the mission has no randomness, and nothing is rare"
                    )
                return played

            if redraws:
                starts = [(b.name, i + 1) for b in self.mission.blocks if not b.rate for i in range(b.count)]
                few = max(2, particles // 2)
                before = split(play, few, max(1, round(replaced * few)), [BEFORE], self.first_seed)
                moves = Redraws.of(before[0], starts, redraws)
            found = split(play, particles, n_replaced, range(repetitions), self.first_seed, moves)
            value, low, high = interval([r.probability for r in found])
            if value == 0.0:  # none of the first games failed either
                high = 1.0 - 0.05 ** (1.0 / (particles * repetitions))
            failures = worst_first(p for r in found for p in r.failures)
            result = Probability(
                value, low, high, found, particles, player.game_s, player.cpu_s, failures, before
            )
            result.notes = list(self._notes(result))
            self._write(
                ledger,
                failures,
                {
                    "probability": value, "low": low, "high": high, "particles": particles, "replaced": replaced, "notes": result.notes,
                    "repetitions": [[r.probability, r.n_games, r.n_ancestors, r.levels] for r in found],
                },
            )  # fmt: skip
        return result

    def importance(
        self, games: int = 1000, per_round: int = 400, directory: str | Path | None = None, **how: Any
    ) -> ImportanceEstimate:
        """Estimate the probability that a game fails by importance sampling of values with distributions.

        Args:
            games: Of the last sample, from which the estimate follows.
            per_round: Games of each round before, which seek where failures are.

        Raises:
            ParameterError: A value has no distribution, the mission cannot be played with a value, all games fail or none, or a number is
                not allowed.
        """
        check_argument("games", games, Whole(10, 10**9))
        check_argument("per_round", per_round, Whole(50, 10**6))
        self._check_distributions()
        with self._ledger(directory) as ledger:
            player = self._player(ledger, how)
            last: list[Played] = []

            def robustness_of(u: np.ndarray, first: int) -> np.ndarray:
                values = [tuple(self._settings(row).items()) for row in u.tolist()]
                self._make(values)
                seeds = [(self.first_seed + first + i) % 2**64 for i in range(len(u))]
                games = [StressGame(seed, (), each) for seed, each in zip(seeds, values, strict=True)]
                last[:] = player.play(games)
                return np.array([p.verdict.robustness for p in last])

            found = estimate(robustness_of, len(self.distributions), games, per_round, self.first_seed)
            found.game_s, found.cpu_s = player.game_s, player.cpu_s
            found.failures = worst_first(p for p in last if p.verdict.has_failed)
            self._write(ledger, found.failures, entry(found))
        return found

    def _check_distributions(self) -> None:
        """Check that values vary by distributions, and by nothing else."""
        if self.others:
            raise ParameterError("importance sampling is of one mission; to compare two, use `search`")
        for variable in self.variables:
            raise ParameterError(
                f"{variable.name} varies without a distribution; write {variable.name}=normal(10, 2), lognormal(10, 0.2) or uniform(5, 15)"
            )
        if not self.distributions:
            raise ParameterError(
                "nothing varies; vary values with distributions, as prey.Boids.max_speed=normal(10, 2)"
            )
        self.check()
        self._check_effects()

    def _make(self, values: Sequence[tuple[tuple[str, Any], ...]]) -> None:
        """Make the missions of games with values together, which is faster than one by one.

        Raises:
            ParameterError: One cannot be played.
        """
        try:
            missions = self.batch.missions_at([dict(each) for each in values])
        except TussleError:
            for each in values:
                if error := self._refusal(dict(each)):
                    raise ParameterError(
                        f"with {label(dict(each))} the mission cannot be played: {error}; choose a distribution without such values"
                    ) from None
            raise
        self._made = {
            StressGame(0, (), each): mission for each, mission in zip(values, missions, strict=True)
        }

    def _settings(self, u: Sequence[float]) -> dict[str, Any]:
        """Settings at standard normal numbers."""
        return {d.name: d.setting(d.value_at(x)) for d, x in zip(self.distributions, u, strict=True)}

    def chances(
        self,
        failed: Played,
        moments: int = 9,
        branches: int = 50,
        directory: str | Path | None = None,
        **how: Any,
    ) -> list[Chance]:
        """How likely the failure of a game was from moments on: each the start of branches that repeat the game and then have other luck.

        Args:
            failed: A game of this study that failed.
            moments: Moments, evenly spread from the start of the game to its failure.
            branches: Branches from each.

        Raises:
            ParameterError: The game did not fail, or a number is not allowed.
        """
        check_argument("moments", moments, Whole(2, 10**4))
        check_argument("branches", branches, Whole(1, 10**6))
        with self._ledger(directory) as ledger:
            player = self._player(ledger, how)
            return chances(player.play, failed, moments, branches)

    def why(
        self,
        failed: Played,
        moments: int = 9,
        branches: int = 50,
        directory: str | Path | None = None,
        **how: Any,
    ) -> Why:
        """Why a game failed: what undoes its failure, when it was decided, and the nearest game that passes.

        Args:
            failed: A game of this study that failed.
            moments: Moments of the overview, as of `chances`.
            branches: Games of each row, and from each moment.
            directory: Where games are kept, and the result is added to that of `sample`, `probability` or `search`, with the nearest
                passing game as `failures/N-saved.xml` and recordings of both; None keeps them in memory.

        Raises:
            ParameterError: The game did not fail, or a number is not allowed.
        """
        check_argument("moments", moments, Whole(2, 10**4))
        check_argument("branches", branches, Whole(2, 10**6))
        with self._ledger(directory) as ledger:
            player = self._player(ledger, how)
            mission = self.mission_of(failed.game)
            explanation = Explanation(player.play, failed, mission, self.watching, self.mission_of, branches)
            found = explanation.find(moments)
            if ledger is not None and self._written is not None and self._written[0] == ledger.path:
                write_why(*self._written, found, self.failing_mission, self._record)
        return found

    def smallest(self, failed: Played, max_games: int = MAX_SHRINK_GAMES) -> SmallestGame:
        """A small game that fails, from one of this study: fewer entities, blocks and plugins, shorter, with rounder numbers.

        Args:
            failed: A game of this study that failed.
            max_games: Games to play at most.

        Raises:
            ParameterError: The game did not fail, or the number is not allowed.
        """
        check_argument("max_games", max_games, Whole(1, 10**6))
        return shrink(self.mission_of(failed.game), failed, self.watching, max_games)

    def _notes(self, found: Probability) -> list[str]:
        repetitions, n = found.repetitions, len(found.repetitions)
        extinct = [r for r in repetitions if r.is_extinct]
        notes = []
        if not (self.guide or self.specification).can_guide:
            notes.append(
                "nothing is known of this specification before a game ends, so splitting cannot tell good games from better ones; "
                "it needs a condition under always"
            )
        if len(extinct) == n:
            notes.append(
                f"no game failed in any repetition; the upper end is that of the {n * found.n:,} games at the start alone"
            )
        elif extinct:
            notes.append(
                f"{len(extinct)} of {n} repetitions died out before a failure; more --particles make the result surer"
            )
        jumps = [r for r in repetitions if any(share > MANY for share in r.shares)]
        if len(jumps) > n // 2:
            notes.append(
                f"in {len(jumps)} of {n} repetitions a round replaced more than half of the games at once: many come equally near, "
                "and branches do not come nearer by other luck"
            )
        ancestors = [r.n_ancestors for r in repetitions if not r.is_extinct]
        if ancestors and np.median(ancestors) < MIN_ANCESTORS and not found.before:
            notes.append(
                f"the failing games of a repetition descend from {np.median(ancestors):.0f} of its {found.n} first games: what is decided "
                "at the start of a game is seen through few of them; --redraws tries other starts, more --particles make the result surer"
            )
        return notes

    def _ledger(self, directory: str | Path | None) -> Any:
        return nullcontext() if directory is None else Ledger(Path(directory), self.info)

    def _player(self, ledger: Ledger | None, how: Mapping[str, Any]) -> GamePlayer:
        return GamePlayer(
            self.batch, self.watching, ledger, missions=lambda games: list(map(self.mission_of, games)), **how
        )

    def mission_of(self, game: StressGame) -> Mission:
        """The mission of a game, with its values.

        Raises:
            TussleError: It cannot be played with them.
        """
        batch = (self.batch, *self.others)[game.mission]
        if not game.values and not game.change:
            return batch.mission
        key = StressGame(0, (), game.values, game.mission, game.change)
        if key not in self._made:
            if len(self._made) >= MAX_MADE:
                self._made.clear()
            mission = batch.missions_at([dict(game.values)])[0] if game.values else batch.mission
            self._made[key] = changed(mission, game.change) if game.change else mission
        return self._made[key]

    def failing_mission(self, game: StressGame) -> str:
        """A mission file that plays a game again, with its seed and its luck."""
        return to_xml(self.mission_of(game).replace(rekeys=game.rekeys), game.seed)

    def _record(self, game: StressGame, directory: Path) -> None:
        mission = self.mission_of(game).replace(rekeys=game.rekeys)
        files = () if self.batch.loaded is None else self.batch.loaded.plugin_files
        record_game(mission, game.seed, self.specification, files, directory)

    def _write(self, ledger: Ledger | None, failures: Sequence[Played], result: Mapping[str, Any]) -> None:
        """Write the result, and the worst failures as missions."""
        if ledger is not None:
            whole = write_result(ledger.path, failures, result, self.failing_mission)
            self._written = ledger.path, whole
