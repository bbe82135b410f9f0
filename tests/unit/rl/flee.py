"""A small game for the interfaces: prey that learn, and hunters that play by rule."""

from tussle import Block, Mission
from tussle.rl import Act, NearestOthers, Own, Task, Term, alive, captured
from tussle.stock import Boids, Predator, SimpleCapture, Unicycle


def mission(prey: int = 6, **changes):
    flock = Block(
        name="prey",
        team=1,
        count=prey,
        placement="uniform",
        half_width=(60, 60, 10),
        scatter_first=True,
        autonomy=Boids(),
        motion=Unicycle(vel_max=20, turn_rate_max=2),
    )
    hunters = Block(
        name="hunters",
        team=2,
        count=2,
        position=(90, 0, 0),
        heading="180 deg",
        autonomy=Predator(max_speed=40, capture_range=12),
        motion=Unicycle(vel_max=40, turn_rate_max=3, pitch_rate_max=2),
    )
    values = {
        "blocks": [flock, hunters],
        "dt": 0.1,
        "end": 6,
        "interactions": [SimpleCapture(capture_range=12)],
    }
    return Mission(**{**values, "end_conditions": "time, one_team, all_dead", **changes})


class Flee(Task):
    mission = mission()
    learners = "prey"
    observation = (Own("vel", scale=20.0), NearestOthers(3, scale={"offset": 50.0, "relative_vel": 20.0}))
    action = (Act("speed", 0.0, 20.0), Act("turn_rate", -2.0, 2.0), Act("pitch_rate", value=0.0))
    reward = {"alive": Term(alive, 0.1), "captured": Term(captured, -1.0)}  # noqa: RUF012
