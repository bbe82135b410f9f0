"""Simulated time for nodes of ROS 2."""

from __future__ import annotations

from tussle.plugins.links.ros.dds import Ros2Link
from tussle.plugins.stock.interaction.ros_clock_server import ClockOfROS, ClockTopic


class TopicsOfClock(ClockTopic):
    """Topics that pause the simulation and make single steps."""

    link_type = Ros2Link

    def open(self) -> None:
        """Use simulated time, and subscribe to the topics."""
        link, gate = self.link, self.link.gate
        link.is_sim_time = True
        link.subscribe("tussle/pause", "std_msgs/Bool", lambda data: gate.set_paused(any(data[4:5])))
        link.subscribe("tussle/step", "std_msgs/Empty", lambda _: gate.allow())


class ROS2ClockServer(ClockOfROS):
    """Publishes simulated time on /clock after each step. Nodes follow it that have set their parameter use_sim_time.

    Time begins at the mission's start. tussle/pause (std_msgs/Bool) pauses and continues, tussle/step (std_msgs/Empty) makes one step
    while paused: topics, since services differ between the implementations of DDS. In a stack of worlds, the time is that of the
    first one.

    Raises:
        MissingExtraError: Cyclone DDS is not installed.
        RosError: The domain cannot be joined.
    """

    clock_type = TopicsOfClock
