"""MotorSchemas as in SCRIMMAGE."""

from __future__ import annotations

from tussle.api import Behavior, Children, GroupView, HistoricAttributes
from tussle.plugins.historic.angles import headings
from tussle.plugins.historic.autonomy.move_to_goal_ms import MoveToGoalMS
from tussle.plugins.stock.autonomy import motor_schemas
from tussle.plugins.stock.autonomy.avoid_entity_ms import AvoidEntityMS


class MotorSchemas(motor_schemas.MotorSchemas):
    """MotorSchemas that avoids others and goes to (100, 0, 0) where no behaviours are given; in tussle it flies straight on.

    The desired heading is not negative.
    """

    historic_attributes = HistoricAttributes(unread=("pub_vel_vec",))
    behaviors = Children(
        Behavior,
        by_state=True,
        default=(AvoidEntityMS(minimum_range=2.0), MoveToGoalMS(goal=(100.0, 0.0, 0.0))),
        doc="The combined behaviours.",
    )

    def step(self, g: GroupView) -> None:
        super().step(g)
        self.desired_heading[:] = headings(self.desired_heading)
