"""Mission files: `read_mission(file)` gives the mission as data, and all that is wrong with the file at once."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from tussle.errors import MissionError, TussleError
from tussle.geodesy import Origin
from tussle.mission import codecs
from tussle.mission.catalogue import KINDS, Catalogue
from tussle.mission.entities import EntityReader, Fields, block_names, expanded
from tussle.mission.limits import Limits
from tussle.mission.node import Budget, Node
from tussle.mission.overrides import Overrides, as_texts
from tussle.mission.plugin_files import PluginFile
from tussle.mission.plugin_tags import PluginReader
from tussle.mission.problems import Place, Problems
from tussle.mission.source import Reader, Source, find_mission
from tussle.mission.spec import MISSION_VALUES, Mission, end_conditions
from tussle.mission.tags import RUN, SEED_ATTRIBUTES, WORLD, Known
from tussle.scene import Scene
from tussle.texts import shown, truth

SEED = re.compile(r"\d{1,20}", re.ASCII)
PLUGIN_TAGS = {"entity_interaction": "interactions", "metrics": "metrics", "network": "networks"}


@dataclass(frozen=True)
class Loaded:
    """A mission file as it was read.

    Attributes:
        mission: What is played.
        seed: The file's seed; None without one.
        name: The mission's title, else the file's name.
        path: The file.
        text: The mission as one XML text: placeholders and settings replaced, includes in place. Reading it gives the same mission.
        notes: What the reader should know, one line each: what is unknown or ignored, and where tussle does something else.
        viewer: Settings kept for the viewer: attributes of <run> and tags by name, "entities" by block, "plugins" by "plugin@attribute".
        log: Settings about output, by tag.
        placeholders: Names that can be set, with their defaults.
        places: Block name -> "file:line", for messages about it.
        files: All files that were read: the mission's and those it includes.
        settings: What was set, as texts that the file takes.
    """

    mission: Mission
    seed: int | None
    name: str
    path: Path
    text: str
    notes: tuple[str, ...] = ()
    viewer: dict[str, Any] = field(default_factory=dict)
    log: dict[str, Any] = field(default_factory=dict)
    placeholders: dict[str, str] = field(default_factory=dict)
    places: dict[str, str] = field(default_factory=dict)
    files: tuple[Path, ...] = ()
    settings: dict[str, str] = field(default_factory=dict)


def read_mission(
    source: str | Path,
    overrides: Mapping[str, Any] | None = None,
    *,
    strict: bool = False,
    plugin_files: Sequence[str | Path | PluginFile] = (),
    search: Sequence[str | Path] = (),
    allow_large: bool = False,
) -> Loaded:
    """Read a mission.

    Args:
        source: A file, or the name of a mission that ships, such as "predator_prey".
        overrides: Values of the file's `${name=default}`, and of anything in it by path: "run.dt", "prey.count",
            "prey.Boids.max_speed", "SimpleCapture.capture_range", "prey.motion_model" ("Unicycle vel_max='30'"). By path a number
            is SI and a text is as in the file; the value of a placeholder is put into the file as it is.
        strict: Tags and attributes that mean nothing are errors instead of notes.
        plugin_files: Python files whose plugins the mission may name.
        search: Folders in which missions and included files are looked for, besides the mission's own.
        allow_large: Lift the limits that keep a hostile file from taking all memory, while it is read and while it is played.

    Raises:
        MissionError: It cannot be read or played. One line for each thing that is wrong, beginning with file and line.
    """
    budget = Budget(Limits.large() if allow_large else Limits())
    given = {str(name): value for name, value in (overrides or {}).items()}
    settings = as_texts(given)
    catalogue = Catalogue(plugin_files)
    problems = Problems(strict=strict)
    path = find_mission(source, search)
    read = Reader(settings, problems, budget, search).read(path)
    if read.root.tag != "runscript":
        raise MissionError(
            f"{read.root.place}: the outermost tag is <{read.root.tag[:80]}>; a mission's is <runscript>"
        )
    expanded(read.root, problems, budget)
    tree = Overrides(read.root, catalogue, read.placeholders)
    paths = {name: tree.set(name, value) for name, value in given.items() if name not in read.placeholders}
    if paths:
        read.text = read.root.to_text()
    return replace(_WorldReader(read, catalogue, problems, budget).loaded(), settings=settings | paths)


class _WorldReader:
    """Reads the tags of <runscript>."""

    def __init__(self, source: Source, catalogue: Catalogue, problems: Problems, budget: Budget) -> None:
        self.source = source
        self.catalogue = catalogue
        self.problems = problems
        self.budget, self.limits = budget, budget.limits
        self.root = source.root
        self.viewer: dict[str, Any] = {}
        self.log: dict[str, Any] = {}
        self.kept: list[str] = []

    def loaded(self) -> Loaded:
        root, problems = self.root, self.problems
        for attribute in root.attributes:
            if attribute != "name" and "}" not in attribute:
                problems.unknown(root.where(attribute), "attribute of <runscript>", attribute, ["name"])
        if root.text:
            problems.note(root.place, f"text between the tags of <runscript> is ignored: {shown(root.text)}")
        if not any(True for _ in root.find_all("entity")):
            problems.error(root.place, "the mission has no <entity>")
        times = self._run()
        origin = self._origin()
        plugins = PluginReader(self.catalogue, problems, self.budget, self._shared(), origin.from_geodetic)
        world = self._world_plugins(plugins)
        entities = EntityReader(plugins, problems, origin, self.limits, times["update"])
        nodes = list(root.find_all("entity"))
        self._count_tags(nodes)
        blocks = [entities.block(node, name) for node, name in zip(nodes, block_names(nodes), strict=True)]
        conditions, seed = self._end_conditions(), self._seed()
        self._settings()
        if entities.drawn:
            self.viewer["entities"] = entities.drawn
        if plugins.drawn:
            self.viewer["plugins"] = plugins.drawn
        self._say_what_is_kept(plugins.drawn)
        problems.check()
        name = root.attributes.get("name", "").strip()
        settings: dict[str, Any] = {**times, **world}
        try:
            mission = Mission(
                blocks=[block for block in blocks if block is not None],
                end_conditions=conditions,
                scene=Scene(origin=origin, bases=tuple(entities.bases)),
                name=name,
                limits=self.limits,
                **settings,
            )
        except TussleError as error:
            raise MissionError(f"{root.place}: {error}") from error
        places = {block: str(place) for block, place in entities.places.items()}
        return Loaded(
            mission, seed, name or self.source.path.stem, self.source.path, self.source.text, problems.notes, self.viewer, self.log,
            self.source.placeholders, places, tuple(self.source.files),
        )  # fmt: skip

    def _count_tags(self, entities: list[Node]) -> None:
        """Refuse what would take a while only to be compared.

        Raises:
            MissionError: There are too many blocks, or plugins in one place.
        """
        hint = "for a file you trust there is allow_large"
        if len(entities) > self.limits.blocks:
            raise MissionError(
                f"{entities[-1].place}: there are more than {self.limits.blocks:,} <entity>; {hint}"
            )
        for node in (self.root, *entities):
            if sum(child.tag in KINDS for child in node.children) > self.limits.plugins:
                raise MissionError(
                    f"{node.place}: there are more than {self.limits.plugins:,} plugins in <{node.tag}>; {hint}"
                )

    def _last(self, tag: str) -> Node | None:
        """The last tag of a name, which counts."""
        return next((child for child in reversed(self.root.children) if child.tag == tag), None)

    def _run(self) -> dict[str, Any]:
        """Times and steps, checked against each other; the viewer's settings are put aside."""
        node = self._last("run") or Node("run", {}, "", [], self.root.place)
        for attribute in node.attributes:
            if attribute not in RUN:
                self.problems.unknown(node.where(attribute), "attribute of <run>", attribute, RUN)
        # The attributes are read as if they were tags, so that one reader serves both.
        children = [Node(k, {}, v, [], node.where(k)) for k, v in node.attributes.items() if k in RUN]
        fields = Fields(Node("run", {}, "", children, node.place), RUN, self.problems)
        for name, known in RUN.items():
            if known.kept_for and fields.has(name):
                self._keep(self.viewer, name, fields.found[name], known, f"run@{name}")
        # Where one is wrong that has been told, and its default stands in for it.
        dt, start, end = fields.number("dt"), fields.number("start"), fields.number("end")
        most = self.limits.substeps
        substeps = fields.read("motion_multiplier", lambda text: codecs.whole(text, 1, most))
        if not abs((end - start) / dt) <= self.limits.steps:
            text = (
                f"from {start:g} to {end:g} s in steps of {dt:g} s are more than {self.limits.steps:,} steps"
            )
            self.problems.error(fields.place("end"), text)
        elif abs((n := max(0.0, (end - start) / dt)) - round(n)) > 0.01:
            last = start + math.ceil(n - 0.5) * dt
            self.problems.note(
                fields.place("end"),
                f"end {end:g} s is not a whole number of steps of {dt:g} s; the last ends at {last:g} s",
            )
        update = fields.read("update", lambda text: MISSION_VALUES["update"].convert(text, "update"))
        return {"dt": dt, "start": start, "end": end, "motion_multiplier": substeps, "update": update}

    def _origin(self) -> Origin:
        names = ("latitude_origin", "longitude_origin", "altitude_origin")
        nodes = [node for name in names if (node := self._last(name))]
        fields = Fields(Node("runscript", {}, "", nodes, self.root.place), WORLD, self.problems)
        return Origin(*fields.angles(names[0], names[1]), fields.number(names[2]))

    def _shared(self) -> dict[str, dict[str, str]]:
        """<param_common> name -> attributes."""
        shared: dict[str, dict[str, str]] = {}
        for node in self.root.find_all("param_common"):
            name = node.attributes.get("name", "")
            if not name:
                self.problems.error(node.place, "param_common has no name, by which plugins take it")
            shared[name] = {child.tag: child.text for child in node.children}
        return shared

    def _world_plugins(self, plugins: PluginReader) -> dict[str, list[Any]]:
        taken: set[str] = set()
        return {name: plugins.many(self.root.find_all(tag), taken) for tag, name in PLUGIN_TAGS.items()}

    def _end_conditions(self) -> tuple[str, ...]:
        node = self._last("end_condition")
        if node is None:
            return ("time",)
        try:
            found = end_conditions(node.text, "end_condition")
        except MissionError as error:
            self.problems.error(node.place, str(error))
            return ("time",)
        if not found:
            self.problems.note(node.place, "<end_condition> is empty; the mission ends by time")
        return found or ("time",)

    def _seed(self) -> int | None:
        node = self._last("seed")
        if node is None or not node.text:
            return None
        for attribute in node.attributes:
            if attribute in SEED_ATTRIBUTES:
                self.problems.note(
                    node.where(attribute), f"seed@{attribute} is ignored: one seed holds for a whole run"
                )
            else:
                self.problems.unknown(
                    node.where(attribute), "attribute of <seed>", attribute, SEED_ATTRIBUTES
                )
        if SEED.fullmatch(node.text) is None or int(node.text) >= 2**64:
            text = f"seed {shown(node.text)} is not allowed; it takes a whole number from 0 to 2^64 - 1"
            self.problems.error(node.place, text)
            return None
        return int(node.text)

    def _settings(self) -> None:
        """Put aside what is for the viewer and the log, and name what is unknown."""
        for node in self.root.children:
            known = WORLD.get(node.tag)
            if known is None:
                self.problems.unknown(node.place, "tag", node.tag, WORLD)
            elif known.kept_for:
                self._keep(
                    self.viewer if known.kept_for == "viewer" else self.log, node.tag, node, known, node.tag
                )
            elif node.tag not in ("run", "seed", "entity", "param_common", *PLUGIN_TAGS):
                for attribute in node.attributes:
                    self.problems.unknown(node.where(attribute), f"attribute of <{node.tag}>", attribute, ())

    def _keep(self, into: dict[str, Any], name: str, node: Node, known: Known, label: str) -> None:
        """A setting that no game depends on; attributes of its own make it a dict, its text under "value"."""
        try:
            value: Any = node.text
            if known.reads == "truth":
                value = truth(node.text)
            elif known.reads == "number":
                value = codecs.number(node.text)
        except TussleError as error:
            self.problems.error(node.place, f"{name}: {error}")
            return
        into[name] = {"value": value, **node.attributes} if node.attributes else value
        if known.kept_for == "viewer":
            self.kept.append(label)

    def _say_what_is_kept(self, drawn: Mapping[str, str]) -> None:
        names = sorted(
            {
                *self.kept,
                *(f"entity {key}" for e in self.viewer.get("entities", {}).values() for key in e),
                *drawn,
            }
        )
        if names:
            self.problems.note(
                Place(self.root.place.file, self.root.place.line), f"kept for the viewer: {', '.join(names)}"
            )
