// A node of ROS 1 in C++: each odom of a robot is answered with its own turn of speed, and told on standard output.
#include <cstdio>

#include <geometry_msgs/Twist.h>
#include <nav_msgs/Odometry.h>
#include <ros/ros.h>
#include <sensor_msgs/LaserScan.h>

int main(int argc, char** argv) {
  ros::init(argc, argv, "driver");
  ros::NodeHandle node;
  ros::Publisher command = node.advertise<geometry_msgs::Twist>("cmd_vel", 1);
  ros::Subscriber odom = node.subscribe<nav_msgs::Odometry>(
      "odom", 10,
      [&](const nav_msgs::Odometry::ConstPtr& message) {
        const auto& at = message->pose.pose.position;
        std::printf("odom %.17g %.17g %.17g %.9f\n", at.x, at.y, at.z, message->header.stamp.toSec());
        std::fflush(stdout);
        geometry_msgs::Twist twist;
        twist.linear.x = 2.0;
        command.publish(twist);
      },
      ros::VoidConstPtr(), ros::TransportHints().tcpNoDelay());
  ros::Subscriber scan = node.subscribe<sensor_msgs::LaserScan>(
      "base_scan", 10, [&](const sensor_msgs::LaserScan::ConstPtr& message) {
        std::printf("scan %zu\n", message->ranges.size());
        std::fflush(stdout);
      });
  ros::spin();
}
