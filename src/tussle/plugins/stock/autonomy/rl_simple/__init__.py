"""Robots that move by the actions of an actor and earn rewards near the origin or near each other."""

from __future__ import annotations

import copy
import inspect
import types
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from tussle.api import Autonomy, GroupView, Handle, HistoricAttributes, Input, Output, Param, Publish
from tussle.declare.messages import RewardGiven
from tussle.errors import ParameterError, clipped
from tussle.numeric import clip
from tussle.plugins.stock.autonomy.rl_simple.actors import ActorServer, Alternating, RemoteActor, spaces_of

DEFAULT_MODULE = "scrimmage.openai.tests.test_openai"
DEFAULT_FUNCTION = "actor_init_func"


@dataclass
class Agent:
    """The actor of an entity.

    Attributes:
        actor: The actor; None before the first observation.
    """

    actor: Any = None


class RLSimple(Autonomy):
    """Moves by the actions of a Python actor, and earns a reward of 1 in each step in which it is near the origin.

    The reward is published as `RewardGiven`, which `OpenAIRewards` sums: 1 where |x|, rounded to whole metres, is below `radius`. The actor
    gets the observation of `RLSimpleSensor` or `RLConsensusSensor`, (k,), and returns an action: first the discrete components, then the
    continuous ones. A discrete one is 1 (1 m/s along its axis) or 0 (-1 m/s); a continuous one is a velocity, limited to `max_speed`.

    Actors come from plugin files (`--plugin-path`), since a mission names no code: a function whose first parameter is named
    `action_space`, such as `def actor_init_func(action_space, obs_space, params)`. It is called once for each entity, with spaces of
    Gymnasium (None without it) and the parameters as texts, and returns a callable or an object with `act`. A mission names it by
    `actor_init_func`, the default being the function of that name. Without one, entities move to and fro.

    With `grpc_mode`, a server is asked for actions by gRPC, with the service `OpenAI` of SCRIMMAGE: `SendEnvironment` when an entity
    appears, `GetAction` in each step. Each call may take 10 s, and has the number of the world and the id of the entity as metadata.

    Differences from SCRIMMAGE: it imports any module; a snapshot has the attributes of an actor that is an object of a
    class, and no variables of functions and nothing of a server; `done` of a server's action has no effect.
    """

    grade = "external"
    historic_attributes = HistoricAttributes(
        unread=("server_address", "library"), chosen_by="actor_init_func",
        chosen_default=DEFAULT_FUNCTION, chosen_kind="function {} whose first parameter is action_space",
    )  # fmt: skip
    actor_init: ClassVar[Callable[[Any, Any, dict[str, str]], Any]] = Alternating
    """Creates an actor."""
    is_own_actor: ClassVar[bool] = True
    """True for the built-in actor, False for a function of a plugin file."""

    radius = Param(
        2.0, unit="m", ge=0.0, doc="Distance from the origin along x below which there are rewards."
    )
    x_discrete = Param(True, doc="Choose the velocity along x from two values.")
    ctrl_y = Param(False, doc="Choose a velocity along y too.")
    y_discrete = Param(False, doc="Choose the velocity along y from two values.")
    max_speed = Param(10.0, unit="m/s", ge=0.0, doc="Limit of a continuous velocity.")
    module = Param(
        DEFAULT_MODULE, doc="Module of the actor in the mission file; the actor itself is in a plugin file."
    )
    grpc_mode = Param(False, structural=True, doc="Ask a server for actions.")
    grpc_address = Param("127.0.0.1", doc="Where that is.")
    port = Param(50051, structural=True, ge=1, le=65535, doc="Its port.")
    agent = Handle(doc="The actor.")
    observation = Input(fields="value", ragged=True)
    rewards = Publish(RewardGiven)
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def check_values(self) -> None:
        """Check that there is an actor."""
        name = type(self).__name__
        if self._is_alternating() and self.module != DEFAULT_MODULE:
            raise ParameterError(
                f"{name}.module = {clipped(self.module)!r}: a mission names no code; give the actor's file with --plugin-path, in which a "
                f"function such as {DEFAULT_FUNCTION}(action_space, obs_space, params) returns the actor, or omit module"
            )

    def open_one(self, row: Any) -> Agent:
        """Return an agent without an actor, which is created at the first observation."""
        return Agent()

    def save_one(self, agent: Agent) -> Any:
        """Return a copy of the actor; None for that of a server, which is told the environment again."""
        return None if isinstance(agent.actor, RemoteActor) else copy.deepcopy(agent.actor)

    def load_one(self, row: Any, state: Any) -> Agent:
        """Recreate the actor."""
        return Agent(copy.deepcopy(state))

    @classmethod
    def adapters(cls, module: Mapping[str, Any]) -> list[type[RLSimple]]:
        """Return a plugin for each function that a module, given by its names, defines to create actors."""
        return [
            adapted(cls, value) for value in list(module.values()) if is_actor_init(value, module["__name__"])
        ]

    def step(self, g: GroupView) -> None:
        reward = self.reward(g)
        rows = np.flatnonzero(reward)
        self.rewards.publish(rows, entity=g.id[rows], team=g.team[rows], reward=reward[rows])
        x_discrete, ctrl_y, y_discrete, max_speed = (
            np.broadcast_to(value, g.n) for value in (self.x_discrete, self.ctrl_y, self.y_discrete, self.max_speed)
        )  # fmt: skip
        for row, agent in enumerate(self.agent):
            seen = np.array(self.observation[row][0])
            kinds = (bool(x_discrete[row]), bool(y_discrete[row]) if ctrl_y[row] else None)
            limit = float(max_speed[row])
            if agent.actor is None:
                agent.actor = self._actor(g, row, kinds, limit, len(seen))
            self.velocity[:, row] = self._velocity(
                getattr(agent.actor, "act", agent.actor)(seen), kinds, limit
            )

    def reward(self, g: GroupView) -> np.ndarray:
        """Rewards of this step, (n,)."""
        return np.where(np.floor(np.abs(g.pos[0]) + 0.5) < self.radius, 1.0, 0.0)

    def _is_alternating(self) -> bool:
        return self.is_own_actor and not self.grpc_mode

    def _actor(
        self, g: GroupView, row: int, kinds: tuple[bool, bool | None], limit: float, n_observed: int
    ) -> Any:
        """Create an actor."""
        values = {name: np.asarray(getattr(self, name)) for name in self.params()}
        texts = {name: str(value[row] if value.ndim == 1 else value) for name, value in values.items()}
        if self.grpc_mode:
            address = f"{self.grpc_address}:{self.port}"
            server = g.context.share((RLSimple, address), lambda: ActorServer(address))
            is_discrete = [kind for kind in kinds if kind is not None]
            return RemoteActor(
                server, is_discrete, limit, n_observed, texts, int(g.world[row]), int(g.id[row])
            )
        actor = type(self).actor_init(*spaces_of(*kinds, limit, n_observed), texts)
        if not callable(getattr(actor, "act", actor)):
            raise ParameterError(
                f"{type(self).__name__}: {self._function()} returned {clipped(str(actor))!r}; it returns a callable or an object with act"
            )
        return actor

    def _function(self) -> str:
        return str(getattr(type(self).actor_init, "__name__", "the actor's function"))

    def _velocity(
        self, action: Any, kinds: tuple[bool, bool | None], limit: float
    ) -> tuple[float, float, float]:
        """Velocity [m/s] of an action."""
        is_discrete = [kind for kind in kinds if kind is not None]
        order = [i for i, kind in enumerate(is_discrete) if kind] + [
            i for i, kind in enumerate(is_discrete) if not kind
        ]
        parts = action if isinstance(action, tuple | list) else (action,)
        try:
            numbers = np.concatenate([np.ravel(np.asarray(part, float)) for part in parts])
        except (TypeError, ValueError):
            numbers = np.empty(0)
        if self._is_alternating():
            numbers = np.repeat(numbers, len(order))
        if len(numbers) != len(order) or not np.isfinite(numbers).all():
            raise ParameterError(
                f"{type(self).__name__}: the actor of {self._function()} chose {clipped(str(action))}; an action has {len(order)} finite "
                "numbers, first the discrete ones"
            )
        velocity = [0.0, 0.0, 0.0]
        for i, number in zip(order, numbers, strict=True):
            velocity[i] = (
                (1.0 if number > 0 else -1.0) if is_discrete[i] else float(clip(number, -limit, limit))
            )
        return velocity[0], velocity[1], velocity[2]


class RLConsensus(RLSimple):
    """Moves by the actions of a Python actor, and earns rewards near others; see `RLSimple` for actors and actions.

    With `reward_type="others"`, the reward of a step is the share of the world's entities that are other ones with
    |x - own x| below `radius`; with "origin", the default, it is that of `RLSimple`.

    Differences from SCRIMMAGE: it divides rewards by the duration of the mission [s].
    """

    grade = "external"

    reward_type = Param(
        "origin", choices=("origin", "others"), doc="Reward for being near the origin, or near others."
    )

    def reward(self, g: GroupView) -> np.ndarray:
        """Rewards of this step, (n,)."""
        if self.reward_type == "origin":
            return super().reward(g)
        reward = np.zeros(g.n)
        for world in np.unique(g.world):
            x = np.sort(g.bodies.pos[0, g.bodies.world == world])
            rows = np.flatnonzero(g.world == world)
            own, radius = g.pos[0, rows], np.broadcast_to(self.radius, g.n)[rows]
            near = np.searchsorted(x, own + radius, "left") - np.searchsorted(x, own - radius, "right")
            reward[rows] = np.maximum(near - 1, 0) / len(x)
        return reward


def is_actor_init(value: Any, module: str) -> bool:
    """Return True if a value of a module is a function that is defined there and creates actors."""
    if not isinstance(value, types.FunctionType) or value.__module__ != module:
        return False
    return next(iter(inspect.signature(value).parameters), "") == "action_space"


def adapted(base: type[RLSimple], function: Callable[..., Any]) -> type[RLSimple]:
    """Return the plugin that uses the actors of a function. It belongs to the module of the function."""
    name = f"{base.__name__}_{function.__name__}"
    members = {
        "__module__": function.__module__, "__doc__": f"{base.__name__} with the actors of {function.__name__}.",
        "actor_init": staticmethod(function), "is_own_actor": False,
    }  # fmt: skip
    return types.new_class(name, (base,), exec_body=lambda body: body.update(members))
