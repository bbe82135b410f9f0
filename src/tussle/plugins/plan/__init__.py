"""Motion planning with the motion models that fly: a batched sampling-based planner, and OMPL's planners (extra `plan`)."""

from tussle.plugins.plan.problem import Plan, Problem
from tussle.plugins.plan.sst import solve
from tussle.plugins.plan.with_ompl import solve_with_ompl

__all__ = ["Plan", "Problem", "solve", "solve_with_ompl"]
