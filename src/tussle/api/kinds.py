"""Base classes of plugins."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np

from tussle.api.group import GroupView
from tussle.api.plugin import HistoricAttributes, Plugin
from tussle.api.results import named, number
from tussle.api.row_laws import step_rows
from tussle.api.world import WorldView
from tussle.declare.columns import EntityRef, Numbers, Output, Param, State
from tussle.declare.messages import Messages
from tussle.errors import DeclarationError, ParameterError
from tussle.world.scene import HeightField, TeamRegion, Volume


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
