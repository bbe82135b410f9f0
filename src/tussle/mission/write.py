"""Missions written back: `to_xml` as a mission file, `to_python` as the Python code that builds it."""

from __future__ import annotations

import dataclasses
import json
import re
from collections.abc import Iterator, Sequence
from typing import Any

from tussle.api.plugin import Plugin
from tussle.declare.texts import shown
from tussle.errors import MissionError, ParameterError
from tussle.mission import codecs
from tussle.mission.entities import block_names
from tussle.mission.given import GivenMission, mission_of
from tussle.mission.node import Node
from tussle.mission.plugin_tags import RATED
from tussle.mission.problems import Place
from tussle.mission.rekeys import rekeys_text
from tussle.mission.spec import Block, Mission
from tussle.mission.tags import BASE, ENTITY, RUN, SEED_ATTRIBUTES, WORLD, TagSpec
from tussle.plugins import stock
from tussle.world.scene import Base, Cuboid, HeightField, Prism, Scene, TriangleMesh

NOWHERE = Place("", 0)
SEED_TAG = re.compile(r"<!--.*?-->|(?P<head><seed(?:\s[^<>]*?)?)(?:/>|>[^<]*</seed\s*>)", re.DOTALL)
"""A comment, or the tag of the seed."""
ROOT_TAG = re.compile(r"<runscript\b[^<>]*>")
HISTORIC = "tussle.plugins.historic."
PUBLIC = {
    "tussle.plugins.stock.": "tussle.stock",
    HISTORIC: "tussle.historic",
    "tussle.world.": "tussle.scene",
}
"""Public modules from which classes of these packages are imported by name."""
COMPONENTS = {
    "position": ("x", "y", "z"),
    "velocity": ("vx", "vy", "vz"),
    "variance": ("variance_x", "variance_y", "variance_z"),
    "half_width": ("half_width_x", "half_width_y", "half_width_z"),
    "box": ("box_x", "box_y", "box_z"),
}
"""Values of a block that are three tags each."""
TAGS = {
    "count": "count",
    "placement": "placement",
    "scatter_first": "use_variance_all_ents",
    "heading": "heading",
    "heading_variance": "variance_heading",
    "roll": "roll",
    "speed": "speed",
    "health": "health",
    "radius": "radius",
    "mass": "mass",
    "rate": "generate_rate",
    "slots": "generate_count",
    "first_birth": "generate_start_time",
    "interval_sd": "generate_time_variance",
    "without_space": "generate_without_space",
}
"""Values of a block that are one tag each."""


def with_seed(text: str, seed: int) -> str:
    """The text of a mission file with this seed in place of its own; where it has none, behind the root tag, unless that is 1."""
    tags = [found for found in SEED_TAG.finditer(text) if found["head"]]
    if tags:
        found = tags[0]
        return f"{text[: found.start()]}{found['head']}>{seed}</seed>{text[found.end() :]}"
    return (
        text if seed == 1 else ROOT_TAG.sub(lambda root: f"{root[0]}\n  <seed>{seed}</seed>", text, count=1)
    )


def to_xml(mission: GivenMission, seed: int | None = None) -> str:
    """Write a mission as a mission file, which plays to the same state hash. Plugins are written by the names of their classes.

    Args:
        mission: The mission, the name of one that ships, or a mission file.
        seed: Written as <seed>; None for that of the file, if it has one.

    Raises:
        MissionError: There is no such mission, or a value of it cannot be written in a mission file.
    """
    mission, own_seed = mission_of(mission, "to_xml")
    seed = own_seed if seed is None else seed
    titles = {"name": mission.name, "compat": mission.compat}
    root = _node("runscript", {name: text for name, text in titles.items() if text})
    run = {
        name: codecs.written(getattr(mission, name)) for name in ("start", "end", "dt", "motion_multiplier")
    }
    if mission.update != RUN["update"].default:
        run["update"] = mission.update
    root.children = [_node("run", run), _node("end_condition", text=", ".join(mission.end_conditions))]
    reseed = {name: getattr(mission, name) for name in SEED_ATTRIBUTES if name != "rekeys"}
    reseed = {name: codecs.written(value) for name, value in reseed.items() if value is not None}
    if mission.rekeys:
        reseed["rekeys"] = rekeys_text(mission.rekeys)
    if seed is not None or reseed:
        root.children.append(_node("seed", reseed, "" if seed is None else str(seed)))
    origin = mission.scene.origin
    for name in () if origin.is_default else ("latitude", "longitude", "altitude"):
        root.children.append(_value(f"{name}_origin", getattr(origin, name), WORLD))
    for plugin in () if mission.compat else (p for outer in mission.plugins for p in outer.walk()):
        if type(plugin).__module__.startswith(HISTORIC):
            raise MissionError(
                f"mission: {plugin.instance_name} has the law of SCRIMMAGE, but the mission does not; give it compat='scrimmage'"
            )
    root.children += _scene(mission.scene)
    plugins = (
        ("network", mission.networks),
        ("entity_interaction", mission.interactions),
        ("metrics", mission.metrics),
    )
    root.children += [_plugin(tag, plugin, "mission") for tag, made in plugins for plugin in made]
    entities = [_entity(block) for block in mission.blocks]
    root.children += entities
    for block, name in zip(mission.blocks, block_names(entities), strict=True):
        if block.name != name:
            raise MissionError(
                f"block {block.name!r}: the name would be read back as {name!r}; call it {name!r}"
            )
    for base in mission.scene.bases:
        _add_base(base, mission.blocks, entities)
    return f'<?xml version="1.0"?>\n{root.to_text()}'


def _scene(scene: Scene) -> Iterator[Node]:
    """Yield tags of ground, walls and surfaces.

    Raises:
        MissionError: A part has no tag.
    """
    if scene.ground is not None:
        yield _node("ground", text=codecs.written(scene.ground.height))
    for wall in scene.walls:
        if isinstance(wall, Cuboid):
            place = {"center": codecs.written(wall.center), "lengths": codecs.written(wall.lengths)}
            yield _node("wall", place | {"rpy": codecs.written(wall.rpy, ("rad",) * 3, ("deg",) * 3)})
        elif isinstance(wall, Prism):
            ends = {"low": codecs.written(wall.low), "high": codecs.written(wall.high)}
            yield _node("building", {"corners": codecs.written(wall.corners), **ends})
        else:
            raise _no_tag(f"wall {wall!r}")
    surfaces: list[HeightField | TriangleMesh] = [*scene.meshes]
    surfaces += [] if scene.terrain is None else [scene.terrain]
    for surface in surfaces:
        if not surface.tag:
            raise _no_tag(repr(surface))
        yield _node("terrain", dict(surface.tag[1:]), surface.tag[0][1])
    if scene.boundaries:
        raise _no_tag("scene.boundaries")


def _no_tag(part: str) -> MissionError:
    return MissionError(f"mission: {part} has no tag in mission files; write the mission as Python instead")


def _node(tag: str, attributes: dict[str, str] | None = None, text: str = "") -> Node:
    return Node(tag, attributes or {}, text, [], NOWHERE)


def _value(tag: str, value: Any, tags: dict[str, TagSpec]) -> Node:
    """Return a tag with a value in SI units. Its unit is written if a bare number has another unit."""
    unit = tags[tag].unit
    return _node(tag, text=codecs.written(value, (unit.replace("deg", "rad"),), (unit,)))


def _entity(block: Block) -> Node:
    node = _node("entity")
    node.children = [
        _node("name", text=block.name),
        _value("team_id", block.team, ENTITY),
    ]  # a file without team is noted
    values: dict[str, Any] = {}
    for name, tags in COMPONENTS.items():
        given = getattr(block, name)
        values |= dict(zip(tags, given, strict=True)) if given is not None else {}
    if block.velocity is not None and not any(block.velocity):
        values["speed"] = 0.0  # in a file, a velocity of 0 means that `speed` is used
    for name, tag in TAGS.items():
        values.setdefault(tag, getattr(block, name))
    values["pitch"] = -block.climb
    if block.rate is None:
        values = {tag: value for tag, value in values.items() if not tag.startswith("generate_")}
    for tag, value in values.items():
        if not _is_default(value, ENTITY[tag].default):
            node.children.append(_value(tag, value, ENTITY))
    kinds: dict[str, Sequence[Plugin]] = {
        "autonomy": block.autonomy, "controller": block.controller, "motion_model": [block.motion], "sensor": block.sensor
    }  # fmt: skip
    node.children += [
        _plugin(tag, plugin, f"block {block.name!r}") for tag, made in kinds.items() for plugin in made
    ]
    return node


def _is_default(value: Any, default: str) -> bool:
    if isinstance(value, (bool, str)):
        return codecs.written(value) == default
    return default != "none" and value == float(default)


def _plugin(tag: str, plugin: Plugin, where: str) -> Node:
    if plugin.rate is not None and tag not in RATED:
        raise MissionError(
            f"{where}: {plugin.instance_name}: mission files have no loop_rate for a {tag}; write the mission as Python instead"
        )
    try:
        return _node(tag, _attributes(plugin), type(plugin).__name__)
    except (MissionError, ParameterError) as error:
        raise MissionError(f"{where}: {plugin.instance_name}: {error}") from error


def _attributes(plugin: Plugin) -> dict[str, str]:
    """Return the attributes of a plugin's tag: name, rate, and the parameters that differ from their defaults."""
    found = {} if plugin.instance_name == type(plugin).__name__ else {"name": plugin.instance_name}
    if plugin.rate is not None:
        found["loop_rate"] = codecs.written(plugin.rate)
    if plugin.active_in:
        found["states"] = ", ".join(plugin.active_in)
    # Parameters whose default differs from SCRIMMAGE's are always written; otherwise the reader adds a note.
    always_written = {name: plugin.values[name] for name in plugin.historic_attributes.differs}
    for name, value in (always_written | dict(plugin.given())).items():
        if name in plugin.children():
            if fields := plugin.children()[name].fields:
                rows = (" ".join(each.values[field] for field in fields) for each in value)
                found[name] = " ".join(f"[ {row} ]" for row in rows)
            else:
                inner = (codecs.inline_text(type(each).__name__, _attributes(each)) for each in value)
                found[name] = " ".join(inner)
            continue
        column = plugin.params()[name]
        text = codecs.written(value, column.units, column.text_units)
        if column.convert(text) != value:
            raise MissionError(f"{name} = {shown(repr(value))} would not be read back unchanged")
        found[name] = text
    return found


def _add_base(base: Base, blocks: Sequence[Block], entities: Sequence[Node]) -> None:
    for block, entity in zip(blocks, entities, strict=True):
        if block.team == base.team:
            values = dict(zip("xyz", base.position, strict=True)) | {
                "radius": base.radius,
                "opacity": base.opacity,
            }
            node = _node("base")
            node.children = [_value(tag, value, BASE) for tag, value in values.items()]
            entity.children.append(node)
            return
    raise MissionError(
        f"mission: the base of team {base.team} cannot be written, as no block is of this team"
    )


def to_python(mission: GivenMission, seed: int | None = None) -> str:
    """Write the Python code that builds a mission and plays it.

    Args:
        mission: The mission, the name of one that ships, or a mission file.
        seed: Seed of the game; None for that of the file, or else 1.

    Raises:
        MissionError: There is no such mission, two classes have the same name, or the mission has a height field or a mesh.
    """
    mission, own_seed = mission_of(mission, "to_python")
    seed = own_seed if seed is None else seed
    imports: dict[str, str] = {"Mission": "tussle", "Simulation": "tussle"}
    made = "\n".join(_code(mission, imports))
    by_module = {
        module: sorted(n for n, m in imports.items() if m == module) for module in sorted({*imports.values()})
    }
    return (
        "\n".join(_import(module, names) for module, names in by_module.items()) + f"\n\nmission = {made}\n\n"
        'if __name__ == "__main__":\n'
        f"    with Simulation(mission, {1 if seed is None else seed}) as simulation:\n"
        "        simulation.run()\n"
        "        for result in simulation.result():\n"
        "            print(result, result.state_hash)\n"
    )


def _import(module: str, names: Sequence[str]) -> str:
    line = f"from {module} import {', '.join(names)}"
    return (
        line
        if len(line) < 100
        else f"from {module} import (\n" + "".join(f"    {name},\n" for name in names) + ")"
    )


def _code(value: Any, imports: dict[str, str]) -> list[str]:
    """Return the lines of code of a value, and add the names that it needs to `imports`, with their modules."""
    if isinstance(value, str):
        return [json.dumps(value, ensure_ascii=False)]
    if isinstance(value, (tuple, list)) and any(map(_is_made, value)):
        return ["[", *(f"    {line}" for each in value for line in _comma(_code(each, imports))), "]"]
    if isinstance(value, dict) and value:
        parts = [(f"{key!r}: ", _comma(_code(each, imports))) for key, each in value.items()]
        return ["{", *(f"    {line}" for key, (first, *rest) in parts for line in (key + first, *rest)), "}"]
    if not _is_made(value):
        if "inf" in re.findall(r"\w+", repr(value)):
            imports["inf"] = "math"
        return [repr(value)]
    if isinstance(value, (HeightField, TriangleMesh)):
        raise MissionError(
            f"mission: {value!r} cannot be written as code; write the mission without it, and "
            "read it with tussle.world.rays.files.read_surface"
        )
    name = type(value).__name__
    module = "tussle" if isinstance(value, (Block, Mission)) else type(value).__module__
    module = next((public for package, public in PUBLIC.items() if module.startswith(package)), module)
    if imports.setdefault(name, module) != module:
        raise MissionError(
            f"two classes are called {name}, in {imports[name]} and {module}; rename one of them"
        )
    lines, is_flat = [], True
    for key, each in _arguments(value):
        first, *rest = _comma(_code(each, imports))
        lines += [f"    {key}={first}", *(f"    {line}" for line in rest)]
        is_flat = is_flat and not rest
    flat = f"{name}({', '.join(line.strip().removesuffix(',') for line in lines)})"
    return [flat] if is_flat and len(flat) < 80 else [f"{name}(", *lines, ")"]


def _is_made(value: Any) -> bool:
    """Return True if a value is made by calling its class."""
    return isinstance(value, Plugin) or dataclasses.is_dataclass(value)


def _comma(lines: list[str]) -> list[str]:
    return [*lines[:-1], f"{lines[-1]},"]


def _arguments(value: Any) -> Iterator[tuple[str, Any]]:
    """Yield the arguments of a plugin or dataclass that differ from their defaults."""
    if isinstance(value, Plugin):
        yield from value.given()
        yield from [("name", value.instance_name)] * (value.instance_name != type(value).__name__)
        yield from [("rate", value.rate)] * (value.rate is not None)
        yield from [("states", ", ".join(value.active_in))] * bool(value.active_in)
        return
    for field in dataclasses.fields(value):
        given = getattr(value, field.name)
        default = field.default if field.default_factory is dataclasses.MISSING else field.default_factory()
        if field.name == "networks":  # the networks that every mission adds come first
            added = tuple(stock.load(name)() for name in stock.ALWAYS_THERE)
            given = given[len(added) :] if given[: len(added)] == added else given
        is_one = isinstance(given, tuple) and len(given) == 1 and isinstance(given[0], Plugin)
        if given != default and field.repr:
            yield field.name, given[0] if is_one else given
