"""The pair loop around neighbour laws: blocks of eight agents walk their candidates, each agent a lane.

The loop is written for the laws that it runs, as text: their columns become arguments, their contributions accumulators in
registers. Several laws share one walk: the candidates near a block are found once, and the first loop over them notes which
are near enough for laws that look less far.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tussle.errors import DeclarationError
from tussle.neighbors import lanes
from tussle.neighbors.lane_code import lane_code
from tussle.neighbors.lane_count import LANES
from tussle.neighbors.lanes import bits, choose, load
from tussle.neighbors.law import Law
from tussle.neighbors.walk_python import walk_in_python
from tussle.neighbors.walk_text import Part, WalkText
from tussle.numeric.kernel import Kernel, device, is_interpreted, kernel
from tussle.numeric.rk4 import label


@dataclass(frozen=True)
class Walk:
    """One walk over the neighbours for several laws.

    Attributes:
        own: Columns by row that its kernel takes, in order; "team" among them where laws tell teams apart.
        other: Columns by place.
        run: The kernel; eight agents are its lanes.
        run_single: The same for agents that are each in a world of their own; eight neighbours of one agent are its lanes.
        n_out: Number of contributions in all.
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
    """Places of the spans [begin, end) within reach of the box, into `found`; no branch on a single place. Returns how many."""
    sx, sy, sz = places
    n = 0
    for s in range(begin, end):
        for p in range(span_start[s], span_end[s], LANES):
            hit = bits(squared_gap(load(sx, p), load(sy, p), load(sz, p), box) < reach2)
            hit &= (1 << min(LANES, span_end[s] - p)) - 1
            for k in range(LANES):
                found[n] = p + k
                n += (hit >> k) & 1
    return n


@device
def find_teams(begin, end, span_start, span_end, places, team, wanted, box, reach2, mates, others):  # type: ignore[no-untyped-def]
    """As find_near, those of team `wanted` into `mates` and the rest into `others`. Returns how many of each."""
    sx, sy, sz = places
    n_mates, n_others = 0, 0
    for s in range(begin, end):
        for p in range(span_start[s], span_end[s], LANES):
            hit = bits(squared_gap(load(sx, p), load(sy, p), load(sz, p), box) < reach2)
            hit &= (1 << min(LANES, span_end[s] - p)) - 1
            if hit == 0:
                continue
            mine = hit & bits(load(team, p) == wanted)
            for k in range(LANES):
                mates[n_mates] = p + k
                n_mates += (mine >> k) & 1
            hit ^= mine
            if hit != 0:
                for k in range(LANES):
                    others[n_others] = p + k
                    n_others += (hit >> k) & 1
    return n_mates, n_others


@device
def square_of(radius):  # type: ignore[no-untyped-def]
    """Squared radius; of one that is not above 0 nobody is within."""
    return radius * radius if radius > 0.0 else -1.0


FROM_LANES = [
    "bits",
    "choose",
    "inverse_sqrt",
    "lanes_sqrt",
    "load",
    "lowest",
    "number",
    "ones",
    "splat",
    "store",
    "truth",
]


def make_walk(laws: Sequence[Law], where: Law | None, code_of: Callable[[str], str]) -> Walk:
    """The walk of some laws.

    Args:
        laws: Their order is that of the results.
        where: A law whose one contribution says whether a pair counts for any of them.
        code_of: Gives the kernel code (F, I, B) of an own column.

    Raises:
        DeclarationError: A law is not what can be done for eight lanes at once, or returns another number of contributions.
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
    }
    parts, at = [], 0
    for law in laws:
        parts.append(part_of(law, at, scope))
        at += len(law.reductions)
    text = WalkText(parts, part_of(where, at, scope) if where else None, at)
    if any(is_interpreted(law.function) for law in laws):
        run = walk_in_python(laws, where, text.own, text.other)
        return Walk(text.own, text.other, run, run, at)
    other, own = " ".join("F" * len(text.other)), " ".join(code_of(name) for name in text.own)
    out = "(I2w F2w) i8 (i8 i8) i8 -> i8" if text.lists_pairs else "F2w i8 (i8 i8) i8"
    signature = f"(I2 I2 I) (F2 F2) ({other}) ({own}) {out}"

    def written(lines: Iterable[str], suffix: str) -> Kernel:
        exec("\n".join(lines) + "\n", scope)  # noqa: S102 - written here; what authors wrote is in functions of its own
        made = scope["walk"]
        made.__module__ = laws[0].function.__module__
        names = (law.function.__qualname__ for law in (*laws, *([where] if where else [])))
        made.__qualname__ = "+".join(names) + suffix
        return kernel(signature)(made)

    kernel_of_blocks = written(text.lines(), "")
    single = kernel_of_blocks if text.lists_pairs else written(text.single_lines(), " single")
    return Walk(text.own, text.other, kernel_of_blocks, single, at)


def part_of(law: Law, at: int, scope: dict[str, Any]) -> Part:
    """A law's function for lanes, put into the walk's scope."""
    code = lane_code(law.function)
    if len(code.masks) != len(law.reductions):
        raise DeclarationError(
            f"{label(law.function)}: it returns {len(code.masks)} contributions; declared are {len(law.reductions)}: "
            f"{', '.join(law.reductions)}"
        )
    scope[f"law_{at}"] = code.function
    return Part(law, at, code.masks, code.can_skip)
