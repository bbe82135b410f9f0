"""A game of two equal sides, as a file of plugins: each side's predators catch the other side; who flies by a policy catches nobody."""

from tussle.mission import Block, Mission
from tussle.rl import Act, NearestOthers, Own, Task, Term, alive, register
from tussle.stock import Boids, Predator, SimpleCapture, Unicycle


def side(name, team, x, autonomy=None):
    return Block(
        name=name, team=team, count=3, position=(x, 0.0, 0.0), placement="uniform", half_width=(10.0, 30.0, 0.0), scatter_first=True,
        autonomy=autonomy or Predator(max_speed=20.0, capture_range=8.0, prey_team_id=3 - team),
        motion=Unicycle(vel_max=20, turn_rate_max=2),
    )  # fmt: skip


def field(*blocks):
    return Mission(
        blocks=list(blocks),
        dt=0.1,
        end=6.0,
        interactions=[SimpleCapture(capture_range=8.0)],
        end_conditions="time, one_team",
    )


class Chase(Task):
    mission = field(side("red", 1, -30.0), side("blue", 2, 30.0))
    learners = "red"
    observation = (Own("vel", scale=20.0, frame="heading"), NearestOthers(1, frame="heading", scale=20.0))
    action = (Act("speed", 0.0, 20.0), Act("turn_rate", -2.0, 2.0), Act("pitch_rate", value=0.0))
    reward = {"alive": Term(alive, 0.01)}  # noqa: RUF012
    opponents, is_symmetric, margin = "test/ChaseBlue-v0", True, "alive[1]-alive[2]"


class ChaseBlue(Chase):
    learners = "blue"
    opponents, margin = "test/Chase-v0", "alive[2]-alive[1]"


class Flee(Task):
    """Prey against predators: the prey win if two of three are left."""

    mission = field(side("prey", 1, -30.0, Boids(max_speed=10.0)), side("hunters", 2, 30.0))
    learners = "prey"
    observation = (Own("vel", scale=20.0),)
    action = (Act("speed", 0.0, 20.0), Act("turn_rate", -2.0, 2.0), Act("pitch_rate", value=0.0))
    reward = {"alive": Term(alive, 0.01)}  # noqa: RUF012
    opponents, margin = "test/Hunt-v0", "alive[1]-1.5"


class Hunt(Flee):
    learners = "hunters"
    observation = (Own("vel", scale=20.0), NearestOthers(1, scale=20.0))
    opponents, margin = "test/Flee-v0", "1.5-alive[1]"


for task in (Chase, ChaseBlue, Flee, Hunt):
    register(f"test/{task.__name__}-v0", task)
