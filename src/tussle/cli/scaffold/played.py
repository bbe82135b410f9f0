"""The text of a small mission that uses a given plugin."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain
from typing import Any
from xml.sax.saxutils import quoteattr

from tussle import stock
from tussle.api import Plugin
from tussle.columns import Publish, Subscribe
from tussle.engine.simulation import Simulation
from tussle.errors import MissionError, TussleError
from tussle.mission import Block, Mission

SELF = "SELF"
"""Placeholder for the plugin itself in a lineup."""

LINEUPS: dict[str, list[tuple[str, str, str]]] = {
    # (autonomies, controller, motion model), tried in this order.
    "autonomy": [
        (SELF, "DirectController", "Unicycle"),
        (SELF, "UnicyclePID", "Unicycle"),
        (SELF, "SingleIntegratorControllerSimple", "SingleIntegrator"),
        (SELF, "SimpleAircraftControllerPID", "SimpleAircraft"),
        (f"{SELF} Boids", "DirectController", "Unicycle"),
    ],
    "motion": [
        ("Boids", "DirectController", SELF),
        ("Straight", "UnicyclePID", SELF),
        ("Straight", "SimpleAircraftControllerPID", SELF),
        ("Straight", "HarmonicOscillatorConstController", SELF),
    ],
    "controller": [
        ("Straight", SELF, "Unicycle"),
        ("Straight", SELF, "SimpleAircraft"),
        ("Boids", SELF, "SingleIntegrator"),
        ("Boids", SELF, "Unicycle"),
        ("Straight", SELF, "HarmonicOscillator"),
        ("MultirotorTests", SELF, "Multirotor"),
        ("GoTo", f"UUV6DOFPIDController {SELF}", "UUV6DOF"),
    ],
}
USUAL = [("Boids", "DirectController", "Unicycle")]

TEXT = """\
<?xml version="1.0"?>
<runscript name={title}>

  <run start="0" end="60" dt="0.1" motion_multiplier="{substeps}"/>
  <end_condition>time</end_condition>
  <seed>1</seed>
{world}
  <entity>
    <name>robots</name>
    <team_id>1</team_id>
    <count>${{count=20}}</count>
    <x>0</x> <y>0</y> <z>200</z>
    <variance_x>40000</variance_x> <variance_y>40000</variance_y> <variance_z>400</variance_z>
    <speed>15</speed>
{autonomy}{controller}    <motion_model{pitching}>{motion}</motion_model>
{sensor}  </entity>

  <entity>
    <name>others</name>
    <team_id>2</team_id>
    <count>5</count>
    <x>800</x> <y>0</y> <z>200</z> <heading>180</heading>
    <variance_x>10000</variance_x> <variance_y>10000</variance_y>
    <autonomy>Boids</autonomy>
    <motion_model use_pitch="true">Unicycle</motion_model>
  </entity>

</runscript>
"""


def mission_text(kind: str, name: str, plugin: Plugin) -> str:
    """Return a mission of 20 robots and 5 others that uses the plugin.

    Args:
        kind: Kind of the plugin.
        name: Name of the plugin in the mission.
        plugin: An instance, used to find stock plugins that fit it.

    Raises:
        MissionError: The plugin does not fit any stock plugins.
    """
    autonomies, controllers, motion = (part.replace(SELF, name) for part in _lineup(kind, plugin))
    autonomy = "".join(f"    <autonomy>{each}</autonomy>\n" for each in autonomies.split())
    controller = "".join(f"    <controller>{each}</controller>\n" for each in controllers.split())
    tags = {"interaction": "entity_interaction", "metric": "metrics", "network": "network"}
    world = "".join(
        f"\n  <network name={quoteattr(each)}>SphereNetwork</network>\n" for each in _networks(plugin)
    )
    for boundary in plugin.named_regions():
        name_of = quoteattr(f"region {boundary:g}")
        world += f"\n  <entity_interaction name={name_of} boundary_id='{boundary:g}'>Boundary</entity_interaction>\n"
    world += f"\n  <{tags[kind]}>{name}</{tags[kind]}>\n" if kind in tags else ""
    sensor = f"    <sensor>{name}</sensor>\n" if kind == "sensor" else ""
    pitching = ' use_pitch="true"' if motion == "Unicycle" else ""
    return TEXT.format(
        title=quoteattr(f"{name} at work"), substeps=10, world=world, autonomy=autonomy, controller=controller,
        motion=motion, pitching=pitching, sensor=sensor,
    )  # fmt: skip


def _lineup(kind: str, plugin: Plugin) -> tuple[str, str, str]:
    """Return the first lineup that can be built."""
    why = ""
    for lineup in chain(LINEUPS.get(kind, USUAL), _to_points(kind, plugin)):
        try:
            with Simulation(_mission(kind, plugin, lineup)):
                return lineup
        except TussleError as error:
            why = str(error)
    raise MissionError(
        f"no mission could be written for {plugin!r}: it fits none of the stock plugins ({why})"
    )


def _to_points(kind: str, plugin: Plugin) -> Iterator[tuple[str, str, str]]:
    """Lineups that go to points, with the controllers or motion models that connect to the plugin."""
    stocked = {name: stock.load(name) for name in stock.manifest()}
    of_kind = {
        which: {n: c for n, c in stocked.items() if c.kind == which} for which in ("controller", "motion")
    }
    if kind == "motion":
        needed = {
            channel
            for column in plugin.inputs().values()
            for channel in column.channels
            if not column.optional
        }
        for name, controller in of_kind["controller"].items():
            if needed <= {channel for column in controller.outputs().values() for channel in column.channels}:
                yield "GoTo", name, SELF
    if kind == "controller":
        yield from (("GoTo", SELF, name) for name in of_kind["motion"])


def _mission(kind: str, plugin: Plugin, lineup: tuple[str, str, str]) -> Mission:
    autonomies, controller, motion = (
        [plugin if n == SELF else stock.load(n)() for n in part.split()] for part in lineup
    )
    sensor = plugin if kind == "sensor" else ()
    block = Block(
        name="robots", position=(0, 0, 200), autonomy=autonomies, controller=controller, motion=motion[0], sensor=sensor
    )  # fmt: skip
    world = dict(_world(kind, plugin))
    return Mission(blocks=[block], end=1.0, **world)


def _networks(plugin: Plugin) -> list[str]:
    """Networks of the plugin's topics that a mission does not add by itself."""
    topics = [*plugin.declared(Publish).values(), *plugin.declared(Subscribe).values()]
    names = dict.fromkeys(plugin.values[topic.network_param] for topic in topics if topic.network_param)
    return [name for name in names if name not in stock.ALWAYS_THERE]


def _world(kind: str, plugin: Plugin) -> Iterator[tuple[str, Any]]:
    if networks := [stock.load("SphereNetwork")(name=name) for name in _networks(plugin)]:
        yield "networks", networks
    regions = [
        stock.load("Boundary")(name=f"region {i:g}", boundary_id=int(i)) for i in plugin.named_regions()
    ]
    if kind in ("metric", "network"):
        yield f"{kind}s", plugin
    yield "interactions", [*regions, *([plugin] if kind == "interaction" else [])]
