"""The pair loop in Python, for a debugger: laws are called for one pair at a time. Results equal the kernels' bit for bit."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from operator import add
from typing import Any

import numpy as np

from tussle.numeric.kernel import stats
from tussle.numeric.neighbors.lane_count import LANES
from tussle.numeric.neighbors.lanes import inverse_sqrt
from tussle.numeric.neighbors.law import OTHER, Law
from tussle.numeric.neighbors.walk_text import START

Values = Mapping[str, Any]


def walk_in_python(
    laws: Sequence[Law], where: Law | None, own_names: Sequence[str], other_names: Sequence[str], n_lanes: int
) -> Callable[..., int]:
    """Return a function with the arguments of the kernel of these laws; see `make_walk`.

    The neighbours of an agent are in `n_lanes` lanes: 1 for the kernel that has agents in the lanes.
    """

    def walk(
        longs: Any, points: Any, other: Any, own: Any, out: Any, first: int, part: Any, most: int
    ) -> int:
        stats.interpreted += 1
        cuts, spans, order = longs
        n_listed = 0
        for b in range(*part):
            for q in range(cuts[1, b], cuts[1, b + 1]):
                me = cuts[0, q]
                i = order[me] - first
                mine = {name: np.float64(column[i]) for name, column in zip(own_names, own, strict=True)}
                totals = [[Totals(law, mine) for law in laws] for _ in range(n_lanes)]
                found = (
                    (p, spans[0, s]) for s in range(*cuts[3:5, b]) for p in range(*spans[:, s]) if p != me
                )
                for p, start in found:
                    theirs = {name: column[p] for name, column in zip(other_names, other, strict=True)}
                    here = points[1][:, me]
                    pair = {**mine, **theirs, **between(points[1][:, p] - here)}
                    pair["range_squared"] = between(points[-1][:, p] - here)["distance_squared"]
                    for each in totals[(p - start) % n_lanes] if where is None or call(where, pair) else ():
                        values = each.add(pair)
                        if values is not None and each.law.lists:
                            if n_listed < out[1].shape[1]:
                                out[0][:, n_listed], out[1][:, n_listed] = (i, order[p]), values
                            n_listed += 1
                if not laws[0].lists:
                    every = (reduced(lanes) for lanes in zip(*totals, strict=True))
                    out[:, i] = [value for each in every for value in each.results()]
        return n_listed

    return walk


def between(offset: np.ndarray) -> dict[str, Any]:
    """Values of a pair by name, from its offset [m], (3,)."""
    x, y, z = offset
    square = x * x + y * y + z * z
    return {
        "offset_x": x, "offset_y": y, "offset_z": z, "distance": np.sqrt(square), "distance_squared": square,
        "inverse_distance": inverse_sqrt.py_func(np.full(LANES, square))[0],
    }  # fmt: skip


def call(law: Law, pair: Values) -> Any:
    """Call a law for a pair."""
    with np.errstate(all="ignore"):  # as in compiled code
        return law.function(*[pair[name] for name in law.arguments])


class Totals:
    """Reduced contributions of one entity's neighbours to a law.

    Args:
        law: The law.
        mine: The entity's columns.
    """

    def __init__(self, law: Law, mine: Values) -> None:
        self.law, self.n, self.closest = law, 0, (np.inf, np.inf)
        self.sums = [START.get(each, 0.0) for each in law.reductions.values()]
        radii = [mine[radius] if isinstance(radius, str) else radius for radius in law.radii]
        self.range, *self.limits = [radius * radius if radius > 0.0 else -1.0 for radius in radii]

    def add(self, pair: Values) -> tuple[Any, ...] | None:
        """Add a pair. Returns the law's values, or None if the pair does not count."""
        law = self.law
        if not pair["range_squared"] < self.range:
            return None
        if not all(pair["distance_squared"] < limit for limit in self.limits):
            return None
        if law.teams and (pair["team"] == pair[OTHER + "team"]) != (law.teams == "own"):
            return None
        result = call(law, pair)
        if result is None:
            return None
        values: tuple[Any, ...] = result if isinstance(result, tuple) else (result,)
        rank = pair["distance_squared"], pair.get(OTHER + "id", np.inf)
        is_closer = rank < self.closest
        self.closest = min(rank, self.closest)
        self.n += 1
        for k, (value, reduction) in enumerate(zip(values, law.reductions.values(), strict=True)):
            if reduction in ("sum", "mean"):
                self.sums[k] += value
            elif reduction == "count":
                self.sums[k] += bool(value)
            elif {"min": value < self.sums[k], "max": value > self.sums[k], "nearest": is_closer}.get(
                reduction
            ):
                self.sums[k] = value
        return values

    def absorb(self, other: Totals) -> Totals:
        """Add the contributions of other lanes."""
        is_closer = other.closest < self.closest
        for k, reduction in enumerate(self.law.reductions.values()):
            mine, theirs = self.sums[k], other.sums[k]
            if reduction == "nearest":
                self.sums[k] = theirs if is_closer else mine
            else:
                self.sums[k] = {"min": min, "max": max}.get(reduction, add)(mine, theirs)
        self.closest = min(self.closest, other.closest)
        self.n += other.n
        return self

    def results(self) -> Iterator[float]:
        """Yield the reduced contributions in order."""
        for total, reduction in zip(self.sums, self.law.reductions.values(), strict=True):
            yield total / max(self.n, 1) if reduction == "mean" else total


def reduced(lanes: Sequence[Totals]) -> Totals:
    """Reduce lanes, in pairs."""
    while len(lanes) > 1:
        lanes = [a.absorb(b) for a, b in zip(lanes[::2], lanes[1::2], strict=True)]
    return lanes[0]
