"""Manual control: the sticks of an operator in place of the commands of an entity's autonomies."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from typing import NamedTuple

import numpy as np

from tussle.api.bodies import derived_from
from tussle.declare.messages import Messages
from tussle.engine.calls import Call
from tussle.engine.group import Binding, Group
from tussle.engine.state import SimulationState
from tussle.engine.wiring import read_channels

AHEAD, LEFT, UP = range(3)
AXES = "ahead", "left", "up"
SPEEDS = "vel_max", "speed_max", "max_speed", "max_velocity", "max_vel", "speed"
TURNS = "turn_rate_max", "max_yaw_vel"
PITCHES = "pitch_rate_max", "max_pitch_rate"
ACCELERATIONS = "max_acc", "accel_max"
SLOWEST = "min_velocity", "speed_min"
OF_AIRCRAFT = "aileron", "desired_roll"
"""Channels of motion models that fly by their wings, unless they have a lowest speed."""
FASTER = 0.5
"""Share of the speed that their autonomies want by which a full stick makes these faster or slower."""


class Drive(NamedTuple):
    """How an axis of the sticks drives a channel.

    Attributes:
        axis: "ahead", "left" or "up", by number.
        full: The channel at a full stick, in its unit; negative for a channel whose positive direction is the other one.
        limits: Parameters of the entity's plugins, the motion model's first, that take the place of `full` where they are positive.
        base: What is added: "" is nothing, else a column of the body.
    """

    axis: int
    full: float
    limits: tuple[str, ...] = ()
    base: str = ""


DRIVES = {
    "speed": Drive(AHEAD, 10.0, SPEEDS), "desired_speed": Drive(AHEAD, 10.0, SPEEDS),
    "velocity_x": Drive(LEFT, -10.0, SPEEDS), "velocity_y": Drive(AHEAD, 10.0, SPEEDS),
    "velocity_z": Drive(UP, 5.0, ("velocity_z_max", *SPEEDS)),
    "acceleration_x": Drive(LEFT, -2.0, ACCELERATIONS), "acceleration_y": Drive(AHEAD, 2.0, ACCELERATIONS),
    "acceleration_z": Drive(UP, 2.0, ACCELERATIONS),
    "position_x": Drive(LEFT, -10.0, SPEEDS, "x"), "position_y": Drive(AHEAD, 10.0, SPEEDS, "y"),
    "position_z": Drive(UP, 10.0, SPEEDS, "z"),
    "x_thrust": Drive(AHEAD, 2.0), "y_thrust": Drive(LEFT, 2.0), "z_thrust": Drive(UP, 2.0),
    "throttle": Drive(AHEAD, 1.0), "elevator": Drive(UP, -1.0), "aileron": Drive(LEFT, -1.0), "rudder": Drive(LEFT, 1.0),
    "turn_rate": Drive(LEFT, 1.0, TURNS), "turn_force": Drive(LEFT, 1.0), "steering": Drive(LEFT, 0.5),
    "roll_rate": Drive(LEFT, 0.5, ("max_roll_rate",)),
    "pitch_rate": Drive(UP, 0.5, PITCHES), "desired_pitch": Drive(UP, 0.5, ("pitch_max", "max_pitch")),
    "desired_roll": Drive(LEFT, -0.5, ("roll_max", "max_roll")),
    "desired_heading": Drive(LEFT, 0.8, (), "yaw"), "desired_altitude": Drive(UP, 20.0, (), "z"),
}  # fmt: skip
"""Channel -> how it is driven. Velocities, accelerations and points are in the world frame: ahead is North, left is West."""
OF_WORLD = "velocity_y", "acceleration_y", "position_y"
HELD = {"desired_heading": Drive(LEFT, 0.0, (), "yaw"), "turn_rate": Drive(LEFT, 0.0)}
"""Channel -> how it is held where other channels are in the world frame: who goes to the left does not turn."""


class Driven(NamedTuple):
    """A channel of a group that can be driven: its name, its row in the group's table, and how."""

    channel: str
    row: int
    drive: Drive


def driven_channels(group: Group) -> list[Driven]:
    """The channels that the autonomies of a group write for its first controller, or its motion model, and that an axis drives."""
    reader = (*group.controllers, group.motion)[0]
    written = {row for _, row in _channels(group, group.autonomies, is_output=True)}
    read = _channels(group, [reader], is_output=False)
    found = [
        Driven(channel, row, DRIVES[channel]) for channel, row in read if row in written and channel in DRIVES
    ]
    if any(each.channel in OF_WORLD for each in found):
        return [each._replace(drive=HELD.get(each.channel, each.drive)) for each in found]
    return found


def _channels(group: Group, bindings: list[Binding], is_output: bool) -> Iterator[tuple[str, int]]:
    for top in bindings:
        for binding in top.walk():
            cls = type(binding.spec)
            columns = cls.outputs().items() if is_output else read_channels(binding.spec)
            for name, column in columns:
                if not column.ragged and name in binding.places:
                    yield from zip(column.channels, group.rows_of(binding, name), strict=True)


def axes_of(group: Group) -> dict[str, list[str]]:
    """Axis -> the channels of a group that it drives; empty for entities that cannot be driven."""
    found = driven_channels(group)
    axes = {
        axis: [each.channel for each in found if AXES[each.drive.axis] == axis and each.drive.full]
        for axis in AXES
    }
    return axes if found else {}


def request_control(state: SimulationState, batch: Messages) -> None:
    """Keep the sticks of `ManualControl` messages from the next step on, or give entities back to their autonomies."""
    was_empty = not state.manual
    for i in range(batch.n):
        key = int(batch.world[i]), int(batch.entity[i])
        if batch.is_on[i]:
            state.manual[key] = tuple(np.clip(batch.sticks[:, i], -1.0, 1.0).tolist())
        else:
            state.manual.pop(key, None)
    if was_empty == bool(state.manual):
        state.population.on_new_group()


def manual_calls(state: SimulationState, group: Group) -> tuple[list[Call], list[Call]]:
    """The calls before and after control and motion of a group while an entity is driven: sticks in, and what autonomies wrote back.

    Autonomies that write only when they are told something have their commands again when the entity is given back.
    """
    if not state.manual:
        return [], []
    kept: list[tuple[int, int, float]] = []
    channels = driven_channels(group)
    return (
        [Call(f"{'manual':<12} {group.name}: sticks", partial(_drive, state, group, channels, kept))],
        [Call(f"{'manual':<12} {group.name}: commands of autonomies", partial(_give_back, group, kept))],
    )


def _drive(
    state: SimulationState, group: Group, channels: list[Driven], kept: list[tuple[int, int, float]]
) -> None:
    kept.clear()
    keys = list(state.manual)
    if not keys:
        return
    rows = state.population.bodies.rows_of(*np.array(keys, np.int64).reshape(-1, 2).T.copy())
    data = group.table.arrays[float]
    for key, row in zip(keys, rows.tolist(), strict=True):
        mine = row - group.first
        if row < 0 and state.running[key[0]]:
            del state.manual[key]  # it is dead
        if not 0 <= mine < group.n:
            continue
        for _, place, drive in channels:
            wanted = float(data[place, mine])
            kept.append((place, mine, wanted))
            data[place, mine] = _command(group, mine, drive, state.manual[key], wanted)


def _give_back(group: Group, kept: list[tuple[int, int, float]]) -> None:
    data = group.table.arrays[float]
    for place, row, value in kept:
        data[place, row] = value
    kept.clear()


def _command(group: Group, row: int, drive: Drive, sticks: tuple[float, ...], wanted: float) -> float:
    """The value of a channel; `wanted` is that of the autonomies."""
    stick, bodies, at = sticks[drive.axis], group.bodies, group.first + row
    full = _parameter(group, row, drive.limits) or abs(drive.full)
    if drive.limits is SPEEDS and drive.axis == AHEAD and not drive.base:
        slowest = min(_parameter(group, row, SLOWEST), full)
        if wanted > 0.0 and _is_aircraft(group, row):
            return wanted * (1.0 + FASTER * stick)
        if slowest > 0.0:  # it cannot stand still: the middle of the stick is the middle of its speeds
            return 0.5 * (full + slowest) + 0.5 * (full - slowest) * stick
    command = stick * (full if drive.full > 0.0 else -full)
    if drive.base == "yaw":
        return command + float(derived_from("yaw", bodies.quat[:, at : at + 1])[0])
    return command + float(bodies.pos["xyz".index(drive.base), at]) if drive.base else command


def _is_aircraft(group: Group, row: int) -> bool:
    """Whether an entity falls when it stands still, and has no lowest speed that says so."""
    lowest = [_value(group, group.motion, row, name) for name in SLOWEST]
    return bool({*group.motion.spec.input_channels()} & {*OF_AIRCRAFT}) and not any(
        map(math.isfinite, lowest)
    )


def _parameter(group: Group, row: int, names: tuple[str, ...]) -> float:
    """The first of these parameters that is positive and finite: of the motion model, then of controllers and autonomies; else 0."""
    for binding in (group.motion, *group.controllers, *group.autonomies):
        for name in names:
            if 0.0 < (value := _value(group, binding, row, name)) < math.inf:
                return value
    return 0.0


def _value(group: Group, binding: Binding, row: int, name: str) -> float:
    """Value of a parameter; nan where the plugin has none of this name, or one of several numbers."""
    place = binding.places.get(name) if name in binding.params else None
    return math.nan if place is None or place.k else float(group.table.array(place)[row])


def manual_columns(state: SimulationState, world: int) -> np.ndarray:
    """Id and sticks of each driven entity of a world, (4, m), for the state hash."""
    mine = sorted((who, *sticks) for (of, who), sticks in state.manual.items() if of == world)
    return np.array(mine, float).reshape(-1, 4).T
