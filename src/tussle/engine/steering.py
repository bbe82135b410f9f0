"""Runs the controllers and the motion model of a group in one kernel over all substeps, if row laws or kernels over ranges allow it."""

from __future__ import annotations

from dataclasses import replace

from tussle.api.bodies import DERIVED
from tussle.api.group import ROWS_PER_THREAD
from tussle.api.kinds import Controller
from tussle.api.laws import BODY
from tussle.api.motion import WRITABLE, MotionModel
from tussle.api.range_kernel import RANGE_STEP, RangeKernel
from tussle.api.rigid_body import RIGID_BODY, TO_COLUMNS, RigidBodyModel
from tussle.api.row_laws import Rows, laws_of
from tussle.declare.columns import Handle, Topic
from tussle.engine.group import Binding, Group
from tussle.numeric.row_kernel import BlockCall, Item, Number, RowCall, numbers_of

ARRAYS = "address", "x", "u", "p", "numbers", "wholes"
MORE = "u8 F2w F2 F2 F I", "".join(f"{name}, " for name in ARRAYS)
RANGE_CALL = BlockCall(ARRAYS, RANGE_STEP, "dt, 1", (), "x", RIGID_BODY)
"""A substep of a motion model with a kernel over ranges."""


class Steering:
    """All substeps of a group in one step.

    The kernel processes the rows in blocks and completes all substeps of a block before the next block. Between substeps,
    controllers read the body values that the law of the motion model returns. The body table is written after the last substep.
    """

    def __init__(self, group: Group, rows: Rows, ranged: RangeKernel | None = None) -> None:
        self.group, self.rows, self.ranged = group, rows, ranged

    def run(self, dt: float, substeps: int) -> None:
        """Run controllers and motion of all rows for a number of substeps of dt [s]."""
        group = self.group
        table, ranged = group.table, self.ranged
        more = ranged.arrays(group.x, group.u, group.p) if ranged else ()
        least = ranged.rows_per_thread if ranged else ROWS_PER_THREAD
        self.rows.run(
            group.controller_view, lambda dtype, row: table.arrays[dtype][row], dt, substeps, more, least
        )
        group.publish()


def steering_of(group: Group) -> Steering | None:
    """Return the kernel of a group, or None if there is none.

    There is none if a controller has no row laws or has a rate, if the motion model has neither row laws nor a kernel over ranges, or if
    a controller reads body values that the law of the motion model does not return.
    """
    motion = group.motion
    in_ranges = _uses_range_kernel(group)
    if not all(_is_law(b) for b in group.controllers) or not (in_ranges or _has_row_laws(motion)):
        return None
    calls = [placed(call, group, b) for b in group.controllers for call in laws_of(b.plugin, b.plugin.wired)]
    moves: list[RowCall | BlockCall]
    if in_ranges:
        commands = {Number((float, row)) for row in group.u_rows}
        given = [each for call in calls for each in numbers_of(call.results) if each in commands]
        moves = [replace(RANGE_CALL, arguments=tuple(dict.fromkeys(given))), TO_COLUMNS]
    else:
        moves = [placed(call, group, motion) for call in laws_of(motion.plugin)]
    from_sensors = set(group.belief) | ({*DERIVED} if "quat" in group.belief else set())
    held = [Number(part) for part, (name, _) in BODY.items() if name in from_sensors]
    changing = {Number(part) for part, (name, _) in BODY.items() if name in (*WRITABLE, *DERIVED)}
    returned = {each for call in moves for each in numbers_of(call.results)}
    read = {each for call in calls for each in numbers_of(call.arguments)}
    if (read & changing) - returned - set(held):
        return None
    if in_ranges:
        return Steering(group, Rows([*calls, *moves], held, MORE), group.range_kernel)
    return Steering(group, Rows([*calls, *moves], held))


def _is_law(binding: Binding) -> bool:
    cls = type(binding.plugin)
    is_alone = not any(isinstance(c, (Handle, Topic)) for c in cls.columns.values()) and not binding.children
    return cls.step is Controller.step and bool(cls.row_laws) and binding.spec.rate is None and is_alone


def _has_row_laws(binding: Binding) -> bool:
    cls = type(binding.plugin)
    return bool(cls.row_laws) and cls.advance is MotionModel.advance and not cls.handles()


def _uses_range_kernel(group: Group) -> bool:
    """Return True if the kernel over ranges can read the inputs and write the state in the group's table, without copies."""
    cls = type(group.motion.plugin)
    is_rigid_body = issubclass(cls, RigidBodyModel) and cls.to_body is RigidBodyModel.to_body
    return group.range_kernel is not None and is_rigid_body and not group.stacks_inputs and not cls.handles()


def placed(call: RowCall, group: Group, binding: Binding) -> RowCall:
    """Return the call with plugin columns replaced by rows of the group's table, so that plugins share connected channels."""

    def at(item: Item) -> Item:
        if not isinstance(item, Number) or not isinstance(item.key, tuple):
            return item
        name, place = item.key
        return Number((binding.places[name].dtype, group.rows_of(binding, name)[place]))

    return call.replaced(at, at)
