"""What belongs to the episode of each world: its seed, and the parameters that `reset` was given."""

from __future__ import annotations

import copy
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from tussle.batch.variables import Choice, Range
from tussle.engine.params import Overrides
from tussle.errors import ParameterError
from tussle.numeric import rng
from tussle.rl.draws import extremes, named
from tussle.rl.task import Task

EPISODE = rng.stream_key("tussle.rl", "episode")
N_SEEDS = 2**64
"""Seeds are whole numbers below it."""


class Episodes:
    """Seeds and parameters of the episodes of W worlds.

    The engine holds the values of parameters by world. Kept here is which of them `reset` was given, since variables of the task do
    not change these, and distributions, of which each episode draws.

    Attributes:
        seeds: Seed of each world's episode, (W,).
        given: World -> values or distributions of the parameters that it was given, by path.
        values: World -> values of the parameters that were given or drawn for its episode, by path, in SI units.
    """

    def __init__(self, task: Task, n_worlds: int) -> None:
        self.task = task
        self.seeds = np.random.SeedSequence().generate_state(n_worlds, np.uint64) >> np.uint64(1)
        self.given: dict[int, dict[str, Any]] = {}
        self.values: list[dict[str, Any]] = [{} for _ in range(n_worlds)]
        self._first, self._number = self.seeds.copy(), np.zeros(n_worlds, np.int64)

    def follow(self, worlds: np.ndarray) -> None:
        """Set the seeds of the next episodes of some worlds to those that follow."""
        self._number[worlds] += 1
        shares = rng.uniform(self._first[worlds], EPISODE, 0, self._number[worlds])[0]
        self.seeds[worlds] = (shares * 2.0**53).astype(np.uint64)

    def begin(self, worlds: np.ndarray, seeds: list[int | None], is_first: bool) -> None:
        """Set the seeds of the next episodes of some worlds; None stands for the one that follows, or the present one at first."""
        known = np.array([s is not None for s in seeds], bool)
        if not is_first:
            self.follow(worlds[~known])
        self._first[worlds[known]] = np.array([s for s in seeds if s is not None], np.uint64)
        self._number[worlds[known]] = 0
        self.seeds[worlds[known]] = self._first[worlds[known]]

    def set_params(self, worlds: np.ndarray, values: Mapping[str, list[Any]]) -> None:
        """Add checked parameters of some worlds to those that they were given; without any, forget those."""
        for i, w in enumerate(worlds.tolist()):
            own = {path: items[i] for path, items in values.items()}
            if own:
                self.given[w] = {**self.given.get(w, {}), **own}
            else:
                self.given.pop(w, None)

    def drawn(
        self, worlds: np.ndarray, overrides: Overrides
    ) -> list[tuple[np.ndarray, dict[str, list[Any]]]]:
        """Draw the parameters of the next episodes of some worlds, and note the values.

        Returns:
            Worlds, and their values by path, in SI units: those of variables and distributions, of which each world has its own.
        """
        varied = {variable.name: variable for variable in self.task.variables}
        if not varied and not self.given:
            for w in worlds[[bool(self.values[w]) for w in worlds.tolist()]].tolist():
                self.values[w] = {}
            return []
        found: dict[str, list[tuple[int, Any]]] = {}
        for w in worlds.tolist():
            mine = {**varied, **self.given.get(w, {})}
            self.values[w] = {
                path: value for path, value in mine.items() if not isinstance(value, Range | Choice)
            }
            for path, value in mine.items():
                if path in varied or path not in self.values[w]:
                    found.setdefault(path, []).append((w, value))
        parts = []
        for path, items in found.items():
            some = np.array([w for w, _ in items])
            shares = rng.uniform(self.seeds[some], rng.stream_key("tussle.rl", path), 0, 0)[0].tolist()
            values = [
                v.setting(v.value_at(share)) if isinstance(v, Range | Choice) else v
                for (_, v), share in zip(items, shares, strict=True)
            ]
            converted = [overrides.checked({path: value}, 1)[path][0] for value in values]
            for w, value in zip(some.tolist(), converted, strict=True):
                self.values[w][path] = value
            parts.append((some, {path: converted}))
        return parts

    def told(self) -> dict[str, Any]:
        """Parameters that were given or drawn for the present episodes, by path, (W,) or (W, k), as Gymnasium tells them.

        "_PATH" has the worlds that have one, (W,); the others have 0.
        """
        out: dict[str, Any] = {}
        for path in dict.fromkeys(path for mine in self.values for path in mine):
            have = np.array([path in mine for mine in self.values])
            first = next(mine[path] for mine in self.values if path in mine)
            values = np.array([mine.get(path, first) for mine in self.values])
            values[~have] = values.dtype.type()
            out[path], out[f"_{path}"] = values, have
        return out

    def state(self) -> tuple[Any, ...]:
        """A copy, for `restore`."""
        return copy.deepcopy((self.seeds, self._first, self._number, self.given, self.values))

    def restore(self, state: tuple[Any, ...]) -> None:
        """Return to a state."""
        self.seeds[:], self._first[:], self._number[:], given, values = state
        self.given, self.values = copy.deepcopy(given), copy.deepcopy(values)


def checked_worlds(worlds: Any, n_worlds: int) -> np.ndarray:
    """Numbers of the chosen worlds, from numbers or a mask; None means all.

    Raises:
        ParameterError: They are neither, or a number is out of range or there twice.
    """
    if worlds is None:
        return np.arange(n_worlds)
    chosen = np.atleast_1d(np.asarray(worlds))
    is_mask = chosen.dtype == bool and chosen.shape == (n_worlds,)
    is_list = chosen.ndim == 1 and (chosen.dtype.kind in "iu" or not len(chosen))
    numbers = np.flatnonzero(chosen) if is_mask else chosen.astype(np.int64) if is_list else np.array([-1])
    if len(np.unique(numbers)) < len(numbers) or ((numbers < 0) | (numbers >= n_worlds)).any():
        raise ParameterError(
            f"worlds = {chosen.tolist()} is not allowed; it takes numbers from 0 to {n_worlds - 1}, each once, or a mask of "
            f"{n_worlds} truth values"
        )
    return numbers


def checked_seeds(seed: Any, worlds: np.ndarray) -> list[int | None]:
    """A seed for each of some worlds, or None for the one that follows.

    Args:
        seed: Seed of world 0, world k has seed + k; or one for each of `worlds`; or None.
        worlds: Numbers of the worlds.

    Raises:
        ParameterError: A seed is not allowed, or their number differs from that of the worlds.
    """
    if seed is None:
        return [None] * len(worlds)
    largest = N_SEEDS - 1
    if is_whole(seed):
        last = int(worlds.max(initial=0))
        if not 0 <= seed <= largest - last:
            most = f"2^64 - {last + 1}" + f", as world {last} has seed + {last}" * (last > 0)
            raise ParameterError(f"seed = {seed} is not allowed; it takes a whole number from 0 to {most}")
        return [int(seed) + w for w in worlds.tolist()]
    is_list = isinstance(seed, Iterable) and not isinstance(seed, str | bytes | Mapping)
    many = list(seed) if is_list and getattr(seed, "shape", None) != () else [seed] * len(worlds)
    if len(many) != len(worlds):
        raise ParameterError(
            f"seed = {seed!r} is not allowed; it has {len(many)} seeds for {len(worlds)} worlds; give one number, or one for each world"
        )
    for each in many:
        if each is not None and not (is_whole(each) and 0 <= each <= largest):
            raise ParameterError(
                f"seed = {each!r} is not allowed; it takes a whole number from 0 to 2^64 - 1, or None for the one that follows"
            )
    return [None if s is None else int(s) for s in many]


def is_whole(value: Any) -> bool:
    """Whether a value is a whole number, of Python or NumPy; truth values are none."""
    return isinstance(value, (int, np.integer)) and not isinstance(value, bool)


def checked_params(params: Any, overrides: Overrides, n_worlds: int) -> dict[str, list[Any]] | None:
    """Values of parameters for n_worlds worlds, by path; None for no change.

    Raises:
        ParameterError: A path or value is not allowed, or the number of values differs from that of the worlds.
    """
    if params is None:
        return None
    if not isinstance(params, Mapping):
        raise ParameterError(
            f"params = {params!r:.80} is not allowed; it takes values by path, {{}} for the mission's own values, or None for the "
            "present ones"
        )
    for path in params:
        if not isinstance(path, str):
            raise ParameterError(
                f"params: {path!r:.80} is not allowed; a path is a text, such as 'prey.speed'"
            )
    found: dict[str, list[Any]] = {}
    for path, value in params.items():
        is_list = isinstance(value, list | tuple) and any(isinstance(v, Range | Choice) for v in value)
        if not is_list and not isinstance(value, Range | Choice):
            found |= overrides.checked({path: value}, n_worlds)
            continue
        many = list(value) if is_list else [value] * n_worlds
        if len(many) != n_worlds:
            raise ParameterError(
                f"{path!r} has {len(many)} values for {n_worlds} worlds; give one value or distribution, or one per world"
            )
        found[path] = [checked_value(path, v, overrides) for v in many]
    return found


def checked_value(path: str, value: Any, overrides: Overrides) -> Any:
    """A value of a parameter in one world, or a distribution of allowed values.

    Raises:
        ParameterError: The path or a value is not allowed.
    """
    if not isinstance(value, Range | Choice):
        return overrides.checked({path: value}, 1)[path][0]
    variable = named(value, path)
    for end in extremes(variable):
        overrides.checked({path: end}, 1)
    return variable


__all__ = ["Episodes", "checked_params", "checked_seeds", "checked_value", "checked_worlds", "is_whole"]
