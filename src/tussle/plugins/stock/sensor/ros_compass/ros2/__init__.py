"""The direction of North for nodes of ROS 2."""

from tussle.plugins.links.ros.dds import Ros2Link
from tussle.plugins.stock.sensor.ros_compass import CompassByROS


class ROS2Compass(CompassByROS):
    """Publishes the unit vector to the North in the body frame on compass (sensor_msgs/msg/MagneticField), in the robot's namespace.

    Namespace, frame and measurement are those of `ROSCompass`.

    Raises:
        MissingExtraError: Cyclone DDS is not installed.
        RosError: The domain cannot be joined.
    """

    link_type = Ros2Link
