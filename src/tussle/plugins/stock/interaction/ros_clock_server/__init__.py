"""Simulated time for nodes of ROS 1, and what the clock of ROS 2 shares with it."""

from __future__ import annotations

from typing import Any, ClassVar

from tussle.api import Interaction, Param, WorldView
from tussle.plugins.links.ros.link import RosLink
from tussle.plugins.links.ros.steps import NodeLink


class ClockOfROS(Interaction):
    """Columns and methods of clocks; abstract."""

    grade = "external"
    awaits = "ROS"
    clock_type: ClassVar[type[ClockTopic]]
    """Its part outside the simulation."""

    start_paused = Param(False, doc="Wait for tussle/step or tussle/pause before the first step.")

    def start(self, w: WorldView) -> None:
        """Publish the first time."""
        self._tick(w, self._clock(w))

    def step(self, w: WorldView) -> None:
        """Publish the time; wait while paused if no robot does."""
        clock = self._clock(w)
        link = clock.link
        if link.lost and w.n:
            w.fail(0, link.lost)
        self._tick(w, clock)
        if not link.groups:
            link.gate.enter(w.context.is_interrupted)
            link.collect()

    def _clock(self, w: WorldView) -> ClockTopic:
        share, type_ = w.context.share, self.clock_type
        clock: ClockTopic = share(
            f"{type_.link_type.system} clock",
            lambda: type_(type_.link_type.of(share), bool(self.start_paused[0])),
        )
        return clock

    def _tick(self, w: WorldView, clock: ClockTopic) -> None:
        clock.publish(clock.link.stamp(float(w.t[0])))


class ClockTopic:
    """Topic and control of a simulation's clock; abstract.

    Args:
        link: The link of the simulation.
        is_paused: Whether it waits before the first step.

    Attributes:
        publish: Publishes a stamp.
    """

    link_type: ClassVar[type[NodeLink]]

    def __init__(self, link: Any, is_paused: bool) -> None:
        self.link = link
        self.publish = link.clock()
        link.gate.set_paused(is_paused)
        self.open()

    def open(self) -> None:
        """Use simulated time, and let nodes pause the simulation."""
        raise TypeError(f"{type(self).__name__} cannot be controlled")

    def end(self) -> None:
        """Do nothing: the link withdraws what is open."""


class ServicesOfClock(ClockTopic):
    """Services of ROS 1."""

    link_type = RosLink

    def open(self) -> None:
        """Set use_sim_time, and offer the services."""
        link, ros = self.link, self.link.ros
        link.use_sim_time()
        link.offer("tussle/pause", ros.SetBool, self._pause)
        link.offer("tussle/step", ros.Trigger, self._step)

    def _pause(self, request: Any) -> tuple[bool, str]:
        self.link.gate.set_paused(bool(request.data))
        return True, ""

    def _step(self, _: Any) -> tuple[bool, str]:
        is_done = self.link.gate.step()
        return is_done, "" if is_done else "the simulation is not paused, or has ended"


class ROSClockServer(ClockOfROS):
    """Publishes simulated time on /clock after each step, and sets the ROS parameter use_sim_time until the simulation is closed.

    Time begins at the mission's start (in the existing system, at the wall clock's time). Services: tussle/pause (std_srvs/SetBool)
    pauses and continues, tussle/step (std_srvs/Trigger) makes one step while paused and returns when the states after it are published.
    In a stack of worlds, the time is that of the first one.

    Raises:
        MissingExtraError: rospy is not installed.
        RosError: No ROS master answers.
    """

    clock_type = ServicesOfClock
