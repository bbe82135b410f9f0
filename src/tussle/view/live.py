"""Control and observation of a running simulation: pause, step, rewind, frames, without delaying it."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from contextvars import copy_context
from functools import cached_property
from typing import Any, Self

import numpy as np

from tussle.arguments import checked, explained
from tussle.declare.messages import CustomKeyPress, Message, RemoveEntity, WorldPointClicked
from tussle.documents import POSITIVE, check_argument, is_whole
from tussle.engine.result import WorldResult
from tussle.engine.simulation import Simulation
from tussle.engine.step_end import world_result
from tussle.errors import ParameterError, PluginError, nearest_name
from tussle.pacing import Pace
from tussle.record.inputs import ExternalInput
from tussle.view.alarms import SpecificationAlarms, SpecificationMonitor, SpecificationState
from tussle.view.curves import GameCurves
from tussle.view.drawn import DrawCollector, Shape
from tussle.view.entity import EntityState, entity_state
from tussle.view.feed import MessageFeed, TopicTraffic
from tussle.view.frame import Event, Frame, FrameReader
from tussle.view.ground_map import GroundMap
from tussle.view.latest import LINGER, LatestValue
from tussle.view.link import OperatorLink
from tussle.view.orders import fields_from
from tussle.view.pacing import checked_warp, faster, slower
from tussle.view.playback import Order, PlaybackController
from tussle.view.player import Injection, Player, Setting
from tussle.view.scenery import Scenery, scenery_of
from tussle.view.series import CurveName, StepSeries
from tussle.view.sight import fields_of_view
from tussle.view.style import Style

FRAME_PERIOD = 1.0 / 30.0
"""Least time between two frames [s]."""
STATE_PERIOD = 0.1
"""Least time between two readings of an entity [s]."""
RESULT_PERIOD = 0.5
"""Least time between two provisional results [s]."""
FORGET_TIME = 10.0
"""Time after the last request at which the state of an entity is dropped [s]."""


@explained
class Live:
    """Controls a simulation and observes it while it plays.

    Controls return at once and are executed between two steps, in their order; a seek and a reset end a seek that is under way.
    Observations also return at once, with the latest value; values are made only while they are requested. Results do not depend on
    controls and observers, except for messages to the plugins (`publish`); after rewinding, the game repeats bit for bit.

    Simulations whose plugins have state outside that cannot be saved cannot be rewound, and `notes` says why. `tussle.view.player.Player`
    describes the effects on recorders.

    Args:
        simulation: The simulation; unless `is_followed`, it must not be stepped by others.
        world: Number of the world that is shown. The game ends with it.
        pace: Simulated seconds per second; None is as fast as possible.
        is_paused: Start paused.
        threaded: Play in a new thread. Otherwise the game stands still, controls are executed by the caller, and observations are
            always current.
        is_followed: Others step the simulation and call `follow` after each step. The game can be paused, stepped and slowed down,
            but not rewound, reset or sent messages.
        snapshot_every: Least simulated time between snapshots [s]; they are also limited to 1 % of the CPU time.
        memory: Memory for snapshots and past frames [MB], half of it for each.
        viewer: Viewer tags of the mission file, see `tussle.mission.Loaded`.
        inputs: What came from outside in a recorded run of the game, see `tussle.record.load_inputs`; it comes again, until a message
            or a reset takes the game on another course.
        link: Over which messages, orders, sticks and settings come to the game; by default they come before the next step.
        specifications: Monitors of the simulation, made before its first step, see `tussle.stress.Monitor`.
        margin: Distance from failure below which there is an alarm, in the SI unit of what a specification compares.
        ground_map: A map that pictures show on the ground; by default that of the mission file.

    Attributes:
        see: Age of what a page shows, by the link [s]. The observations here are of the present.

    Raises:
        ParameterError: A value is not allowed.
    """

    @checked("threaded", "is_paused", "is_followed", "ground_map")
    def __init__(
        self,
        simulation: Simulation,
        world: int = 0,
        *,
        pace: float | None = 1.0,
        is_paused: bool = False,
        threaded: bool = True,
        is_followed: bool = False,
        snapshot_every: float = 1.0,
        memory: float = 256.0,
        viewer: Mapping[str, Any] | None = None,
        inputs: Sequence[ExternalInput] = (),
        link: OperatorLink | None = None,
        specifications: Sequence[SpecificationMonitor] = (),
        margin: float = 1.0,
        ground_map: GroundMap | None = None,
    ) -> None:
        check_argument("snapshot_every", snapshot_every, POSITIVE)
        check_argument("memory", memory, POSITIVE)
        check_argument("margin", margin, POSITIVE)
        if not (is_whole(world) and 0 <= world < simulation.n_worlds):
            raise ParameterError(
                f"world = {world!r} is not allowed; there are worlds 0 to {simulation.n_worlds - 1}"
            )
        self.simulation, self.world, self.viewer = simulation, world, dict(viewer or {})
        self._ground_map = ground_map
        self._clock = simulation.state.context.clock
        self._collector = DrawCollector(simulation, world)
        self._pace = Pace(checked_warp(pace))
        self.see = 0.0 if link is None else link.see
        alarms = SpecificationAlarms(specifications, margin, world, self.time_of)
        self._player = Player(simulation, world, snapshot_every, 1e6 * memory, alarms, inputs, link)
        self._playback = PlaybackController(self._player, self._pace, self._collector, is_paused, self._renew)
        ring = self._playback.ring
        self._frame: LatestValue[Frame] = LatestValue(
            FrameReader(simulation, world).frame, FRAME_PERIOD, ring
        )
        self._shapes: LatestValue[tuple[Shape, ...]] = LatestValue(self._collector.shapes, FRAME_PERIOD, ring)
        self._result: LatestValue[WorldResult | None] = LatestValue(self._make_result, RESULT_PERIOD, ring)
        self._feed = MessageFeed(simulation, world)
        self._messages: LatestValue[list[TopicTraffic]] = LatestValue(self._feed.read, STATE_PERIOD, ring)
        self._alarms: LatestValue[list[SpecificationState]] = LatestValue(
            self._make_alarms, STATE_PERIOD, ring
        )
        self._entities: dict[int, LatestValue[EntityState | None]] = {}
        self._renew(True)
        self._thread: threading.Thread | None = None
        self._is_followed = is_followed
        if threaded and not is_followed:
            self._thread = threading.Thread(target=self._playback.run, name="tussle live", daemon=True)
            self._thread.start()

    # -- controls -----------------------------------------------------------------------------------------------------------------

    def _give(self, do: Callable[[], None], *, is_seek: bool = False, may_cut_in: bool = False) -> None:
        self._playback.give(Order(do, is_seek, may_cut_in))
        if self._thread is None and not self._is_followed:
            self._playback.drain()

    def _send(self, order: Any, do: Callable[[], None], is_sure: bool = False) -> None:
        """Give an order that goes over the link, see `Player.send`, with the name of who gives it."""
        self._check_is_own()
        context = copy_context()
        self._give(lambda: self._player.send(order, lambda: context.run(do), is_sure))

    def _check_is_own(self) -> None:
        if self._is_followed:
            raise ParameterError(
                "another program plays this game: it can be paused, stepped and slowed down, nothing else"
            )

    def follow(self) -> None:
        """Show the state after steps that the caller made; return when the next one is due, which is not while the game is paused."""
        self._playback.follow()

    def pause(self) -> None:
        """Pause after the present step."""
        self._playback.is_paused = True
        self._playback.ring()

    def resume(self) -> None:
        """Play on, after the controls given before."""
        self._playback.is_paused = False
        self._playback.ring()

    def toggle(self) -> None:
        """Pause or resume."""
        (self.resume if self.is_paused else self.pause)()

    def step(self, n: int = 1) -> None:
        """Pause and make exactly n steps.

        Raises:
            ParameterError: n < 0, in a game that is followed.
        """
        if n < 0:
            self._check_is_own()
        self.pause()
        self._give(lambda: self._playback.move(n))

    def step_back(self, n: int = 1) -> None:
        """Pause and go back n steps."""
        self.step(-n)

    def seek(self, t: float) -> None:
        """Go to the last step not after a time [s], without pausing or resuming.

        Raises:
            ParameterError: The time is not a number.
        """
        self._check_is_own()
        step = self._step_at(t)
        self._give(lambda: self._playback.go(step), is_seek=True, may_cut_in=True)

    def reset(self, seed: int | None = None) -> None:
        """Restart, with another seed if one is given, without pausing or resuming.

        Raises:
            ParameterError: The seed is not a whole number.
        """
        self._check_is_own()
        if seed is not None and (isinstance(seed, bool) or not isinstance(seed, (int, np.integer))):
            raise ParameterError(f"seed = {seed!r} is not allowed; it takes a whole number")
        number = None if seed is None else int(seed)
        self._give(lambda: self._playback.begin_anew(number), may_cut_in=True)

    def publish(
        self,
        type_: type[Message],
        *,
        network: str = "",
        topic: str = "",
        receivers: Iterable[int] = (),
        **fields: Any,
    ) -> None:
        """Publish a message to the plugins before the next step and its replays, as `Simulation.publish`. Errors appear in `notes`."""
        ids = tuple(map(int, receivers))
        order = [type_.__name__, network, topic, ids, fields]
        self._send(order, lambda: self._player.publish(type_, network, topic, fields, ids))

    def order(self, receivers: Iterable[int], network: str, topic: str, values: Mapping[str, Any]) -> None:
        """Publish a message that a user has typed to some entities, see `tussle.view.orders`. Errors of the game appear in `notes`.

        Raises:
            ParameterError: There is no such topic, or a value does not fit.
        """
        topics = self.simulation.state.message_bus.topics
        buffer = topics.get((network, topic))
        if buffer is None:
            names = sorted("/".join(each) for each in topics)
            raise ParameterError(
                f"there is no topic {network}/{topic}{nearest_name(f'{network}/{topic}', names)}"
            )
        fields = fields_from(buffer.type, values)
        self.publish(buffer.type, network=network, topic=topic, receivers=receivers, **fields)

    def set_parameter(self, entities: Iterable[int], path: str, value: Any) -> None:
        """Set a parameter of some entities before the next step, in SI units. Errors appear in `notes`.

        Args:
            entities: Their ids.
            path: Plugin and parameter, "GoTo.speed".
            value: The value, or those of its components.
        """
        ids = tuple(map(int, entities))
        self._send([path, value, ids], lambda: self._player.set_parameter(path, value, ids))

    def drive(self, who: int, sticks: Sequence[float] | None) -> None:
        """Drive an entity in place of its autonomies from the next step on, see `tussle.engine.manual`. Errors appear in `notes`.

        Args:
            who: Its id.
            sticks: Deflections ahead, left and up, from -1 to 1; None gives it back to its autonomies.
        """
        player = self._player
        do = (lambda: player.release(who)) if sticks is None else (lambda: player.drive(who, sticks))
        self._send([who, sticks], do, is_sure=sticks is None)

    def remove(self, entities: Iterable[int]) -> None:
        """Remove entities at the end of the next step."""
        for who in entities:
            self.publish(RemoveEntity, entity=int(who), why="order")

    def spawn(self, block: str, position: Any) -> None:
        """Ask for an entity of a block before the next step, which is born with the one after it. Errors of the game appear in `notes`.

        Args:
            block: Name of the block. The entity has its heading and speed.
            position: Position [m], (3,), world frame.

        Raises:
            ParameterError: The position is not three finite numbers.
        """
        pos = _checked_point("position", position)
        self._send([block, pos], lambda: self._player.spawn(block, pos))

    def publish_click(self, point: Any) -> None:
        """Publish `WorldPointClicked` with a point [m], (3,), on the network that reaches everyone.

        Raises:
            ParameterError: It is not three finite numbers.
        """
        self.publish(WorldPointClicked, pos=_checked_point("point", point))

    def publish_key(self, key: str) -> None:
        """Publish `CustomKeyPress` on the network that reaches everyone."""
        self.publish(CustomKeyPress, key=key)

    @property
    def warp(self) -> float:
        """Wanted simulated seconds per second; inf, or None when set, is as fast as possible."""
        return self._pace.warp

    @warp.setter
    def warp(self, warp: float | None) -> None:
        self._pace.warp = checked_warp(warp)
        self._pace.restart()
        self._playback.ring()

    def faster(self) -> None:
        """Increase the warp: doubled below 2, then one more."""
        self.warp = faster(self.warp)

    def slower(self) -> None:
        """Decrease the warp: one less above 2, then halved; from as fast as possible, to the speed that was reached."""
        self.warp = slower(self.warp, self.warp_reached)

    def stop(self, timeout: float = 10.0) -> None:
        """End the thread after the present step and release the simulation. A second call does nothing."""
        self._playback.end()
        if self._thread is not None:
            self._thread.join(timeout)
            if self._thread.is_alive():
                return  # the last step takes that long
        self._collector.close()
        self._feed.close()
        self._player.close()

    def settle(self, timeout: float = 60.0) -> bool:
        """Wait until all controls given before were executed; return whether they were within a time [s]."""
        done = threading.Event()

        def tell() -> None:
            self._renew(True)
            done.set()

        self._give(tell)
        return done.wait(timeout)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    # -- state ----------------------------------------------------------------------------------------------------------------------

    def time_of(self, step: int) -> float:
        """Time at the beginning of a step [s]."""
        return float(self._clock.start + step * self._clock.dt)

    def _step_at(self, t: float) -> int:
        try:
            return math.floor((t - self._clock.start) / self._clock.dt + 1e-6)
        except (OverflowError, ValueError):
            raise ParameterError(f"t = {t!r} is not allowed; it takes a time in s") from None

    @property
    def step_number(self) -> int:
        """Number of the step that begins with the visible state; during a seek, where the seek began."""
        return self._playback.shown[0]

    @property
    def t(self) -> float:
        """Time of the visible state [s]."""
        return self.time_of(self._playback.shown[0])

    @property
    def span(self) -> tuple[float, float]:
        """First and last simulated time [s]."""
        return self.time_of(self._player.first_step), self.time_of(self._player.last_step)

    @property
    def seed(self) -> int:
        return int(self.simulation.state.context.seeds[self.world])

    @property
    def is_paused(self) -> bool:
        return self._playback.is_paused

    @property
    def is_over(self) -> bool:
        """The world has ended or a step failed; the game can only be rewound or reset."""
        return self._playback.shown[1]

    @property
    def is_seeking(self) -> bool:
        """A seek is under way; the visible state is the one before it."""
        return self._playback.is_seeking

    @property
    def epoch(self) -> int:
        """Number of seeks and resets; trails end there."""
        return self._playback.epoch

    @property
    def error(self) -> BaseException | None:
        """The error that stopped the game, which can still be rewound; None without one."""
        ended = self.simulation.state.results[self.world]
        return self._playback.error or (ended.error if ended is not None and self.is_over else None)

    @property
    def notes(self) -> list[str]:
        """Notes for the user, one line each."""
        return list(self._player.notes)

    @property
    def warp_reached(self) -> float:
        """Simulated seconds per second over the last second; 0 while paused."""
        return self._playback.speed.speed()[0]

    @property
    def steps_per_second(self) -> float:
        """Steps per second over the last second; 0 while paused."""
        return self._playback.speed.speed()[1]

    @property
    def events(self) -> list[Event]:
        """Events in order, with alarms; after rewinding, also those after the present."""
        alarms = self._player.alarms.events
        return (
            sorted([*self._player.events, *alarms], key=lambda e: e.t)
            if alarms
            else list(self._player.events)
        )

    @property
    def injections(self) -> list[Injection | Setting]:
        """Messages to the plugins, and parameters that were set, from outside."""
        return list(self._player.injections)

    @property
    def curves(self) -> GameCurves:
        """Quantities in each step so far."""
        return self._player.curves

    def watch(self, wanted: Collection[CurveName]) -> None:
        """Add these columns of entities to the curves from the present step on; columns that are not named leave them."""
        self._give(lambda: self._player.curves.watch(wanted, self._player.step))

    # -- observations -------------------------------------------------------------------------------------------------------------

    def frame(self) -> Frame:
        """The latest frame. Frames are made only while requested: the first one after a while may be old."""
        frame = self._taken(self._frame)
        assert frame is not None
        return frame  # type: ignore[no-any-return]

    def frame_at(self, t: float) -> Frame:
        """The last kept frame not after a time [s], while the game goes on; the first for earlier times.

        Values are in single precision, and of a long game not every step is kept; `seek` restores the full state.

        Raises:
            ParameterError: The time is not a number.
        """
        step = max(self._step_at(t), self._player.first_step)
        return self._player.history.at(step) or self.frame()

    def shapes(self) -> tuple[Shape, ...]:
        """Shapes drawn in the last step, and earlier ones that last. Collected only while requested."""
        return self._taken(self._shapes) or ()

    def messages(self) -> list[TopicTraffic]:
        """What plugins publish, by topic. Listened to only while requested: nothing at the first request."""
        return self._taken(self._messages) or []

    def alarms(self) -> list[SpecificationState]:
        """How far the game is from breaking each specification. Alarms are looked for only while it is requested, in all steps so far."""
        return self._taken(self._alarms) or []

    @property
    def robustness(self) -> dict[CurveName, StepSeries]:
        """Robustness of the specifications at each step, up to the last request of `alarms`."""
        return self._player.alarms.series

    def _make_alarms(self) -> list[SpecificationState]:
        player = self._player
        if player.is_broken:
            return self._alarms.value or []
        return player.alarms.read(player.step, player.is_over)

    def result(self) -> WorldResult | None:
        """The provisional result, without state hash until the game ends; None at the first request."""
        return self._taken(self._result)  # type: ignore[no-any-return]

    def entity(self, who: int) -> EntityState | None:
        """Body, plugin columns and messages of an entity; None if it does not exist, and at the first request."""
        if who not in self._entities:
            make = lambda: entity_state(self.simulation, self.world, who)  # noqa: E731
            self._entities[who] = LatestValue(make, STATE_PERIOD, self._playback.ring)
        return self._taken(self._entities[who])  # type: ignore[no-any-return]

    def _taken(self, latest: LatestValue[Any]) -> Any:
        value = latest.take()
        if self._thread is None and not self._is_followed:
            self._renew(True)
            value = latest.value
        return value

    def _renew(self, is_still: bool) -> None:
        """Make requested values; called between steps by the playing thread."""
        playback, version = self._playback, self._playback.version
        if playback.is_seeking:
            return
        values: list[LatestValue[Any]] = [
            self._frame,
            self._result,
            self._shapes,
            self._messages,
            self._alarms,
            *list(self._entities.values()),
        ]
        for latest in values:
            try:
                latest.renew(version, is_still=is_still, always=is_still and latest is self._frame)
            except Exception as error:  # noqa: BLE001 - an error of an observation does not stop the game
                self._player.note(f"an observation failed: {type(error).__name__}: {error}")
        if self._shapes.idle_for < 4.0 * LINGER:
            self._collector.open()
        else:
            self._collector.close()
        if self._messages.idle_for < FORGET_TIME:
            self._feed.open()
        else:
            self._feed.close()
        for who, latest in list(self._entities.items()):
            if latest.idle_for > FORGET_TIME:
                self._entities.pop(who, None)

    def _make_result(self) -> WorldResult | None:
        ended = self.simulation.state.results[self.world]
        if ended is not None and not self.simulation.state.running[self.world]:
            return ended
        try:
            return world_result(self.simulation.state, self.world, "", is_hashed=False)
        except PluginError as error:
            self._player.note(str(error))
            return None

    # -- constants ------------------------------------------------------------------------------------------------------------------

    @property
    def name(self) -> str:
        return self.simulation.mission.name or "mission"

    @cached_property
    def blocks(self) -> list[str]:
        """Names of the blocks; the column `block` of a frame counts in them."""
        return [b.name for b in self.simulation.mission.blocks]

    @cached_property
    def block_teams(self) -> list[int]:
        """Team of each block."""
        return [b.team for b in self.simulation.mission.blocks]

    @cached_property
    def teams(self) -> dict[int, str]:
        """Team number -> names of its blocks, in order of the teams."""
        pairs = list(zip(self.block_teams, self.blocks, strict=True))
        return {
            t: ", ".join(name for team, name in pairs if team == t) for t in sorted(set(self.block_teams))
        }

    @cached_property
    def style(self) -> Style:
        """Colours and models of the entities."""
        blocks = self.simulation.mission.blocks
        plugins = [[type(p).__name__ for p in b.plugins] for b in blocks]
        boxes, views = [b.box for b in blocks], [fields_of_view(b) for b in blocks]
        return Style(self.blocks, self.block_teams, plugins, self.viewer, boxes, views)

    @cached_property
    def scenery(self) -> Scenery:
        """Ground, bases, boundaries and terrain."""
        return scenery_of(self.simulation.mission, self.viewer, ground_map=self._ground_map)


def _checked_point(name: str, point: Any) -> np.ndarray:
    pos = np.array(point, float)
    if pos.shape != (3,) or not np.isfinite(pos).all():
        raise ParameterError(f"{name} = {point!r} is not allowed; it takes x, y, z in m")
    return pos
