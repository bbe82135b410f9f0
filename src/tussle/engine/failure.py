"""Errors of plugins, with file and line in the plugin, entity, world and step."""

from __future__ import annotations

import inspect
import traceback
from bdb import BdbQuit
from pathlib import Path
from typing import Any

import numpy as np

from tussle.api.bodies import Bodies
from tussle.api.group import GroupView
from tussle.api.world import WorldView
from tussle.engine.group import Binding, Group
from tussle.errors import PluginError, TussleError
from tussle.folders import real_path

_OWN = str(real_path(Path(__file__)).parents[1])


def _location(error: BaseException, plugin: Any) -> str:
    """Return file:line of the deepest frame in the plugin's file, else of the deepest frame outside this package."""
    try:
        own_file = inspect.getfile(type(plugin))
    except (OSError, TypeError):
        own_file = ""
    frames = traceback.extract_tb(error.__traceback__)
    mine = (
        [f for f in frames if f.filename == own_file]
        or [f for f in frames if not f.filename.startswith(_OWN)]
        or list(frames)
    )
    return f"{Path(mine[-1].filename).name}:{mine[-1].lineno}" if mine else "?"


def raised(error: BaseException, plugin: Any, *, where: str, step: int, world: int | None) -> PluginError:
    """Return the `PluginError` for an exception raised in a plugin. Its cause has a traceback that starts in the plugin's code.

    Raises:
        KeyboardInterrupt: The user left the debugger.
    """
    if isinstance(error, BdbQuit):
        raise KeyboardInterrupt(f"the debugger was left in {plugin.instance_name}, step {step}") from None
    if isinstance(error, TussleError) and all(
        frame.filename.startswith(_OWN) for frame in traceback.extract_tb(error.__traceback__)
    ):  # raised by this package: its message names the place
        text = str(error)
    else:
        place = error.__traceback__
        while place is not None and place.tb_frame.f_code.co_filename.startswith(_OWN):
            place = place.tb_next
        if place is not None:
            error = error.with_traceback(place)
        text = f"{_location(error, plugin)}: {type(error).__name__}: {error}"
    return PluginError(text, where=where, step=step, world=world, plugin=plugin.instance_name, cause=error)


def leaving(end: SystemExit, step: int) -> BaseException:
    """Return an interruption if `q` in the debugger ended the program, as it does from Python 3.14 on; the same exit otherwise."""
    frames = traceback.extract_tb(end.__traceback__)
    if Path(frames[-1].filename).stem != "pdb":
        return end
    place = next(f for f in reversed(frames) if Path(f.filename).stem not in ("pdb", "bdb", "cmd"))
    return KeyboardInterrupt(
        f"the debugger was left in {Path(place.filename).name}:{place.lineno}, step {step}"
    )


def in_call(error: Exception, plugin: Any, view: GroupView, group: Group | None = None) -> PluginError:
    """Return the `PluginError` for an exception in a plugin call: with plugin and step, and with entity and world if they are known.

    Raises:
        KeyboardInterrupt: The user left the debugger.
    """
    if isinstance(error, PluginError) and error.step is not None:  # raised by `fail`
        return error
    row, view.failing_row = view.failing_row, None
    rows = slice(None) if row is None else slice(row, row + 1)
    clock = view.context.clock
    worlds = np.unique(view.world[rows]) if view.n else np.arange(len(clock.step))
    if isinstance(view, WorldView) and view.failing_world is not None:
        worlds, view.failing_world = np.array([view.failing_world]), None
    where = "" if group is None else group.name
    if row is not None and group is not None:
        where = f"{group.block_of(row)} {int(view.id[row])}"
    step, world = int(clock.step[worlds].max()), int(worlds[0]) if len(worlds) == 1 else None
    if isinstance(error, PluginError):
        error.where, error.step, error.world, error.plugin = where, step, world, plugin.instance_name
        return error
    return raised(error, plugin, where=where, step=step, world=world)


def not_finite(group: Group, bodies: Bodies, row: int, step: int, interactions: list[str]) -> PluginError:
    """Return the error for a body row whose state is not finite.

    The error names the first plugin output, in call order, that is not finite. If all outputs are finite, it names the motion model,
    or the interactions if the motion model's own state is finite.

    Args:
        group: Group of the row.
        bodies: The body table.
        row: The row.
        step: The step.
        interactions: Names of the interactions.
    """
    i, world = row - group.first, int(bodies.world[row])
    entity = f"{group.block_of(i)} {int(bodies.id[row])}"
    for binding in [*(b for a in group.autonomies for b in a.walk()), *group.controllers]:
        if found := _not_finite_output(binding, group, i):
            text = f"{found} is not a finite number"
            break
    else:
        binding = group.motion
        values = ", ".join(
            f"{name} = {np.array2string(getattr(bodies, name)[..., row], precision=6)}"
            for name in ("pos", "quat", "health")
        )
        text = f"the entity's state is not finite: {values}; all outputs of its autonomies and controllers are finite"
        if interactions and np.isfinite(group.x[:, i]).all():
            text += f", and so is the state of its motion model, {binding.spec.instance_name}: one of the interactions wrote it"
            return PluginError(text, where=entity, step=step, world=world, plugin=" or ".join(interactions))
        loads = np.concatenate([bodies.force[:, row], bodies.torque[:, row]])
        if interactions and not np.isfinite(loads).all():
            text += f"; the force or torque on it, written by {' or '.join(interactions)}, is not finite"
    return PluginError(text, where=entity, step=step, world=world, plugin=binding.spec.instance_name)


def _not_finite_output(binding: Binding, group: Group, row: int) -> str:
    for name, column in type(binding.spec).outputs().items():
        if name in binding.ragged:
            items = group.table.lists[binding.ragged[name]][row]
            bad = items[~np.isfinite(items)]
            if len(bad):
                return f"an item of output {column.channels[0]!r} = {bad[0]}"
            continue
        values = np.atleast_1d(group.table.array(binding.places[name])[..., row])
        for channel, value in zip(column.channels, values, strict=True):
            if not np.isfinite(value):
                return f"output {channel!r} = {value}"
    return ""
