"""The mission that is written with a new plugin."""

from __future__ import annotations

from tussle.cli.scaffold.copied import class_renamed
from tussle.plugins import stock

LINEUPS = {
    "autonomy": ("{name}", "DirectController", "Unicycle"),
    "motion": ("Boids", "DirectController", "{name}"),
    "controller": ("Straight", "{name}", "Unicycle"),
}
"""Autonomy, controller and motion model with the template of a kind, where they are not the usual ones."""
USUAL = "Boids", "DirectController", "Unicycle"
WORLD = {"interaction": "entity_interaction", "metric": "metrics", "network": "network"}
"""Tags of the plugins of a world."""

TEXT = """\
<?xml version="1.0"?>
<runscript name="{name} at work">

  <run start="0" end="60" dt="0.1" motion_multiplier="10"/>
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
    <autonomy>{autonomy}</autonomy>
    <controller>{controller}</controller>
    <motion_model{pitching}>{motion}</motion_model>
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


def mission_text(kind: str, name: str) -> str:
    """Return a mission of 20 robots and 5 others that uses a plugin made from the template of its kind."""
    autonomy, controller, motion = (part.format(name=name) for part in LINEUPS.get(kind, USUAL))
    tag = WORLD.get(kind)
    return TEXT.format(
        name=name, autonomy=autonomy, controller=controller, motion=motion,
        pitching=' use_pitch="true"' if motion == "Unicycle" else "",
        world=f"\n  <{tag}>{name}</{tag}>\n" if tag else "",
        sensor=f"    <sensor>{name}</sensor>\n" if kind == "sensor" else "",
    )  # fmt: skip


def example_text(origin: str, class_name: str, name: str) -> str:
    """Return the example of a stock plugin for a copy of the plugin; it reads the same files."""
    path = stock.examples()[origin]
    text = path.read_text(encoding="utf-8").replace("${folder}", str(path.parent))
    return class_renamed(text, class_name, name)
