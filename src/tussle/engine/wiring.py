"""Connect the channels of an entity's plugins by name, and check their units and list fields."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from tussle.declare import units
from tussle.declare.columns import Channel, Output
from tussle.engine.table import ColumnPlace, Table
from tussle.errors import WiringError, listed, nearest_name

FEEDS = {
    "autonomy": "autonomies read those of sensors",
    "controller": "a controller reads those of sensors, and of what stands before it",
    "motion": "the motion model reads those of sensors, and of the last controller if there is one",
}
"""What feeds a kind of plugin, for messages."""
BELIEF = {"belief_pos": ("pos", 3, "m"), "belief_vel": ("vel", 3, "m/s"), "belief_quat": ("quat", 4, "")}


@dataclass(slots=True)
class Link:
    """Location of a channel column. With `rows`, the plugin has its own array: inputs are copied from these rows, outputs to them."""

    place: ColumnPlace
    rows: tuple[int, ...] | None = None


@dataclass
class Bus:
    """Channels between one stage and the next.

    Attributes:
        row: Channel -> row in the table's float array; for a list, its index in the table's lists.
        unit: Channel -> its unit; for a list, the units of its fields.
        fields: Channel -> fields of its list; None for a number.
        writers: Channel -> names of the plugins that write it, in call order.
        read: Channels that a plugin reads.
    """

    row: dict[str, int] = field(default_factory=dict)
    unit: dict[str, tuple[str, ...]] = field(default_factory=dict)
    fields: dict[str, tuple[str, ...] | None] = field(default_factory=dict)
    writers: dict[str, list[str]] = field(default_factory=dict)
    read: set[str] = field(default_factory=set)


def read_channels(plugin: Any) -> list[tuple[str, Channel]]:
    """Input columns used by a plugin, in order of declaration."""
    inputs = type(plugin).inputs()
    names = plugin.active_inputs() if hasattr(type(plugin), "active_inputs") else list(inputs)
    return [(k, inputs[k]) for k in names]


def written_channels(plugin: Any) -> dict[str, Channel]:
    """Output columns that a plugin writes, in order of declaration."""
    outputs: dict[str, Channel] = {**type(plugin).outputs()}
    names = plugin.offered_outputs() if hasattr(type(plugin), "offered_outputs") else outputs
    return {k: outputs[k] for k in names}


class Wiring:
    """Channel connections of one group.

    Args:
        where: Name of the entity block, for error messages.
        table: Table to which the channel columns are added.
        advise: Returns controllers that would connect the written channels to the read ones, for error messages.
    """

    def __init__(
        self, where: str, table: Table, advise: Callable[[Iterable[str], Iterable[str]], list[str]]
    ) -> None:
        self.where = where
        self.table = table
        self.advise = advise
        self.links: dict[tuple[int, str], Link | int] = {}
        self.wired: dict[int, set[str]] = {}
        self.writers: list[tuple[str, str, list[str]]] = []
        self.sensed: list[str] = []
        self._all: tuple[Any, ...] = ()

    def connect(
        self, sensors: Sequence[Any], autonomies: Sequence[Any], controllers: Sequence[Any], motion: Any
    ) -> None:
        """Connect sensors, autonomies, controllers and motion model.

        Raises:
            WiringError: No plugin writes an input's channel, or its writer has another unit or other fields.
        """
        self._all = (*sensors, *autonomies, *controllers)
        working = [c for c in controllers if not c.passthrough]
        autonomies = [plugin for autonomy in autonomies for plugin in sharing(autonomy)]
        self._check_passthrough(controllers, [*working, motion])
        sense = self._bus(sensors, [])
        self._join(sense, sensors, [])
        self._check_altered(sensors)
        stages: list[list[Any]] = [list(autonomies), *[[c] for c in working]]
        for producers, consumer in zip(stages, [*working, motion], strict=True):
            bus = self._bus(producers, [consumer])
            self._join(bus, producers, [consumer], sense)
        self.sensed = sorted(sense.writers)
        for autonomy in autonomies:
            self._read(autonomy, {}, sense, required=True)
            for plugin in _nested(autonomy):
                self._read(plugin, {}, sense, required=False)

    def _check_passthrough(self, controllers: Sequence[Any], consumers: Sequence[Any]) -> None:
        following = list(consumers)
        for controller in controllers:
            if not controller.passthrough:
                following.pop(0)
                continue
            offered = {c for column in type(controller).outputs().values() for c in column.channels}
            needed = [
                c
                for _, column in read_channels(following[0])
                for c in column.channels
                if not getattr(column, "optional", False)
            ]
            for channel in needed if offered else []:
                if channel not in offered:
                    raise self._no_writer(following[0], channel, offered, controller.instance_name)

    def _check_altered(self, sensors: Sequence[Any]) -> None:
        """Check that a sensor that alters channels stands after one that writes them, and is called as often."""
        written: dict[str, Any] = {}
        for sensor in sensors:
            for column in written_channels(sensor).values():
                for channel in column.channels:
                    if sensor.alters_sensors:
                        at = f"{self.where}: {sensor.instance_name} alters channel {channel!r}"
                        if channel not in written:
                            raise WiringError(
                                f"{at}, which no sensor before it writes{nearest_name(channel, written)}; {listed(written)}"
                            )
                        if written[channel].rate != sensor.rate:
                            own, its = (_rate_text(each) for each in (sensor, written[channel]))
                            raise WiringError(
                                f"{at} {own}, but {written[channel].instance_name} writes it {its}; give both the same rate"
                            )
                    written[channel] = sensor

    def _bus(self, producers: Sequence[Any], consumers: Sequence[Any]) -> Bus:
        """Allocate rows for all channels. Those of the consumers come first, in order, so that inputs are contiguous where possible."""
        bus = Bus()
        for plugin in consumers:
            for _, column in read_channels(plugin):
                self._add(bus, column)
        for plugin in producers:
            for column in written_channels(plugin).values():
                self._add(bus, column)
        return bus

    def _add(self, bus: Bus, column: Channel) -> None:
        default = column.default
        each = default if isinstance(default, tuple) else [default] * len(column.channels)
        defaults = dict(zip(column.channels, each, strict=True))
        for channel, form in _forms(column).items():
            if channel not in bus.row:
                if column.ragged:
                    bus.row[channel] = self.table.add_list(column)
                else:
                    place = self.table.add(("channel", len(self.table.places)), float, 0, defaults[channel])
                    bus.row[channel] = place.first
                bus.fields[channel], bus.unit[channel] = form

    def _join(
        self, bus: Bus, producers: Sequence[Any], consumers: Sequence[Any], fallback: Bus | None = None
    ) -> None:
        for plugin in producers:
            for column in written_channels(plugin).values():
                for channel in column.channels:
                    bus.writers.setdefault(channel, []).append(plugin.instance_name)
        for plugin in producers:
            for name, column in written_channels(plugin).items():
                self._check_form(plugin, column, bus)
                self.links[id(plugin), name] = self._link(column, bus)
        for plugin in consumers:
            self._read(plugin, bus, fallback, required=True)
            if getattr(type(plugin), "reads_all", False):
                bus.read.update(bus.writers)
        for channel, names in bus.writers.items():
            if len(names) > 1:
                self.writers.append((self.where, channel, names))
        for plugin in producers:
            for name, column in written_channels(plugin).items():
                if name in BELIEF or any(c in bus.read for c in column.channels):
                    self.wired.setdefault(id(plugin), set()).add(name)
                if bus.read.isdisjoint(column.channels) and not consumers:
                    # Sensor outputs may be read by autonomies, and by name from outside.
                    self.wired.setdefault(id(plugin), set()).add(name)

    def _read(self, plugin: Any, bus: Any, fallback: Bus | None, required: bool) -> None:
        for name, column in read_channels(plugin):
            source = None
            for candidate in (bus, fallback):
                if candidate and all(c in candidate.writers for c in column.channels):
                    source = candidate
                    break
            if source is None:
                if not column.optional and not required:  # type: ignore[attr-defined]
                    continue  # binding reports the error
                if not column.optional:  # type: ignore[attr-defined]
                    written = {c for b in (bus, fallback) if b for c in b.writers}
                    absent = next((c for c in column.channels if c not in written), column.channels[0])
                    raise self._no_writer(plugin, absent, written, "")
                if isinstance(bus, Bus) and all(c in bus.row for c in column.channels):
                    self.links[id(plugin), name] = self._link(column, bus)
                else:
                    self.links[id(plugin), name] = self.unconnected(column, (id(plugin), name))
                continue
            self._check_form(plugin, column, source)
            source.read.update(column.channels)
            self.links[id(plugin), name] = self._link(column, source)

    def unconnected(self, column: Channel, key: Any) -> Link | int:
        """Location of a channel column that is not connected."""
        if column.ragged:
            return self.table.add_list(column)
        return Link(self.table.add(key, float, len(column.fields), column.default))

    def _link(self, column: Channel, bus: Bus) -> Link | int:
        rows = tuple(bus.row[c] for c in column.channels)
        if column.ragged:
            return rows[0]
        if not column.fields or rows == tuple(range(rows[0], rows[0] + len(rows))):
            return Link(ColumnPlace(float, rows[0], len(column.fields)))
        return Link(self.table.add(("own", len(self.table.places)), float, len(column.fields)), rows)

    def _check_form(self, plugin: Any, column: Channel, bus: Bus) -> None:
        kind = "writes" if isinstance(column, Output) else "reads"
        for channel, (fields, own) in _forms(column).items():
            at = f"{self.where}: {plugin.instance_name}.{column.name} {kind} channel {channel!r}"
            there = bus.fields[channel]
            if fields != there:
                raise WiringError(
                    f"{at} as {_form_text(fields)}, but another plugin declares it as {_form_text(there)}"
                )
            for name, unit, other in zip(fields or ("",), own, bus.unit[channel], strict=True):
                if not units.compatible(unit, other):
                    of = f", field {name!r}," if name else ""
                    raise WiringError(
                        f"{at}{of} in {unit or 'no unit'!r}, but another plugin declares it in {other or 'no unit'!r}"
                    )

    def _no_writer(self, reader: Any, channel: str, offered: Iterable[str], through: str) -> WiringError:
        offered = sorted(offered)
        fitting = self.advise(offered, [c for _, column in read_channels(reader) for c in column.channels])
        advice = f"; controllers that connect them: {', '.join(fitting)}" if fitting else ""
        by = f" through {through}" if through else ""
        others = [p for p in self._all if any(channel in c.channels for c in written_channels(p).values())]
        if others and reader.kind in FEEDS:
            advice += f"; {others[0].instance_name} writes it, but {FEEDS[reader.kind]}"
        return WiringError(
            f"{self.where}: no plugin writes channel {channel!r} for {reader.instance_name}{by}{nearest_name(channel, offered)}; "
            f"written channels: {', '.join(offered) or 'none'}{advice}"
        )


def sharing(plugin: Any) -> Iterator[Any]:
    """Yield a plugin and all plugins inside it that share the channels of the entity."""
    yield plugin
    for name, column in plugin.children().items():
        for child in plugin.values[name] if column.shares_channels else ():
            yield from sharing(child)


def _nested(plugin: Any) -> Iterator[Any]:
    """Yield all plugins nested in a plugin that have private channels."""
    for name, column in plugin.children().items():
        for child in () if column.shares_channels else plugin.values[name]:
            yield child
            yield from _nested(child)


def _forms(column: Channel) -> dict[str, tuple[tuple[str, ...] | None, tuple[str, ...]]]:
    """Channel -> (fields of its list or None, units)."""
    if column.ragged:
        return {column.channels[0]: (column.fields, column.units)}
    return {channel: (None, (unit,)) for channel, unit in zip(column.channels, column.units, strict=True)}


def _rate_text(sensor: Any) -> str:
    return "in every step" if sensor.rate is None else f"at {sensor.rate:g} Hz"


def _form_text(fields: tuple[str, ...] | None) -> str:
    if fields is None:
        return "a number"
    n = len(fields)
    return f"a list of {n} field{'s' * (n > 1)} ({' '.join(fields)})" if n else "a list of numbers"
