"""Actors of a server, by gRPC."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from tussle.errors import ParameterError
from tussle.plugins.links.rpc import load_grpc, message_types

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
