"""An autonomy: the decisions of a robot, in plain Python for one robot at a time."""

import math

from tussle.api import EasyAutonomy, Me, Output, Param, State, wrap


class New(EasyAutonomy):
    """Flies towards the nearest robot of another team, or straight on if there is none."""

    max_speed = Param(25.0, unit="m/s", ge=0.0, doc="Speed while chasing.")
    other_team = Param(2, doc="Team to chase.")
    way = State(unit="m", doc="Distance flown so far.")
    speed = Output(unit="m/s")
    turn_rate = Output(unit="rad/s")
    pitch_rate = Output(unit="rad/s")

    def step_one(self, me: Me) -> None:
        """Decide for one robot. `me` has its pos, yaw, climb, neighbours, and the columns declared above."""
        me.speed = me.max_speed
        me.way += me.max_speed * me.dt
        other = me.nearest(team=me.other_team)
        if other is None:
            me.turn_rate = me.pitch_rate = 0.0
            return
        east, north, up = other.pos - me.pos
        me.turn_rate = wrap(math.atan2(north, east) - me.yaw)
        me.pitch_rate = math.atan2(up, math.hypot(east, north)) - me.climb
