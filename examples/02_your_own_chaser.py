"""Your own chaser, in plain Python for one entity at a time, against the stock predator.

Stock predators all follow the nearest prey and soon fly on top of each other. Your chasers select different prey.
"""

import math
import sys
from typing import Any

from tussle import Block, Mission, Simulation
from tussle.api import EasyAutonomy, EntityRef, Output, Param, Publish, wrap
from tussle.messages import CaptureEntity
from tussle.stock import Boids, Predator, SimpleCapture, SimpleCaptureMetrics, Unicycle


class SharingChaser(EasyAutonomy):
    """Chases one of the nearest prey, a different one per chaser, until it is gone."""

    prey_team = Param(1, doc="Team that is hunted.")
    max_speed = Param(35.0, unit="m/s", ge=0.0)
    capture_range = Param(5.0, unit="m", gt=0.0)
    target = EntityRef(doc="Prey being chased; None when it is gone.")
    speed = Output(unit="m/s")
    turn_rate = Output(unit="rad/s")
    pitch_rate = Output(unit="rad/s")
    capture = Publish(CaptureEntity)

    def step_one(self, me: Any) -> None:
        if me.target is None:
            prey = me.near(3000.0, team=me.prey_team)  # nearest first
            if not prey:
                return  # the last commands persist
            me.target = prey[min(me.id % 5, len(prey) - 1)]
        east, north, up = me.target.pos - me.pos
        me.speed = me.max_speed
        me.turn_rate = wrap(math.atan2(north, east) - me.yaw)
        me.pitch_rate = math.atan2(up, math.hypot(east, north)) - me.climb
        if me.distance(me.target) < me.capture_range:
            me.publish("capture", target=me.target)


PLACE: dict[str, Any] = {"placement": "uniform", "half_width": (300, 300, 100)}
BODY = Unicycle(vel_max=35, turn_rate_max=2, pitch_rate_max=1.5)
YOURS, STOCK = SharingChaser(), Predator(max_speed=35, allow_prey_switching=False)
MISSION = Mission(
    blocks=[
        Block(name="prey", team=1, count=60, **PLACE, autonomy=Boids(), motion=Unicycle(vel_max=30)),
        Block(name="you", team=2, count=5, position=(1500, -500, 0), **PLACE, autonomy=YOURS, motion=BODY),
        Block(name="stock", team=3, count=5, position=(1500, 500, 0), **PLACE, autonomy=STOCK, motion=BODY),
    ],
    end=120,
    interactions=[SimpleCapture()],
    metrics=[SimpleCaptureMetrics()],
)
results = Simulation(MISSION, seeds=range(1, int(sys.argv[1]) + 1 if len(sys.argv) > 1 else 25)).run()
for r in results:
    print(f"game {r.seed:2}: you {r.scores[2]:2g}, stock predators {r.scores[3]:2g}, prey left {r.alive[1]}")
won, lost = (sum(r.winner == team for r in results) for team in (2, 3))
print(f"of {len(results)} games you won {won} and lost {lost}")
