"""Source text of the pair-loop kernel, generated for the laws that it evaluates."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

from tussle.numeric.neighbors.law import OTHER, Law
from tussle.numeric.source import indented

START = {"min": math.inf, "max": -math.inf, "nearest": math.nan}
"""Initial values of reductions that do not start at 0."""
LANE_OF_AGENT = "order[queries[q0 + k]] - first", "p"
"""Row and place of the pair in lane k, if its lanes are agents."""
LANE_OF_NEIGHBOR = "i", "p + k"
"""The same if its lanes are neighbours of one agent."""
RESULTS = {"min": "lane[:LANES].min()", "max": "lane[:LANES].max()", "nearest": "lane[first_lane]"}
"""Expressions that reduce the lanes of one agent, for reductions that are not sums."""


@dataclass(frozen=True)
class Part:
    """One law of a pair loop. In the text, v_k is contribution k of a pair, and a_k is its reduction over the pairs.

    Attributes:
        law: The law.
        at: Number of its first contribution, also used in the name of its function.
        masks: Which of its contributions are masks.
        can_skip: The law returns None for some pairs.
    """

    law: Law
    at: int
    masks: tuple[bool, ...]
    can_skip: bool

    @property
    def reductions(self) -> list[tuple[int, str]]:
        """Number and reduction of each contribution."""
        return list(enumerate(self.law.reductions.values(), self.at))

    @property
    def counted(self) -> str:
        """Mask of the lanes for which the pair counts."""
        return f"inside & counts_{self.at}" if self.can_skip else "inside"

    def begin(self) -> Iterator[str]:
        """Code before the loop over the candidates."""
        if self.law.lists:
            return
        for k, reduction in self.reductions:
            yield f"a_{k} = splat({START.get(reduction, 0.0)})"
        if "mean" in self.law.reductions.values():
            yield f"n_{self.at} = splat(0.0)"
        if "nearest" in self.law.reductions.values():
            yield f"best_{self.at}, best_id_{self.at} = splat(np.inf), splat(np.inf)"

    def contributions(self) -> Iterator[str]:
        """The call of the law."""
        names = [f"v_{k}" for k, _ in self.reductions] + ([f"counts_{self.at}"] if self.can_skip else [])
        yield f"{', '.join(names)}, = law_{self.at}({', '.join(f'{name}_' for name in self.law.arguments)})"
        for (k, reduction), is_mask in zip(self.reductions, self.masks, strict=True):
            if reduction == "count" and not is_mask:
                yield f"v_{k} = truth(v_{k})"
            if reduction != "count" and is_mask:
                yield f"v_{k} = number(v_{k})"

    def step(self, pair: tuple[str, str] = LANE_OF_AGENT) -> Iterator[str]:
        """Code for one candidate of each lane. `pair`: row and place of the pair in lane k, for lists."""
        at = self.at
        yield from self.contributions()
        yield f"ok = {self.counted}"
        if self.law.lists:
            yield from self.append(*pair)
            return
        if "nearest" in self.law.reductions.values():
            nearer = f"(distance_squared_ == best_{at}) & (other_id_ < best_id_{at})"
            yield f"closer = ok & ((distance_squared_ < best_{at}) | ({nearer}))"
            yield f"best_{at} = choose(closer, distance_squared_, best_{at})"
            yield f"best_id_{at} = choose(closer, other_id_, best_id_{at})"
        if "mean" in self.law.reductions.values():
            yield f"n_{at} = choose(ok, n_{at} + 1.0, n_{at})"
        for k, reduction in self.reductions:
            mask, value = "ok", f"a_{k} + v_{k}"
            if reduction == "count":
                mask, value = f"ok & v_{k}", f"a_{k} + 1.0"
            elif reduction in ("min", "max"):
                mask, value = f"ok & (v_{k} {'<' if reduction == 'min' else '>'} a_{k})", f"v_{k}"
            elif reduction == "nearest":
                mask, value = "closer", f"v_{k}"
            yield f"a_{k} = choose({mask}, {value}, a_{k})"

    def append(self, row: str, place: str) -> Iterator[str]:
        """Code that appends the counted pairs to the lists, up to their size."""
        yield "hits = bits(ok)"
        yield "if hits != 0:"
        for k, _ in self.reductions:
            yield f"    store(lane, (results_at + {k}) * LANES, v_{k})"
        yield "while hits != 0:"
        yield "    k = lowest(hits)"
        yield "    hits &= hits - 1"
        yield "    if n_listed < out[1].shape[1]:"
        yield f"        out[0][0, n_listed], out[0][1, n_listed] = {row}, order[{place}]"
        for k, _ in self.reductions:
            yield f"        out[1][{k}, n_listed] = lane[(results_at + {k}) * LANES + k]"
        yield "    n_listed += 1"

    def single_end(self) -> Iterator[str]:
        """Code that reduces the lanes of one agent and writes its row."""
        if self.law.lists:
            return
        if "mean" in self.law.reductions.values():
            yield f"store(lane, 0, n_{self.at})"
            yield "n = sum_of(lane)"
        if "nearest" in self.law.reductions.values():
            yield f"store(lane, 0, best_{self.at})"
            yield f"store(lane, LANES, best_id_{self.at})"
            yield "first_lane = first_of(lane)"
        for k, reduction in self.reductions:
            yield f"store(lane, 0, a_{k})"
            value = RESULTS.get(reduction, "sum_of(lane)")
            yield f"out[{k}, i] = {f'{value} / n if n > 0.0 else 0.0' if reduction == 'mean' else value}"

    def end(self) -> Iterator[str]:
        """Code after the loop."""
        for k, reduction in self.reductions:
            if reduction == "mean":
                yield f"a_{k} = choose(n_{self.at} > 0.0, a_{k} / n_{self.at}, 0.0)"


class WalkText:
    """Source text of a pair-loop kernel.

    The scratch array `lane` holds groups of LANES numbers: the lanes' own columns, squared radii, then results.

    Args:
        parts: The laws.
        where: Condition for all laws, if any.
        n_out: Number of contributions.
    """

    def __init__(self, parts: Sequence[Part], where: Part | None, n_out: int) -> None:
        self.parts, self.where, self.n_out = parts, where, n_out
        every = [*parts, *([where] if where else [])]
        names = dict.fromkeys(name for part in every for name in part.law.columns)
        self.by_team = any(part.law.teams for part in parts)
        names |= dict.fromkeys(("team", "other_team") if self.by_team else ())
        self.own = tuple(name for name in names if not name.startswith(OTHER)) or ("team",)
        self.other = tuple(
            sorted(name for name in names if name.startswith(OTHER))
        )  # sorted, so that components of a column are adjacent
        self.taken = [name for name in self.own if any(name in part.law.arguments for part in every)]
        self.limits = list(dict.fromkeys(part.law.radii for part in parts))
        self.lists = list(dict.fromkeys(part.law.teams for part in parts))
        self.limits_at = len(self.taken)
        self.results_at = self.limits_at + len(self.limits)
        self.lists_pairs = parts[0].law.lists

    def head(self) -> Iterator[str]:
        """The kernel's signature and the names of its arrays."""
        yield "def walk(longs, points, other, own, out, first, part, most):"
        yield "    cuts, spans, order = longs"
        yield "    queries, block_first, span_first, span_last = cuts[0], cuts[1], cuts[3], cuts[4]"
        yield "    span_start, span_end = spans[0], spans[1]"
        for number, name in enumerate("qs"):
            yield f"    {name}x, {name}y, {name}z = points[{number}][0], points[{number}][1], points[{number}][2]"
        for number, name in enumerate(self.other):
            yield f"    by_place_{name} = other[{number}]"
        for number, name in enumerate(self.own):
            yield f"    by_row_{name} = own[{number}]"
        yield "    begin, stop = part"

    def lines(self) -> Iterator[str]:
        """Text of the kernel that has agents in the lanes."""
        yield from self.head()
        yield f"    lane = np.empty({self.results_at + self.n_out} * LANES)"
        kept = [*(["all"] if None in self.lists else []), *(["own", "other"] if self.by_team else [])]
        lists = [
            *(f"places_{each}" for each in kept),
            *(f"near_{number}" for number in range(len(self.limits))),
        ]
        yield "    size = most + LANES"
        yield f"    found = np.empty({len(lists)} * size, np.int64)"
        for number, name in enumerate(lists):
            yield f"    {name} = found[{number} * size : {number + 1} * size]"
        yield f"    results_at, n_listed = {self.results_at}, 0"
        yield "    for b in range(begin, stop):"
        yield "        q0 = block_first[b]"
        yield "        width = block_first[b + 1] - q0"
        yield "        x, y, z = load(qx, q0), load(qy, q0), load(qz, q0)"
        yield "        done = 0"
        yield "        while done != (1 << width) - 1:"
        yield from indented(3, self.take_lanes())
        yield from indented(3, self.find_places())
        yield from indented(3, self.load_lanes())
        for teams in self.lists:
            yield from indented(3, self.over(teams))
        yield from indented(3, () if self.lists_pairs else self.put())
        yield "            done |= taken"
        if self.lists_pairs:
            yield "    return n_listed"

    def single_lines(self) -> Iterator[str]:
        """Text of the kernel that has neighbours in the lanes, which are reduced at the end.

        The first radius of a law is compared with the positions that decide who is in range, the others with the current ones.
        """
        yield from self.head()
        yield "    rx, ry, rz = points[2][0], points[2][1], points[2][2]"
        yield f"    lane = np.empty({2 + self.n_out} * LANES)"
        yield "    results_at, n_listed = 2, 0"
        yield "    for b in range(begin, stop):"
        yield "        for q in range(block_first[b], block_first[b + 1]):"
        yield "            me = queries[q]"
        yield "            i = order[me] - first"
        for name in self.taken:
            yield f"            {name}_ = splat(1.0 * by_row_{name}[i])"  # converts flags to numbers
        if self.by_team:
            yield "            mine = splat(float(by_row_team[i]))"
        for at, radii in enumerate(self.limits):
            yield f"            range2_{at} = {square(radii[:1])}"
            if len(radii) > 1:
                yield f"            limit2_{at} = {square(radii[1:])}"
        for part in self.parts:
            yield from indented(3, part.begin())
        yield "            for s in range(span_first[b], span_last[b]):"
        yield "                for p in range(span_start[s], span_end[s], LANES):"
        yield from indented(5, self.single_neighbors())
        for part in self.parts:
            near = f"near_{self.limits.index(part.law.radii)}"
            yield f"                    inside = {f'{near} & {part.law.teams}_' if part.law.teams else near}"
            yield "                    if bits(inside) != 0:"
            yield from indented(6, distances(part.law.names))
            yield from indented(6, part.step(LANE_OF_NEIGHBOR))
        for part in self.parts:
            yield from indented(3, part.single_end())
        if self.lists_pairs:
            yield "    return n_listed"

    def single_neighbors(self) -> Iterator[str]:
        """Code that loads LANES neighbours of one agent, and their masks by existence, team and distance."""
        for axis in "xyz":
            yield f"range_{axis} = load(r{axis}, p) - s{axis}[me]"
        yield "range_squared = range_x * range_x + range_y * range_y + range_z * range_z"
        yield "counted = below(span_end[s] - p) & (below(me - p) | ~below(me - p + 1))"
        for at in range(len(self.limits)):
            yield f"near_{at} = (range_squared < range2_{at}) & counted"
        yield f"if {' | '.join(f'bits(near_{at})' for at in range(len(self.limits)))} == 0:"
        yield "    continue"
        for axis in "xyz":
            yield f"offset_{axis}_ = load(s{axis}, p) - s{axis}[me]"
        yield "distance_squared_ = offset_x_ * offset_x_ + offset_y_ * offset_y_ + offset_z_ * offset_z_"
        for at, radii in enumerate(self.limits):
            if len(radii) > 1:
                yield f"near_{at} = near_{at} & (distance_squared_ < limit2_{at})"
        for name in self.other:
            yield f"{name}_ = load(by_place_{name}, p)"
        if self.where:
            yield from distances(self.where.law.names)
            yield from self.where.contributions()
            counts = f" & counts_{self.where.at}" if self.where.can_skip else ""
            for at in range(len(self.limits)):
                yield f"near_{at} = near_{at} & v_{self.where.at}{counts}"
        if self.by_team:
            yield "own_, other_ = other_team_ == mine, other_team_ != mine"

    def take_lanes(self) -> Iterator[str]:
        """Code that loads the lanes' columns into `lane`; unused lanes get a negative squared radius."""
        active = "k < width"
        if self.by_team:  # a block with several teams is processed once per team
            yield "k = 0"
            yield "while (done >> k) & 1:"
            yield "    k += 1"
            yield "wanted = by_row_team[order[queries[q0 + k]] - first]"
            active = "(k < width) & (by_row_team[i] == wanted)"
        yield "taken = 0"
        yield "reach2 = 0.0"
        yield "west, east, south, north, low, high = np.inf, -np.inf, np.inf, -np.inf, np.inf, -np.inf"
        yield "for k in range(LANES):"
        yield "    q = q0 + min(k, width - 1)"
        yield "    i = order[queries[q]] - first"
        yield f"    active = {active}"
        for at, name in enumerate(self.taken):
            yield f"    lane[{at} * LANES + k] = by_row_{name}[i]"
        for at, radii in enumerate(self.limits):
            yield f"    limit_{at} = {square(radii)} if active else -1.0"
            yield f"    lane[{self.limits_at + at} * LANES + k] = limit_{at}"
        yield "    if active:"
        yield "        taken |= 1 << k"
        for at in range(len(self.limits)):
            yield f"        reach2 = max(reach2, limit_{at})"
        yield "        west, east = min(west, qx[q]), max(east, qx[q])"
        yield "        south, north = min(south, qy[q]), max(north, qy[q])"
        yield "        low, high = min(low, qz[q]), max(high, qz[q])"

    def find_places(self) -> Iterator[str]:
        """Code that finds the places near the lanes: of all entities, of the lanes' team, of other teams."""
        spans = "span_first[b], span_last[b], span_start, span_end, (sx, sy, sz)"
        box = "(west, east, south, north, low, high), reach2"
        if None in self.lists:
            yield f"n_all = find_near({spans}, {box}, places_all)"
        if self.by_team:
            team = "by_place_other_team, float(wanted)"
            yield f"n_own, n_other = find_teams({spans}, {team}, {box}, places_own, places_other)"

    def load_lanes(self) -> Iterator[str]:
        """Code that loads values that are the same for all candidates."""
        yield "me = load(queries, q0)"
        for at, name in enumerate(self.taken):
            yield f"{name}_ = load(lane, {at} * LANES)"
        for at in range(len(self.limits)):
            yield f"limit2_{at} = load(lane, {self.limits_at + at} * LANES)"

    def over(self, teams: str | None) -> Iterator[str]:
        """Loops over the candidates of some teams, one per radius; the first loop selects the candidates of the others."""
        parts = [part for part in self.parts if part.law.teams == teams]
        limits = [n for n, radii in enumerate(self.limits) if any(part.law.radii == radii for part in parts)]
        for number in limits:
            inside = [part for part in parts if part.law.radii == self.limits[number]]
            for part in inside:
                yield from part.begin()
            is_first = number == limits[0]
            list_name = teams or "all"
            places, count = f"near_{number}", f"n_near_{number}"
            if is_first:
                places, count = f"places_{list_name}", f"n_{list_name}"
            rest = limits[1:] if is_first else []
            for other in rest:
                yield f"n_near_{other} = 0"
            yield f"for c in range({count}):"
            yield from indented(1, self.pair(places, number, teams, inside, rest))
            for part in inside:
                yield from part.end()

    def pair(
        self, places: str, number: int, teams: str | None, parts: list[Part], rest: list[int]
    ) -> Iterator[str]:
        """Code for one candidate and LANES agents."""
        yield f"p = {places}[c]"
        for axis in "xyz":
            yield f"offset_{axis}_ = s{axis}[p] - {axis}"
        yield "distance_squared_ = offset_x_ * offset_x_ + offset_y_ * offset_y_ + offset_z_ * offset_z_"
        for other in rest:
            yield f"near_{other}[n_near_{other}] = p"
            yield f"n_near_{other} += bits(distance_squared_ < limit2_{other}) != 0"
        taken = {name for part in [*parts, *([self.where] if self.where else [])] for name in part.law.names}
        yield from distances(taken)
        for name in sorted(taken):
            if name.startswith(OTHER):
                yield f"{name}_ = splat(by_place_{name}[p])"
        me = "" if teams == "other" else " & unlike(me, p)"
        yield f"inside = (distance_squared_ < limit2_{number}){me}"
        if self.where:
            yield from self.where.contributions()
            yield f"inside = {self.where.counted} & v_{self.where.at}"
        for part in parts:
            yield from part.step()

    def put(self) -> Iterator[str]:
        """Code that writes the contributions of the used lanes to their rows."""
        for at in range(self.n_out):
            yield f"store(lane, {self.results_at + at} * LANES, a_{at})"
        yield "for k in range(LANES):"
        yield "    if (taken >> k) & 1:"
        yield "        i = order[queries[q0 + k]] - first"
        yield f"        for at in range({self.n_out}):"
        yield f"            out[at, i] = lane[({self.results_at} + at) * LANES + k]"


def distances(names: Collection[str]) -> Iterator[str]:
    """Code for the distances of pairs, as far as they are among the names that a law takes."""
    if "distance" in names:
        yield "distance_ = lanes_sqrt(distance_squared_)"
    if "inverse_distance" in names:
        yield "inverse_distance_ = inverse_sqrt(distance_squared_)"


def square(radii: tuple[str | float, ...]) -> str:
    """Expression of the square of the smallest radius of row i."""
    text = ""
    for radius in radii:
        value = f"by_row_{radius}[i]" if isinstance(radius, str) else repr(float(radius))
        text = f"min({text}, square_of({value}))" if text else f"square_of({value})"
    return text
