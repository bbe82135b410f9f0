"""Robots that are driven by nodes of ROS 2."""

from tussle.plugins.links.ros.dds import Ros2Link
from tussle.plugins.stock.autonomy.ros_autonomy import PublishedByROS


class ROS2Autonomy(PublishedByROS):
    """Connects a robot to ROS 2: cmd_vel moves it; odom, base_pose_ground_truth, base_scan and tf are published.

    Topics, frames and times are those of `ROSAutonomy`; stamps are simulated time with `ROS2ClockServer`, and the wall clock's
    otherwise. The simulation takes part in the domain ROS_DOMAIN_ID, on the loopback interface unless CYCLONEDDS_URI configures
    Cyclone DDS otherwise. [ROS 2](../ros2.md) tells more.

    With `lockstep`, each step waits until each robot has received a command after its odom of that step.

    Raises:
        MissingExtraError: Cyclone DDS is not installed.
        RosError: The domain cannot be joined.
    """

    link_type = Ros2Link
