"""Searches for the nearest others of each agent, which start from the distances of the last search and are shared within a step.

Whoever is nearest now was about as far away at the last decision. So a search takes all within a distance that is a little larger than
that of the last k-th other, which are few, and sorts these without branches. If they are fewer than k, it takes a larger distance: the
result is that of a full search in every bit, whatever the guess was.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.rl.kernels import find_from_guess


class SharedSearches:
    """What searches of the agents of a stack of worlds keep: guesses from step to step, and results within a step.

    Args:
        n_agents: Agents of all worlds.
    """

    def __init__(self, n_agents: int) -> None:
        self._n_agents = n_agents
        self._guesses: dict[Any, np.ndarray] = {}
        self._results: dict[Any, tuple[int, np.ndarray, np.ndarray]] = {}

    def nearest(
        self, bodies: Any, of: Any, who: tuple[np.ndarray, np.ndarray, np.ndarray], places: Any, arrays: Any,
        numbers: tuple[int, int, float], split: Any,
    ) -> np.ndarray:  # fmt: skip
        """Rows of the nearest others of some agents, (m, k or more), nearest first; -1 where there are fewer.

        Args:
            bodies: The body table.
            of: Name of the others.
            who: Rows and agents, and what each looks for, (m,) each.
            places: row_world, place and order of the index; arrays: its table.
            numbers: Number of others k, mode of the search, and radius [m].
            split: Calls a function for parts of the agents in several threads.
        """
        rows = who[0]
        k, mode, radius = numbers
        version, known, near = self._results.get((of, radius), (-1, None, np.zeros((0, 0), np.int64)))
        if version == bodies.version and known is rows and near.shape[1] >= k:
            return near
        k = max(k, near.shape[1])  # so that the first search of the next step serves all that follow
        guesses = self._guesses.get((of, radius))
        if guesses is None:
            guesses = self._guesses[of, radius] = np.full(self._n_agents, np.inf)
        near = np.empty((len(rows), k), np.int64)
        split(
            len(rows),
            lambda *part: find_from_guess(
                bodies.floats, who, places, arrays, (k, mode, radius), guesses, part, near
            ),
        )
        self._results[of, radius] = bodies.version, rows, near
        return near


__all__ = ["SharedSearches"]
