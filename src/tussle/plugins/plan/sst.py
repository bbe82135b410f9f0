"""A sampling-based planner that computes many branches at once with the compiled motion model.

Stable sparse trees (Li, Littlefield and Bekris 2016, "Asymptotically optimal sampling-based kinodynamic planning", IJRR 35): a random
state selects the cheapest node near it, from which random commands are propagated; of the nodes in a region, only the cheapest is
extended further. Differences: regions are the cells of a grid instead of balls around witnesses, and branches are propagated in batches.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tussle.arguments import explained
from tussle.documents import POSITIVE, Whole, check_argument
from tussle.plugins.plan.kernels import admit, select
from tussle.plugins.plan.problem import POSITION, Plan, Problem

SELECTION_RADIUS = 2.0
"""Nodes within this distance of a sample compete by cost [cells]."""
TOWARD_GOAL = 0.05
"""Fraction of the samples whose position is the goal."""
COMMANDS_PER_NODE = 8
"""Commands that are tried from each selected node."""
MAX_BRANCHES = 10**8
"""Largest number of commands to try, for each of which memory is taken."""


class Tree:
    """The nodes, and the cheapest node of each cell.

    Args:
        problem: The planning problem.
        sizes: Size of a cell by bounded field.
        room: Largest number of nodes.
    """

    def __init__(self, problem: Problem, sizes: np.ndarray, room: int) -> None:
        self.problem, self.sizes, self.n, self.n_cells = problem, sizes, 0, 0
        d, m, c = len(sizes), len(problem.fields), len(problem.commands)
        self.x, self.cost, self.parent = np.empty((m, room)), np.empty(room), np.empty(room, np.int64)
        self.commands, self.steps = np.empty((c, room)), np.empty(room, np.int64)
        self.points, self.best, self.node = np.empty((d, room)), np.empty(room), np.empty(room, np.int64)
        self.table = np.zeros((d + 1, 2 * room + 1), np.int64)

    def add(
        self,
        x: np.ndarray,
        cost: np.ndarray,
        parent: np.ndarray,
        commands: np.ndarray,
        steps: np.ndarray,
        allowed: np.ndarray,
    ) -> None:
        """Add the allowed ones of some branches that are the cheapest of their cells: states (m, B), costs, parents, commands, steps."""
        points = x[self.problem.bounded[0]] / self.sizes[:, None]
        cells = np.floor(np.where(allowed, points, 0.0)).astype(np.int64)
        number = np.empty(len(cost), np.int64)
        self.n_cells = admit(cells, cost, allowed, self.n_cells, self.table, self.best, number)
        kept = np.flatnonzero(number >= 0)
        new = slice(self.n, self.n + len(kept))
        self.x[:, new], self.cost[new], self.parent[new] = x[:, kept], cost[kept], parent[kept]
        self.commands[:, new], self.steps[new] = commands[:, kept], steps[kept]
        cell = number[kept]
        self.points[:, cell], self.node[cell] = points[:, kept], np.arange(new.start, new.stop)
        self.n = new.stop

    def select(self, samples: np.ndarray) -> np.ndarray:
        """Nodes to extend for samples (d, B), (B,)."""
        selected = np.empty(samples.shape[1], np.int64)
        select(samples, self.points, self.best, self.n_cells, SELECTION_RADIUS, selected)
        nodes: np.ndarray = self.node[selected]
        return nodes

    def plan_to(self, node: int, is_solved: bool, n_propagated: int) -> Plan:
        """The plan to a node."""
        nodes = []
        while self.parent[node] >= 0:
            nodes.append(node)
            node = int(self.parent[node])
        nodes.reverse()
        return Plan(
            problem=self.problem,
            is_solved=is_solved,
            commands=self.commands[:, nodes].T.copy(),
            steps=self.steps[nodes].copy(),
            nodes=self.x[self.problem.position, : self.n],
            parents=self.parent[: self.n].copy(),
            costs=self.cost[: self.n].copy(),
            n_propagated=n_propagated,
        )


@explained
def solve(
    problem: Problem,
    *,
    seed: int = 0,
    branches: int = 100_000,
    batch: int = 1024,
    cells: Mapping[str, float] | None = None,
    stop_at_first: bool = False,
) -> Plan:
    """Search the fastest way to the goal; the longer the search, the better the plan.

    Args:
        problem: The planning problem.
        seed: Seed; equal seeds give equal plans.
        branches: Number of commands to try.
        batch: Number of commands that are propagated at once.
        cells: Bounded state field -> size of a cell; by default a fiftieth of the range of positions, an eighth of others.
        stop_at_first: Return the first plan that reaches the goal.

    Returns:
        The fastest plan, without commands if the start is in the goal. If `is_solved` is false, the goal was not reached, and the plan ends
        nearest to it, at `distance_left`.

    Raises:
        ParameterError: A value is not allowed.
    """
    check_argument("seed", seed, Whole())
    check_argument("branches", branches, Whole(1, MAX_BRANCHES))
    check_argument("batch", batch, Whole(COMMANDS_PER_NODE, MAX_BRANCHES))
    sizes = _cell_sizes(problem, cells or {})
    if problem.is_at_goal:
        return problem.empty_plan()
    chance = np.random.default_rng(seed)
    tree = Tree(problem, sizes, branches + batch + 1)
    none, first = np.zeros((len(problem.commands), 1)), problem.first[:, None]
    tree.add(first, np.zeros(1), np.full(1, -1), none, np.zeros(1, np.int64), np.ones(1, bool))
    best, least, n_propagated = 0, np.inf, 0
    done = 0
    while done < branches and not (stop_at_first and least < np.inf):
        parents = np.repeat(tree.select(_samples(problem, tree, chance, batch)), COMMANDS_PER_NODE)
        grown = tree.n
        n_propagated += _grow(problem, tree, parents, chance)
        done += len(parents)
        fresh = slice(grown, tree.n)
        gap = problem.distance(tree.x[:, fresh])
        there = np.where(gap <= problem.goal_radius, tree.cost[fresh], np.inf)
        if len(there) and there.min() < least:
            best, least = grown + int(there.argmin()), float(there.min())
    if least == np.inf:
        best = int(problem.distance(tree.x[:, : tree.n]).argmin())
    return tree.plan_to(best, least < np.inf, n_propagated)


def _cell_sizes(problem: Problem, cells: Mapping[str, float]) -> np.ndarray:
    problem.check_names("cells", cells, tuple(problem.bounds))
    sizes = []
    for name, (low, high) in problem.bounds.items():
        size = cells.get(name, (high - low) / (50 if name in POSITION else 8) or 1.0)
        check_argument(f"cells: {name}", size, POSITIVE)
        sizes.append(size)
    return np.array(sizes)


def _samples(problem: Problem, tree: Tree, chance: np.random.Generator, batch: int) -> np.ndarray:
    """Random points within the bounds, some at the goal, in cells, (d, n)."""
    _, low, high = problem.bounded
    n = batch // COMMANDS_PER_NODE
    samples: np.ndarray = chance.uniform(low[:, None], high[:, None], (len(low), n))
    toward = chance.random(n) < TOWARD_GOAL
    for name, place in zip(POSITION, problem.goal, strict=True):
        if name in problem.bounds:
            samples[list(problem.bounds).index(name), toward] = place
    samples /= tree.sizes[:, None]
    return samples


def _grow(problem: Problem, tree: Tree, parents: np.ndarray, chance: np.random.Generator) -> int:
    """Extend nodes by random commands. Returns the number of steps that were propagated."""
    n = len(parents)
    low, high = np.array(list(problem.commands.values()), float).T
    commands = chance.uniform(low[:, None], high[:, None], (len(low), n))
    steps = chance.integers(problem.shortest, problem.longest + 1, n)
    order = np.argsort(-steps, kind="stable")  # those that end early are the last columns
    parents, commands, drawn = parents[order], commands[:, order], steps[order]
    steps = drawn.copy()
    x = np.ascontiguousarray(tree.x[:, parents])
    end, allowed = x.copy(), np.ones(n, bool)
    is_there = np.zeros(n, bool)
    for k in range(1, int(drawn[0]) + 1):
        m = int(np.count_nonzero(drawn >= k))
        path = problem.propagate(np.ascontiguousarray(x[:, :m]), commands[:, :m], 1)
        before, x = path
        moves = ~is_there[:m]  # a branch ends where it reaches the goal
        end[:, :m] = np.where(moves, x, end[:, :m])
        allowed[:m] &= ~moves | problem.is_allowed(x, before)
        arrived = moves & allowed[:m] & (problem.distance(x) <= problem.goal_radius)
        steps[:m][arrived] = k
        is_there[:m] |= arrived
    cost = tree.cost[parents] + problem.dt * steps
    tree.add(end, cost, parents, commands, steps, allowed)
    return int(steps.sum())


__all__ = ["solve"]
