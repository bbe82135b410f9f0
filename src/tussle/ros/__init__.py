"""ROS 1: one node of rospy per process, and the topics of robots."""
