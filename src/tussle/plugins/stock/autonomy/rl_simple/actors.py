"""Actors, which choose actions from observations."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from tussle.errors import ParameterError
from tussle.plugins.links.rpc import load_grpc, message_types


class Alternating:
    """Alternates: every component of the action is 1 in the first step, then 0 (discrete) or -1 (continuous), then 1 again.

    Args:
        action_space: A space of Gymnasium; unused.
        observation_space: A space of Gymnasium; unused.
        params: The parameters of the plugin; unused.
    """

    def __init__(self, action_space: Any, observation_space: Any, params: dict[str, str]) -> None:
        self.is_forward = False

    def __call__(self, observation: np.ndarray) -> int:
        """Return the next action: 1 or -1 for all components; for discrete components -1 means 0."""
        self.is_forward = not self.is_forward
        return 1 if self.is_forward else -1


def spaces_of(x_discrete: bool, y_discrete: bool | None, max_speed: float, observed: int) -> tuple[Any, Any]:
    """Return the spaces of actions and observations that SCRIMMAGE passes to actors.

    Args:
        x_discrete: Whether the velocity along x has two values.
        y_discrete: Whether that along y has two values; None if it is not controlled.
        max_speed: Limit of continuous actions [m/s].
        observed: Number of components of an observation.

    Returns:
        Discrete or MultiDiscrete, Box, or a Tuple of both; and a Box. None and None without Gymnasium.
    """
    try:
        from gymnasium import spaces
    except ImportError:
        return None, None
    is_discrete = [part for part in (x_discrete, y_discrete) if part is not None]
    parts: list[Any] = []
    if discrete := sum(is_discrete):
        parts.append(spaces.Discrete(2) if discrete == 1 else spaces.MultiDiscrete([2] * discrete))
    if continuous := len(is_discrete) - discrete:
        parts.append(spaces.Box(-max_speed, max_speed, (continuous,), np.float64))
    action = parts[0] if len(parts) == 1 else spaces.Tuple(parts)
    return action, spaces.Box(-np.inf, np.inf, (observed,), np.float64)


TIMEOUT = 10.0  # [s] longest wait for an answer, and for a server that starts later
SERVICE = "/scrimmage_proto.OpenAI/"
MESSAGES = {
    "ContExtrema": "double min, double max",
    "ActionSpace": "repeated int32 discrete, repeated ContExtrema continuous",
    "Parameter": "string key, string value",  # as a map is sent
    "Environment": "ActionSpace action_spaces, ActionSpace observation_spaces, double min_reward, double max_reward, "
    "repeated Parameter params",
    "Obs": "repeated int32 discrete, repeated double continuous",
    "Action": "repeated int32 discrete, repeated double continuous, bool done",
    "Empty": "",
}


class ActorServer:
    """A connection to a server of actors: the service `scrimmage_proto.OpenAI`.

    Args:
        address: Host and port.
    """

    def __init__(self, address: str) -> None:
        self.address = address
        self._grpc = load_grpc("grpc_mode")
        self.types = message_types("scrimmage_proto", **MESSAGES)
        self._channel = self._grpc.insecure_channel(address)

    def ask(self, method: str, request: Any, answer: str, of: tuple[tuple[str, str], ...]) -> Any:
        """Call a method and return its answer, a message of that type; `of` goes as metadata.

        Raises:
            ParameterError: The server does not answer, or answers with an error.
        """
        call = self._channel.unary_unary(
            SERVICE + method, lambda message: message.SerializeToString(), self.types[answer].FromString
        )
        try:
            return call(request, timeout=TIMEOUT, wait_for_ready=True, metadata=of)
        except self._grpc.RpcError as error:
            raise ParameterError(
                f"the server of actors at {self.address} (grpc_address, port) has no answer to {method} after {TIMEOUT:g} s: "
                f"{error.code().name} {error.details()}"
            ) from None

    def end(self) -> None:
        """Close the connection; called when the simulation is closed."""
        self._channel.close()


class RemoteActor:
    """The actor of an entity, in a server.

    Args:
        server: The server.
        is_discrete: Whether each component of an action is chosen from two values.
        limit: Of continuous components [m/s].
        n_observed: Numbers of an observation.
        params: The parameters of the plugin, as texts.
        world: World of the entity; it goes with each call as metadata.
        entity: Its id, likewise.
    """

    def __init__(
        self, server: ActorServer, is_discrete: list[bool], limit: float, n_observed: int, params: Mapping[str, str],
        world: int, entity: int,
    ) -> None:  # fmt: skip
        self._server, types = server, server.types
        self._of = ("world", str(world)), ("entity", str(entity))
        space, extrema = types["ActionSpace"], types["ContExtrema"]
        n = sum(is_discrete)
        actions = space(
            discrete=[2] * n, continuous=[extrema(min=-limit, max=limit)] * (len(is_discrete) - n)
        )
        seen = space(continuous=[extrema(min=-math.inf, max=math.inf)] * n_observed)
        environment = types["Environment"](
            action_spaces=actions, observation_spaces=seen, min_reward=-math.inf, max_reward=math.inf,
            params=[types["Parameter"](key=key, value=value) for key, value in params.items()],
        )  # fmt: skip
        server.ask("SendEnvironment", environment, "Empty", self._of)

    def act(self, observation: np.ndarray) -> tuple[list[int], list[float]]:
        """Discrete and continuous components of the action for an observation, (k,)."""
        observed = self._server.types["Obs"](continuous=observation.tolist())
        action = self._server.ask("GetAction", observed, "Action", self._of)
        return list(action.discrete), list(action.continuous)
