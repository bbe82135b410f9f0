"""Specific force and rotation for nodes of ROS 2."""

from tussle.plugins.links.ros.dds import Ros2Link
from tussle.plugins.stock.sensor.ros_imu_sensor import ImuByROS


class ROS2IMUSensor(ImuByROS):
    """Publishes specific force, angular velocity and attitude on imu (sensor_msgs/msg/Imu), in the robot's namespace.

    Measurements, errors and frame are those of `ROSIMUSensor`.

    Raises:
        MissingExtraError: Cyclone DDS is not installed.
        RosError: The domain cannot be joined.
    """

    link_type = Ros2Link
