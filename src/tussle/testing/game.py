"""The conformance kit's game: a small mission around one plugin."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from tussle.api import (
    Autonomy,
    Behavior,
    Controller,
    Interaction,
    Message,
    Metric,
    MotionModel,
    Network,
    Publish,
    Sensor,
    WorldPlugin,
)
from tussle.declare.columns import Channel, Topic
from tussle.engine.simulation import Simulation
from tussle.engine.wiring import BELIEF, read_channels, sharing, written_channels
from tussle.mission import Block, Mission
from tussle.plugins.stock import ALWAYS_THERE, GlobalNetwork, MotorSchemas
from tussle.testing.partners import (
    Driver,
    KitMessage,
    Reaper,
    SignalBehavior,
    can_fill,
    driver,
    signal_sensor,
    sink,
)

SEEDS = (11, 12, 13, 14, 15)
"""Seeds of the compared worlds. World 13 dies out early (see `Reaper`)."""
STEPS = 20


@dataclass(frozen=True)
class ConformanceGame:
    """A mission around a plugin.

    Attributes:
        plugin: The plugin as data.
        mission: A mission with deaths, births, a moved entity, and worlds that end at different times.
        quiet: The same mission without these.
        paths: Paths of the plugin, such as "red.Boids".
    """

    plugin: Any
    mission: Mission
    quiet: Mission
    paths: tuple[str, ...]

    def params(self, seeds: Sequence[int]) -> dict[str, list[Any]]:
        """Parameters that differ between worlds, depending on the worlds' seeds."""
        out: dict[str, list[Any]] = {}
        for name in self.plugin.params():
            values = [scaled(self.plugin, name, 1.03 - 0.02 * (seed % 3)) for seed in seeds]
            if self.plugin.params()[name].is_row_data:
                out[f"{self.paths[0]}.{name}"] = values
        return out

    def play(self, seeds: Sequence[int], threads: int = 1) -> Simulation:
        """A simulation of the mission with these seeds."""
        return Simulation(self.mission, seeds, self.params(seeds), threads=threads, on_error="raise")


def scaled(plugin: Any, name: str, factor: float) -> Any:
    """A parameter's value, multiplied by a factor if it is a real number per row and the product is within its bounds."""
    column, value = plugin.params()[name], plugin.values[name]
    if not column.is_row_data or column.dtype is not float or column.choices:
        return value
    changed = tuple(v * factor for v in value) if column.fields else value * factor
    parts = changed if column.fields else (changed,)
    return changed if all(map(column.is_within, parts)) else value


# -- the mission ------------------------------------------------------------------------------------------------------------------


def build(plugin: Any, companions: Sequence[Any] = ()) -> ConformanceGame:
    """Build a game around a plugin, with partners that write its inputs, read its outputs and exchange messages with it.

    Args:
        plugin: The plugin as data.
        companions: Plugins as data that replace the kit's own, if the plugin needs particular ones.
    """
    plugin = _with_children(plugin)
    sent, received = _topics(plugin)
    if isinstance(plugin, WorldPlugin):
        for message in _types_read(_missions(plugin, companions, sent, received).quiet):
            sent.add((message, message.__name__, "GlobalNetwork"))
        for message in _types_published(_missions(plugin, companions, sent, received).quiet):
            received.add((message, message.__name__, "GlobalNetwork"))
    return _missions(plugin, companions, sent, received)


def _with_children(plugin: Any) -> Any:
    inner: dict[str, Any] = {}
    for name, column in plugin.children().items():
        if not plugin.values[name]:
            made = column.kind if column.fields else SignalBehavior
            inner[name] = [driver((), (), (), ()) if column.kind is Autonomy else made()]
    return plugin.replace(**inner) if inner else plugin


def _topics(plugin: Any) -> tuple[set[Any], set[Any]]:
    """The topics that the driver publishes, and those that it subscribes to: (message, topic, network)."""
    sent: set[Any] = set()
    received: set[Any] = set()
    for name, column in plugin.topics().items():
        assert isinstance(column, Topic), name
        topic = plugin.values[column.topic_param] if column.topic_param else column.topic
        network = plugin.values[column.network_param] if column.network_param else column.network
        network = network or ALWAYS_THERE[0]
        (received if isinstance(column, Publish) else sent).add(
            (column.message, topic or column.message.__name__, network)
        )
    for name in plugin.children():
        for child in plugin.values[name]:
            its_sent, its_received = _topics(child)
            sent |= its_sent
            received |= its_received
    if isinstance(plugin, Network):
        topic = KitMessage, KitMessage.__name__, plugin.__dict__["instance_name"]
        sent.add(topic)
        received.add(topic)
    return sent, received


def _types_read(mission: Mission) -> list[type[Message]]:
    """Message types that the world plugins read in the first steps, since these are not declared."""
    found: dict[type[Message], None] = {}
    with Simulation(mission, 1) as sim:
        view, inbox = sim.state.world_view, sim.state.world_view.inbox
        view.__dict__["inbox"] = lambda type_: (found.setdefault(type_), inbox(type_))[1]
        sim.step(3)
    return [message for message in found if can_fill(message)]


def _types_published(mission: Mission) -> list[type[Message]]:
    """Message types that the world plugins publish in the first steps."""
    found: dict[type[Message], None] = {}
    with Simulation(mission, 1) as sim:
        publish_to = sim.state.world_view.publish_to
        sim.state.world_view.publish_to = lambda type_, network: (
            found.setdefault(type_),
            publish_to(type_, network),
        )[1]
        sim.step(8)
    return list(found)


def _missions(
    plugin: Any, companions: Sequence[Any], sent: Iterable[Any], received: Iterable[Any]
) -> ConformanceGame:
    publishes = sorted((t for t in sent if can_fill(t[0])), key=_topic_order)
    subscribes = sorted(received, key=_topic_order)
    all_: list[Any] = [plugin, *companions]
    networks: list[Any] = [p for p in all_ if isinstance(p, Network)]
    there = {"GlobalNetwork", *(n.instance_name for n in networks)}
    missing = sorted({topic[2] for topic in (*publishes, *subscribes)} - there)
    networks += [GlobalNetwork(name=name) for name in missing]
    varied = plugin.replace(**{name: scaled(plugin, name, 0.9) for name in plugin.params()})
    # Partners are made once for all blocks, so that their entities are rows of one group.
    slots = _slots(plugin, companions, publishes, subscribes)
    mixed = {name: _swapped(value, plugin, varied) for name, value in slots.items()}
    blocks = [_block("red", 1, slots), _block("blue", 2, mixed), _block("late", 1, slots)]
    named = {name for one in all_ for inner in one.walk() for name in inner.named_blocks()}
    spare = [Block(name=name, count=0, **slots) for name in sorted(named - {block.name for block in blocks})]
    path = plugin.instance_name
    if isinstance(plugin, Behavior):
        path = f"MotorSchemas.{path}"
    paths = (path,) if isinstance(plugin, WorldPlugin) else tuple(f"{b.name}.{path}" for b in blocks)
    mission = Mission(
        blocks=[*blocks, *spare],
        dt=0.1,
        end=0.1 * STEPS,
        motion_multiplier=2,
        end_conditions="time, all_dead",
        interactions=[*(p for p in all_ if isinstance(p, Interaction)), Reaper()],
        metrics=[p for p in all_ if isinstance(p, Metric)],
        networks=networks,
        name=f"conformance of {plugin.instance_name}",
    )
    quiet = mission.replace(blocks=[*blocks[:2], *spare], interactions=mission.interactions[:-1])
    return ConformanceGame(plugin, mission, quiet, paths if len(paths) == 1 else paths[:2])


def _topic_order(topic: Any) -> tuple[str, str, str]:
    return topic[2], topic[1], topic[0].__name__


def _block(name: str, team: int, slots: dict[str, Any]) -> Block:
    late: dict[str, Any] = {"rate": 10.0, "first_birth": 0.3} if name == "late" else {}
    # Near each other and near the origin, which is the default of most positions.
    x, count = {"red": (0.0, 5), "blue": (5.0, 4), "late": (-5.0, 2)}[name]
    return Block(
        name=name, team=team, count=count, position=(x, 0.0, 4.0), variance=(30.0, 30.0, 10.0), scatter_first=True,
        heading=x / 2.0, heading_variance=1.0, climb=0.1, speed=6.0, **late, **slots,
    )  # fmt: skip


def _slots(
    plugin: Any, companions: Sequence[Any], publishes: Sequence[Any], subscribes: Sequence[Any]
) -> dict[str, Any]:
    """Plugins of a block, by argument of `Block`."""
    holder = MotorSchemas(behaviors=[plugin]) if isinstance(plugin, Behavior) else plugin
    kinds = (Autonomy, Controller, Sensor, MotionModel)
    given: list[Any] = [holder, *companions]
    places: list[list[Any]] = [[p for p in given if isinstance(p, kind)] for kind in kinds]
    autonomies, controllers, sensors, motions = places
    inner = [*autonomies, *(b for a in autonomies for b in a.values.get("behaviors", ()))]
    altering = [s for s in sensors if s.alters_sensors]
    sensors = [s for s in sensors if not s.alters_sensors]
    altered = [c for s in altering for c in written_channels(s).values()]
    measured = [c for s in sensors for name, c in type(s).outputs().items() if name not in BELIEF]
    written = [c for s in sensors for c in written_channels(s).values()]
    missing = _without([c for a in inner for _, c in read_channels(a)], measured) + _without(altered, written)
    readers = [[c for _, c in read_channels(p)] for p in (*controllers, *motions)]
    wanted = next((columns for columns in readers if columns), [])
    written = [c for a in autonomies for b in sharing(a) for c in written_channels(b).values()]
    pilot = driver(_without(wanted, written), measured, publishes, subscribes)
    if not motions:
        last = [c for c in controllers if not c.passthrough] or controllers
        end = list(written_channels(last[-1]).values()) if last else []
        motions = [sink(end or [*Driver.outputs().values(), *_without(written, [])])]
    sensors = [*sensors, *([signal_sensor(missing)] if missing else []), *altering]
    return {
        "autonomy": [pilot, *autonomies],
        "controller": controllers,
        "motion": motions[0],
        "sensor": sensors,
    }


def _swapped(value: Any, old: Any, new: Any) -> Any:
    """The plugins of a slot, with `old` replaced by `new`."""
    if isinstance(value, list):
        return [_swapped(v, old, new) for v in value]
    if value is old:
        return new
    return (
        value.replace(behaviors=[new])
        if isinstance(old, Behavior) and isinstance(value, MotorSchemas)
        else value
    )


def _without(columns: Iterable[Channel], others: Iterable[Channel]) -> list[Channel]:
    """The columns that have a channel which neither `others` nor earlier columns have."""
    there = {channel for c in others for channel in c.channels}
    kept = []
    for column in columns:
        if not there.issuperset(column.channels):
            kept.append(column)
            there |= set(column.channels)
    return kept
