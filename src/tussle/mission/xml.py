"""Mission files: `read_mission(file)` returns the mission as data, or raises all errors of the file at once."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from tussle.declare.texts import shown, truth
from tussle.documents import several
from tussle.errors import MissionError, ParameterError, TussleError, clipped
from tussle.mission import codecs
from tussle.mission.catalogue import KINDS, Catalogue
from tussle.mission.data_files import DataFiles, data_folders
from tussle.mission.effects import check_effects
from tussle.mission.entities import EntityReader, Fields, block_names, expand_entity_common
from tussle.mission.laws import check_compat
from tussle.mission.limits import Limits
from tussle.mission.node import Budget, Node
from tussle.mission.overrides import TreeEditor, as_texts
from tussle.mission.plugin_files import PluginFile
from tussle.mission.plugin_tags import PluginReader
from tussle.mission.problems import Place, Problems
from tussle.mission.rekeys import parse_rekeys
from tussle.mission.scene_tags import SCENE_TAGS, SceneReader
from tussle.mission.source import MissionSource, SourceReader, find_mission
from tussle.mission.spec import MISSION_VALUES, Mission, end_conditions, read_from_file, too_early
from tussle.mission.strictness import report_stray, strictness_of
from tussle.mission.tags import RUN, RUNSCRIPT, SEED_ATTRIBUTES, WORLD, TagSpec
from tussle.world.geodesy import Origin
from tussle.world.scene import Scene

SEED = re.compile(r"\d{1,20}", re.ASCII)
PLUGIN_TAGS = {"entity_interaction": "interactions", "metrics": "metrics", "network": "networks"}


VIEWER_NOTE = "kept for the viewer: "
"""Part of the notes on settings that only the viewer uses."""


@dataclass(frozen=True)
class Loaded:
    """The content of a mission file.

    Attributes:
        mission: The mission.
        seed: The file's seed; None without one.
        name: The mission's title, else the file's name.
        path: The file.
        text: The mission as one XML text: placeholders and settings replaced, includes resolved. Reading it gives the same mission.
        notes: Notes about the file, one line each: unknown and ignored tags, and differences between tussle and the format.
        viewer: Settings for the viewer: attributes of <run> and tags by name, "entities" by block, "plugins" by "plugin@attribute".
        log: Settings of the output, by tag.
        placeholders: Names of the placeholders, with their defaults.
        placeholder_places: Name of a placeholder -> "file:line" of each place where it stands, with what is ignored there.
        places: Block name -> "file:line", for messages about it.
        files: All files that were read: the mission's and those it includes.
        scene_files: Files of surfaces and their textures, by their paths from the folder in which they were found.
        settings: Values set from outside, as texts of the file.
        plugin_files: The Python files with plugins that it was read with.
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
    placeholder_places: dict[str, tuple[str, ...]] = field(default_factory=dict)
    places: dict[str, str] = field(default_factory=dict)
    files: tuple[Path, ...] = ()
    scene_files: dict[str, Path] = field(default_factory=dict)
    settings: dict[str, str] = field(default_factory=dict)
    plugin_files: tuple[PluginFile, ...] = ()

    @property
    def game_notes(self) -> tuple[str, ...]:
        """The notes without those on settings of the viewer."""
        return tuple(note for note in self.notes if VIEWER_NOTE not in note)


def read_mission(
    source: str | Path,
    overrides: Mapping[str, Any] | None = None,
    *,
    strict: bool | None = None,
    plugin_files: Sequence[str | Path | PluginFile] = (),
    search: Sequence[str | Path] = (),
    allow_large: bool = False,
    compat: str | None = None,
    checks_effects: bool = True,
    plays: bool = True,
) -> Loaded:
    """Read a mission.

    Args:
        source: A file, or the name of a shipped mission ("predator_prey") or of a stock plugin ("Boids"), for its example.
        overrides: Values of the file's placeholders, `${name=default}`, and of anything in it by path: "run.dt", "prey.count",
            "prey.Boids.max_speed", "SimpleCapture.capture_range", "prey.motion_model" ("Unicycle vel_max='30'"). By path, a number
            is SI and a text is read as in the file; the value of a placeholder is inserted into the file as it is.
        strict: Unknown tags and attributes are errors, else they are ignored with a note; None: they are errors, unless the file has
            marks of a mission of SCRIMMAGE: its style sheet, compat="scrimmage", or tags that only SCRIMMAGE uses, such as <log_dir>.
        plugin_files: Python files with further plugins for the mission.
        search: Folders that are searched for missions, included files, and files that plugins name (data of SCRIMMAGE), besides the
            mission's own. Those of the environment variable SCRIMMAGE_DATA_PATH are searched after them.
        allow_large: Raise the limits that keep a hostile file from taking all memory, for reading and for running.
        compat: As for `Mission`; None for the value in the file.
        checks_effects: It is an error if an override has no effect, since its placeholder stands only in what is ignored. For this
            check the mission is read once more for each override.
        plays: The mission is to be played. Otherwise, to be looked at, each plugin is that of its tag, and nothing but files of missions
            is read: no plugin is tried, as an aircraft is in JSBSim that may fly compiled instead.

    Raises:
        MissionError: The mission cannot be read or is invalid. The message has one line for each error, with file and line.
    """
    limits = Limits.large() if allow_large else Limits()
    search = data_folders(several(search))
    plugin_files = several(plugin_files)

    def read(given: Mapping[str, Any]) -> Loaded:
        return _read(source, given, strict, plugin_files, search, limits, compat, plays)

    given = {str(name): value for name, value in (overrides or {}).items()}
    loaded = read(given)
    if checks_effects:
        check_effects(read, loaded, given)
    return loaded


def _read(
    source: str | Path,
    given: Mapping[str, Any],
    strict: bool | None,
    plugin_files: Sequence[str | Path | PluginFile],
    search: Sequence[str | Path],
    limits: Limits,
    compat: str | None,
    plays: bool,
) -> Loaded:
    budget = Budget(limits)
    settings = as_texts(given)
    problems = Problems()
    path = find_mission(source, search)
    read = SourceReader(settings, problems, budget, search).read(path)
    if read.root.tag != "runscript":
        raise MissionError(
            f"{read.root.place}: the root tag is <{clipped(read.root.tag)}>; it must be <runscript>"
        )
    files = tuple(f if isinstance(f, PluginFile) else PluginFile.of(f) for f in plugin_files)
    catalogue = _catalogue(read, compat, files)
    problems.strictness = strictness_of(read.root, read.own_text, strict)
    report_stray(read.root, problems)
    expand_entity_common(read.root, problems, budget)
    tree = TreeEditor(read.root, catalogue, read.placeholders)
    paths = {name: tree.set(name, value) for name, value in given.items() if name not in read.placeholders}
    if paths:
        read.text = read.root.to_text()
    reader = _WorldReader(read, catalogue, problems, budget, [path.parent, *map(Path, search)], plays)
    return replace(reader.loaded(), settings=settings | paths, plugin_files=files)


def _catalogue(read: MissionSource, compat: str | None, plugin_files: Sequence[Any]) -> Catalogue:
    """Return the catalogue for `compat`, or for the laws that the file names. `compat` is written into the mission's text.

    Raises:
        MissionError: There are no such laws, or a plugin file cannot be imported.
    """
    root = read.root
    place = None if compat is not None else root.where("compat")
    if compat is not None and compat != root.attributes.get("compat", ""):
        root.attributes["compat"] = compat
        read.text = root.to_text()
    try:
        check_compat(root.attributes.get("compat", ""))
    except MissionError as error:
        raise MissionError(f"{place}: {error}" if place else str(error)) from None
    return Catalogue(plugin_files, root.attributes.get("compat", ""))


class _WorldReader:
    """Reads the tags of <runscript>."""

    def __init__(
        self,
        source: MissionSource,
        catalogue: Catalogue,
        problems: Problems,
        budget: Budget,
        folders: list[Path],
        plays: bool,
    ) -> None:
        self.source, self.folders, self.plays = source, folders, plays
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
            if attribute not in RUNSCRIPT and "}" not in attribute:
                problems.unknown(root.where(attribute), "attribute of <runscript>", attribute, RUNSCRIPT)
        if root.text:
            problems.note(root.place, f"text between the tags of <runscript> is ignored: {shown(root.text)}")
        if not any(True for _ in root.find_all("entity")):
            problems.error(root.place, "the mission has no <entity>")
        times = self._run()
        origin = self._origin()
        find = DataFiles(self.folders[0], self.folders[1:]).find
        plugins = PluginReader(
            self.catalogue,
            problems,
            self.budget,
            find,
            self._shared(),
            origin.from_geodetic,
            plays=self.plays,
        )
        world = self._world_plugins(plugins)
        scene = SceneReader(root, self.folders, origin, problems)
        entities = EntityReader(plugins, problems, origin, self.limits, times["update"], scene.mesh_lengths)
        nodes = list(root.find_all("entity"))
        self._count_tags(nodes)
        blocks = [entities.block(node, name) for node, name in zip(nodes, block_names(nodes), strict=True)]
        plugins.report_unread()
        plugins.report_teams({block.team for block in blocks if block is not None})
        for node in root.find_all("param_common"):
            if node.attributes.get("name") not in plugins.shared_taken:
                problems.note(node.place, "no plugin takes this <param_common>; it is ignored")
        if plugins.has_found:
            self.source.text = root.to_text()
        conditions, seed, reseed = self._end_conditions(), self._seed(), self._reseed()
        if "time" in conditions and (text := too_early(times["start"], times["end"], times["dt"])):
            problems.error((self._last("run") or self.root).where("end"), text)
        parts = scene.parts()
        self._settings()
        self.viewer.pop("map", None)
        if (found := scene.map_file()) is not None:
            self.viewer["map"] = {"file": str(found[0]), "bounds": found[1]}
        if entities.viewer:
            self.viewer["entities"] = entities.viewer
        if plugins.viewer:
            self.viewer["plugins"] = plugins.viewer
        self._note_viewer_settings(plugins.viewer)
        problems.check()
        name = root.attributes.get("name", "").strip()
        settings: dict[str, Any] = {**times, **world, **reseed}
        try:
            mission = read_from_file(
                Mission(
                    blocks=[block for block in blocks if block is not None],
                    end_conditions=conditions,
                    scene=Scene(origin=origin, bases=tuple(entities.bases), **parts),
                    name=name,
                    compat=root.attributes.get("compat", ""),
                    limits=self.limits,
                    **settings,
                )
            )
        except TussleError as error:
            raise MissionError(f"{root.place}: {error}") from error
        places = {block: str(place) for block, place in entities.places.items()}
        return Loaded(
            mission, seed, name or self.source.path.stem, self.source.path, self.source.text, problems.notes, self.viewer, self.log,
            self.source.placeholders, self._placeholder_places(), places, (*self.source.files, *scene.files), scene.files_by_name(),
        )  # fmt: skip

    def _placeholder_places(self) -> dict[str, tuple[str, ...]]:
        return {
            name: tuple(
                ": ".join([str(place), *self.problems.at(place)[:1]]) for place in dict.fromkeys(places)
            )
            for name, places in self.source.places.items()
        }

    def _count_tags(self, entities: list[Node]) -> None:
        """Check the number of blocks and plugins before they are compared with one another, which takes quadratic time.

        Raises:
            MissionError: There are too many blocks, or plugins in one tag.
        """
        hint = "use allow_large for a file that you trust"
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
        """Return the last tag with this name, which is the one in effect."""
        return next((child for child in reversed(self.root.children) if child.tag == tag), None)

    def _run(self) -> dict[str, Any]:
        """Read and check times and steps, and store the settings of the viewer."""
        node = self._last("run") or Node("run", {}, "", [], self.root.place)
        for attribute in node.attributes:
            if attribute not in RUN:
                self.problems.unknown(node.where(attribute), "attribute of <run>", attribute, RUN)
        # Attributes are read as if they were tags, so that `Fields` reads both.
        children = [Node(k, {}, v, [], node.where(k)) for k, v in node.attributes.items() if k in RUN]
        fields = Fields(Node("run", {}, "", children, node.place), RUN, self.problems)
        for name, known in RUN.items():
            if known.kept_for and fields.has(name):
                self._keep(self.viewer, name, fields.found[name], known, f"run@{name}")
        # A wrong value has been reported and is replaced by its default.
        dt, start, end = fields.number("dt"), fields.number("start"), fields.number("end")
        most = self.limits.substeps
        substeps = fields.read("motion_multiplier", lambda text: self._whole(fields, text, most))
        if not abs((end - start) / dt) <= self.limits.steps:
            text = f"there are more than {self.limits.steps:,} steps of {dt:g} s from {start:g} to {end:g} s"
            self.problems.error(fields.place("end"), text)
        elif abs((n := max(0.0, (end - start) / dt)) - round(n)) > 0.01:
            last = start + math.ceil(n - 0.5) * dt
            self.problems.note(
                fields.place("end"),
                f"end {end:g} s is not a whole number of steps of {dt:g} s; the last ends at {last:g} s",
            )
        update = fields.read("update", lambda text: MISSION_VALUES["update"].convert(text, "update"))
        return {"dt": dt, "start": start, "end": end, "motion_multiplier": substeps, "update": update}

    def _whole(self, fields: Fields, text: str, most: int) -> int:
        """Return motion_multiplier, the whole part of a number with a fraction."""
        value = codecs.number(text)
        if value < 1.0 or value == int(value):
            return codecs.integer(text, 1, most)
        whole = codecs.integer(str(int(value)), 1, most)
        self.problems.note_repair(
            fields.place("motion_multiplier"), f"motion_multiplier: {shown(text)} is not a whole number", f'motion_multiplier="{whole}"'
        )  # fmt: skip
        return whole

    def _origin(self) -> Origin:
        names = ("latitude_origin", "longitude_origin", "altitude_origin")
        nodes = [node for name in names if (node := self._last(name))]
        if not nodes:
            return Origin()
        fields = Fields(Node("runscript", {}, "", nodes, self.root.place), WORLD, self.problems)
        if len(missing := [name for name in names[:2] if not fields.has(name)]) == 1:
            text = f"<{missing[0]}> is missing, and is taken to be {WORLD[missing[0]].default} degrees"
            self.problems.note(nodes[0].place, text)
        return Origin(*fields.angles(names[0], names[1]), fields.number(names[2]))

    def _shared(self) -> dict[str, dict[str, Node]]:
        """Map the name of each <param_common> to its tags, by name."""
        shared: dict[str, dict[str, Node]] = {}
        for node in self.root.find_all("param_common"):
            name = node.attributes.get("name", "")
            if not name:
                self.problems.error(node.place, "param_common has no name; plugins take it by its name")
            shared[name] = {child.tag: child for child in node.children}
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

    def _reseed(self) -> dict[str, Any]:
        """Read the time from which another seed is used, and that seed."""
        node = self._last("seed")
        found: dict[str, Any] = {}
        if node is None:
            return found
        for attribute, text in node.attributes.items():
            if attribute not in SEED_ATTRIBUTES:
                self.problems.unknown(
                    node.where(attribute), "attribute of <seed>", attribute, SEED_ATTRIBUTES
                )
                continue
            try:
                if attribute == "rekeys":
                    found[attribute] = parse_rekeys(text)
                else:
                    found[attribute] = MISSION_VALUES[attribute].convert(text, f"seed@{attribute}")
            except (ParameterError, MissionError) as error:
                self.problems.error(node.where(attribute), str(error))
        if "reseed_time" in found and "reseed" not in node.attributes:
            self.problems.note(
                node.where("reseed_time"),
                "without seed@reseed the second seed depends on the first, not on the clock",
            )
        if "reseed" in found and "reseed_time" not in found:
            self.problems.note(node.where("reseed"), "seed@reseed is ignored without reseed_time")
            del found["reseed"]
        return found

    def _seed(self) -> int | None:
        node = self._last("seed")
        if node is None or not node.text:
            return None
        if SEED.fullmatch(node.text) is None or int(node.text) >= 2**64:
            text = f"seed {shown(node.text)} is not allowed; it takes a whole number from 0 to 2^64 - 1"
            self.problems.error(node.place, text)
            return None
        return int(node.text)

    def _settings(self) -> None:
        """Store the settings of the viewer and the log, and report unknown tags."""
        for node in self.root.children:
            known = WORLD.get(node.tag)
            if known is None:
                self.problems.unknown(node.place, "tag", node.tag, WORLD)
            elif known.kept_for:
                for attribute in node.attributes if known.kept_for == "viewer" else ():
                    if attribute not in known.attributes:
                        self.problems.unknown(
                            node.where(attribute), f"attribute of <{node.tag}>", attribute, known.attributes
                        )
                self._keep(
                    self.viewer if known.kept_for == "viewer" else self.log, node.tag, node, known, node.tag
                )
            elif node.tag not in ("run", "seed", "entity", "param_common", *PLUGIN_TAGS, *SCENE_TAGS):
                for attribute in node.attributes:
                    self.problems.unknown(node.where(attribute), f"attribute of <{node.tag}>", attribute, ())

    def _keep(self, into: dict[str, Any], name: str, node: Node, known: TagSpec, label: str) -> None:
        """Store a setting that the game does not depend on; with attributes it is a dict, with its text under "value"."""
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

    def _note_viewer_settings(self, of_plugins: Mapping[str, str]) -> None:
        names = sorted(
            {
                *self.kept,
                *(f"entity {key}" for e in self.viewer.get("entities", {}).values() for key in e),
                *of_plugins,
            }
        )
        if names:
            self.problems.note(
                Place(self.root.place.file, self.root.place.line), f"{VIEWER_NOTE}{', '.join(names)}"
            )
