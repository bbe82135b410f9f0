"""An autonomy that runs a class of SCRIMMAGE's Python interface."""

from __future__ import annotations

import copy
import json
import types
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from tussle.api import Autonomy, GroupView, Handle, HistoricAttributes, Output, Param
from tussle.errors import ParameterError
from tussle.plugins.stock.autonomy.py_autonomy.bindings import ID, Contact, Quaternion, State
from tussle.plugins.stock.autonomy.py_autonomy.straight import StraightClass

PREFIX = "PyAutonomy_"
"""Prefix of the names of plugins made of Python classes."""
METHODS = ("init", "step_autonomy")
NOT_PASSED_ON = ("pubs", "subs", "shapes")


@dataclass
class PythonAgent:
    """The Python object of an entity.

    Attributes:
        python: The object.
        has_begun: Whether `init` was called. It is called just before the first step, so that it may read `state`.
    """

    python: Any
    has_begun: bool = False


class Contacts(Mapping[int, Contact]):
    """Entities of a world by id. Each contact is created on access.

    Args:
        bodies: The body table.
        world: Number of the world.
    """

    def __init__(self, bodies: Any, world: int) -> None:
        self._bodies = bodies
        self._row = {int(bodies.id[row]): int(row) for row in np.flatnonzero(bodies.world == world)}

    def __len__(self) -> int:
        return len(self._row)

    def __iter__(self) -> Iterator[int]:
        return iter(self._row)

    def __getitem__(self, entity: int) -> Contact:
        row, contact = self._row[entity], Contact()
        contact.id = ID(entity, 0, int(self._bodies.team[row]))
        contact.state, contact.radius = state_of(self._bodies, row), float(self._bodies.radius[row])
        return contact


def state_of(view: Any, row: int) -> State:
    """Return the state of a row of a view or of the body table."""
    pos, vel, omega, quat = (getattr(view, name)[:, row] for name in ("pos", "vel", "omega", "quat"))
    return State(pos, vel, omega, Quaternion(*quat))


class PyAutonomy(Autonomy):
    """Runs a Python class of SCRIMMAGE, one object for each entity.

    The class is defined in a plugin file (`--plugin-path`); a mission names it by `class`, and all other attributes of the tag are the
    dictionary of texts that `init` takes. Before each `step_autonomy(t, dt)` the object is given `state`, its believed state, and
    `contacts`, the true ones by id. Afterwards its `desired_state` is written to the channels that controllers and motion models read:
    its position; its velocity; and for vehicles that are flown by heading, altitude and speed the yaw, the height and the first
    component of the velocity. `import scrimmage` in a plugin file is tussle's `State`, `Quaternion`, `ID` and `Contact`. Messages and
    shapes of these classes are refused. A class that returns False ends its world with an error.
    """

    grade = "external"
    historic_attributes = HistoricAttributes(
        unread=("module", "library"), chosen_by="class", rest="init_params"
    )
    python_class: ClassVar[type] = StraightClass
    """The class; without `class` in a mission it is an example that flies straight on."""

    init_params = Param("{}", doc="Argument of `init`: a JSON object of texts.")
    agent = Handle(doc="The Python object.")
    position = Output("position_x position_y position_z", unit="m")
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")
    desired_heading = Output(unit="rad")
    desired_altitude = Output(unit="m")
    desired_speed = Output(unit="m/s")

    def check_values(self) -> None:
        """Check that the parameters are an object of texts."""
        try:
            values = json.loads(self.init_params)
        except ValueError as error:
            raise ParameterError(
                f"PyAutonomy.init_params = {self.init_params!r} is not JSON: {error}"
            ) from None
        if not isinstance(values, dict) or not all(isinstance(value, str) for value in values.values()):
            raise ParameterError(
                f"PyAutonomy.init_params = {self.init_params!r} is not allowed; it takes an object of texts, "
                'such as {"speed": "21"}'
            )

    def open_one(self, row: Any) -> PythonAgent:
        """Create the Python object."""
        python = self.python_class()
        python.id, python.pubs, python.subs, python.shapes = ID(row.id, 0, row.team), {}, {}, []
        return PythonAgent(python)

    def save_one(self, agent: PythonAgent) -> tuple[dict[str, Any], bool]:
        """Attributes of the object, without those that are set before each step."""
        kept = {name: value for name, value in vars(agent.python).items() if name != "contacts"}
        return copy.deepcopy(kept), agent.has_begun

    def load_one(self, row: Any, state: tuple[dict[str, Any], bool]) -> PythonAgent:
        """Recreate the object."""
        python = self.python_class()
        vars(python).update(copy.deepcopy(state[0]))
        return PythonAgent(python, state[1])

    @staticmethod
    def adapters(module: Mapping[str, Any]) -> list[type[PyAutonomy]]:
        """Return a plugin for each Python class that a module, given by its names, defines."""
        return [
            adapted(value) for value in list(module.values()) if is_python_autonomy(value, module["__name__"])
        ]

    def step(self, g: GroupView) -> None:
        worlds: dict[int, Contacts] = {}
        dt = np.broadcast_to(g.dt, g.n)
        for row, agent in enumerate(self.agent):
            python, world = agent.python, int(g.world[row])
            if world not in worlds:
                worlds[world] = Contacts(g.bodies, world)
            if not agent.has_begun:
                python.state = state_of(g, row)
                python.init(json.loads(self.init_params))
                agent.has_begun = True
            python.state, python.contacts = state_of(g, row), worlds[world]
            if not python.step_autonomy(float(g.t[row]), float(dt[row])):
                g.fail(row, f"{type(python).__name__}.step_autonomy returned False, which ends the game")
            self._write(row, python)

    def _write(self, row: int, python: Any) -> None:
        name = type(python).__name__
        for attribute in NOT_PASSED_ON:
            if getattr(python, attribute, None):
                raise ParameterError(
                    f"{name}.{attribute} is not empty: messages and shapes of Python classes are not passed on; "
                    "derive the class from tussle.api.EasyAutonomy, which has publish and draw"
                )
        desired = getattr(python, "desired_state", None)
        if not isinstance(desired, State):
            raise ParameterError(f"{name}.desired_state is {desired!r}; it takes a scrimmage.State")
        self.position[:, row], self.velocity[:, row] = desired.pos, desired.vel
        self.desired_heading[row] = desired.quat.yaw()
        self.desired_altitude[row], self.desired_speed[row] = desired.pos[2], desired.vel[0]


def is_python_autonomy(value: Any, module: str) -> bool:
    """Return True if a value of a module is a class that is defined there and has the methods of SCRIMMAGE's Python interface."""
    is_own = isinstance(value, type) and value.__module__ == module and not issubclass(value, Autonomy)
    return is_own and all(callable(getattr(value, name, None)) for name in METHODS)


def adapted(python_class: type) -> type[PyAutonomy]:
    """Return the plugin that runs a Python class. It belongs to the module of the class."""
    name = PREFIX + python_class.__name__
    doc = f"Runs the Python class {python_class.__name__}, see PyAutonomy."
    members = {"__module__": python_class.__module__, "__doc__": doc, "python_class": python_class}
    return types.new_class(name, (PyAutonomy,), exec_body=lambda body: body.update(members))
