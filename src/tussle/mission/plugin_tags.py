"""Reading of plugin tags, and of behaviors in a parameter, into plugins."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tussle.api.plugin import Plugin
from tussle.declare.columns import Param
from tussle.declare.texts import shown
from tussle.errors import MissionError, TussleError, listed
from tussle.mission import codecs
from tussle.mission.catalogue import KINDS, AbsentPluginError, Catalogue, historic
from tussle.mission.node import Budget, Node
from tussle.mission.problems import Place, Problems
from tussle.mission.spec import teams_named
from tussle.mission.tags import PLUGIN

MAX_NESTED = 4
"""Maximum nesting of behaviors."""
LOOP_RATE = Param(0.0, unit="1/s", ge=0.0, lt=math.inf)
RATED = ("autonomy", "controller", "sensor", "behaviors")


def free_name(wanted: str, taken: set[str]) -> str:
    """Return the wanted name, with a number appended if it is taken, and add it to `taken`."""
    name, n = wanted, 2
    while name in taken:
        name, n = f"{wanted}_{n}", n + 1
    taken.add(name)
    return name


@dataclass
class PluginTag:
    """A plugin as written in the file.

    Attributes:
        tag: Tag, which gives the kind: a key of KINDS.
        plugin: Name of the plugin class.
        attributes: Attributes as written.
        where: Returns the place of an attribute; of the tag for "".
        common: Attributes that it takes from a <param_common>: name -> tag there.
        node: The tag itself; None for a plugin in a parameter.
    """

    tag: str
    plugin: str
    attributes: dict[str, str]
    where: Callable[[str], Place]
    common: dict[str, Node] = field(default_factory=dict)
    node: Node | None = None

    @classmethod
    def of(cls, node: Node) -> PluginTag:
        return cls(node.tag, node.text, dict(node.attributes), node.where, node=node)


@dataclass
class PluginReader:
    """Makes plugins from tags.

    Attributes:
        catalogue: Finds the classes.
        problems: Receives errors and notes.
        budget: Limits that it shares with the mission's files.
        find: Returns a file of data by its name.
        shared: <param_common> name -> its tags, by name.
        from_geodetic: Converts latitude, longitude [rad], altitude [m], (3,), to a world position [m].
        viewer: Receives attributes for the viewer: "plugin@attribute" -> text.
        unread: Tags of <param_common> that a plugin does not read: place and name -> the arguments of `Problems.unknown`.
        read: Place and name of those that a plugin reads.
        shared_taken: Names of the <param_common> that a plugin takes.
        teams: Teams that tags name: place, parameter, number.
        has_found: Whether attributes were added to tags, since they name files that were found.
        plays: Whether other plugins may stand in for those of the tags, since the mission is to be played.
    """

    catalogue: Catalogue
    problems: Problems
    budget: Budget
    find: Callable[[str], Path]
    shared: Mapping[str, Mapping[str, Node]] = field(default_factory=dict)
    from_geodetic: Callable[..., Any] | None = None
    viewer: dict[str, str] = field(default_factory=dict)
    unread: dict[tuple[Place, str], tuple[Place, str, str, list[str]]] = field(default_factory=dict)
    read: set[tuple[Place, str]] = field(default_factory=set)
    shared_taken: set[str] = field(default_factory=set)
    has_found: bool = False
    teams: list[tuple[Place, str, Any]] = field(default_factory=list)
    plays: bool = True

    def many(self, nodes: Iterable[Node], taken: set[str] | None = None) -> list[Any]:
        """Make the plugins of several tags; tags with errors are left out.

        Args:
            nodes: The tags.
            taken: Instance names in use; the new ones are added.
        """
        made = (self.make(PluginTag.of(node), set() if taken is None else taken) for node in nodes)
        return [plugin for plugin in made if plugin is not None]

    def make(self, written: PluginTag, taken: set[str], depth: int = 0) -> Plugin | None:
        """Make the plugin of a tag. Returns None if it has errors, which are added to `problems`."""
        cls = self._class_of(written)
        if cls is None:
            return None
        self._add_shared(written)
        is_found = self._find_files(written, cls)
        name, rate = self._name(written, taken), self._rate(written)
        values: dict[str, Any] = {}
        known, is_right, rest = cls.historic_attributes, True, dict[str, str]()
        self._join(written, cls)
        for attribute, text in written.attributes.items():
            if attribute in (*PLUGIN, known.chosen_by):
                continue
            parameter = known.renamed.get(attribute, attribute)
            if parameter in cls.params() or parameter in cls.children():
                try:
                    values[parameter] = self._value(cls, parameter, text, written, depth)
                except TussleError as error:
                    self._report(written.where(attribute), cls, parameter, error, text)
                    is_right = False
            elif known.rest and attribute not in known.unread:
                rest[attribute] = text
            else:
                self._not_a_parameter(written, cls, attribute)
        self.read.update((node.place, key) for key, node in written.common.items())
        if rest:
            values[known.rest] = json.dumps(rest)
        for attribute, text in known.differs.items():
            if attribute not in values:
                self.problems.note(written.where(""), text)
        if not (is_right and is_found):
            return None
        try:
            plugin = cls(name=name, rate=rate, states=written.attributes.get("states"), **values)
        except TussleError as error:
            self.problems.error(written.where(""), str(error))
            return None
        for each, team in teams_named(plugin).items():
            self.teams.append((written.where(each), f"{written.plugin}.{each}", team))
        return plugin

    def faster(self, plugin: Plugin | None, written: PluginTag, is_moving: bool) -> Plugin | None:
        """Return the plugin that stands in for that of a tag, if there is one; it has its name. `is_moving` as of `Plugin.stand_in`."""
        if plugin is None or not self.plays:
            return plugin
        name, values, note = plugin.stand_in(is_moving)
        if note:
            self.problems.note(written.where(""), f"{written.plugin} {note}")
        if not name:
            return plugin
        states = written.attributes.get("states")
        return self.catalogue.load(name)(name=plugin.instance_name, rate=plugin.rate, states=states, **values)

    def _class_of(self, written: PluginTag) -> type[Plugin] | None:
        place, tag = written.where(""), "behavior" if written.tag == "behaviors" else written.tag
        if not written.plugin:
            self.problems.error(place, f"<{tag}> is empty; it takes the name of a plugin")
            return None
        try:
            cls = self.catalogue.load(written.plugin)
        except AbsentPluginError as error:
            self.problems.error(place, f"{tag} {error}")
            return None
        except MissionError as error:
            self.problems.error(place, f"{tag}: {error}")
            return None
        known = cls.historic_attributes
        chosen = written.attributes.get(known.chosen_by, known.chosen_default or None)
        if chosen is not None:
            try:
                cls = self.catalogue.adapter(cls, chosen)
            except MissionError as error:
                self.problems.error(written.where(known.chosen_by), str(error))
                return None
        elif hides := self.catalogue.hides(written.plugin):
            self.problems.note(place, hides)
        if not issubclass(cls, KINDS[written.tag]):
            right_tag = next(
                (t for t, kind in KINDS.items() if issubclass(cls, kind) and t != "behaviors"), "no tag"
            )
            self.problems.error(place, f"{written.plugin} is not allowed in {tag}; it belongs in {right_tag}")
            return None
        return cls

    def _add_shared(self, written: PluginTag) -> None:
        name = written.attributes.get("param_common")
        if name is None:
            return
        if name not in self.shared:
            self.problems.absent(written.where("param_common"), "param_common", name, self.shared)
            return
        place, shared = written.where("param_common"), self.shared[name]
        self.shared_taken.add(name)
        self.budget.spend_nodes(len(shared), place)
        self.budget.spend_text(sum(len(node.text) for node in shared.values()), str(place))
        written.common = {key: node for key, node in shared.items() if key not in written.attributes}
        written.attributes |= {key: node.text for key, node in written.common.items()}

    def _find_files(self, written: PluginTag, cls: type[Plugin]) -> bool:
        """Add the attributes that say where the files are that the tag names. Returns whether all are there."""
        try:
            found = cls.with_files(written.attributes, self.find)
        except TussleError as error:
            self.problems.error(written.where(""), f"{written.plugin}: {error}")
            return False
        written.attributes |= found
        if found and written.node is not None:
            written.node.attributes |= found
            self.has_found = True
        return True

    def report_teams(self, known: Iterable[int]) -> None:
        """Report the teams that tags name and no block has."""
        for place, parameter, team in self.teams:
            if team not in known:
                text = f"{parameter} = {team}: no <entity> has this team; {listed(map(str, sorted(known)))}"
                self.problems.note(place, text)

    def report_unread(self) -> None:
        """Report the tags of <param_common> that no plugin reads. A plugin may take some that only others read."""
        for where, unknown in self.unread.items():
            if where not in self.read:
                self.problems.unknown(*unknown, lists=True)

    def _name(self, written: PluginTag, taken: set[str]) -> str:
        wanted = written.attributes.get("name", written.plugin).strip()
        if not wanted or "." in wanted:
            text = f"name {shown(wanted)} is not allowed: a name is not empty and has no dot, since paths such as prey.Boids.gain use dots"
            self.problems.error(written.where("name"), text)
            wanted = written.plugin
        name = free_name(wanted, taken)
        if name != wanted:
            self.problems.note(
                written.where("name"),
                f"a second {wanted} is called {name}; give it another name with name='...'",
            )
        return name

    def _rate(self, written: PluginTag) -> float | None:
        text = written.attributes.get("loop_rate")
        if text is None:
            return None
        place = written.where("loop_rate")
        if written.tag not in RATED:
            self.problems.note(place, f"loop_rate of a {written.tag} is ignored; it runs in every step")
            return None
        try:
            return LOOP_RATE.convert(text, "loop_rate") or None
        except TussleError as error:
            self.problems.error(place, str(error))
            return None

    def _join(self, written: PluginTag, cls: type[Plugin]) -> None:
        """Combine attributes that are components of one parameter."""
        for parameter, parts in cls.historic_attributes.joined.items():
            if any(part in written.attributes for part in parts):
                column = cls.params()[parameter]
                components = zip(parts, column.default, strict=True)
                text = ", ".join(written.attributes.pop(part, repr(default)) for part, default in components)
                written.attributes.setdefault(parameter, text)

    def _value(self, cls: type[Plugin], parameter: str, text: str, written: PluginTag, depth: int) -> Any:
        if parameter not in cls.children():
            if parameter in cls.historic_attributes.least_zero and text.strip().startswith("-"):
                text = "0"
            return cls.params()[parameter].convert(text, from_geodetic=self.from_geodetic)
        if depth >= MAX_NESTED:
            raise MissionError(f"plugins are nested more than {MAX_NESTED} deep")
        place = written.where(parameter)
        taken: set[str] = set()
        column = cls.children()[parameter]
        if column.fields:
            rows = codecs.word_rows(text, column.fields)
            names = [free_name(column.kind.__name__, taken) for _ in rows]
            return [column.kind(name=name, **row) for name, row in zip(names, rows, strict=True)]
        tag = next((tag for tag, known in KINDS.items() if known is column.kind), "behaviors")
        made = [
            self.make(PluginTag(tag, name, attributes, lambda _: place), taken, depth + 1)
            for name, attributes in self._inline(text, place)
        ]
        return [plugin for plugin in made if plugin is not None]

    def _inline(self, text: str, place: Place) -> list[codecs.InlinePlugin]:
        """Parse the plugins in a parameter, also with quotes that do not match."""
        try:
            return codecs.inline_plugins(text)
        except MissionError as error:
            try:
                found = codecs.inline_plugins_by_blanks(text)
                repaired = " ".join(codecs.inline_text(*plugin) for plugin in found)
            except TussleError:
                raise error from None
            self.problems.note_repair(place, str(error), repaired)
            return found

    def _not_a_parameter(self, written: PluginTag, cls: type[Plugin], attribute: str) -> None:
        viewer, place, known = historic()["viewer"], written.where(attribute), cls.historic_attributes
        if attribute.startswith(tuple(viewer["prefixes"])) or attribute in viewer["names"]:
            self.viewer[f"{written.plugin}@{attribute}"] = written.attributes[attribute]
        elif attribute in known.unread or attribute in historic()["unread"]["names"]:
            self.problems.note(
                place, f"{attribute} of {written.plugin} has no effect in tussle; it is ignored"
            )
        else:
            allowed = [*cls.params(), *cls.children(), *known.renamed, *PLUGIN]
            what = f"attribute of {cls.__name__}"
            if attribute in written.common:
                place = written.common.pop(attribute).place
                self.unread[place, attribute] = place, what, attribute, allowed
            else:
                self.problems.unknown(place, what, attribute, allowed, lists=True)

    def _report(
        self, place: Place, cls: type[Plugin], parameter: str, error: TussleError, written: str
    ) -> None:
        name = f"{cls.__name__}.{parameter}"
        text = str(error)
        limit = cls.params().get(parameter)
        if (
            limit is not None
            and limit.ge == 0.0
            and parameter.endswith("_max")
            and written.strip().startswith("-")
        ):
            text += f'; write {parameter}="{written.strip()[1:]}"'
        self.problems.error(place, text if text.startswith(name) else f"{name}: {text}")
