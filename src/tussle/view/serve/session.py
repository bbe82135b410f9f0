"""The commands of a served simulation, as JSON objects."""

from __future__ import annotations

import base64
import inspect
import json
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from tussle.declare import messages
from tussle.engine.simulation import Simulation
from tussle.engine.snapshot import Snapshot
from tussle.errors import ParameterError, TussleError, listed, nearest_name

MAX_SNAPSHOTS = 16
"""Kept at once; the oldest is dropped for another."""
ENCODINGS = ("list", "base64")


def encoded(values: Any, encoding: str) -> Any:
    """Values as JSON: nested lists, or the bytes of an array with its type and shape.

    Args:
        values: An array; lists of entities are an array of objects.
        encoding: "list" (numbers that are not finite become null) or "base64" (all bits are kept).

    Raises:
        ParameterError: The encoding is not known.
    """
    if encoding not in ENCODINGS:
        raise ParameterError(
            f"encoding = {encoding!r} is not allowed{nearest_name(str(encoding), ENCODINGS)}; {listed(ENCODINGS)}"
        )
    if values is None:
        return None
    array = np.asarray(values)
    if array.dtype == object:
        flat = [encoded(value, encoding) for value in array.reshape(-1)]
        return (
            flat
            if array.ndim == 1
            else [flat[k : k + array.shape[1]] for k in range(0, array.size, array.shape[1])]
        )
    if encoding == "base64":
        data = base64.b64encode(array.tobytes()).decode()
        return {"dtype": array.dtype.str, "shape": list(array.shape), "base64": data}
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        return np.where(np.isfinite(array), array.astype(object), np.array(None)).tolist()
    return array.tolist()


def as_json(message: Any) -> str:
    """A message as JSON, in which numbers that are not finite are null: those of a metric, or of a client's id."""
    try:
        return json.dumps(message, allow_nan=False)
    except ValueError:
        return json.dumps(json.loads(json.dumps(message), parse_constant=lambda _: None))


class Session:
    """Executes commands on a simulation. Each public method is a command; its arguments are the fields of the message.

    Args:
        simulation: The simulation; nobody else may step it.
    """

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self._snapshots: dict[int, Snapshot] = {}
        self._n_snapshots = 0

    @staticmethod
    def commands() -> dict[str, Callable[..., Any]]:
        """The commands by name."""
        return {
            name: value
            for name, value in vars(Session).items()
            if inspect.isfunction(value) and not name.startswith("_") and name != "call"
        }

    def call(self, command: str, fields: Mapping[str, Any]) -> dict[str, Any]:
        """Execute a command and return the fields of its answer.

        Raises:
            TussleError: The command or a field is not known, or a value is not allowed.
        """
        known = self.commands()
        if command not in known:
            raise ParameterError(
                f"there is no command {command!r}{nearest_name(str(command), known)}; {listed(known)}"
            )
        allowed = inspect.signature(known[command]).parameters
        for name in fields:
            if name not in allowed or name == "self":
                names = [each for each in allowed if each != "self"]
                raise ParameterError(
                    f"{command} has no field {name!r}{nearest_name(name, names)}; {listed(names)}"
                )
        for name, parameter in allowed.items():
            if parameter.default is parameter.empty and name not in fields and name != "self":
                raise ParameterError(f"{command} needs the field {name!r}")
        try:
            return dict(known[command](self, **fields))
        except TussleError:
            raise
        except (TypeError, ValueError, OverflowError) as error:  # of values of a wrong type, deep in an array
            raise ParameterError(f"{command}: a value is not allowed: {error}") from error

    # -- time -------------------------------------------------------------------------------------------------------------------

    def now(self) -> dict[str, Any]:
        """Time and step of each world, and whether all have ended."""
        simulation = self._simulation
        return {"t": simulation.t.tolist(), "step": simulation.steps.tolist(), "is_over": simulation.is_over}

    def reset(self, worlds: list[int] | None = None, seeds: list[int] | None = None) -> dict[str, Any]:
        """Restart worlds, all if none are named, with the same seeds or new ones."""
        self._simulation.reset(range(self._simulation.n_worlds) if worlds is None else worlds, seeds)
        return self.now()

    def snapshot(self) -> dict[str, Any]:
        """Keep the whole state."""
        self._n_snapshots += 1
        self._snapshots[self._n_snapshots] = self._simulation.snapshot()
        if len(self._snapshots) > MAX_SNAPSHOTS:
            del self._snapshots[min(self._snapshots)]
        return {"snapshot": self._n_snapshots}

    def restore(self, snapshot: int) -> dict[str, Any]:
        """Return to a state that was kept."""
        if snapshot not in self._snapshots:
            raise ParameterError(f"there is no snapshot {snapshot!r}; {listed(map(str, self._snapshots))}")
        self._simulation.restore(self._snapshots[snapshot])
        return self.now()

    # -- state ------------------------------------------------------------------------------------------------------------------

    def describe(self) -> dict[str, Any]:
        """The mission, its blocks and its worlds."""
        mission, context = self._simulation.mission, self._simulation.state.context
        blocks = [{"name": block.name, "team": block.team, "count": block.count} for block in mission.blocks]
        return {
            "mission": mission.name, "dt": mission.dt, "end": mission.end, "seeds": [int(seed) for seed in context.seeds],
            "blocks": blocks, "schedule": self._simulation.describe(), **self.now(),
        }  # fmt: skip

    def read(self, path: str, encoding: str = "list") -> dict[str, Any]:
        """A column, such as "prey.pos", and which places hold a living entity; as `Simulation.read`."""
        values, mask = self._simulation.read(path)
        return {"values": encoded(values, encoding), "mask": encoded(mask, encoding)}

    def write(self, path: str, values: Any) -> dict[str, Any]:
        """Set a column, with values shaped as from `read`; as `Simulation.write`."""
        array = np.array(values)
        try:
            array = array.astype(float) if array.dtype == object else array
        except TypeError:
            raise ParameterError("values are no numbers, nor lists of numbers or null") from None
        self._simulation.write(path, array)
        return {}

    def publish(
        self, message: str, fields: Any, worlds: list[int] | None = None, network: Any = "", topic: Any = ""
    ) -> dict[str, Any]:  # fmt: skip
        """Publish a message to the plugins, such as SpawnEntity or RemoveEntity; as `Simulation.publish`."""
        if not (isinstance(fields, dict) and isinstance(network, str) and isinstance(topic, str)):
            raise ParameterError(
                "publish: fields is an object with values by name; network and topic are texts"
            )
        kinds = {kind.__name__: kind for kind in messages.Message.__subclasses__()}
        if message not in kinds:
            raise ParameterError(
                f"there is no message {message!r}{nearest_name(str(message), kinds)}; {listed(sorted(kinds))}"
            )
        self._simulation.publish(kinds[message], worlds, network=network, topic=topic, **fields)
        return {}

    def result(self) -> dict[str, Any]:
        """Why each world ended, who is alive, scores and metrics, so far."""
        names = ("seed", "end", "alive", "scores", "metrics", "winner")
        worlds = [{name: getattr(each, name) for name in names} for each in self._simulation.result()]
        return {"worlds": json.loads(json.dumps(worlds, default=_plain))}

    def state_hash(self, world: int = 0) -> dict[str, Any]:
        """Hash of the state of a world."""
        return {"hash": self._simulation.state_hash(world)}


def _plain(value: Any) -> Any:
    """A NumPy value as one of Python; else its text."""
    return value.tolist() if isinstance(value, (np.generic, np.ndarray)) else str(value)
