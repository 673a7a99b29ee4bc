#!/usr/bin/env python3
"""Node for ROS 2, the twin of ros1_node.py: the same parameters, topics and modules. NOT RUN: Debian 12 has no rclpy.
What it shares with ros1_node.py, all but this file, is tested there. docs/ros.md."""

import sys

import grouser
import rclpy
from geometry_msgs.msg import Twist, TwistStamped, TwistWithCovarianceStamped
from grouser_msgs.msg import VehicleAnswer, WheelAnswer
from grouser_ros import parameters
from grouser_ros.speed_mask import fill_grid
from nav_msgs.msg import OccupancyGrid, Odometry
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import String

TWISTS = {"Twist": Twist, "TwistStamped": TwistStamped, "Odometry": Odometry}
QUEUE = 10


class GrouserNode(Node):
    def __init__(self):
        super().__init__("grouser")
        self.values = parameters.checked(lambda name, default: self.declare_parameter(name, default).value)
        self.monitor, mask = parameters.make(self.values)
        if mask:
            latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
            for name, cells in (("speed_mask", mask.speed), ("keepout_mask", mask.keepout)):
                grid = fill_grid(OccupancyGrid(), mask, cells, self.values["map_frame"])
                grid.header.stamp = self.get_clock().now().to_msg()
                self.create_publisher(OccupancyGrid, f"~/{name}", latched).publish(grid)
            self.get_logger().info(f"speed_mask: m/s = {mask.limit / 100:.9g} times the cell")
        if self.monitor:
            self.answers = self.create_publisher(VehicleAnswer, "~/answer", QUEUE)
            self.twists = self.create_publisher(TwistWithCovarianceStamped, "~/twist", QUEUE)
            self.create_subscription(TWISTS[self.values["twist_type"]], "twist", self.take_twist, 1)
            self.create_subscription(Imu, "imu", self.take_imu, qos_profile_sensor_data)
            self.create_subscription(String, "soil", self.take_soil, 1)
            self.create_subscription(JointState, "joint_states", self.answer, qos_profile_sensor_data)

    def take(self, setter, *values):
        try:
            setter(*values)
        except grouser.Error as error:
            self.get_logger().error(str(error), throttle_duration_sec=1.0)

    def take_twist(self, message):
        self.take(self.monitor.set_twist, *parameters.twist_of(message))

    def take_imu(self, message):
        q = message.orientation
        self.take(self.monitor.set_orientation, q.x, q.y, q.z, q.w)

    def take_soil(self, message):
        self.take(self.monitor.set_soil, message.data)

    def answer(self, joints):
        out = VehicleAnswer()
        if not self.monitor.answer(out, WheelAnswer, joints.name, joints.position, joints.velocity):
            return
        out.header.stamp, out.header.frame_id = joints.header.stamp, self.values["base_frame"]
        if out.problem:
            self.get_logger().error(out.problem, throttle_duration_sec=1.0)
        twist = TwistWithCovarianceStamped()
        twist.header = out.header
        if parameters.fill_twist(twist, out):
            self.twists.publish(twist)
        self.answers.publish(out)


def main():
    rclpy.init()
    try:
        rclpy.spin(GrouserNode())
    except grouser.Error as error:
        print(f"grouser: {error}", file=sys.stderr)
        return 2
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main())
