"""Games of particles in a plane: tag, cooperative navigation, physical deception and dispersion.

They have the laws of motion, observations, actions and rewards of simple_tag, simple_spread and simple_adversary in MPE2 (Lowe and others
2017, Mordatch and Abbeel 2018), and of dispersion in VMAS: with the same first positions and actions, trajectories agree to 1e-9.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.api import (
    Autonomy,
    Controller,
    EasyAutonomy,
    Input,
    Interaction,
    MotionModel,
    Output,
    Param,
    State,
)
from tussle.mission import Block, Mission
from tussle.plugins.stock import Still
from tussle.rl.action import Act
from tussle.rl.computed import Computed
from tussle.rl.draws import uniform
from tussle.rl.kernels import glide, slide, total_force
from tussle.rl.observation import Each, Own
from tussle.rl.reward import Situation, Term
from tussle.rl.task import Task

AGENTS, OTHERS, LANDMARKS = 1, 0, 2
"""Teams: those whom the game is about, their adversaries, and landmarks."""


class ParticleContact(Controller):
    """Adds the forces of soft contacts to the push of a particle."""

    strength = Param(5.0, unit="N", gt=0.0, doc="Force of a push of 1.")
    stiffness = Param(
        100.0,
        unit="N/m",
        ge=0.0,
        doc="Contact force per penetration; 0 for particles that pass through each other.",
    )
    passes = Param(-1, doc="Team whose members are passed through.")
    push_x = Input()
    push_y = Input()
    total_x = Output(unit="N")
    total_y = Output(unit="N")

    def step(self, g: Any) -> None:
        index = g.index(np.inf)
        rows = slice(g.first, g.last)
        places = index.row_world[rows], index.place[rows], index.world_start
        own = *g.components("pos")[:2], self.strength, self.stiffness, self.passes.astype(float)
        others = index.points, g.by_place(index, "radius")[0], g.by_place(index, "team")[0]
        total_force((self.push_x, self.push_y), own, places, others, (self.total_x, self.total_y))


class Particle(MotionModel):
    """A particle in the plane, of mass 1, which loses a quarter of its velocity per step."""

    max_speed = Param(1e6, unit="m/s", gt=0.0)
    x = State("x y vx vy", unit="m m m/s m/s")
    total_x = Input(unit="N")
    total_y = Input(unit="N")
    advance = slide

    def from_body(self, body: Any, rows: np.ndarray) -> None:
        self.x[:2, rows], self.x[2:, rows] = body.pos[:2, rows], body.vel[:2, rows]

    def to_body(self, body: Any) -> None:
        body.pos[:2], body.vel[:2] = self.x[:2], self.x[2:]


class PushToNearest(Autonomy):
    """Pushes a particle towards the nearest member of a team, or away from it: the rule of these games."""

    team = Param(LANDMARKS, doc="Team of those that it is pushed to.")
    gain = Param(1.0, doc="Size of the push; negative to flee.")
    push_x = Output()
    push_y = Output()

    def step(self, g: Any) -> None:
        near = g.nearest(teams=self.team)
        push = self.gain * near.offset[:2, 0] / np.maximum(near.distance[0], 1e-9)
        self.push_x[:], self.push_y[:] = push


class GoalLandmark(Interaction):
    """Holds which landmark is the goal, which only the agents know."""

    number = Param(0, ge=0, doc="Place of the landmark in its block.")

    def step(self, w: Any) -> None:
        """Nothing: rewards and observations read the number."""


def particles(
    name: str, count: int, radius: float, team: int, half_width: float = 1.0, **plugins: Any
) -> Block:
    """Particles that start anywhere in a square."""
    return Block(
        name=name, team=team, count=count, radius=radius, placement="uniform", half_width=(half_width, half_width, 0),
        scatter_first=True, **{"motion": Particle(), **plugins},
    )  # fmt: skip


def game(name: str, *blocks: Block, **values: Any) -> Mission:
    """A game of 25 steps of 0.1 s."""
    return Mission(name=name, dt=0.1, end=2.5, blocks=blocks, **values)


OWN = Own("vel pos", planar=True)
MOVES = Act("push_x push_y", levels=[(0, 0), (-1, 0), (1, 0), (0, -1), (0, 1)])
REACH = 0.05
"""Radius of the chased agent of tag [m]."""


def spans(agents: np.ndarray, food: np.ndarray) -> np.ndarray:
    """Distances of positions (W, A, 2) and (W, n, 2) [m], (W, A, n)."""
    offset = agents[:, :, None] - food[:, None]
    return np.asarray(np.sqrt((offset * offset).sum(axis=-1)))


def distances(now: Situation, of: str) -> np.ndarray:
    """Distance of each agent to each entity of a block [m], (W, A, n)."""
    return spans(now.pos[..., :2], now.simulation.read(f"{of}.pos")[0][..., :2])


def caught(now: Situation) -> np.ndarray:
    """10 per contact for all adversaries, minus 10 for the agent, which must also stay in the field; agents are the last in a world."""
    x, y = now.pos[..., 0], now.pos[..., 1]
    dx, dy = x[:, :3] - x[:, 3:], y[:, :3] - y[:, 3:]
    n_contacts = (np.sqrt(dx * dx + dy * dy) < 0.075 + REACH).sum(axis=1)
    outside = np.zeros(len(x))
    for side in np.abs(x[:, 3]), np.abs(y[:, 3]):
        far = np.flatnonzero(side >= 0.9)
        bound = np.where(
            side[far] < 1.0, (side[far] - 0.9) * 10.0, np.minimum(np.exp(2.0 * side[far] - 2.0), 10.0)
        )
        outside[far] += bound
    agent = -10.0 * n_contacts - outside
    return np.stack([10.0 * n_contacts] * 3 + [agent], axis=1)


class SimpleTag(Task):
    """Three adversaries chase a faster agent between two round landmarks."""

    mission = game(
        "simple_tag",
        particles("adversary", 3, 0.075, OTHERS, controller=ParticleContact(strength=3), motion=Particle(max_speed=1.0),
                  autonomy=PushToNearest(team=AGENTS)),
        particles("agent", 1, REACH, AGENTS, controller=ParticleContact(strength=4), motion=Particle(max_speed=1.3),
                  autonomy=PushToNearest(team=OTHERS, gain=-1.0)),
        particles("landmark", 2, 0.2, LANDMARKS, 0.9, motion=Still()),
    )  # fmt: skip
    learners = "adversary agent"
    observation = {  # noqa: RUF012
        "adversary": [
            OWN,
            Each("landmark", planar=True),
            Each("adversary agent", planar=True),
            Each("agent", "vel", planar=True),
        ],
        "agent": [OWN, Each("landmark", planar=True), Each("adversary", planar=True)],
    }
    action = MOVES
    reward = {"tag": Term(caught)}  # noqa: RUF012


def no_messages(simulation: Any) -> np.ndarray:
    """The messages of the two others, who are silent: zeros, (W, 3, 4)."""
    return np.zeros((simulation.n_worlds, 3, 4))


def far_from_landmarks(now: Situation) -> np.ndarray:
    """Sum over the landmarks of the distance of the nearest agent [m], (W, 1)."""
    return np.asarray(distances(now, "landmark").min(axis=1).sum(axis=1)[:, None])


def touching(now: Situation) -> np.ndarray:
    """Number of other agents that an agent touches, (W, A)."""
    return now.n_within(0.3, "agent")


class SimpleSpread(Task):
    """Three agents spread to cover three landmarks without touching each other."""

    mission = game(
        "simple_spread",
        particles(
            "agent", 3, 0.15, AGENTS, controller=ParticleContact(passes=LANDMARKS), autonomy=PushToNearest()
        ),
        particles("landmark", 3, 0.05, LANDMARKS, motion=Still()),
    )
    learners = "agent"
    observation = (
        OWN,
        Each("landmark", planar=True),
        Each("agent", planar=True),
        Computed(4, no_messages, low=0.0, high=0.0),
    )
    action = MOVES
    reward = {"far": Term(far_from_landmarks, -0.5), "touching": Term(touching, -0.5)}  # noqa: RUF012


def goal_of(simulation: Any) -> np.ndarray:
    """Position of the goal of each world [m], (W, 2)."""
    number, _ = simulation.read("GoalLandmark.number")
    landmarks, _ = simulation.read("landmark.pos")
    return np.asarray(landmarks[np.arange(len(number)), number, :2])


def goal_offset(simulation: Any) -> np.ndarray:
    """Vector to the goal [m], (W, 3, 2)."""
    pos = np.concatenate(
        [simulation.read(f"{name}.pos")[0][..., :2] for name in ("adversary", "agent")], axis=1
    )
    return np.asarray(goal_of(simulation)[:, None] - pos)


def deceived(now: Situation) -> np.ndarray:
    """Minus the distance to the goal for the adversary; for agents, its distance minus that of the nearest agent [m], (W, 3)."""
    offset = now.pos[..., :2] - goal_of(now.simulation)[:, None]
    distance = np.sqrt((offset * offset).sum(axis=-1))
    agents = distance[:, 0] - distance[:, 1:].min(axis=1)
    return np.stack([-distance[:, 0], agents, agents], axis=1)


class SimpleAdversary(Task):
    """Two agents go to one of two landmarks, and keep an adversary, which does not know which one it is, from it."""

    mission = game(
        "simple_adversary",
        particles(
            "adversary", 1, 0.15, OTHERS, controller=ParticleContact(stiffness=0), autonomy=PushToNearest()
        ),
        particles(
            "agent", 2, 0.15, AGENTS, controller=ParticleContact(stiffness=0), autonomy=PushToNearest()
        ),
        particles("landmark", 2, 0.08, LANDMARKS, motion=Still()),
        interactions=[GoalLandmark()],
    )
    vary = {"GoalLandmark.number": uniform(0, 1, whole=True)}  # noqa: RUF012
    learners = "adversary agent"
    observation = {  # noqa: RUF012
        "adversary": [Each("landmark", planar=True), Each("agent", planar=True)],
        "agent": [
            Computed(2, goal_offset),
            Each("landmark", planar=True),
            Each("adversary agent", planar=True),
        ],
    }
    action = MOVES
    reward = {"deceived": Term(deceived)}  # noqa: RUF012


class WalledParticle(MotionModel):
    """A particle of mass 1 in a square, which loses a quarter of its velocity per step, and advances by the new velocity."""

    half_width = Param(1.0, unit="m", gt=0.0, doc="Half of the side of the square.")
    x = State("x y vx vy", unit="m m m/s m/s")
    push_x = Input(unit="N")
    push_y = Input(unit="N")
    advance = glide
    from_body, to_body = Particle.from_body, Particle.to_body


class PushToOwn(EasyAutonomy):
    """Pushes the k-th particle of a block to the k-th landmark, whose ids follow: the rule of dispersion."""

    n = Param(4, gt=0, doc="Number of particles.")
    push_x = Output(unit="N")
    push_y = Output(unit="N")

    def step_one(self, me: Any) -> None:
        offset = me.entity(me.id + me.n).pos - me.pos
        me.push_x, me.push_y = (min(max(10.0 * value, -1.0), 1.0) for value in offset[:2])


EATING = 0.085
"""Distance below which a particle reaches food: their radii [m]."""


class Meals(Interaction):
    """Food of which each piece is eaten, once, by the agents that reach it first; they share it."""

    share = State("a b c d", per="world", doc="Part of each piece for each who eats it in this step.")
    eaten = State("a b c d", dtype=bool, per="world", doc="Which pieces have been eaten.")

    def step(self, w: Any) -> None:
        agents, food = (np.flatnonzero(w.team == team) for team in (AGENTS, LANDMARKS))
        worlds = w.world[food].reshape(-1, 4)[:, 0]
        places = [w.pos[:2, rows].T.reshape(len(worlds), 4, 2) for rows in (agents, food)]
        n = (spans(*places) < EATING).sum(axis=1).T
        is_new = (n > 0) & ~self.eaten[:, worlds]
        self.share[:, worlds] = is_new / np.maximum(n, 1)
        self.eaten[:, worlds] |= is_new


def meals(now: Situation) -> np.ndarray:
    """Food that each agent has eaten in this step, (W, A)."""
    share, _ = now.simulation.read("Meals.share")
    return np.asarray(((distances(now, "food") < EATING) * share[:, None]).sum(axis=-1))


def food(simulation: Any) -> np.ndarray:
    """Offset of each piece of food [m], and whether it has been eaten, (W, A, 12)."""
    pos, there = (simulation.read(f"{name}.pos")[0][..., :2] for name in ("agent", "food"))
    eaten = np.broadcast_to(simulation.read("Meals.eaten")[0][:, None, :, None], (len(pos), 4, 4, 1))
    return np.concatenate([there[:, None] - pos[:, :, None], eaten], axis=-1).reshape(len(pos), 4, 12)


class Dispersion(Task):
    """Four agents, which start in the centre, spread to eat four pieces of food."""

    mission = game(
        "dispersion",
        Block(
            name="agent", team=AGENTS, count=4, radius=0.035, variance=(0, 0, 0), autonomy=PushToOwn(),
            motion=WalledParticle(),
        ),
        particles("food", 4, 0.05, LANDMARKS, motion=Still()),
        interactions=[Meals()],
    )  # fmt: skip
    time_limit = 10.0
    learners = "agent"
    observation = (
        Own("pos vel", planar=True),
        Computed(12, food, [-2.0, -2.0, 0.0] * 4, [2.0, 2.0, 1.0] * 4),
    )
    action = (Act("push_x", -1.0, 1.0), Act("push_y", -1.0, 1.0))
    reward = {"meals": Term(meals)}  # noqa: RUF012

    def ends(self, now: Situation) -> np.ndarray:
        """All food has been eaten."""
        return np.asarray(now.simulation.read("Meals.eaten")[0].all(axis=1))


__all__ = ["Dispersion", "Particle", "ParticleContact", "SimpleAdversary", "SimpleSpread", "SimpleTag"]
