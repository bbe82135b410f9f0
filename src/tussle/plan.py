"""Planning with the motion models that fly."""

from tussle.plugins.plan import Plan, Problem, solve, solve_with_ompl

__all__ = ["Plan", "Problem", "solve", "solve_with_ompl"]
__path__: list[str] = []  # former modules are found by tussle.former_names
