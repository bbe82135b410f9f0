"""MoveToGoalMS: a behaviour that goes to a point."""

from tussle.plugins.stock.autonomy.move_to_goal_ms.plugin import MoveToGoalMS

__all__ = ["MoveToGoalMS"]
