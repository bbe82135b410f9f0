"""Why a game failed: what undoes the failure, by branches in which one thing is other than it was, and when it was decided."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tussle.batch.statistics import wilson
from tussle.engine.simulation import Simulation
from tussle.errors import BatchError, TussleError
from tussle.mission import Mission
from tussle.mission.rekeys import RekeyTarget
from tussle.numeric.rng import stream_key
from tussle.stress.chances import Chance, branches_from, chances
from tussle.stress.changes import Change, removable
from tussle.stress.games import Played, StressGame
from tussle.stress.monitor import Watching
from tussle.stress.shrink import play

Play = Callable[[Sequence[StressGame]], list[Played]]

FEW, MANY = 0.25, 0.95
"""Parts of the branches from a moment that fail: up to the first, the failure is open; from the second on, the game is lost."""
UNDONE = 0.5
"""A change undoes a failure if the whole interval of the part of games that still fail is below this."""
MAX_WHO = 24
"""Entities of the blocks that matter of which each is looked at alone; with more, the first ones."""
MAX_STREAMS = 48
"""Random streams that are looked at."""


@dataclass(frozen=True)
class Counterfactual(Chance):
    """Games in which one thing is other than in a failing game.

    Attributes:
        kind: "luck": the draws of a block, entity, plugin or label are other from `step` on, those of all others stay. "entity": a block or
            entity is not there; "plugin": a fault does not happen, or a plugin is left out; "messages": those of a network reach all, or
            none. These three hold from the beginning of the game, which has the same draws up to `step` and then other ones.
        name: What is other.
    """

    kind: str
    name: str

    @property
    def undoes(self) -> bool:
        """Most of these games do not fail, with 95 % confidence."""
        return self.high < UNDONE


@dataclass(frozen=True)
class Why:
    """Why and when a game failed.

    Attributes:
        failed: The game.
        chances: How likely its failure was from moments on.
        open_step: The last moment from which at most a quarter of the branches fail; None if more fail from the beginning on.
        lost_step: The first moment after it from which at least 95 % fail.
        saved: The branch that passes and is the same game for longest; None if all fail.
        rows: What was changed, and what came of it.
    """

    failed: Played
    chances: list[Chance]
    open_step: int | None
    lost_step: int
    saved: Played | None
    rows: list[Counterfactual]

    @property
    def saved_step(self) -> int | None:
        """The last moment at which the game could still be saved, as far as branches show."""
        return None if self.saved is None else self.saved.game.rekeys[-1][0]

    @property
    def causes(self) -> list[str]:
        """What undoes the failure: luck, faults and messages, as "luck left/2", each once."""
        found = [f"{row.kind} {row.name}" for row in self.rows if row.undoes and row.kind != "entity"]
        return list(dict.fromkeys(found))

    @property
    def needed(self) -> list[str]:
        """Blocks and entities without which the game does not fail, as those between which a distance was too small."""
        return [row.name for row in self.rows if row.undoes and row.kind == "entity"]

    def entry(self) -> dict[str, Any]:
        """As in `result.json`."""
        return {
            "state_hash": self.failed.state_hash,
            "chances": [vars(each) for each in self.chances],
            "open_step": self.open_step,
            "lost_step": self.lost_step,
            "saved_step": self.saved_step,
            "rows": [vars(each) for each in self.rows],
        }


class Explanation:
    """Looks for what undoes a failure.

    Args:
        play: Plays games.
        failed: The game that failed.
        mission: Its mission.
        watching: The specification.
        made: Returns the mission of a game.
        branches: Games of each row, and from each moment.
    """

    def __init__(
        self,
        play: Play,
        failed: Played,
        mission: Mission,
        watching: Watching,
        made: Callable[[StressGame], Mission],
        branches: int,
    ) -> None:
        self._play, self._failed, self._mission = play, failed, mission
        self._watching, self._made, self._n = watching, made, branches
        self._from: dict[int, list[Played]] = {}

    def find(self, moments: int) -> Why:
        """Answer when and why.

        Args:
            moments: Moments of which the first overview is made.

        Raises:
            ParameterError: The game did not fail.
        """
        seen = chances(self._play, self._failed, moments, self._n)
        steps = [each.step for each in seen]
        opened = self._last(steps, lambda n_failed: n_failed <= FEW * self._n)
        later = steps if opened is None else [opened, *(step for step in steps if step > opened)]
        undecided = self._last(later, lambda n_failed: n_failed < MANY * self._n)
        lost = 0 if undecided is None else undecided + 1
        saving = self._last(steps, lambda n_failed: n_failed < self._n)
        saved = None
        if saving is not None:
            saved = next(p for p in self._branches(saving) if not p.verdict.has_failed)
        draws, networks = self._traced()
        rows = [*self._luck(opened, draws), *self._changes(lost, networks)]
        return Why(self._failed, seen, opened, lost, saved, rows)

    def _branches(self, step: int) -> list[Played]:
        """Branches from a moment with other luck of all, the same as of `chances`."""
        if step not in self._from:
            self._from[step] = self._play(branches_from(self._failed.game, step, self._n))
        return self._from[step]

    def _last(self, steps: Sequence[int], is_so: Callable[[int], bool]) -> int | None:
        """The last step at which something is so of the number of branches that fail, to one step; None if it is at none of the steps.

        Between the last of the given steps at which it is so and the next one, by bisection: as if it did not come back.
        """

        def is_at(step: int) -> bool:
            return is_so(sum(p.verdict.has_failed for p in self._branches(step)))

        place = next((i for i in reversed(range(len(steps))) if is_at(steps[i])), None)
        if place is None or place + 1 == len(steps):
            return None if place is None else steps[place]
        low, high = steps[place], steps[place + 1]
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (middle, high) if is_at(middle) else (low, middle)
        return low

    # -- other luck of some -----------------------------------------------------------------------------------------------------------

    def _luck(self, opened: int | None, draws: Sequence[RekeyTarget]) -> list[Counterfactual]:
        """Other luck of blocks and of the entities of those that matter, from the beginning and the last open moment; of streams."""
        steps = sorted({0, opened or 0})
        blocks = self._mission.blocks
        drawing = {target.owner for target in draws}
        by_id = any(
            target.owner not in [b.name for b in blocks] for target in draws
        )  # keyed by entities, perhaps
        of_blocks = self._redrawn([RekeyTarget(b.name) for b in blocks if by_id or b.name in drawing], steps)
        matters = {row.name for row in of_blocks if row.n_failed < row.n}
        who = [
            RekeyTarget(b.name, i + 1)
            for b in blocks
            if b.count > 1 and b.name in matters
            for i in range(b.count)
        ]
        return [
            *of_blocks,
            *self._redrawn(who[:MAX_WHO], steps),
            *self._redrawn(draws[:MAX_STREAMS], steps[-1:]),
        ]

    def _traced(self) -> tuple[list[RekeyTarget], set[str]]:
        """The random streams that the game draws from, by block and world plugin, and the networks on which somebody listens."""
        game = self._failed.game
        with Simulation(self._made(game).replace(rekeys=game.rekeys), game.seed) as sim:
            sim.run()
            drawn = sorted(sim.state.context.streams)
            networks = {topic.network for topic in sim.state.message_bus.topics.values() if topic.inboxes}
        of_blocks, of_world = self._mission.draws
        found = [
            RekeyTarget(block, 0, plugin, label)
            for plugin, label in drawn
            for block in of_blocks
            if plugin in of_blocks[block]
        ]
        return found + [
            RekeyTarget(plugin, 0, "", label) for plugin, label in drawn if plugin in of_world
        ], networks

    def _redrawn(self, targets: Iterable[RekeyTarget], steps: Sequence[int]) -> list[Counterfactual]:
        game = self._failed.game
        asked = [
            (
                ("luck", str(target), step),
                [
                    game.redrawn(
                        step, stream_key("stress", "luck", f"{game.name} {step} {target} {i}"), str(target)
                    )
                    for i in range(self._n)
                ],
            )
            for target in targets
            for step in steps
        ]
        return self._rows(asked)

    # -- without some -----------------------------------------------------------------------------------------------------------------

    def _changes(self, lost: int, networks: Collection[str]) -> list[Counterfactual]:
        """The game without blocks, entities of those that matter, plugins and messages."""
        blocks = [b for b in self._mission.blocks if b.count]
        of_blocks = self._without([("entity", b.name, "0") for b in blocks], lost)
        matters = {row.name for row in of_blocks if row.high < MANY}
        who = [
            ("entity", b.name, str(i + 1))
            for b in blocks
            if b.count > 1 and b.name in matters
            for i in range(b.count)
        ]
        return [
            *of_blocks,
            *self._without(who[:MAX_WHO], lost),
            *self._without(removable(self._mission, networks), lost),
        ]

    def _without(self, changes: Iterable[Change], lost: int) -> list[Counterfactual]:
        asked = []
        for change in changes:
            game = replace(self._failed.game, change=change)
            if not self._is_playable(game):
                continue
            keys = [stream_key("stress", "without", f"{game.name} {lost} {i}") for i in range(self._n - 1)]
            kind = "messages" if change[0].startswith("reach") else change[0]
            asked.append(((kind, _label(change), lost), [game, *(game.branch(lost, key) for key in keys)]))
        try:
            return self._rows(asked)
        except BatchError:  # with other luck, a game without something may fail with an error
            rows: list[Counterfactual] = []
            for each in asked:
                with suppress(BatchError):
                    rows += self._rows([each])
            return rows

    def _is_playable(self, game: StressGame) -> bool:
        try:
            mission = self._made(game).replace(rekeys=game.rekeys)
        except TussleError:
            return False
        return play(mission, game.seed, self._watching) is not None

    def _rows(self, asked: Sequence[tuple[tuple[str, str, int], list[StressGame]]]) -> list[Counterfactual]:
        played = self._play([game for _, games in asked for game in games])
        counts = (
            np.array([p.verdict.has_failed for p in played], bool).reshape(-1, self._n).sum(axis=1).tolist()
        )
        return [
            Counterfactual(step, self._n, k, *wilson(k, self._n), kind, name)
            for ((kind, name, step), _), k in zip(asked, counts, strict=True)
        ]


def _label(change: Change) -> str:
    kind, name, *number = change
    if kind == "entity":
        return str(RekeyTarget(name, int(number[0])))
    return name if kind == "plugin" else f"{name} {kind}"
