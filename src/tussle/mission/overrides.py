"""Settings from outside by path: `run.dt=0.05`, `prey.count=50`, `prey.Boids.max_speed=20`, `prey.motion_model=SingleIntegrator`."""

from __future__ import annotations

from collections.abc import Mapping

from tussle.errors import MissionError, listed, nearest_name
from tussle.mission import codecs
from tussle.mission.entities import block_names
from tussle.mission.node import Node
from tussle.mission.problems import Place
from tussle.mission.tags import ENTITY, RUN

WORLD_PLUGINS = ("entity_interaction", "metrics", "network")
ENTITY_PLUGINS = ("autonomy", "controller", "motion_model", "sensor")
PLACE = Place("the settings", 0)


def split_overrides(
    overrides: Mapping[str, str], placeholders: Mapping[str, str]
) -> tuple[dict[str, str], dict[str, str]]:
    """Overrides of placeholders, and those by path.

    Raises:
        MissionError: A name is neither.
    """
    named, paths = {}, {}
    for name, value in overrides.items():
        if name in placeholders:
            named[name] = value
        elif "." in name:
            paths[name] = value
        else:
            raise MissionError(
                f"the mission has no setting {name[:80]!r}{nearest_name(name[:80], placeholders)}; {listed(sorted(placeholders))}; "
                f"also by path: run.dt, BLOCK.TAG, BLOCK.PLUGIN.ATTRIBUTE, PLUGIN.ATTRIBUTE"
            )
    return named, paths


def apply_path(root: Node, path: str, value: str) -> None:
    """Set one value in the tree.

    Raises:
        MissionError: The path leads nowhere.
    """
    first, *rest = path.split(".")
    try:
        if first == "run" and len(rest) == 1:
            _set_run(root, rest[0], value)
            return
        entities = list(root.find_all("entity"))
        blocks = dict(zip(block_names(entities), entities, strict=True))
        if first in blocks and rest:
            _set_in_block(blocks[first], rest, value)
            return
        world = {
            node.attributes.get("name", node.text): node
            for node in root.children
            if node.tag in WORLD_PLUGINS
        }
        if first in world and len(rest) == 1:
            _set_attribute(world[first], rest[0], value)
            return
        known = ["run", *blocks, *world]
        raise MissionError(f"there is no {first[:80]!r}{nearest_name(first[:80], known)}; {listed(known)}")
    except MissionError as error:
        raise MissionError(f"setting {path[:200]}={value[:80]}: {error}") from None


def _set_run(root: Node, attribute: str, value: str) -> None:
    if attribute not in RUN:
        raise MissionError(f"run has no {attribute[:80]!r}{nearest_name(attribute[:80], RUN)}; {listed(RUN)}")
    runs = list(root.find_all("run"))
    if not runs:
        runs = [Node("run", {}, "", [], root.place)]
        root.children.insert(0, runs[0])
    _set_attribute(runs[-1], attribute, value)


def _set_attribute(node: Node, name: str, value: str) -> None:
    node.attributes[name] = value
    # Not of the file: what is wrong with it is an error even where the file's own would be a note.
    node.lines[name] = 0


def _set_in_block(block: Node, rest: list[str], value: str) -> None:
    if len(rest) == 1:
        _set_tag(block, rest[0], value)
        return
    name, attribute = rest[0], ".".join(rest[1:])
    plugins = {n.attributes.get("name", n.text): n for n in block.children if n.tag in ENTITY_PLUGINS}
    if name not in plugins or len(rest) > 2:
        raise MissionError(
            f"the block has no plugin {name[:80]!r}{nearest_name(name[:80], plugins)}; {listed(plugins)}"
        )
    _set_attribute(plugins[name], attribute, value)


def _set_tag(block: Node, tag: str, value: str) -> None:
    """Put one tag in the place of all of its name; a plugin may bring attributes: "Unicycle vel_max='30'"."""
    if tag not in ENTITY or tag == "base":
        raise MissionError(
            f"an entity has no tag {tag[:80]!r}{nearest_name(tag[:80], ENTITY)}; {listed(ENTITY)}"
        )
    block.children = [child for child in block.children if child.tag != tag]
    if tag in ENTITY_PLUGINS:
        if value.strip():
            told = codecs.told(value)
            block.children.append(
                Node(tag, told.attributes, told.name, [], block.place, dict.fromkeys(told.attributes, 0))
            )
    else:
        block.children.append(Node(tag, {}, value.strip(), [], block.place))
