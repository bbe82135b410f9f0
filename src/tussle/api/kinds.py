"""The kinds of plugin that an author derives from."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from tussle.api.group import GroupView
from tussle.api.plugin import HistoricAttributes, Plugin
from tussle.api.row_laws import step_rows
from tussle.api.world import WorldView
from tussle.columns import Output, Param


class EntityPlugin(Plugin):
    """A plugin of an entity; abstract."""

    kind: ClassVar[str] = "entity plugin"
    wired: frozenset[str]
    """In a simulation: names of its outputs that somebody reads. The others may be left as they are."""

    def spawn(self, g: GroupView, rows: np.ndarray) -> None:
        """Set the columns of new rows where their declared defaults do not do; `rows` are row numbers in `g`."""

    def step(self, g: GroupView) -> None:
        """One step of all rows."""
        raise TypeError(f"{type(self).__name__} has no step")


class Autonomy(EntityPlugin):
    """Decides: reads the entity's belief and its neighbours, writes wanted values; abstract."""

    kind = "autonomy"


class Behavior(Autonomy):
    """A motor schema: an autonomy inside another one, whose output is one wanted velocity; abstract."""

    kind = "behavior"
    gain = Param(1.0, ge=0.0, doc="Weight among the behaviours of one entity.")
    desired_velocity = Output(
        "desired_velocity_x desired_velocity_y desired_velocity_z",
        unit="m/s",
        doc="Wanted velocity, world frame.",
    )


class Controller(EntityPlugin):
    """Turns wanted values into what the next controller or the motion model takes; abstract.

    It is written as row laws (see `row_law`), or as a `step` of all rows.
    """

    kind = "controller"
    passthrough: ClassVar[bool] = False
    """Its outputs are its inputs: it is wiring, and no call."""

    def step(self, g: GroupView) -> None:
        """One step of all rows: the row laws, in order of declaration."""
        step_rows(self, g)


class Sensor(EntityPlugin):
    """Measures after motion, and writes channels for autonomies; abstract.

    Its outputs `belief_pos`, `belief_vel` and `belief_quat` are the state that the entity believes itself in.
    """

    kind = "sensor"


class WorldPlugin(Plugin):
    """A plugin of the world; abstract. Its parameters are one value per world."""

    kind: ClassVar[str] = "world plugin"

    def start(self, w: WorldView) -> None:
        """Called once for worlds that begin, after their first entities are placed."""

    def step(self, w: WorldView) -> None:
        """One step of all worlds."""

    def result(self, w: WorldView) -> dict[str, np.ndarray]:
        """Values to report: name -> (n_worlds,) or (n_teams, n_worlds)."""
        return {}

    def result_of(self, w: WorldView, world: int) -> dict[str, Any]:
        """Values to report of one world: name -> number, or team -> number."""
        out: dict[str, Any] = {}
        for name, array in self.result(w).items():
            item = np.asarray(array)[..., world]
            out[name] = dict(zip(w.teams.tolist(), item.tolist(), strict=True)) if item.ndim else item.item()
        return out


class Interaction(WorldPlugin):
    """Acts between entities after motion and sensors: captures, collisions, fields; abstract."""

    kind = "interaction"

    def rejects(self, w: WorldView, world: int, pos: np.ndarray, taken: np.ndarray) -> bool:
        """Whether an entity must not be placed at `pos` [m], (3,), in world number `world`, where others stand at `taken`, (3, m)."""
        return False


class Metric(WorldPlugin):
    """Counts and scores; abstract. A result named "score" with one row per team decides who wins."""

    kind = "metric"


class Network(WorldPlugin):
    """Carries messages between entities; abstract."""

    kind = "network"
    historic_attributes = HistoricAttributes(least_zero=("comm_delay",))
    comm_delay = Param(0.0, unit="s", ge=0.0, doc="Time from sending to the earliest delivery.")

    def route(self, w: WorldView, messages: Any) -> Any:
        """Who hears each message: `EVERYONE`, `SAME_ENTITY`, or (message numbers, body rows of the receivers)."""
        raise TypeError(f"{type(self).__name__} has no route")
