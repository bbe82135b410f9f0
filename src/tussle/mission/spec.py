"""A mission as frozen data: blocks of entities with their plugins, world plugins, scene, times and end conditions."""

from __future__ import annotations

import dataclasses
import functools
import inspect
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, TypeVar

import numpy as np

from tussle.api import Autonomy, Controller, Interaction, Metric, MotionModel, Network, Plugin, Sensor
from tussle.api.context import missing_service
from tussle.declare.columns import Param
from tussle.documents import is_count
from tussle.errors import MissionError, ParameterError, TussleError, listed, nearest_name
from tussle.mission import displayed
from tussle.mission.cadence import Cadence
from tussle.mission.laws import check_compat, with_laws
from tussle.mission.limits import Limits
from tussle.mission.quantities import Quantities, QuantitiesOrNone, Quantity, QuantityOrNone, given
from tussle.mission.rekeys import check_targets, checked_rekeys
from tussle.plugins import stock
from tussle.world.scene import Scene, find_region

T = TypeVar("T")

END_CONDITIONS = ("time", "one_team", "all_dead", "none")
END = Param("time", choices=END_CONDITIONS)
RUN = "run"
"""First name of paths to the mission's times and steps."""
OF_BLOCK = ("autonomy", "controller", "motion", "sensor")
OF_WORLD = ("interactions", "metrics", "networks")
"""Names of the plugins of a block, and of a mission."""
UPDATES = ("synchronous", "sequential", "random", "random_in_blocks")
ONE_BY_ONE = UPDATES[1:]
"""Update orders in which entities decide and move one after another."""
SHUFFLED = UPDATES[2:]
"""Update orders that are drawn anew in each step; they take one world at a time."""
PLACEMENTS = ("normal", "uniform")
WITHOUT_SPACE = ("wait", "fail")


def _converted(where: str, frozen: Any, columns: Mapping[str, Param]) -> None:
    """Convert declared values in place; None is kept where it is the default."""
    for name, column in columns.items():
        value = getattr(frozen, name)
        if value is None and getattr(type(frozen), name) is None:
            continue
        if column.fields and isinstance(value, (int, float)):
            value = [value] * len(column.fields)
        try:
            _set(frozen, name, column.convert(value, f"{where}: {name}"))
        except ParameterError as error:
            raise MissionError(str(error)) from None


def _declared(kind: type, **columns: Any) -> dict[str, Param]:
    """Declarations of a dataclass's values; the defaults are those of its fields."""
    declared = {}
    for name, options in columns.items():
        default = options.pop("default", getattr(kind, name))
        is_number = not isinstance(default, (bool, str))
        declared[name] = Param(default, **({"gt": -math.inf, "lt": math.inf} if is_number else {}) | options)
    return declared


def too_early(start: float, end: float, dt: float) -> str:
    """What is wrong with an end time [s] before which no step would be played; "" for others."""
    if (end - start) / dt > 0.5:
        return ""
    least = start + 0.5 * dt
    return f"end = {end:g} s is not allowed; with start = {start:g} s and dt = {dt:g} s it takes a time > {least:g} s"


def end_conditions(value: Any, where: str) -> tuple[str, ...]:
    """Parse end conditions from a list or a text; duplicates are dropped.

    Raises:
        MissionError: It is neither a list nor a text of end conditions.
    """
    words = value.replace(",", " ").split() if isinstance(value, str) else value
    try:
        return tuple(dict.fromkeys(END.convert(word, where) for word in words))
    except (TypeError, ParameterError) as error:
        prefix = "" if isinstance(error, ParameterError) else f"{where} = {value!r} is not allowed: "
        raise MissionError(f"{prefix}{error}") from None


def _plugins(where: str, value: Any, kind: type) -> tuple[Any, ...]:
    plugins = tuple(value) if isinstance(value, (list, tuple)) else () if value is None else (value,)
    for plugin in plugins:
        if not isinstance(plugin, kind):
            hint = " (it is a class; call it to make an instance)" if isinstance(plugin, type) else ""
            raise MissionError(f"{where}: {plugin!r} is not of kind {kind.__name__}{hint}")
        if getattr(plugin, "active_in", ()):
            raise MissionError(
                f"{where}: {plugin!r} has states, which only plugins inside another one follow; leave them out"
            )
    names = [p.instance_name for p in plugins]
    for name in names:
        if names.count(name) > 1:
            raise MissionError(
                f"{where}: two plugins are called {name!r}; give one of them another name with name=..."
            )
    return plugins


def teams_named(plugin: Plugin) -> dict[str, int]:
    """Return the parameters of a plugin that were given and name a team, with its number: 0 and below are nobody or all."""
    given = {name: str(plugin.stated.get(name, "")) for name in plugin.named_teams}
    return {name: int(text) for name, text in given.items() if is_count(text) and int(text)}


def _refuse_rate(where: str, plugin: Any, why: str) -> None:
    if plugin.rate is not None:
        raise MissionError(
            f"{where}: {plugin.instance_name} has rate = {plugin.rate!r}, but it {why}; leave the rate out"
        )


def _set(frozen: Any, name: str, value: Any) -> None:
    object.__setattr__(frozen, name, value)


def _check_names(where: str, kind: Any, given: Iterable[str]) -> None:
    names = [f.name for f in dataclasses.fields(kind)]
    for name in given:
        if name not in names:
            raise MissionError(f"{where} has no {name!r}{nearest_name(name, names)}; {listed(names)}")


EXAMPLES = {"name": 'name="prey"', "blocks": 'blocks=[Block(name="prey", motion=Unicycle())]'}
"""Arguments that must be given, as one writes them."""


def _named(kind: type[T]) -> type[T]:
    """Decorator of a dataclass: an unknown or a missing argument raises a MissionError with its name."""
    construct = kind.__init__
    _, *others = inspect.signature(construct).parameters.values()
    needed = [each.name for each in others if each.default is each.empty]

    @functools.wraps(construct)
    def checked(self: Any, **values: Any) -> None:
        _check_names(kind.__name__, kind, values)
        for name in needed:
            if name not in values:
                raise MissionError(
                    f"a {kind.__name__} needs {name}, such as {kind.__name__}({EXAMPLES[name]})"
                )
        construct(self, **values)

    kind.__init__ = checked  # type: ignore[method-assign]
    return kind


@_named
@dataclass(frozen=True, kw_only=True)
class Block:
    """A block of entities with the same plugins: their number, initial states and times of birth.

    Attributes:
        name: Name of the block, unique in its mission.
        team: Team number.
        count: Total number of entities, later births included.
        position: Start position of the first entity [m], (3,), world frame.
        variance: Placement "normal": variance of the other entities' positions around it [m^2], (3,).
        half_width: Placement "uniform": largest distance of the other entities from it along each axis [m], (3,).
        placement: "normal" or "uniform".
        scatter_first: Whether the first entity is placed like the others.
        heading: Heading, counter-clockwise from East [rad]. This and all other numbers with units may be texts: "180 deg".
        heading_variance: Variance of the heading [rad^2].
        climb: Elevation of the nose, up positive [rad].
        roll: Bank, right wing down positive [rad].
        velocity: Initial velocity [m/s], (3,), world frame; None for `speed` along the body x axis.
        speed: Initial speed [m/s].
        health: Initial health; an entity is removed when it reaches 0.
        radius: Body radius [m].
        mass: Mass [kg], for motion models without a parameter `mass`.
        box: Lengths along the body's x, y and z axes of the box that rays meet [m], (3,); None for a sphere of `radius`.
        rate: Births per second in each slot [1/s]; None if all entities exist from the start.
        slots: With a rate: number of birth sequences that run in parallel.
        first_birth: With a rate: time of the first birth [s].
        interval_sd: With a rate: standard deviation of the time between births [s].
        without_space: With a rate: what a birth does that finds no free position. "wait": it tries again in each step; "fail": the
            world ends with an error.
        autonomy: One or several autonomies.
        controller: One or several controllers, in order from the autonomy to the motion model.
        motion: The motion model.
        sensor: One or several sensors.
    """

    name: str
    team: int = 0
    count: int = 1
    position: Quantities = given((0.0, 0.0, 0.0))
    variance: Quantities = given((100.0, 100.0, 0.0))
    half_width: Quantities = given((0.0, 0.0, 0.0))
    placement: str = "normal"
    scatter_first: bool = False
    heading: Quantity = given(0.0)
    heading_variance: Quantity = given(0.0)
    climb: Quantity = given(0.0)
    roll: Quantity = given(0.0)
    velocity: QuantitiesOrNone = given(None)
    speed: Quantity = given(0.0)
    health: float = 1.0
    radius: Quantity = given(1.0)
    mass: Quantity = given(1.0)
    box: QuantitiesOrNone = given(None)
    rate: QuantityOrNone = given(None)
    slots: int = 1
    first_birth: Quantity = given(0.0)
    interval_sd: Quantity = given(0.0)
    without_space: str = "wait"
    autonomy: Any = ()
    controller: Any = ()
    motion: Any = None
    sensor: Any = ()

    def __post_init__(self) -> None:
        where = f"block {self.name!r}"
        if not isinstance(self.name, str):
            raise MissionError(f"{where}: the name of a block must be a text")
        if not self.name or "." in self.name:
            raise MissionError(
                f"{where}: the name of a block must not be empty or contain a dot, since paths such as prey.Boids.gain use dots"
            )
        _converted(where, self, BLOCK_VALUES)
        _set(self, "autonomy", _plugins(f"{where}: autonomy", self.autonomy, Autonomy))
        _set(self, "controller", _plugins(f"{where}: controller", self.controller, Controller))
        _set(self, "sensor", _plugins(f"{where}: sensor", self.sensor, Sensor))
        if isinstance(self.motion, type) or not isinstance(self.motion, MotionModel):
            raise MissionError(
                f"{where}: motion = {self.motion!r} is not a motion model; each block has exactly one, such as motion=Unicycle()"
            )
        _plugins(where, self.plugins, object)
        _refuse_rate(where, self.motion, "is integrated over every step")

    def replace(self, **changes: Any) -> Block:
        """Return a copy with changed values."""
        _check_names("Block", Block, changes)
        return dataclasses.replace(self, **changes)

    @property
    def plugins(self) -> tuple[Any, ...]:
        """All plugins in the order of a step."""
        return (*self.autonomy, *self.controller, self.motion, *self.sensor)

    def __repr__(self) -> str:
        # A debugger also shows a block that could not be made.
        return displayed.block_line(self) if "motion" in vars(self) else object.__repr__(self)

    def _repr_html_(self) -> str:
        return displayed.block_html(self)


MAX_COORDINATE = 1e9
"""Largest coordinate of a block [m]: positions there are good to a micrometre, so that entities still move."""
BLOCK_VALUES = _declared(
    Block,
    team={},
    count={"ge": 0},
    position={"unit": "m", "fields": "x y z", "ge": -MAX_COORDINATE, "le": MAX_COORDINATE},
    variance={"unit": "m^2", "fields": "x y z", "ge": 0.0, "le": MAX_COORDINATE**2},
    half_width={"unit": "m", "fields": "x y z", "ge": 0.0, "le": MAX_COORDINATE},
    placement={"choices": PLACEMENTS},
    scatter_first={},
    heading={"unit": "rad", "text_unit": "deg"},
    heading_variance={"unit": "rad^2", "text_unit": "deg^2", "ge": 0.0},
    climb={"unit": "rad", "text_unit": "deg"},
    roll={"unit": "rad", "text_unit": "deg"},
    velocity={"default": (0.0, 0.0, 0.0), "unit": "m/s", "fields": "x y z"},
    speed={"unit": "m/s", "ge": 0.0},
    health={"gt": 0.0},
    radius={"unit": "m", "gt": 0.0},
    mass={"unit": "kg", "gt": 0.0},
    box={"default": (1.0, 1.0, 1.0), "unit": "m", "fields": "x y z", "gt": 0.0},
    rate={"default": 1.0, "unit": "1/s", "gt": 0.0},
    slots={"gt": 0},
    first_birth={"unit": "s"},
    interval_sd={"unit": "s", "ge": 0.0},
    without_space={"choices": WITHOUT_SPACE},
)
"""Declarations of a block's values, like those of plugin parameters."""
WORLD_VALUES = (
    *("position", "variance", "half_width", "heading", "heading_variance", "climb", "roll"),
    *("speed", "health", "radius", "mass"),
)
"""Values of a block that may differ between the worlds of a stack."""


@_named
@dataclass(frozen=True, kw_only=True)
class Mission:
    """A mission: entities, world plugins, scene, times and end conditions.

    Attributes:
        blocks: The blocks of entities.
        dt: Length of a step [s].
        end: End time with the end condition "time" [s].
        start: Time of step 0 [s].
        motion_multiplier: Substeps of controllers and motion per step.
        update: "synchronous": all entities decide on the states at the start of the step. "sequential": the entities decide and
            move one after another, in order of id; the positions at the start of the step decide who is in range of whom. "random":
            the same in an order that is drawn anew in each step; "random_in_blocks": drawn within each block, block after block.
            These two take one world at a time, not a stack.
        end_conditions: Conditions that end a world, of time, one_team, all_dead, none.
        interactions: Interaction plugins, in order.
        metrics: Metric plugins, in order.
        networks: Networks; GlobalNetwork and LocalNetwork are added if they are missing.
        scene: Origin, ground, walls, boundaries, bases.
        name: Title.
        compat: Laws of the game: "" for tussle's, "scrimmage" for SCRIMMAGE's where they differ. In the latter case stock plugins are
            replaced by those of `tussle.historic`, with the same parameters.
        reseed_time: From the first step at or after this time on [s], random numbers are drawn with another seed; None for never.
        reseed: Seed from `reseed_time` on, the same for all worlds; None to derive it from the seed of each world.
        rekeys: (step, key) pairs: from the states at the start of that step on, all worlds draw random numbers with that key. So a game
            is played again up to a step, and then with other luck. (step, key, target) is for the draws of a target alone: "left" for a
            block, "left/2" for its second entity, "left//Hover/gust" for a plugin and a label of its draws, or a world plugin.
        limits: Limits on the entities that a world may hold, and on the positions drawn for them. The blocks' own entities are
            always accepted; `Limits.large()` is for plugins that spawn very many more.
    """

    blocks: Sequence[Block]
    dt: Quantity = given(0.1)
    end: Quantity = given(50.0)
    start: Quantity = given(0.0)
    motion_multiplier: int = 1
    update: str = "synchronous"
    end_conditions: Any = ("time",)
    interactions: Any = ()
    metrics: Any = ()
    networks: Any = ()
    scene: Scene = field(default_factory=Scene)
    name: str = ""
    compat: str = ""
    reseed_time: QuantityOrNone = given(None)
    reseed: int | None = None
    rekeys: Any = ()
    limits: Limits = field(default=Limits(), repr=False)  # no effect on the game
    is_from_file: ClassVar[bool] = False

    def __post_init__(self) -> None:
        if not isinstance(self.blocks, Iterable):
            raise MissionError(f"mission: blocks = {self.blocks!r} is not allowed; it takes a list of Block")
        _set(self, "blocks", tuple(self.blocks))
        for block in self.blocks:
            if not isinstance(block, Block):
                raise MissionError(f"mission: {block!r} is not a Block")
        names = [b.name for b in self.blocks]
        for name in names:
            if names.count(name) > 1:
                raise MissionError(
                    f"mission: two blocks are called {name!r}; paths and random numbers need unique names"
                )
        _converted("mission", self, MISSION_VALUES)
        if not math.isfinite((self.end - self.start) / self.dt):
            raise MissionError(
                f"mission: end = {self.end!r} with dt = {self.dt!r} is not allowed; the number of steps must be finite"
            )
        _set(self, "rekeys", checked_rekeys(self.rekeys))
        _set(self, "end_conditions", end_conditions(self.end_conditions, "mission: end_conditions"))
        if "time" in self.end_conditions and (problem := too_early(self.start, self.end, self.dt)):
            raise MissionError(f"mission: {problem}")
        for name, kind in (("interactions", Interaction), ("metrics", Metric), ("networks", Network)):
            _set(self, name, _plugins(f"mission: {name}", getattr(self, name), kind))
        given = [p.instance_name for p in self.networks]
        missing = tuple(stock.load(n)() for n in stock.ALWAYS_THERE if n not in given)
        _set(self, "networks", (*missing, *self.networks))
        self._take_laws()
        _plugins("mission", self.world_plugins, object)
        if RUN in [*names, *(p.instance_name for p in self.world_plugins)]:
            raise MissionError(
                f"mission: {RUN!r} is not allowed as the name of a block or plugin; it is reserved for paths such as run.dt"
            )
        for plugin in self.world_plugins:
            if plugin.instance_name in names:
                raise MissionError(
                    f"mission: {plugin.instance_name!r} is the name of a block and of a plugin; paths need unique names"
                )
        check_targets(self.rekeys, *self.draws)
        self._check_rates()
        self._check_needs()
        if not isinstance(self.scene, Scene):
            raise MissionError(f"mission: scene = {self.scene!r} is not a Scene")
        if not isinstance(self.limits, Limits):
            raise MissionError(f"mission: limits = {self.limits!r} is not a Limits")

    def _take_laws(self) -> None:
        """Replace the plugins whose laws differ."""
        check_compat(self.compat)
        if not self.compat:
            return
        _set(self, "blocks", tuple(block.replace(**with_laws(block, OF_BLOCK)) for block in self.blocks))
        for name, plugins in with_laws(self, OF_WORLD).items():
            _set(self, name, plugins)

    def _check_rates(self) -> None:
        for network in self.networks:
            _refuse_rate("mission", network, "carries messages in every step")
        for block in self.blocks:
            for plugin in block.plugins:
                m = self.motion_multiplier if isinstance(plugin, Controller) else 1
                Cadence.of(plugin, m / self.dt, m, f"block {block.name!r}")
        for plugin in (*self.interactions, *self.metrics):
            Cadence.of(plugin, 1.0 / self.dt, 1, "mission")

    def _check_needs(self) -> None:
        """Check that the regions and blocks that plugins name and the services that they call exist."""
        blocks = [block.name for block in self.blocks]
        regions = [region for plugin in self.world_plugins for region in plugin.regions()]
        of_world = {service for plugin in self.world_plugins for service in plugin.services}
        owners = [("mission", self.world_plugins), *((f"block {b.name!r}", b.plugins) for b in self.blocks)]
        for where, outer in owners:
            plugins = [each for plugin in outer for each in plugin.walk()]
            services = of_world.union(*(plugin.services for plugin in plugins))
            for plugin in plugins:
                try:
                    for boundary in plugin.named_regions():
                        find_region(regions, boundary)
                    for name in plugin.named_blocks():
                        if name not in blocks:
                            raise MissionError(
                                f"there is no block {name!r}{nearest_name(name, blocks)}; {listed(blocks)}"
                            )
                    for service in plugin.needed_services:
                        if service not in services:
                            raise MissionError(missing_service(service, services))
                except TussleError as error:
                    raise MissionError(f"{where}: {plugin.instance_name}: {error}") from error

    @property
    def draws(self) -> tuple[dict[str, list[str]], list[str]]:
        """Who draws random numbers: block -> names of its plugins, and the world plugins."""
        names = [
            [each.instance_name for plugin in outer.plugins for each in plugin.walk()]
            for outer in self.blocks
        ]
        of_blocks = dict(zip([block.name for block in self.blocks], names, strict=True))
        return of_blocks, [p.instance_name for p in self.world_plugins]

    def absent_teams(self) -> Iterator[str]:
        """Yield a note for each parameter that names a team which no block has."""
        owners = [*((f"block {b.name!r}", b.plugins) for b in self.blocks), ("mission", self.world_plugins)]
        for where, outer in owners:
            for plugin in (each for one in outer for each in one.walk()):
                for name, team in teams_named(plugin).items():
                    if team not in self.teams:
                        known = listed(map(str, self.teams.tolist()))
                        yield f"{where}: {plugin.instance_name}.{name} = {team}: no block has this team; {known}"

    @property
    def steps(self) -> int:
        """Number of steps until the end time, rounded to the nearest integer."""
        return max(0, math.ceil((self.end - self.start) / self.dt - 0.5))

    @property
    def teams(self) -> np.ndarray:
        """Team numbers, ascending, (n_teams,)."""
        return np.unique(np.array([b.team for b in self.blocks], np.int64))

    @property
    def world_plugins(self) -> tuple[Any, ...]:
        return (*self.interactions, *self.metrics, *self.networks)

    @property
    def plugins(self) -> tuple[Any, ...]:
        """All plugins: those of the blocks, then those of the world."""
        return (*(plugin for block in self.blocks for plugin in block.plugins), *self.world_plugins)

    def replace(self, **changes: Any) -> Mission:
        """Return a copy with changed values."""
        _check_names("Mission", Mission, changes)
        return read_from_file(dataclasses.replace(self, **changes), self.is_from_file)

    def ending_by_time(self) -> Mission:
        """Return a copy with the end condition "time" in addition to its own."""
        conditions = tuple(self.end_conditions)
        return self if "time" in conditions else self.replace(end_conditions=(*conditions, "time"))

    def __repr__(self) -> str:
        return displayed.mission_line(self)

    def _repr_html_(self) -> str:
        return displayed.mission_html(self)


def read_from_file(mission: Mission, is_from_file: bool = True) -> Mission:
    """Keep with a mission whether a file said it, whose notes have its lines; returns the mission."""
    _set(mission, "is_from_file", is_from_file)
    return mission


MISSION_VALUES = _declared(
    Mission,
    dt={"unit": "s", "gt": 0.0},
    end={"unit": "s"},
    start={"unit": "s"},
    motion_multiplier={"ge": 1},
    update={"choices": UPDATES},
    reseed_time={"unit": "s", "default": 0.0},
    reseed={"ge": 0, "default": 0},
)
"""Declarations of a mission's values; their paths begin with "run"."""
