"""Simulated time for nodes of ROS 1."""

from __future__ import annotations

from typing import Any

from tussle.api import Interaction, Param, WorldView
from tussle.ros.link import RosLink


class ROSClockServer(Interaction):
    """Publishes simulated time on /clock after each step, and sets the ROS parameter use_sim_time until the simulation is closed.

    Time begins at the mission's start (in the existing system, at the wall clock's time). Services: tussle/pause (std_srvs/SetBool)
    pauses and continues, tussle/step (std_srvs/Trigger) makes one step while paused and returns when the states after it are published.
    In a stack of worlds, the time is that of the first one.

    Raises:
        MissingExtraError: rospy is not installed.
        RosError: No ROS master answers.
    """

    grade = "external"

    start_paused = Param(False, doc="Wait for tussle/step or tussle/pause before the first step.")

    def start(self, w: WorldView) -> None:
        """Set the parameter, offer the services, and publish the first time."""
        link = w.context.share(
            "ROS clock", lambda: _Clock(RosLink.of(w.context.share), bool(self.start_paused[0]))
        ).link
        self._tick(w, link)

    def step(self, w: WorldView) -> None:
        """Publish the time; wait while paused if no robot does."""
        link = RosLink.of(w.context.share)
        if link.lost and w.n:
            w.fail(0, link.lost)
        self._tick(w, link)
        if not link.groups:
            link.gate.enter(w.context.is_interrupted)

    def _tick(self, w: WorldView, link: RosLink) -> None:
        link.publish("clock", link.ros.Clock(link.stamp(float(w.t[0]))))


class _Clock:
    """Services of a simulation's clock."""

    def __init__(self, link: RosLink, is_paused: bool) -> None:
        self.link = link
        link.use_sim_time()
        link.gate.set_paused(is_paused)
        ros = link.ros
        link.advertise("clock", ros.Clock)
        link.offer("tussle/pause", ros.SetBool, self._pause)
        link.offer("tussle/step", ros.Trigger, self._step)

    def _pause(self, request: Any) -> tuple[bool, str]:
        self.link.gate.set_paused(bool(request.data))
        return True, ""

    def _step(self, _: Any) -> tuple[bool, str]:
        is_done = self.link.gate.step()
        return is_done, "" if is_done else "the simulation is not paused, or has ended"

    def end(self) -> None:
        """Do nothing: the link withdraws the services."""
