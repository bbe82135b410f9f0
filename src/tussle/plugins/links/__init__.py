"""Links to other systems: ROS, autopilots, gRPC."""
