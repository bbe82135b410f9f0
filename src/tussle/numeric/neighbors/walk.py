"""The pair loop of neighbour laws: each block of eight agents loops over its candidates, one agent per lane.

The loop is generated as source text for its laws: their columns become arguments, their contributions accumulators in
registers. Several laws share one walk: the candidates near a block are found once, and the first loop over them marks those
in range of laws with a smaller radius.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from operator import add
from typing import Any

import numpy as np

from tussle.errors import DeclarationError
from tussle.numeric.kernel import Kernel, device, is_interpreted, kernel, stats
from tussle.numeric.neighbors import lanes
from tussle.numeric.neighbors.lane_code import lane_code
from tussle.numeric.neighbors.lane_count import LANES
from tussle.numeric.neighbors.lanes import bits, choose, inverse_sqrt, load, pack
from tussle.numeric.neighbors.law import OTHER, Law
from tussle.numeric.neighbors.walk_text import START, Part, WalkText
from tussle.numeric.refusals import label
from tussle.numeric.source import define


@dataclass(frozen=True)
class Walk:
    """A compiled walk over the neighbours for several laws.

    Attributes:
        own: Columns by row that the kernel takes, in order; includes "team" if a law filters by team.
        other: Columns by place that the kernel takes, in order.
        run: The kernel; its lanes are eight agents.
        run_single: The kernel for agents that are each in a different world; its lanes are eight neighbours of one agent. It also
            takes the positions that decide who is in range.
        n_out: Total number of contributions.
    """

    own: tuple[str, ...]
    other: tuple[str, ...]
    run: Callable[..., Any]
    run_single: Callable[..., Any]
    n_out: int


@device
def squared_gap(x, y, z, box):  # type: ignore[no-untyped-def]
    """Squared distance of eight points from a box (west, east, south, north, low, high), 0 inside."""
    west, east, south, north, low, high = box
    dx = choose(x < west, west - x, choose(x > east, x - east, 0.0))
    dy = choose(y < south, south - y, choose(y > north, y - north, 0.0))
    dz = choose(z < low, low - z, choose(z > high, z - high, 0.0))
    return dx * dx + dy * dy + dz * dz


@device
def find_near(begin, end, span_start, span_end, places, box, reach2, found):  # type: ignore[no-untyped-def]
    """Write the places of the spans [begin, end) within reach of the box to `found`, without a branch per place. Returns their number."""
    sx, sy, sz = places
    n = 0
    for s in range(begin, end):
        for p in range(span_start[s], span_end[s], LANES):
            hit = bits(squared_gap(load(sx, p), load(sy, p), load(sz, p), box) < reach2)
            hit &= (1 << min(LANES, span_end[s] - p)) - 1
            n = pack(found, n, p, hit)
    return n


@device
def find_teams(begin, end, span_start, span_end, places, team, wanted, box, reach2, mates, others):  # type: ignore[no-untyped-def]
    """Like `find_near`: places of team `wanted` go to `mates`, the others to `others`. Returns both numbers."""
    sx, sy, sz = places
    n_mates, n_others = 0, 0
    for s in range(begin, end):
        for p in range(span_start[s], span_end[s], LANES):
            hit = bits(squared_gap(load(sx, p), load(sy, p), load(sz, p), box) < reach2)
            hit &= (1 << min(LANES, span_end[s] - p)) - 1
            if hit == 0:
                continue
            mine = hit & bits(load(team, p) == wanted)
            n_mates = pack(mates, n_mates, p, mine)
            n_others = pack(others, n_others, p, hit ^ mine)
    return n_mates, n_others


@device
def square_of(radius):  # type: ignore[no-untyped-def]
    """Squared radius; -1 for a radius that is not positive, so that nothing is in range."""
    return radius * radius if radius > 0.0 else -1.0


@device
def sum_of(lane):  # type: ignore[no-untyped-def]
    """Sum of eight numbers, in pairs."""
    return ((lane[0] + lane[1]) + (lane[2] + lane[3])) + ((lane[4] + lane[5]) + (lane[6] + lane[7]))


@device
def first_of(lane):  # type: ignore[no-untyped-def]
    """Lane with the smallest of eight numbers, among equal ones that with the smallest of the next eight."""
    best = 0
    for k in range(1, LANES):
        if lane[k] < lane[best] or (lane[k] == lane[best] and lane[LANES + k] < lane[LANES + best]):
            best = k
    return best


FROM_LANES = [
    "below",
    "bits",
    "choose",
    "inverse_sqrt",
    "lanes_sqrt",
    "load",
    "lowest",
    "number",
    "splat",
    "store",
    "truth",
    "unlike",
]


def make_walk(laws: Sequence[Law], where: Law | None, code_of: Callable[[str], str]) -> Walk:
    """Generate the walk of some laws.

    Args:
        laws: In the order of the results.
        where: A law with one contribution: True if the pair counts for the laws.
        code_of: Returns the signature code (F, I, B) of an own column.

    Raises:
        DeclarationError: A law cannot be translated to lanes, or returns a different number of contributions than declared.
    """
    scope: dict[str, Any] = {name: getattr(lanes, name) for name in FROM_LANES}
    scope |= {
        "np": np,
        "inf": np.inf,
        "nan": np.nan,
        "LANES": LANES,
        "square_of": square_of,
        "find_near": find_near,
        "find_teams": find_teams,
        "sum_of": sum_of,
        "first_of": first_of,
    }
    parts, at = [], 0
    for law in laws:
        parts.append(part_of(law, at, scope))
        at += len(law.reductions)
    text = WalkText(parts, part_of(where, at, scope) if where else None, at)
    if any(is_interpreted(law.function) for law in laws):
        run, single = (walk_in_python(laws, where, text.own, text.other, n) for n in (1, LANES))
        return Walk(text.own, text.other, run, single, at)
    other, own = " ".join("F" * len(text.other)), " ".join(code_of(name) for name in text.own)
    out = "(I2w F2w) i8 (i8 i8) i8 -> i8" if text.lists_pairs else "F2w i8 (i8 i8) i8"

    def written(lines: Iterable[str], points: str, suffix: str) -> Kernel:
        authors = [law.function for law in (*laws, *([where] if where else []))]
        names = "+".join(each.__qualname__ for each in authors)
        made = define(lines, scope, laws[0].function.__module__, names + suffix)
        vars(made)["authors"] = authors
        return kernel(f"(I2 I2 I) ({points}) ({other}) ({own}) {out}")(made)

    kernel_of_blocks = written(text.lines(), "F2 F2", "")
    single = written(text.single_lines(), "F2 F2 F2", " single")
    return Walk(text.own, text.other, kernel_of_blocks, single, at)


def part_of(law: Law, at: int, scope: dict[str, Any]) -> Part:
    """Translate a law to lanes and add it to the scope of the walk."""
    code = lane_code(law.function)
    if len(code.masks) != len(law.reductions):
        raise DeclarationError(
            f"{label(law.function)}: it returns {len(code.masks)} contributions, but {len(law.reductions)} are declared: "
            f"{', '.join(law.reductions)}"
        )
    scope[f"law_{at}"] = code.function
    return Part(law, at, code.masks, code.can_skip)


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
