"""Topics of one simulation on the node of this process."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable
from typing import Any

from tussle.ros.node import MASTER_TIMEOUT, master_fault, master_uri, started_node

QUEUE = 10
"""Messages that wait for a slow subscriber; older ones are dropped, so that it does not delay the simulation."""
WATCH_PERIOD = 1.0  # [s] between two questions to the master
NAP = 0.05  # [s] longest wait before Ctrl-C is noticed
NANO = 1_000_000_000


class StepGate:
    """Pauses a simulation between two steps and lets single steps pass.

    Attributes:
        is_paused: Whether the simulation waits at the gate.
    """

    def __init__(self) -> None:
        self.is_paused = False
        self._changed = threading.Condition()
        self._allowed = self._arrived = 0
        self._is_waiting = self._is_closed = False

    def set_paused(self, is_paused: bool) -> None:
        """Pause or continue."""
        with self._changed:
            self.is_paused, self._allowed = is_paused, 0
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
                self._changed.wait(NAP)
            self._is_waiting = False
            self._allowed = max(self._allowed - 1, 0)

    def close(self) -> None:
        """Let all pass from now on."""
        with self._changed:
            self._is_closed = True
            self._changed.notify_all()


class RosLink:
    """The topics, services and parameters of one simulation.

    Attributes:
        ros: rospy and message types.
        groups: Plugins whose `await_peers(g)` and `publish_state(g)` are called at the beginning of each step, and their views.
        gate: Where the simulation waits between steps.
        news: Notified when a command has come.
        lost: Why the master is gone; empty while it answers.
        is_sim_time: Whether stamps are simulated time; otherwise they are the wall clock's.

    Raises:
        MissingExtraError: rospy is not installed.
        RosError: The master does not answer.
    """

    def __init__(self) -> None:
        self.ros = started_node()
        self.groups: dict[int, tuple[Any, Any]] = {}
        self.gate, self.news, self.lost = StepGate(), threading.Condition(), ""
        self.is_sim_time = bool(self.ros.rospy.get_param("/use_sim_time", False))
        self._topics: dict[str, Any] = {}
        self._open: list[Callable[[], Any]] = []
        self._step = -1
        self._is_over = threading.Event()
        self._watch = threading.Thread(target=self._watch_master, name="ROS master", daemon=True)
        self._watch.start()

    @classmethod
    def of(cls, share: Callable[..., Any]) -> RosLink:
        """The link of a simulation; `share` is that of a context or of the row of a handle."""
        link: RosLink = share("ROS 1", cls)
        return link

    def publish(self, topic: str, message: Any) -> None:
        """Publish a message; its topic is advertised before the first one, or by `advertise`."""
        (self._topics.get(topic) or self.advertise(topic, type(message))).publish(message)

    def advertise(self, topic: str, type_: Any) -> Any:
        """Announce a topic, so that subscribers can connect before its first message."""
        if topic not in self._topics:
            publisher = self.ros.rospy.Publisher(f"/{topic}", type_, queue_size=QUEUE)
            self._topics[topic] = publisher
            self._open.append(publisher.unregister)
        return self._topics[topic]

    def subscribe(self, topic: str, type_: Any, callback: Callable[[Any], None], queue: int = QUEUE) -> Any:
        """Call callback(message), in another thread, for each message. Returns the subscriber."""
        # Without tcp_nodelay, a small message such as a command may wait for 40 ms.
        subscriber = self.ros.rospy.Subscriber(
            f"/{topic}", type_, callback, queue_size=queue, tcp_nodelay=True
        )
        self._open.append(subscriber.unregister)
        return subscriber

    def offer(self, service: str, type_: Any, handler: Callable[[Any], Any]) -> None:
        """Offer a service of ROS; handler(request) is called in another thread."""
        self._open.append(self.ros.rospy.Service(f"/{service}", type_, handler).shutdown)

    def use_sim_time(self) -> None:
        """Stamp with simulated time, and tell all nodes that start from now on. The parameter is as before after the simulation."""
        self.is_sim_time = True
        before = self.ros.rospy.get_param("/use_sim_time", False)
        self.ros.rospy.set_param("/use_sim_time", True)
        self._open.append(lambda: self.ros.rospy.set_param("/use_sim_time", before))

    def stamp(self, t: float) -> Any:
        """Time of ROS for a simulated time [s]."""
        nanoseconds = round(t * NANO) if self.is_sim_time else time.time_ns()
        return self.ros.Time(*divmod(max(nanoseconds, 0), NANO))

    def begin_step(self, g: Any) -> None:
        """At the first call in a step: publish the states of all robots, then wait while paused."""
        step = int(g.step_count[0])
        if step != self._step:
            self._step = step
            transforms: list[Any] = []
            living = [(plugin, view) for plugin, view in self.groups.values() if view.n]
            for plugin, view in living:
                plugin.await_peers(view)
            for plugin, view in living:
                transforms += plugin.publish_state(view)
            if transforms:
                self.publish("tf", self.ros.TFMessage(transforms))
            self.gate.enter(g.context.is_interrupted)

    def has_reader(self, topics: Iterable[str]) -> bool:
        """Return True if somebody has subscribed to one of these topics."""
        return any(self._topics[topic].get_num_connections() for topic in topics)

    def wait_for(
        self, is_there: Callable[[], bool], timeout: float, is_interrupted: Callable[[], bool]
    ) -> bool:
        """Wait for a command until is_there(); false after `timeout` [s], when interrupted, or without a master."""
        limit = time.monotonic() + timeout
        with self.news:
            while not is_there():
                left = limit - time.monotonic()
                if left <= 0.0 or self.lost or is_interrupted():
                    return False
                self.news.wait(min(left, NAP))
        return True

    def end(self) -> None:
        """Withdraw topics, services and parameters; called when the simulation is closed."""
        self._is_over.set()
        self.gate.close()
        self._watch.join(2.0 * MASTER_TIMEOUT)
        if not (self.lost or master_fault()):
            for withdraw in reversed(self._open):
                withdraw()

    def _watch_master(self) -> None:
        while not self._is_over.wait(WATCH_PERIOD):
            if fault := master_fault():
                self.lost = f"the ROS master at {master_uri()} is gone ({fault})"
                return
