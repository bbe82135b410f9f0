"""Reads a batch directory: its results, and any of its runs to be played again; or a run directory, to be played again."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow.compute as pc

from tussle.arguments import explained
from tussle.batch import store
from tussle.batch.points import settings_of
from tussle.batch.results import Results
from tussle.batch.trust import DirectoryCode
from tussle.errors import BatchError
from tussle.folders import real_path
from tussle.mission import Loaded, Mission, PluginFile, read_mission
from tussle.record.input_table import load_inputs
from tussle.record.inputs import ExternalInput
from tussle.record.plugin_copies import copied_plugins
from tussle.record.schema import MISSION_FILE, RUN, RUN_FILE

OWN_OPTIONS = ("strict", "compat")
"""Options of `read_mission` that `batch.json` may set."""


@explained
def load_batch(path: str | Path) -> Results:
    """Read the results of a batch directory, complete or not.

    Raises:
        BatchError: There is no batch, or it cannot be read.
    """
    return Results(store.load(path))


@dataclass(frozen=True)
class PlannedRun:
    """One run of a batch or of a run directory, to be played again.

    Attributes:
        loaded: The mission file, read with the values of its point.
        mission: The mission.
        seed: The seed.
        state_hash: State hash of the run there; "" where it is not finished.
        origin: What it comes from: "batch" or "recording".
        inputs: What came from outside into a recorded run.
        interrupted: Why a recording is not complete; "" where it is, or nobody knows.
    """

    loaded: Loaded
    mission: Mission
    seed: int
    state_hash: str
    origin: str = "batch"
    inputs: tuple[ExternalInput, ...] = ()
    interrupted: str = ""


def recorded_run(
    path: Path,
    world: int = 0,
    *,
    may_run: Callable[[DirectoryCode], bool] = lambda code: code.is_own,
    allow_large: bool = False,
    search: Sequence[str | Path] = (),
) -> PlannedRun:
    """A world of a run directory, to be played again. Plugins are read from that directory only.

    Args:
        path: The run directory.
        world: Number of the world.
        may_run: Decides whether the plugin files of the directory may be run; by default those of the user's own runs may.
        allow_large: As for `read_mission`; a directory cannot set it.
        search: The same.

    Raises:
        BatchError: The run has no such world, or was killed, or its plugin files may not be run.
        RecordError: It cannot be read.
        MissionError: Its mission can no longer be read.
    """
    info = RUN.read(path / RUN_FILE) if (path / RUN_FILE).exists() else {}
    worlds = info.get("worlds", [])
    if not 0 <= world < len(worlds):
        known = (
            f"it has worlds 0 to {len(worlds) - 1}"
            if worlds
            else f"it has no {RUN_FILE}, as it was killed or goes on"
        )
        raise BatchError(f"{path}: world {world} cannot be played again; {known}")
    code = DirectoryCode(path, copied_plugins(path))
    if not real_path(path / MISSION_FILE).is_relative_to(real_path(path)):
        raise BatchError(f"{path}: {MISSION_FILE} is outside of the run directory, so it is not read")
    if not may_run(code):
        raise BatchError(f"{path}: {_not_known(code)}")
    loaded = read_mission(
        path / MISSION_FILE,
        strict=False,  # it was read before, perhaps so
        plugin_files=code.files,
        search=search,
        allow_large=allow_large,
    )
    is_timed = "time" in (info["mission"].get("end_conditions") or ())
    mission = loaded.mission.ending_by_time() if is_timed else loaded.mission
    recorded = worlds[world]
    is_over = info["is_complete"] and recorded.get("state_hash")
    state_hash = recorded["state_hash"] if is_over else ""
    inputs, interrupted = load_inputs(path, world), info.get("interrupted", "")
    return PlannedRun(loaded, mission, recorded["seed"], state_hash, "recording", inputs, interrupted)


def _not_known(code: DirectoryCode) -> str:
    return f"not played, since its plugin code is not known to be yours: {code}; --trust runs it, with all your rights"


def planned_run(
    path: str | Path,
    number: int,
    *,
    may_run: Callable[[DirectoryCode], bool] = lambda code: code.is_own,
    allow_large: bool = False,
    search: Sequence[str | Path] = (),
) -> PlannedRun:
    """A run of a batch of a mission file, to be played again. Plugins are read from the batch directory only.

    Args:
        path: The batch directory.
        number: The run.
        may_run: Decides whether the plugin files of the directory may be run; by default those of the user's own batches may.
        allow_large: As for `read_mission`; a directory cannot set it.
        search: The same.

    Raises:
        BatchError: There is no such batch or run, its mission was made in Python, its plugin files may not be run, or it sets
            an option that a directory cannot set.
        MissionError: Its files can no longer be read.
    """
    path = Path(path)
    results = load_batch(path)
    about: dict[str, Any] = results.info["mission"]
    if about.get("made_in") != "file":
        raise BatchError(
            f"{path}: the mission of this batch was made in Python; there, `Batch(...).simulation({number})` is the game of this run"
        )
    if not 0 <= number < results.design.num_rows:
        raise BatchError(
            f"{path}: there is no run {number}; the batch has runs 0 to {results.design.num_rows - 1}"
        )
    options = _options(path, about["options"], {"allow_large": allow_large, "search": bool(search)})
    file = _inside(path, about["file"])
    plugins = [_inside(path, f"{store.PLUGINS}/{name}") for name in about["plugin_files"]]
    code = DirectoryCode(path, tuple(map(PluginFile.of, plugins)))
    for plugin, read in zip(plugins, code.files, strict=True):
        for name in read.texts:  # a neighbour may be a link
            _inside(path, str((plugin.parent / name).relative_to(path / store.MISSION)))
    if not may_run(code):
        raise BatchError(f"{path}: {_not_known(code)}")
    planned = results.design.slice(number, 1).to_pylist()[0]
    point = {v.name: planned[v.name] for v in results.variables}
    settings = {**about["settings"], **settings_of(point, results.variables)}
    loaded = read_mission(
        file,
        settings,
        plugin_files=code.files,
        search=search,
        allow_large=allow_large,
        checks_effects=False,  # the batch was played with them
        **options,
    )
    mission = loaded.mission.ending_by_time() if about["ends_by_time"] else loaded.mission
    found = results.runs.filter(pc.equal(results.runs["run"], number))["state_hash"]
    return PlannedRun(loaded, mission, planned["seed"], found[0].as_py() if len(found) else "")


def _inside(path: Path, name: str) -> Path:
    """A file of the mission folder of a batch.

    Raises:
        BatchError: It is elsewhere, or a link leads elsewhere.
    """
    file = path / store.MISSION / name.replace("\0", "")
    try:
        is_inside = real_path(file).is_relative_to(real_path(path) / store.MISSION)
    except (OSError, RuntimeError) as error:  # links in a circle
        raise BatchError(f"{path}: {name} cannot be read: {error}") from None
    if not is_inside:
        raise BatchError(f"{path}: {name} is outside of the batch directory, so it is not read")
    return file


def _options(path: Path, options: Mapping[str, Any], granted: Mapping[str, bool]) -> dict[str, Any]:
    """The options of `read_mission` that `batch.json` may set: `strict` and `compat`.

    Raises:
        BatchError: It sets another option.
    """
    for name, value in options.items():
        if name not in OWN_OPTIONS and value and not granted.get(name):
            known = "as this batch was made with it, give it again" if name in granted else "it is unknown"
            raise BatchError(f"{path}: a batch directory cannot set the option {name!r}; {known}")
    return {name: options[name] for name in OWN_OPTIONS if options.get(name) is not None}
