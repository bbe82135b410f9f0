"""Reading of <entity> tags into blocks, with the tags that they take from <entity_common>."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tussle.declare.texts import FALSE, shown, truth
from tussle.errors import MissionError, TussleError
from tussle.mission import codecs
from tussle.mission.limits import Limits
from tussle.mission.node import Budget, Node
from tussle.mission.plugin_tags import PluginReader, PluginTag
from tussle.mission.problems import Place, Problems
from tussle.mission.spec import BLOCK_VALUES, RUN, Block
from tussle.mission.tags import BASE, ENTITY, ENTITY_ATTRIBUTES, MANY, TagSpec
from tussle.world.scene import Base, Origin

MAX_TEAM = 2**31 - 1


def expand_entity_common(root: Node, problems: Problems, budget: Budget) -> None:
    """Copy the tags of <entity_common> into each <entity> that takes them, and remove <entity_common>.

    Raises:
        MissionError: The copies exceed the budget.
    """
    shared: dict[str, Node] = {}
    for node in root.find_all("entity_common"):
        name = node.attributes.get("name", "")
        if not name:
            problems.error(node.place, "entity_common has no name; entities take it by its name")
        shared[name] = node
    for node in root.find_all("entity"):
        requested = node.attributes.pop("entity_common", None)
        if requested is None:
            continue
        if requested not in shared:
            problems.absent(node.where("entity_common"), "entity_common", requested, shared)
            continue
        node.children = _merged(shared[requested].children, node.children, budget)
    root.children = [child for child in root.children if child.tag != "entity_common"]


def _merged(common: Iterable[Node], own: list[Node], budget: Budget) -> list[Node]:
    """Return the shared tags that the entity does not override, then its own. Plugins of both are kept, the shared ones first."""
    by_tag: dict[str, list[Node]] = {}
    for mine in own:
        by_tag.setdefault(mine.tag, []).append(mine)
    taken = []
    for node in common:
        budget.spend_copy(node)
        same = by_tag.get(node.tag, [])
        if node.tag == "name" or (same and node.tag not in MANY):
            budget.spend_nodes(len(same), node.place)
            for mine in same:
                if mine.text == node.text:
                    budget.spend_copy(node)
                    mine.attributes = {**node.attributes, **mine.attributes}
            continue
        taken.append(node.copied())
    return [*taken, *own]


def block_names(nodes: Iterable[Node]) -> list[str]:
    """Return the name of each entity's block: its `tag`, else its name, else "team_ID". A second block of a name is called "NAME_2"."""
    taken = {RUN}
    last: dict[str, int] = {}
    names = []
    for node in nodes:
        texts = {child.tag: child.text for child in node.children}
        wanted = node.attributes.get("tag") or texts.get("name") or f"team_{texts.get('team_id') or 0}"
        wanted = "_".join(wanted.replace(".", "_").split())[:80] or "entity"
        name = wanted
        while name in taken:
            last[wanted] = last.get(wanted, 1) + 1
            name = f"{wanted}_{last[wanted]}"
        taken.add(name)
        names.append(name)
    return names


@dataclass
class Fields:
    """Reads the child tags that hold one value each.

    Attributes:
        node: The tag.
        known: Tags that it may contain.
        problems: Receives errors and notes.
        found: The last tag of each name.
    """

    node: Node
    known: Mapping[str, TagSpec]
    problems: Problems
    found: dict[str, Node] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.node.text and self.node.children:
            self.problems.note(
                self.node.place,
                f"text between the tags of <{self.node.tag}> is ignored: {shown(self.node.text)}",
            )
        for child in self.node.children:
            if child.tag not in self.known:
                self.problems.unknown(child.place, f"tag in <{self.node.tag}>", child.tag, self.known)
            elif child.tag in self.found and child.tag not in MANY:
                self.problems.note(child.place, f"<{child.tag}> occurs more than once; the last one is used")
            self.found[child.tag] = child

    def has(self, *names: str) -> bool:
        return all(name in self.found for name in names)

    def place(self, name: str) -> Place:
        return self.found[name].place if name in self.found else self.node.place

    def read(self, name: str, codec: Callable[[str], Any]) -> Any:
        """Return the value of a tag; its default if the tag is missing or wrong."""
        if name in self.found:
            try:
                return codec(self.found[name].text)
            except TussleError as error:
                self.problems.error(
                    self.found[name].place, f"{name}: {str(error).removeprefix(f'{name} = ')}"
                )
        default = self.known[name].default
        return codec(default) if default and default != "none" else None

    def number(self, name: str, unit: str = "") -> float:
        """Return a number in SI units, 0 without a valid value or default. A bare number is in the tag's unit."""
        text_unit, bound = self.known[name].unit, self.known[name].bound

        def codec(text: str) -> float:
            value = codecs.number(text, unit or text_unit, text_unit)
            if (bound == "> 0" and not value > 0.0) or (bound == ">= 0" and value < 0.0):
                raise MissionError(f"{shown(text)} is not allowed; it takes a number {bound}")
            return value

        return self.read(name, codec) or 0.0

    def vector(self, *names: str) -> tuple[float, ...]:
        return tuple(self.number(name) for name in names)

    def angles(self, latitude: str, longitude: str) -> tuple[float, float]:
        """Return latitude and longitude [rad], within their ranges."""
        found = []
        for name, most in ((latitude, 90.0), (longitude, 360.0)):
            value = self.number(name, "rad")
            if abs(value) > math.radians(most):
                text = f"{name}: {math.degrees(value):g} deg is not allowed; it takes degrees from -{most:g} to {most:g}"
                self.problems.error(self.place(name), text)
                value = 0.0
            found.append(value)
        return found[0], found[1]

    def position(self, origin: Origin) -> tuple[float, ...]:
        """Return the position [m] from latitude, longitude and altitude if all three are given, else from x, y, z."""
        geodetic = ("latitude", "longitude", "altitude")
        given = [name for name in geodetic if self.has(name)]
        if len(given) == len(geodetic):
            if origin.is_default:
                text = "the mission has no <latitude_origin> and <longitude_origin>: <latitude> and <longitude> count from 29 N, 95 W"
                self.problems.note(self.place("latitude"), text)
            angles = self.angles("latitude", "longitude")
            return tuple(float(v) for v in origin.from_geodetic(np.array([*angles, self.number("altitude")])))
        for name in given:
            text = (
                f"<{name}> is ignored: {', '.join(geodetic)} have an effect only together; x, y, z are used"
            )
            self.problems.note(self.place(name), text)
        return self.vector("x", "y", "z")


@dataclass
class EntityReader:
    """Makes the blocks and bases of a mission.

    Attributes:
        plugins: Makes the plugins.
        problems: Receives errors and notes.
        origin: Geographic origin of the mission.
        limits: Limits on the number of entities.
        update: The mission's update order; the limit is lower for "sequential".
        mesh_lengths: Lengths of the bounds of a mesh file [m].
        rows: Entities so far.
        bases: Bases so far.
        viewer: Block name -> settings for the viewer.
        places: Block name -> its place.
    """

    plugins: PluginReader
    problems: Problems
    origin: Origin
    limits: Limits
    update: str
    mesh_lengths: Callable[[str], tuple[float, ...]]
    rows: int = 0
    bases: list[Base] = field(default_factory=list)
    viewer: dict[str, dict[str, str]] = field(default_factory=dict)
    places: dict[str, Place] = field(default_factory=dict)

    def block(self, node: Node, name: str) -> Block | None:
        """Make the block of one <entity>. Returns None if it has errors, which are added to `problems`."""
        for attribute in node.attributes:
            if attribute not in ENTITY_ATTRIBUTES:
                self.problems.unknown(
                    node.where(attribute), "attribute of <entity>", attribute, ENTITY_ATTRIBUTES
                )
        fields = Fields(node, ENTITY, self.problems)
        self.places[name] = node.place
        self._note_differences(fields)
        team = fields.read("team_id", lambda text: codecs.integer(text, -MAX_TEAM, MAX_TEAM))
        values: dict[str, Any] = {"name": name, "team": team, "count": self._count(fields)}
        values |= self._body(fields) | self._births(fields, values["count"])
        taken: set[str] = set()
        for kind in ("autonomy", "controller", "sensor"):
            values[kind] = self.plugins.many(node.find_all(kind), taken)
        values["motion"] = self._motion(fields, taken)
        for base in node.find_all("base"):
            self._base(base, team)
        viewer = {
            key: fields.found[key].text for key, known in ENTITY.items() if known.kept_for and fields.has(key)
        }
        if viewer:
            self.viewer[name] = viewer
        if values["motion"] is None:
            return None
        try:
            return Block(**values)
        except TussleError as error:
            self.problems.error(node.place, str(error))
            return None

    def _note_differences(self, fields: Fields) -> None:
        """Note the tags that tussle treats differently from the format."""
        if not fields.has("team_id"):
            self.problems.note(fields.node.place, "the entity has no <team_id>; its team is 0")
        if fields.has("id"):
            self.problems.note(
                fields.place("id"), "<id> is ignored: ids count up from 1 in the order of the file"
            )
        if fields.has("connect_entity") and fields.found["connect_entity"].text.lower() in FALSE:
            self.problems.note(
                fields.place("connect_entity"), "<connect_entity> is ignored: wiring is always checked"
            )
        for tag, node in fields.found.items():
            if tag in ENTITY and tag not in MANY and tag != "motion_model":
                for attribute in node.attributes:
                    self.problems.unknown(node.where(attribute), f"attribute of <{tag}>", attribute, ())

    def _count(self, fields: Fields) -> int:
        count: int = fields.read("count", lambda text: codecs.integer(text, 0))
        self.rows += count
        most = self.limits.most_rows(self.update)
        if self.rows > most >= self.rows - count:
            how = f" with update={self.update!r}" if most < self.limits.rows else ""
            self.problems.error(
                fields.place("count"),
                f"count: the mission has {self.rows:,} entities up to here; the limit{how} is {most:,}; "
                f"use allow_large for a file that you trust",
            )
        return min(count, most)

    def _body(self, fields: Fields) -> dict[str, Any]:
        """Return initial states, and the values of the body."""
        velocity = fields.vector("vx", "vy", "vz")
        box = fields.vector("box_x", "box_y", "box_z")
        if fields.has("box_mesh"):
            box = fields.read("box_mesh", lambda text: self.mesh_lengths(text.strip())) or box
        return {
            "health": fields.number("health"),
            "radius": fields.number("radius"),
            "mass": fields.number("mass"),
            "position": fields.position(self.origin),
            "heading": fields.number("heading", "rad"),
            "roll": fields.number("roll", "rad"),
            "climb": 0.0 - fields.number("pitch", "rad"),
            "velocity": velocity if any(velocity) else None,
            "box": box if any(box) else None,
            "speed": fields.number("speed"),
            "placement": fields.read(
                "placement", lambda text: BLOCK_VALUES["placement"].convert(text, "placement")
            ),
            "variance": fields.vector("variance_x", "variance_y", "variance_z"),
            "half_width": fields.vector("half_width_x", "half_width_y", "half_width_z"),
            "heading_variance": fields.number("variance_heading", "rad^2"),
            "scatter_first": fields.read("use_variance_all_ents", truth),
        }

    def _births(self, fields: Fields, count: int) -> dict[str, Any]:
        """Return the times of birth; empty if all entities exist from the start."""
        if not fields.has("generate_rate"):
            return {}
        rate = fields.read("generate_rate", lambda text: codecs.fraction(text, "1/s")) or 0.0
        slots = fields.read("generate_count", codecs.integer) or 0
        if not (rate > 0.0 and slots > 0):
            text = "<generate_rate> is ignored without a rate > 0 and <generate_count> > 0; all entities exist from the start"
            self.problems.note(fields.place("generate_rate"), text)
            return {}
        return {
            "rate": rate,
            "slots": min(slots, max(1, count)),  # further slots would have no births
            "first_birth": fields.number("generate_start_time"),
            "interval_sd": fields.number("generate_time_variance"),
            "without_space": fields.read(
                "generate_without_space",
                lambda text: BLOCK_VALUES["without_space"].convert(text, "generate_without_space"),
            ),
        }

    def _motion(self, fields: Fields, taken: set[str]) -> Any:
        if fields.has("motion_model"):
            written = PluginTag.of(fields.found["motion_model"])
            if fields.has("script_name"):
                self._add_script(fields, written)
            is_moving = any(fields.vector("vx", "vy", "vz")) or fields.number("speed") != 0.0
            return self.plugins.faster(self.plugins.make(written, taken), written, is_moving)
        default = PluginTag("motion_model", ENTITY["motion_model"].default, {}, lambda _: fields.node.place)
        return self.plugins.make(default, taken)

    def _add_script(self, fields: Fields, written: PluginTag) -> None:
        """Make <script_name> an attribute of the motion model, if the model has this parameter."""
        with suppress(TussleError):  # `make` reports what is wrong with the name
            if "script_name" in self.plugins.catalogue.load(written.plugin).params():
                written.attributes.setdefault("script_name", fields.found["script_name"].text)
                return
        text = f"<script_name> is ignored: {written.plugin} does not read it"
        self.problems.note(fields.place("script_name"), text)

    def _base(self, node: Node, team: int) -> None:
        fields = Fields(node, BASE, self.problems)
        try:
            self.bases.append(
                Base(
                    team=team,
                    position=fields.position(self.origin),
                    radius=fields.number("radius"),
                    opacity=fields.number("opacity"),
                )
            )
        except TussleError as error:
            self.problems.error(node.place, str(error))
