"""Makes the mission of each point, and groups missions whose worlds can share a stack."""

from __future__ import annotations

import dataclasses
import inspect
import pickle
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tussle.batch import by_value
from tussle.batch.tasks import Package
from tussle.batch.variables import Range, Variable
from tussle.errors import MissionError, ParameterError, TussleError, nearest_name
from tussle.mission import Block, Loaded, Mission, PluginFile, read_mission
from tussle.mission.effects import has_effect, without_effect
from tussle.mission.given import wanted
from tussle.mission.paths import with_value
from tussle.mission.spec import WORLD_VALUES

Point = Mapping[str, Any]

MAX_CHECKED = 16
"""Number of points, about, at which an effect of a variable is searched: it may depend on the values of others."""
MAX_OTHERS = 3
"""Number of other values of a variable with which a mission is read to find an effect."""
Signature = tuple[Any, ...]


@dataclass(frozen=True)
class DesignPoint:
    """A point as it is played: its group, and the values that differ from the mission of the group."""

    group: int
    params: dict[str, Any]


def check_source(source: Any, taker: str) -> None:
    """Check that a mission is given, or what one can be made from.

    Raises:
        MissionError: It is neither.
    """
    if not isinstance(source, (str, Path, Mission)) and not callable(source):
        raise MissionError(f"{taker} needs {wanted(source)}")


def read_points(
    source: str | Path, settings: Mapping[str, Any], points: Iterable[Point], **options: Any
) -> Iterator[Loaded]:
    """Read the mission file once for each point.

    Args:
        source: The file.
        settings: Settings of all points.
        points: Settings of each point.
        options: As for `read_mission`.

    Raises:
        MissionError: A point cannot be played; the message names it.
    """
    for number, point in enumerate(points):
        with _naming(number, point):
            yield read_mission(source, {**settings, **point}, **{**options, "checks_effects": False})


def check_variables(
    source: str | Path, settings: Mapping[str, Any], points: Sequence[Point], **options: Any
) -> None:
    """Check that the game depends on each variable, at some of the points.

    Args:
        source: The file.
        settings: Settings of all points.
        points: Settings of each point, with which the mission can be read.
        options: As for `read_mission`.

    Raises:
        MissionError: A variable has no effect, so that points that differ only in it would play the same games.
    """

    def read(given: Mapping[str, Any]) -> Loaded:
        return read_mission(source, given, **{**options, "checks_effects": False})

    useless = list(points[0])
    for point in points[:: max(1, len(points) // MAX_CHECKED)]:
        if not useless:
            return
        given = {**settings, **point}
        loaded = read(given)
        useless = [
            name
            for name in useless
            if not has_effect(read, loaded, given, name, _others(points, name, point[name]))
        ]
    if useless:
        raise MissionError("\n".join(without_effect(name, loaded, "the game") for name in useless))


def with_whole_numbers(
    source: str | Path, settings: Mapping[str, Any], variables: Iterable[Variable], **options: Any
) -> list[Variable]:
    """Return the variables, those ranges as ranges of whole numbers of which the mission reads only whole numbers.

    Args:
        source: The file.
        settings: Settings of all points.
        variables: The variables.
        options: As for `read_mission`.

    Raises:
        ParameterError: A range has more levels than whole numbers.
    """

    def is_read(name: str, value: Any) -> bool:
        try:
            read_mission(source, {**settings, name: value}, **{**options, "checks_effects": False})
        except TussleError:
            return False
        return True

    def takes_whole(v: Variable) -> bool:
        if not isinstance(v, Range) or v.is_int or not (v.low.is_integer() and v.high.is_integer()):
            return False
        return is_read(v.name, v.setting(v.low)) and not is_read(v.name, v.setting(v.low + 0.5))

    return [dataclasses.replace(v, is_int=True) if takes_whole(v) else v for v in variables]  # type: ignore[arg-type]


def build_points(
    source: Mission | Callable[..., Mission],
    settings: Mapping[str, Any],
    points: Iterable[Point],
) -> Iterator[Mission]:
    """Make a mission of Python once for each point.

    Args:
        source: The mission, whose values are set by path, or a function of all values that makes it.
        settings: Settings of all points.
        points: Settings of each point.

    Raises:
        ParameterError: A path leads nowhere, or a value is not allowed.
        MissionError: A function gives no mission.
    """
    for number, point in enumerate(points):
        values = {**settings, **point}
        with _naming(number, point):
            if isinstance(source, Mission):
                mission = source
                for path, value in values.items():
                    mission = with_value(mission, path, value)
            else:
                mission = _made(source, values)
        yield mission


def _others(points: Sequence[Point], name: str, value: Any) -> list[Any]:
    """A few other values of a variable."""
    found: list[Any] = []
    for point in points:
        if len(found) == MAX_OTHERS:
            break
        if point[name] not in (value, *found):
            found.append(point[name])
    return found


@contextmanager
def _naming(number: int, values: Point) -> Iterator[None]:
    """Errors inside name the point."""
    try:
        yield
    except TussleError as error:
        if not values:
            raise
        values_text = ", ".join(f"{k}={v}" for k, v in values.items())
        raise type(error)(f"point {number} ({values_text}): {error}") from None


def _made(function: Callable[..., Mission], values: Mapping[str, Any]) -> Mission:
    """The mission that a function makes of the values.

    Raises:
        ParameterError: It does not take one of them, or needs another.
        MissionError: It gives no mission.
    """
    name = getattr(function, "__name__", repr(function))
    signature = inspect.signature(function)
    try:
        signature.bind(**values)
    except TypeError as error:
        known = list(signature.parameters)
        hint = "".join(nearest_name(k, known) for k in values if k not in known)
        raise ParameterError(
            f"{name} cannot be called with what varies: {error}{hint}; it takes {', '.join(known)}"
        ) from None
    mission = function(**values)
    if not isinstance(mission, Mission):
        raise MissionError(f"{name} gave {mission!r}; it must give a Mission")
    return mission


# -- groups ---------------------------------------------------------------------------------------------------------------


def group_points(
    missions: Sequence[Mission], plugin_files: Sequence[PluginFile] = ()
) -> tuple[list[DesignPoint], Package]:
    """Group points that can share a stack.

    Within a stack, values that each world has (parameters of plugins, speeds of blocks) may differ; structure (counts, the choice of
    plugins, times, text) may not.

    Args:
        missions: The mission of each point.
        plugin_files: Files that their plugins come from.

    Returns:
        Each point as it is played, and the package that workers need.

    Raises:
        MissionError: A mission cannot be sent to other processes.
    """
    groups: dict[Signature, list[int]] = {}
    values = []
    for number, mission in enumerate(missions):
        signature, own = split(mission)
        groups.setdefault(signature, []).append(number)
        values.append(own)
    design_points: list[DesignPoint | None] = [None] * len(missions)
    for group, numbers in enumerate(groups.values()):
        first = values[numbers[0]]
        differing = [path for path in first if any(values[n][path] != first[path] for n in numbers)]
        for n in numbers:
            design_points[n] = DesignPoint(group, {path: values[n][path] for path in differing})
    bases = [missions[numbers[0]] for numbers in groups.values()]
    return [t for t in design_points if t is not None], Package(
        tuple(_pickled(m) for m in bases), tuple(plugin_files)
    )


def _pickled(mission: Mission) -> bytes:
    """A mission, pickled.

    Raises:
        MissionError: It cannot be pickled.
    """
    try:
        return by_value.dumps(mission)
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise MissionError(f"the mission cannot be sent to other processes: {error}") from None


def split(mission: Mission) -> tuple[Signature, dict[str, Any]]:
    """The part of a mission that all worlds of a stack share, hashable, and by path the values that may differ between them."""
    own: dict[str, Any] = {}
    blocks = tuple(_split_block(block, own) for block in mission.blocks)
    world = tuple(
        tuple(_split_plugin(p, p.instance_name, own) for p in getattr(mission, kind))
        for kind in ("interactions", "metrics", "networks")
    )
    fields = {f.name for f in dataclasses.fields(mission)} - {"blocks", "interactions", "metrics", "networks"}
    # Not its repr, which leaves out the middle of long arrays.
    rest = tuple((name, pickle.dumps(getattr(mission, name))) for name in sorted(fields))
    return (blocks, world, rest), own


def _split_block(block: Block, own: dict[str, Any]) -> Signature:
    kinds = ("autonomy", "controller", "sensor")
    for name in WORLD_VALUES:
        own[f"{block.name}.{name}"] = getattr(block, name)
    plugins = tuple(
        tuple(
            _split_plugin(p, f"{block.name}.{p.instance_name}", own, is_of_block=True)
            for p in getattr(block, kind)
        )
        for kind in kinds
    )
    motion = _split_plugin(block.motion, f"{block.name}.{block.motion.instance_name}", own, is_of_block=True)
    fields = {f.name for f in dataclasses.fields(block)} - {*kinds, "motion", *WORLD_VALUES}
    rest = tuple((name, repr(getattr(block, name))) for name in sorted(fields))
    return (plugins, motion, rest)


def _split_plugin(plugin: Any, path: str, own: dict[str, Any], is_of_block: bool = False) -> Signature:
    fixed = []
    for name, column in type(plugin).params().items():
        if column.is_row_data:
            own[f"{path}.{name}"] = plugin.values[name]
        else:
            fixed.append((name, repr(plugin.values[name])))
    # Children of world plugins take no values by world.
    inner = [
        (key, _split_plugin(c, f"{path}.{c.instance_name}", own, True) if is_of_block else c)
        for key in type(plugin).children()
        for c in plugin.values[key]
    ]
    return (
        type(plugin),
        plugin.instance_name,
        plugin.rate,
        plugin.active_in,
        tuple(fixed),
        tuple(inner),
    )
