"""Groups: all rows with the same list of plugins, their columns, and the plugins bound to them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from tussle.api.bodies import Bodies, read_only
from tussle.api.context import Context
from tussle.api.easy.plugins import EasyEntityPlugin
from tussle.api.group import GroupView
from tussle.api.motion import MotionBody
from tussle.api.rigid_body import RigidBodyModel
from tussle.api.wired import Wired
from tussle.declare.columns import (
    Channel,
    EntityRef,
    Handle,
    Output,
    Param,
    Publish,
    State,
    Subscribe,
)
from tussle.declare.comms import Inbox, Publisher
from tussle.engine.table import ColumnPlace, Table
from tussle.engine.wiring import BELIEF, Link, Wiring, read_channels
from tussle.errors import DeclarationError, ParameterError, WiringError, listed, nearest_name


@dataclass
class Binding:
    """One plugin, bound to the columns of its group.

    Attributes:
        plugin: The bound copy.
        spec: The plugin as data.
        view: View that is passed to its `step`.
        path: Plugin names, outermost first: ("MotorSchemas", "AvoidEntityMS").
        places: Attribute -> place of its column in the table.
        params: Attributes that are parameters.
        writable: Attributes that the plugin may write.
        links: Channel attributes that are copied from and to the bus before and after each call.
        ragged: Attribute -> index of its list column in the table.
        handles: Attribute -> one object per row.
        children: Bindings of the plugins inside this plugin.
        wired: Outputs that other plugins read.
        asked: The same set, which keeps those that the plugin asked for and left out.
    """

    plugin: Any
    spec: Any
    view: GroupView
    path: tuple[str, ...]
    places: dict[str, ColumnPlace] = field(default_factory=dict)
    params: tuple[str, ...] = ()
    writable: set[str] = field(default_factory=set)
    links: dict[str, Link] = field(default_factory=dict)
    ragged: dict[str, int] = field(default_factory=dict)
    handles: dict[str, list[Any]] = field(default_factory=dict)
    children: list[Binding] = field(default_factory=list)
    wired: frozenset[str] = frozenset()
    asked: Wired = field(default_factory=Wired)

    def walk(self) -> Iterator[Binding]:
        """Yield this binding and all bindings inside it."""
        yield self
        for child in self.children:
            yield from child.walk()

    def check_is_written(self, name: str, where: str) -> None:
        """Check that the plugin writes a column.

        Raises:
            ParameterError: It is an output that the plugin leaves out, since nobody reads it.
        """
        if name in self.asked.skipped:
            raise ParameterError(
                f"{where} is not computed: {self.path[-1]} leaves out {name!r}, since no plugin of its entity reads it"
            )

    def settle(self) -> bool:
        """Let a plugin that has asked for its outputs ask a plain set from now on, which is faster. Returns whether it does."""
        if self.asked.is_asked:
            self.plugin.__dict__["wired"] = self.wired
        return self.asked.is_asked

    def attach(self, table: Table) -> None:
        """Set the plugin's attributes to the current arrays."""
        own = self.plugin.__dict__
        for name, place in self.places.items():
            array = table.array(place)
            own[name] = array if name in self.writable else read_only(array)
        for name, number in self.ragged.items():
            lists = table.lists[number]
            own[name] = lists if name in self.writable else lists.read_only()
        own.update(self.handles)
        for child in self.children:
            child.attach(table)

    def pull(self, table: Table) -> None:
        """Copy channels that are not contiguous on the bus into the plugin's own arrays."""
        data = table.arrays[float]
        for name, link in self.links.items():
            assert link.rows is not None
            table.array(self.places[name])[:] = data[list(link.rows)]
        for child in self.children:
            child.pull(table)

    def push(self, table: Table) -> None:
        """Copy the plugin's own output arrays to the bus."""
        data = table.arrays[float]
        for name, link in self.links.items():
            if name in self.writable:
                data[list(link.rows or ())] = table.array(self.places[name])


def check_hooks(spec: Any, where: str) -> None:
    """Check that a plugin has the methods that its kind requires.

    Raises:
        DeclarationError: A method is missing, or has another name.
    """
    needed = {"motion": ("from_body", "to_body"), "network": ("route",)}.get(spec.kind, ("step",))
    if isinstance(spec, EasyEntityPlugin):
        needed = ("step_one",)
    if getattr(type(spec), "passthrough", False) or (spec.kind == "controller" and type(spec).row_laws):
        return
    mro = type(spec).__mro__
    abstract = [c for c in mro if c.__module__.startswith("tussle.api.") and c is not RigidBodyModel]
    for hook in needed:
        if any(getattr(type(spec), hook) is getattr(base, hook, None) for base in abstract):
            own = [
                name
                for name, value in vars(type(spec)).items()
                if callable(value) and not name.startswith("__")
            ]
            found = f"; it has: {', '.join(own)}" if own else ""
            raise DeclarationError(
                f"{where}: {type(spec).__name__} has no method {hook!r}{nearest_name(hook, own)}{found}"
            )


class Group:
    """Rows [first, first + n) of the body table, which share one list of plugins.

    Args:
        name: Name of its first block, for messages.
        block: The block that gives the plugins.
        context: Shared by all views.
        bodies: The body table.
        dt: Step length [s].
        substeps: Number of substeps of controllers and motion per step.
        advise: See `Wiring`.
    """

    def __init__(
        self,
        name: str,
        block: Any,
        context: Context,
        bodies: Bodies,
        dt: float,
        substeps: int,
        advise: Callable[..., list[str]],
    ) -> None:
        self.names = [name]
        self.block = block
        self.place = 0
        self.key: Any = None
        self.first: int
        self.n: int
        self.context = context
        self.table = Table()
        self.first, self.n = bodies.n, 0
        self.bodies = bodies
        self.wiring = Wiring(f"block {name!r}", self.table, advise)
        self.wiring.connect(block.sensor, block.autonomy, block.controller, block.motion)
        self.autonomy_view = GroupView(bodies, bodies.n, bodies.n, context, dt)
        self.controller_view = GroupView(bodies, bodies.n, bodies.n, context, dt / substeps)
        self.sensor_view = GroupView(bodies, bodies.n, bodies.n, context, dt)
        self.motion_view = MotionBody(bodies, bodies.n, bodies.n, context, dt / substeps)
        working = [c for c in block.controller if not c.passthrough]
        self.motion = self._bind(block.motion, self.motion_view, (), is_motion=True)
        self.autonomies = [self._bind(p, self.autonomy_view, ()) for p in block.autonomy]
        self.controllers = [self._bind(p, self.controller_view, ()) for p in working]
        self.sensors = [self._bind(p, self.sensor_view, ()) for p in block.sensor]
        self.holds_handles = any(b.handles for b in self.walk())
        self._find_beliefs()
        self.integrate = self.motion.plugin.advance
        self.range_kernel = self.motion.plugin.range_kernel
        self._place_motion()
        self.table.allocate(0)
        self.attach(bodies, bodies.n)

    @property
    def bindings(self) -> list[Binding]:
        """All plugins in the order in which a step calls them."""
        return [*self.autonomies, *self.controllers, self.motion, *self.sensors]

    def walk(self) -> Iterator[Binding]:
        for binding in self.bindings:
            yield from binding.walk()

    @property
    def name(self) -> str:
        """Names of the blocks whose entities belong to the group."""
        return ", ".join(self.names)

    def block_of(self, row: int) -> str:
        """Name of the block of a row of the group."""
        return self.context.block_names[int(self.bodies.block[self.first + row])]

    @property
    def last(self) -> int:
        return self.first + self.n

    @property
    def views(self) -> list[GroupView]:
        return [self.autonomy_view, self.controller_view, self.sensor_view, self.motion_view]

    # -- binding ------------------------------------------------------------------------------------------------------------

    def _bind(
        self,
        spec: Any,
        view: GroupView,
        path: tuple[str, ...],
        is_motion: bool = False,
        is_private: bool = False,
    ) -> Binding:
        check_hooks(spec, f"{self.wiring.where}: {spec.instance_name}")
        binding = Binding(spec.bound(), spec, view, (*path, spec.instance_name))
        plugin, key = binding.plugin, binding.path
        wired = set(self.wiring.wired.get(id(spec), ()))
        params = {k: c for k, c in type(spec).params().items() if c.is_row_data}
        binding.params = tuple(params)
        for (
            name,
            param,
        ) in params.items():  # declared in order, so that those of a motion model form one matrix
            dtype = float if is_motion else param.dtype
            value = spec.values[name]
            default = tuple(value) if param.fields else value
            binding.places[name] = self.table.add((key, name), dtype, len(param.fields), default)
        for name, column in type(spec).columns.items():
            if isinstance(column, Param):
                if column.structural:
                    plugin.__dict__[name] = spec.values[name]
                elif column.ragged:
                    binding.ragged[name] = self.table.add_list(column)
            elif isinstance(column, State) and column.ragged:
                binding.ragged[name] = self.table.add_list(column)
                binding.writable.add(name)
            elif isinstance(column, (State, EntityRef)):
                k = spec.state_size(name) if isinstance(column, State) else 0
                binding.places[name] = self.table.add((key, name), column.dtype, k, column.default)
                binding.writable.add(name)
            elif isinstance(column, Channel):
                self._bind_channel(binding, name, column, is_private)
                if is_private:
                    wired.add(name)
            elif isinstance(column, Handle):
                binding.handles[name] = []
            elif isinstance(column, (Publish, Subscribe)):
                topic = self._topic(spec, column)
                topic.is_published |= isinstance(column, Subscribe) and column.from_outside
                plugin.__dict__[name] = (
                    Publisher(topic, view) if isinstance(column, Publish) else Inbox(topic, view)
                )
        for name, children in type(spec).children().items():
            hides = is_private or not children.shares_channels
            inner = [self._bind(child, view, binding.path, is_private=hides) for child in spec.values[name]]
            plugin.__dict__[name] = [b.plugin for b in inner]
            binding.children += inner
        binding.wired = frozenset(wired)
        plugin.__dict__["wired"] = binding.asked = Wired(wired)
        for service in type(spec).services:
            for one in self.views if hasattr(self, "motion_view") else [view]:
                one.services[service] = getattr(plugin, service)
        return binding

    def _bind_channel(self, binding: Binding, name: str, column: Channel, is_private: bool) -> None:
        link = self.wiring.links.get((id(binding.spec), name))
        if link is None:  # the plugin is inside another one, or a structural parameter disables the channel
            is_read = any(k == name for k, _ in read_channels(binding.spec))
            if is_private and is_read and not column.optional:  # type: ignore[attr-defined]
                sensed, channel = self.wiring.sensed, column.channels[0]
                raise WiringError(
                    f"{self.wiring.where}: {'.'.join(binding.path)}.{name}: a plugin inside another one can only read channels that "
                    f"sensors write, and only in an autonomy; no sensor writes {channel!r}{nearest_name(channel, sensed)}; {listed(sensed)}"
                )
            link = self.wiring.unconnected(column, (binding.path, name))
        if isinstance(link, int):
            binding.ragged[name] = link
        else:
            binding.places[name] = link.place
            if link.rows is not None:
                if isinstance(column, Output) and len(binding.path) > 1:
                    raise WiringError(
                        f"{self.wiring.where}: {'.'.join(binding.path)}.{name}: a plugin inside another one can only write channels that "
                        f"their reader declares together, as one input; {' '.join(column.channels)} are read separately"
                    )
                binding.links[name] = link
        if isinstance(column, Output):
            binding.writable.add(name)

    def _topic(self, spec: Any, column: Any) -> Any:
        values = spec.values
        network = values[column.network_param] if column.network_param else column.network
        name = values[column.topic_param] if column.topic_param else column.topic
        return self.context.topic(
            network,
            name or column.message.__name__,
            column.message,
            f"{self.wiring.where}: {spec.instance_name}",
        )

    def _find_beliefs(self) -> None:
        """Find the sensor outputs that hold the entity's belief."""
        self.belief: dict[str, ColumnPlace] = {}
        for sensor in self.sensors:
            for name, (body, k, _) in BELIEF.items():
                place = sensor.places.get(name)
                if name in sensor.ragged:
                    raise WiringError(
                        f"{self.wiring.where}: {sensor.spec.instance_name}.{name} is a list; it must have {k} channels"
                    )
                if place is not None and isinstance(type(sensor.spec).columns[name], Output):
                    if place.k != k:
                        raise WiringError(
                            f"{self.wiring.where}: {sensor.spec.instance_name}.{name} has {place.k} channels; it must have {k}"
                        )
                    self.belief[body] = place

    # -- rows ---------------------------------------------------------------------------------------------------------------

    def rearrange(self, source: np.ndarray) -> None:
        """Reorder rows: new row i is row source[i] of the old body table; negative values are new rows at the defaults.

        Call `attach` afterwards.
        """
        self.table.rearrange(source, self.first)
        index = np.where(source >= 0, source - self.first, -1) if self.holds_handles else source
        for binding in self.walk() if self.holds_handles else ():
            for name, objects in binding.handles.items():
                binding.handles[name] = [objects[i] if i >= 0 else None for i in index]

    def attach(self, bodies: Bodies, first: int) -> None:
        """Set the rows [first, first + n) in the body table, and set the arrays of all plugins and views."""
        belief = {name: self.table.array(place) for name, place in self.belief.items()}
        self.autonomy_view.belief = self.controller_view.belief = belief
        self.shift(bodies, first)
        for binding in self.bindings:
            binding.attach(self.table)
        self._attach_motion()

    def shift(self, bodies: Bodies, first: int) -> None:
        """Move to other rows of the body table; the group's own rows are unchanged."""
        self.bodies, self.first, self.n = bodies, first, self.table.n
        for view in self.views:
            view.reset(bodies, first, self.last)

    def renew(self, rows: np.ndarray) -> None:
        """Reset some rows, (m,), to the defaults, in place."""
        self.table.renew(rows)
        for view in self.views:
            view.renew()

    def _place_motion(self) -> None:
        """Find the rows of the motion model's state, inputs and parameters in the table."""
        motion, plugin = self.motion, self.motion.plugin
        self.x_place = motion.places[next(k for k, c in type(plugin).states().items() if c.fields)]
        params = [motion.places[k] for k in type(plugin).row_params()]
        first = params[0].first if params else 0
        self.p_rows = slice(first, first + sum(max(1, p.k) for p in params))
        rows = [r for k in plugin.active_inputs() for r in self.rows_of(motion, k)]
        self.body_inputs = plugin.body_inputs()
        side_by_side = rows == list(range(rows[0], rows[0] + len(rows))) if rows else True
        self.u_rows = rows
        self.u_slice = slice(rows[0], rows[0] + len(rows)) if rows and side_by_side else slice(0, 0)
        self.stacks_inputs = bool(self.body_inputs) or not side_by_side

    def _attach_motion(self) -> None:
        data = self.table.arrays[float]
        self.x, self.u, self.p = self.table.array(self.x_place), data[self.u_slice], data[self.p_rows]
        for view in self.views:
            view.motion_state = read_only(self.x)

    def rows_of(self, binding: Binding, name: str) -> tuple[int, ...]:
        """Table rows of a column; for a channel, the rows that its writer and readers share."""
        link = binding.links.get(name)
        if link is not None and link.rows is not None:
            return link.rows
        place = binding.places[name]
        return tuple(range(place.first, place.first + max(1, place.k)))

    def from_body(self, rows: np.ndarray) -> None:
        """Let the motion model set the states of some rows, (m,) ascending, from the body table."""
        view = self.motion_view
        view.span = (int(rows[0]), int(rows[-1]) + 1)
        try:
            self.motion.plugin.from_body(view, rows)
        finally:
            view.span = (0, self.n)

    def advance(self, dt: float, substeps: int) -> None:
        """Integrate all rows over dt [s], and write the new states to the body table."""
        u = self.u
        if self.stacks_inputs:
            u = self._stacked_inputs()
        if self.context.threads == 1 or self.motion.handles:
            self.integrate(self.x, u, self.p, dt, substeps)
        elif ranged := self.range_kernel:
            part = partial(ranged.part, self.x, u, self.p, dt, substeps)
            self.context.split(self.n, part, ranged.rows_per_thread)
        else:
            self.motion_view.split(self._integrate_part, u, dt, substeps)
        self.publish()

    def publish(self) -> None:
        """Write the states to the body table."""
        self.motion.plugin.to_body(self.motion_view)
        self.bodies.touch(self.first, self.last)

    def _integrate_part(self, u: np.ndarray, dt: float, substeps: int, part: tuple[int, int]) -> None:
        """Integrate rows [first, last) on a copy, as kernels need contiguous arrays."""
        rows = slice(*part)
        x = np.ascontiguousarray(self.x[:, rows])
        self.integrate(
            x, np.ascontiguousarray(u[:, rows]), np.ascontiguousarray(self.p[:, rows]), dt, substeps
        )
        self.x[:, rows] = x

    def inputs_of_body(self) -> np.ndarray:
        """Return the inputs of the motion model, (k, n), with 0 in place of what controllers write."""
        u = self._stacked_inputs() if self.stacks_inputs else self.u.copy()
        u[: len(self.u_rows)] = 0.0
        return u

    def _stacked_inputs(self) -> np.ndarray:
        rows = [self.table.arrays[float][self.u_rows]]
        axes = {"x": 0, "y": 1, "z": 2}
        for name in self.body_inputs:
            column, _, axis = name.partition("_")
            values = getattr(self.motion_view, column)
            rows.append((values[axes[axis]] if axis else values)[None, :])
        return np.ascontiguousarray(np.concatenate(rows))
