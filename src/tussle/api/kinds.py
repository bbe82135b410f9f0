"""Base classes of plugins."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from tussle.api.group import GroupView
from tussle.api.plugin import HistoricAttributes, Plugin
from tussle.api.row_laws import step_rows
from tussle.api.world import WorldView
from tussle.declare.columns import EntityRef, Numbers, Output, Param, State, Subscribe
from tussle.declare.messages import Messages, TextMessage
from tussle.errors import DeclarationError, ParameterError
from tussle.world.scene import HeightField, TeamRegion, Volume


def named(found: Any, where: str) -> Mapping[str, Any]:
    """Return results by name.

    Raises:
        ParameterError: They are no dict, or have a name that is no text.
    """
    if not isinstance(found, Mapping):
        raise ParameterError(f"{where} returns {found!r:.60}; it takes a dict, {{'name': value}}")
    for name in found:
        if not (isinstance(name, str) and name):
            raise ParameterError(f"{where}: {name!r:.60} is not a name; it takes a text")
    return found


def number(value: Any, where: str, allowed: str) -> bool | int | float:
    """Return a number of a result.

    Raises:
        ParameterError: It is none, or too long for tables.
    """
    found = value.item() if isinstance(value, np.generic | np.ndarray) and value.ndim == 0 else value
    if not isinstance(found, (bool, int, float)):
        raise ParameterError(f"{where} = {value!r:.60} is not allowed; it takes {allowed}")
    if isinstance(found, int) and abs(found) > sys.float_info.max:
        raise ParameterError(
            f"{where} is a whole number of {found.bit_length():,} bits; it takes up to 1,024"
        )
    return found


class EntityPlugin(Plugin):
    """A plugin of an entity; abstract."""

    kind: ClassVar[str] = "entity plugin"
    only_calls_kernels: ClassVar[bool] = False
    """All that the plugin does in a step is to call kernels and neighbour laws, always the same ones with the same columns, arrays and
    numbers, so that compiled code may call them again. Kernels return nothing, or True where the next one is to be called; what else they
    find is in an array that `GroupView.finish` reads. Classes do not inherit it."""
    wired: frozenset[str]
    """In a simulation: names of the outputs that other plugins read. Other outputs need not be written."""

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        for name, column in cls.states().items():
            if column.per != "entity":
                raise DeclarationError(
                    f"{cls.__name__}.{name}: a column per {column.per} belongs to an interaction, a network or a metric; "
                    "a plugin of an entity has State(per='entity')"
                )

    def unused_states(self) -> tuple[str, ...]:
        """Return names of `State` columns that this instance leaves at their defaults; they are not part of the state hash."""
        return ()

    def state_size(self, name: str) -> int:
        """Return the number of components of a `State` column; a model whose structural parameters add some has more than fields."""
        return len(type(self).states()[name].fields)

    def spawn(self, g: GroupView, rows: np.ndarray) -> None:
        """Initialise columns of newborn entities beyond the declared defaults; `rows` are row numbers in `g`, (m,)."""

    def step(self, g: GroupView) -> None:
        """Perform one step of all rows."""
        raise TypeError(f"{type(self).__name__} has no step")


def row_shape(plugin: Plugin, column: Numbers) -> tuple[int, ...]:
    """Shape of one row's value of a plugin's column that is not ragged: () or (k,), with the components that `state_size` adds."""
    has_size = isinstance(plugin, EntityPlugin) and isinstance(column, State)
    k = plugin.state_size(column.name) if has_size else len(column.fields)
    return (k,) if k else ()


class Autonomy(EntityPlugin):
    """Decision making: reads the entity's belief and neighbours, writes desired values; abstract."""

    kind = "autonomy"


class Behavior(Autonomy):
    """A motor schema: an autonomy inside another one, whose output is a desired velocity; abstract."""

    kind = "behavior"
    gain = Param(1.0, ge=0.0, doc="Weight among the behaviours of one entity.")
    desired_velocity = Output(
        "desired_velocity_x desired_velocity_y desired_velocity_z",
        unit="m/s",
        doc="Desired velocity, world frame.",
    )


class Controller(EntityPlugin):
    """Converts desired values to inputs of the next controller or the motion model; abstract.

    It consists of row laws (see `row_law`), or has a `step` for all rows.
    """

    kind = "controller"
    passthrough: ClassVar[bool] = False
    """Outputs equal inputs: the controller only connects channels and is not called."""

    def step(self, g: GroupView) -> None:
        """Perform one step of all rows: the row laws, in order of declaration."""
        step_rows(self, g)


class Sensor(EntityPlugin):
    """Measures after motion, and writes channels for autonomies; abstract.

    The outputs `belief_pos`, `belief_vel` and `belief_quat` are the entity's estimate of its own state.
    """

    kind = "sensor"
    alters_sensors: ClassVar[bool] = False
    """Return True if the outputs are channels that sensors before it have written, and that it alters."""


class WorldPlugin(Plugin):
    """A plugin of the world; abstract. Parameters have one value per world."""

    kind: ClassVar[str] = "world plugin"
    reads_start_positions: ClassVar[bool] = False
    """Return True if `step` reads `w.start_pos`."""

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        for name, column in cls.columns.items():
            if isinstance(column, EntityRef):
                raise DeclarationError(
                    f"{cls.__name__}.{name}: a world plugin has no EntityRef columns; keep ids in a State(dtype=int)"
                )

    def regions(self) -> tuple[TeamRegion, ...]:
        """Regions that this plugin defines, for `w.region` and pictures; its structural parameters are known."""
        return ()

    def walls(self) -> tuple[Volume, ...]:
        """Walls that this plugin adds to the scene; its structural parameters are known."""
        return ()

    def terrain(self) -> HeightField | None:
        """Terrain that this plugin gives to the scene; its structural parameters are known."""
        return None

    def start(self, w: WorldView) -> None:
        """Called at the start of worlds, after their initial entities are placed."""

    def step(self, w: WorldView) -> None:
        """Perform one step of all worlds."""

    def result(self, w: WorldView) -> dict[str, np.ndarray]:
        """Results: name -> (n_worlds,) or (n_teams, n_worlds)."""
        return {}

    def result_of(self, w: WorldView, world: int) -> dict[str, Any]:
        """Results of one world: name -> number, or name -> {team: number}.

        Raises:
            ParameterError: A result has another shape, or is no number.
        """
        where = f"{type(self).__name__}.result"
        out: dict[str, Any] = {}
        by_world, by_team = (w.n_worlds,), (len(w.teams), w.n_worlds)
        for name, value in named(self.result(w), where).items():
            array = np.asarray(value, None if isinstance(value, np.ndarray) else object)
            allowed = [by_team] if name == "score" and isinstance(self, Metric) else [by_world, by_team]
            if array.shape not in allowed:
                raise ParameterError(
                    f"{where}: {name!r} has the shape {array.shape}; it takes "
                    + " or ".join(
                        f"{shape}, one per {'world' if shape == by_world else 'team and world'}"
                        for shape in allowed
                    )
                )
            values = [number(each, f"{where}: {name!r}", "numbers") for each in array[..., world].flat]
            out[name] = dict(zip(w.teams.tolist(), values, strict=True)) if array.ndim > 1 else values[0]
        return out


class Interaction(WorldPlugin):
    """Interactions of entities after motion and sensors, such as captures, collisions and fields; abstract."""

    kind = "interaction"

    def rejects(self, w: WorldView, world: int, pos: np.ndarray, taken: np.ndarray) -> bool:
        """Return True if an entity must not be placed at `pos` [m], (3,), in world number `world`, with others at `taken` [m], (3, m)."""
        return False


class Metric(WorldPlugin):
    """Counts and scores; abstract. The result "score", with one row per team, determines the winner."""

    kind = "metric"


class Network(WorldPlugin):
    """Carries messages between entities; abstract.

    A network with `losses` counts its links: copies of messages to others within reach, delivered and lost. The counts are part of
    the result of each world.
    """

    kind = "network"
    losses: ClassVar[tuple[str, ...]] = ()
    """Reasons for which a message to an entity within reach may be lost; see `Links`."""
    waits_for_traffic: ClassVar[bool] = False
    """Return True if a delayed message also waits until another one is published on its topic."""
    historic_attributes = HistoricAttributes(least_zero=("comm_delay",))
    comm_delay = Param(0.0, unit="s", ge=0.0, doc="Time from sending to the earliest delivery.")
    monitor_publisher_topics = Param(
        "", doc="Topics whose published messages are counted, by commas; * is all together."
    )
    monitor_subscriber_topics = Param(
        "", doc="Topics whose received messages are counted, by commas; * is all together."
    )
    csv_filename = Param("", doc="File of a run directory for these counts, step by step.")
    link_counts: np.ndarray
    """In a simulation: links delivered, then lost for each reason, (1 + n_losses, n_worlds)."""

    def transmit(self, w: WorldView, outboxes: Sequence[Messages]) -> Any:
        """Route the messages of all topics of a step: `Links`, or what `route` returns for each topic."""
        return [self.route(w, messages) for messages in outboxes]

    def route(self, w: WorldView, messages: Messages) -> Any:
        """Receivers of each message: `EVERYONE`, `SAME_ENTITY`, or (message numbers, body rows of the receivers), each (m,)."""
        raise TypeError(f"{type(self).__name__} has no route")

    def result(self, w: WorldView) -> dict[str, np.ndarray]:
        if not self.losses:
            return {}
        lost = {f"lost_{name}": self.link_counts[1 + i] for i, name in enumerate(self.losses)}
        return {"sent": self.link_counts.sum(axis=0), "delivered": self.link_counts[0], **lost}


class StateFollower(Autonomy):
    """An autonomy with plugins inside that act in some states of the entity; abstract.

    The state is the last text that the entity received on the topic `state_topic_name` of the network that the subclass names in its
    parameter `network_name`. Inner plugins with `states` act in these, the others always. Before the first text only the latter act.
    """

    state_topic_name = Param("State", doc="Topic of the entity's state.")
    state = State(
        dtype=int, default=-1, doc="Number of the state among those named by inner plugins; -1 for others."
    )
    told_state = Subscribe(TextMessage, network_param="network_name", topic_param="state_topic_name")

    def unused_states(self) -> tuple[str, ...]:
        """Return `state` if no inner plugin has states."""
        return () if self._names() else ("state",)

    def read_state(self) -> None:
        """Update `state` with the messages received; call it once in each step."""
        names = self._names()
        if names and self.told_state:
            rows, received = self.told_state.latest()
            number = {name: i for i, name in enumerate(names)}
            self.state[rows] = [number.get(text, -1) for text in received.text]

    def acts(self, plugin: Any, state: np.ndarray | None = None) -> np.ndarray | None:
        """Return True if an inner plugin acts in each row, (n,), for `g.step`; None if it always acts.

        Args:
            plugin: The inner plugin.
            state: State numbers, (n,); by default the present ones.
        """
        if not plugin.active_in:
            return None
        names = self._names()
        return np.isin(self.state if state is None else state, [names.index(n) for n in plugin.active_in])

    def _names(self) -> list[str]:
        inner = [p for key in self.children() for p in self.values[key]]
        return sorted({name for p in inner for name in p.active_in})
