"""Steps of a simulation whose robots are driven by nodes of ROS, for ROS 1 and ROS 2."""

from __future__ import annotations

import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np

from tussle.pacing import POLL_PERIOD

NANO = 1_000_000_000


class Transform(NamedTuple):
    """Pose of one frame in another.

    Attributes:
        parent: The other frame.
        child: The frame.
        stamp: Time, as `NodeLink.stamp` gives it.
        pose: Position [m] and attitude (w, x, y, z), 7 numbers.
    """

    parent: str
    child: str
    stamp: Any
    pose: list[float]


def of_equal_axes(variance: float) -> tuple[float, ...]:
    """Covariance matrix, row by row, of three independent axes with the same variance."""
    return variance, 0.0, 0.0, 0.0, variance, 0.0, 0.0, 0.0, variance


class StepGate:
    """Pauses a simulation between two steps and lets single steps pass.

    Args:
        rest: Waits for some seconds, or until messages have come; by default until the gate has changed.

    Attributes:
        is_paused: Whether the simulation waits at the gate.
    """

    def __init__(self, rest: Callable[[float], object] | None = None) -> None:
        self.is_paused = False
        self._changed = threading.Condition()
        self._rest = rest or self._changed.wait
        self._allowed = self._arrived = 0
        self._is_waiting = self._is_closed = False

    def set_paused(self, is_paused: bool) -> None:
        """Pause or continue."""
        with self._changed:
            self.is_paused, self._allowed = is_paused, 0
            self._changed.notify_all()

    def allow(self) -> None:
        """Let one step pass if the simulation is paused."""
        with self._changed:
            self._allowed += self.is_paused
            self._changed.notify_all()

    def step(self) -> bool:
        """Let one step pass and return after it; false if the simulation is not paused, or has ended."""
        with self._changed:
            if not self.is_paused or self._is_closed:
                return False
            self._allowed += 1
            goal = self._arrived + self._allowed + (not self._is_waiting)
            self._changed.notify_all()
            self._changed.wait_for(lambda: self._arrived >= goal or self._is_closed or not self.is_paused)
            return self._arrived >= goal

    def enter(self, is_interrupted: Callable[[], bool]) -> None:
        """Wait while paused, until a step is allowed or the user interrupts; called once per step."""
        with self._changed:
            self._arrived += 1
            self._is_waiting = True
            self._changed.notify_all()
            while self.is_paused and not (self._allowed or self._is_closed or is_interrupted()):
                self._rest(POLL_PERIOD)
            self._is_waiting = False
            self._allowed = max(self._allowed - 1, 0)

    def close(self) -> None:
        """Let all pass from now on."""
        with self._changed:
            self._is_closed = True
            self._changed.notify_all()


class NodeLink(ABC):
    """The topics of one simulation; abstract. Topics are named without leading slash.

    Args:
        rest: Waits for some seconds, or until messages have come; by default until `news` is notified by other threads.

    Attributes:
        groups: Plugins whose `await_peers(g)` and `publish_state(g)` are called at the beginning of each step, and their views.
        gate: Where the simulation waits between steps.
        news: Notified when a command has come.
        lost: Why no message can come any more; empty while they can.
        is_sim_time: Whether stamps are simulated time; otherwise they are the wall clock's.
        namespaces: Id -> namespace of each robot that publishes its frames, which frames of its sensors have too.
        system: Name of the kind of ROS.
        settling_time: Time after which peers that are known here know this link too [s].
    """

    system: ClassVar[str]
    settling_time: ClassVar[float] = 0.5

    def __init__(self, rest: Callable[[float], object] | None = None) -> None:
        self.groups: dict[int, tuple[Any, Any]] = {}
        self.news, self.lost, self.is_sim_time = threading.Condition(), "", False
        self.gate, self._rest = StepGate(rest), rest or self.news.wait
        self.namespaces: dict[int, str] = {}
        self._topics: dict[str, Any] = {}
        self._step = -1

    @classmethod
    def of(cls, share: Callable[..., Any]) -> Self:
        """The link of a simulation; `share` is that of a context or of the row of a handle."""
        link: Self = share(cls.system, cls)
        return link

    def base_link(self, id_: int, namespace: str) -> str:
        """The frame of a robot's body; below `namespace` if the robot publishes none."""
        return f"{self.namespaces.get(id_, namespace)}/base_link"

    @abstractmethod
    def time_of(self, seconds: int, nanoseconds: int) -> Any:
        """Return a time as messages hold it."""

    @abstractmethod
    def odometry(
        self, topic: str, frame: str, child: str
    ) -> Callable[[Any, list[float], np.ndarray | None], None]:
        """Announce odometry; returns publish(stamp, state, covariances).

        A state is position, attitude (w, x, y, z), velocity and angular velocity in the body frame, 13 numbers. Covariances are those of
        pose and twist, (2, 36), or None where both are exact.
        """

    @abstractmethod
    def scan(self, topic: str, frame: str) -> Callable[[Any, Any, np.ndarray], None]:
        """Announce scans; returns publish(stamp, about, ranges), where `about` is the `ScanPattern`."""

    @abstractmethod
    def transforms(self) -> Callable[[list[Transform]], None]:
        """Announce tf; returns publish(transforms)."""

    @abstractmethod
    def imu(self, topic: str, frame: str) -> Callable[..., None]:
        """Announce imu; returns publish(stamp, quat, rate, force, variances).

        These are attitude, rotation and specific force in the body frame, and the variances of an axis of the rotation and of the force.
        """

    @abstractmethod
    def compass(self, topic: str, frame: str) -> Callable[[Any, list[float]], None]:
        """Announce compass; returns publish(stamp, field), a vector in the body frame."""

    @abstractmethod
    def clock(self) -> Callable[[Any], None]:
        """Announce clock; returns publish(stamp)."""

    @abstractmethod
    def twist(self, topic: str, take: Callable[[tuple[float, ...]], None], is_stamped: bool) -> Any:
        """Call take(values) for each command, six numbers of a Twist or a TwistStamped. Returns the subscriber."""

    @abstractmethod
    def unsubscribe(self, subscriber: Any) -> None:
        """Take no more messages for a subscriber, whose robot has gone."""

    @abstractmethod
    def collect(self) -> None:
        """Take the messages that have come."""

    def stamp(self, t: float) -> Any:
        """Time of ROS for a simulated time [s]."""
        nanoseconds = round(t * NANO) if self.is_sim_time else time.time_ns()
        return self.time_of(*divmod(max(nanoseconds, 0), NANO))

    def begin_step(self, g: Any) -> None:
        """Publish the states of all robots, then wait while paused; only the first call in a step does so."""
        step = int(g.step_count[0])
        if step != self._step:
            self._step = step
            transforms: list[Transform] = []
            living = [(plugin, view) for plugin, view in self.groups.values() if view.n]
            for plugin, view in living:
                plugin.await_peers(view)
            self.collect()
            for plugin, view in living:
                transforms += plugin.publish_state(view)
            if transforms:
                self.transforms()(transforms)
            self.gate.enter(g.context.is_interrupted)
            self.collect()

    def has_reader(self, topics: Iterable[str]) -> bool:
        """Return True if somebody has subscribed to one of these topics."""
        return any(self._topics[topic].get_num_connections() for topic in topics)

    def wait_for(
        self, is_there: Callable[[], bool], timeout: float, is_interrupted: Callable[[], bool]
    ) -> bool:
        """Wait for a command until is_there(); false after `timeout` [s], when interrupted, or if messages cannot come."""
        limit = time.monotonic() + timeout
        with self.news:
            while not is_there():
                left = limit - time.monotonic()
                if left <= 0.0 or self.lost or is_interrupted():
                    return False
                self._rest(min(left, POLL_PERIOD))
        return True
