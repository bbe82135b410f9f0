"""Interface for plugin authors."""

from tussle.api.easy import (
    EasyAutonomy,
    EasyController,
    EasyInteraction,
    EasyMetric,
    EasySensor,
    Me,
    Member,
    OneWorld,
    Other,
)
from tussle.api.group import GroupView
from tussle.api.kinds import (
    Autonomy,
    Behavior,
    Controller,
    EntityPlugin,
    Interaction,
    Metric,
    Network,
    Sensor,
    StateFollower,
    WorldPlugin,
)
from tussle.api.laws import neighbors, together
from tussle.api.links import Links
from tussle.api.mass import MassProperties
from tussle.api.motion import MotionBody, MotionModel
from tussle.api.plugin import HistoricAttributes, Plugin, service
from tussle.api.rigid_body import InertiaParam, PositiveParam, RigidBodyModel
from tussle.api.row_laws import row_law
from tussle.api.world import WorldView
from tussle.declare.columns import (
    Children,
    EntityRef,
    Field,
    Handle,
    Input,
    Output,
    Param,
    Publish,
    State,
    Subscribe,
)
from tussle.declare.comms import EVERYONE, SAME_ENTITY
from tussle.declare.lists import RaggedColumn
from tussle.declare.messages import Message, Messages
from tussle.numeric import wrap
from tussle.numeric.arrays import unit

__all__ = [
    "EVERYONE",
    "SAME_ENTITY",
    "Autonomy",
    "Behavior",
    "Children",
    "Controller",
    "EasyAutonomy",
    "EasyController",
    "EasyInteraction",
    "EasyMetric",
    "EasySensor",
    "EntityPlugin",
    "EntityRef",
    "Field",
    "GroupView",
    "Handle",
    "HistoricAttributes",
    "InertiaParam",
    "Input",
    "Interaction",
    "Links",
    "MassProperties",
    "Me",
    "Member",
    "Message",
    "Messages",
    "Metric",
    "MotionBody",
    "MotionModel",
    "Network",
    "OneWorld",
    "Other",
    "Output",
    "Param",
    "Plugin",
    "PositiveParam",
    "Publish",
    "RaggedColumn",
    "RigidBodyModel",
    "Sensor",
    "State",
    "StateFollower",
    "Subscribe",
    "WorldPlugin",
    "WorldView",
    "neighbors",
    "row_law",
    "service",
    "together",
    "unit",
    "wrap",
]
