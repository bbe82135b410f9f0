"""A node of ROS 1 that knows nothing of tussle: it answers each odom with a command, and prints what it heard."""

import json
import sys

import rospy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan
from tf2_msgs.msg import TFMessage

COMMANDS = {"entity1": (2.0, 0.0), "entity2": (1.0, 0.2)}


def tell(kind, **values):
    print(json.dumps({"kind": kind, **values}), flush=True)


def main():
    rospy.init_node("peer", disable_rostime=True)
    senders = {name: rospy.Publisher(f"/{name}/cmd_vel", Twist, queue_size=10) for name in COMMANDS}

    def on_odom(message, name):
        pose, twist = message.pose.pose, message.twist.twist
        p, q, v, w = pose.position, pose.orientation, twist.linear, twist.angular
        tell(
            "odom", name=name, stamp=message.header.stamp.to_nsec(), frames=[message.header.frame_id, message.child_frame_id],
            state=[p.x, p.y, p.z, q.w, q.x, q.y, q.z, v.x, v.y, v.z, w.x, w.y, w.z],
        )  # fmt: skip
        command = Twist()
        command.linear.x, command.angular.z = COMMANDS[name]
        senders[name].publish(command)

    def on_scan(message):
        tell(
            "scan",
            frame=message.header.frame_id,
            ranges=message.ranges,
            angles=[message.angle_min, message.angle_max],
        )

    def on_tf(message):
        tell("tf", frames=[[t.header.frame_id, t.child_frame_id] for t in message.transforms])

    rospy.Subscriber("/entity1/base_scan", LaserScan, on_scan)
    rospy.Subscriber("/tf", TFMessage, on_tf)
    rospy.Subscriber("/clock", Clock, lambda message: tell("clock", stamp=message.clock.to_nsec()))
    for name in COMMANDS:
        rospy.Subscriber(f"/{name}/odom", Odometry, on_odom, name)
    sys.stdin.read()


main()
