"""ROS 1 by one node of rospy per process, ROS 2 by Cyclone DDS, and the topics of robots, which both share."""
