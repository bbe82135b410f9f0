"""Settings from outside a mission file: values of placeholders, and of tags and attributes by path (`tussle.mission.paths`)."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from typing import Any

from tussle.api.plugin import Plugin
from tussle.declare.texts import shown
from tussle.errors import MissionError, ParameterError, TussleError, clipped, listed, nearest_name
from tussle.mission import codecs
from tussle.mission.catalogue import Catalogue
from tussle.mission.entities import block_names
from tussle.mission.node import Node
from tussle.mission.paths import resolve
from tussle.mission.plugin_tags import free_name
from tussle.mission.spec import RUN
from tussle.mission.tags import ENTITY, PLUGIN
from tussle.mission.tags import RUN as RUN_ATTRIBUTES

WORLD_PLUGINS = ("entity_interaction", "metrics", "network")
ENTITY_PLUGINS = ("autonomy", "controller", "sensor", "motion_model")


def as_texts(settings: Mapping[str, Any]) -> dict[str, str]:
    """Convert settings to the texts that replace placeholders. A number is inserted bare, in the unit of its place in the file.

    Raises:
        MissionError: A value cannot be written.
    """
    found = {}
    for name, value in settings.items():
        try:
            found[str(name)] = codecs.written(value)
        except ParameterError as error:
            raise MissionError(f"setting {name}: {error}") from None
    return found


class TreeEditor:
    """Sets values in a mission's tree.

    Args:
        root: The tree; it is changed.
        catalogue: Finds the plugin classes, whose declarations give the units.
        known: Names of the placeholders, which are already replaced.
    """

    def __init__(self, root: Node, catalogue: Catalogue, known: Iterable[str]) -> None:
        self.root, self.catalogue, self.known = root, catalogue, sorted(known)

    def set(self, path: str, value: Any) -> str:
        """Set one value: a number is SI, a text is read as in the file.

        Returns:
            The value as written in the file.

        Raises:
            MissionError: The path does not exist, or the value cannot be written.
        """
        if "." not in path:
            raise MissionError(
                f"the mission has no setting {clipped(path)!r}{nearest_name(path, self.known)}; {listed(self.known)}; "
                f"allowed are also paths: run.dt, BLOCK.TAG, BLOCK.PLUGIN.ATTRIBUTE, PLUGIN.ATTRIBUTE"
            )
        try:
            owners, name = resolve(path, self.root, self._inside, self._values)
            owner = owners[-1]
            text = codecs.written(value, *self._units(owner, name))
            if owner.tag == "run" and owner not in self.root.children:
                self.root.children.insert(0, owner)
            if owner.tag == "entity":
                _set_tag(owner, name, text)
            else:
                owner.attributes[name] = text
                # Line 0 marks a value set from outside: a problem with it is an error, where it could be a note in the file.
                owner.lines[name] = 0
            for outer in reversed(owners[1:-1]):
                _write_inner(outer)
        except TussleError as error:
            reason = str(error).removeprefix(f"{shown(path)}: ")
            raise MissionError(f"setting {clipped(path, 200)}={clipped(str(value))}: {reason}") from None
        return text

    def _inside(self, node: Node) -> dict[str, Node]:
        """Return the members of a node: run, blocks and world plugins of the root; plugins of a block; plugins inside a plugin."""
        if node is self.root:
            entities = list(node.find_all("entity"))
            blocks = dict(zip(block_names(entities), entities, strict=True))
            runs = [Node(RUN, {}, "", [], node.place), *node.find_all(RUN)]
            return {RUN: runs[-1], **blocks, **_named(node, WORLD_PLUGINS)}
        if node.tag == "entity":
            return _named(node, ENTITY_PLUGINS)
        if node.tag == "run":
            return {}
        cls = self.catalogue.load(node.text)
        renamed = cls.historic_attributes.renamed
        inner = [key for key in node.attributes if renamed.get(key, key) in cls.children()]
        node.children = [
            Node(key, plugin.attributes, plugin.name, [], node.place)
            for key in inner
            if not cls.children()[renamed.get(key, key)].fields
            for plugin in codecs.inline_plugins(node.attributes[key])
        ]
        return _named(node, inner)

    def _values(self, node: Node) -> Collection[str] | None:
        """Return the names of a node's values; None for a plugin, whose attributes are checked when it is read."""
        if node is self.root:
            return ()
        tags = {
            "run": RUN_ATTRIBUTES,
            "entity": {tag: known for tag, known in ENTITY.items() if tag != "base"},
        }
        return tags.get(node.tag)

    def _units(self, node: Node, name: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Return the SI unit, and the unit of a bare number, of each component of a value."""
        known = (PLUGIN | {"run": RUN_ATTRIBUTES, "entity": ENTITY}.get(node.tag, {})).get(name)
        if known is None:
            return _units_of(self.catalogue.load(node.text), name)
        return (known.unit.replace("deg", "rad"),), (known.unit,)


def _units_of(cls: type[Plugin], attribute: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    known, params = cls.historic_attributes, cls.params()
    for parameter, parts in known.joined.items():
        if attribute in parts:
            i, column = parts.index(attribute), params[parameter]
            return (column.units[i],), (column.text_units[i],)
    found = params.get(known.renamed.get(attribute, attribute))
    return (found.units, found.text_units) if found is not None else (("",), ("",))


def _named(node: Node, tags: Iterable[str]) -> dict[str, Node]:
    """Plugins in a tag by instance name."""
    taken: set[str] = set()
    plugins = [child for tag in tags for child in node.find_all(tag)]
    return {free_name(n.attributes.get("name", n.text).strip(), taken): n for n in plugins}


def _write_inner(node: Node) -> None:
    """Write the plugins inside a plugin back into its attributes."""
    for key in dict.fromkeys(child.tag for child in node.children):
        inner = (codecs.inline_text(n.text, n.attributes) for n in node.find_all(key))
        node.attributes[key], node.lines[key] = " ".join(inner), 0
    node.children = []


def _set_tag(block: Node, tag: str, value: str) -> None:
    """Replace all tags of a name by one; a plugin may have attributes: "Unicycle vel_max='30'"."""
    block.children = [child for child in block.children if child.tag != tag]
    if tag not in ENTITY_PLUGINS:
        block.children.append(Node(tag, {}, value.strip(), [], block.place))
    elif value.strip():
        plugin = codecs.inline_plugin(value)
        lines = dict.fromkeys(plugin.attributes, 0)
        block.children.append(Node(tag, plugin.attributes, plugin.name, [], block.place, lines))
