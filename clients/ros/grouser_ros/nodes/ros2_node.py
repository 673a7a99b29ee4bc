#!/usr/bin/env python3
"""Node for ROS 2, the twin of ros1_node.py: the same parameters, topics and modules. NOT RUN: Debian 12 has no rclpy.
What it shares with ros1_node.py, all but this file, is tested there. docs/ros.md."""

import sys
import types

import grouser
import rclpy
from grouser_ros.node import QUEUE, Node
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.executors import ExternalShutdownException
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

SENSOR = QoSProfile(depth=QUEUE, reliability=ReliabilityPolicy.BEST_EFFORT)  # hears reliable publishers as well
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
ANY_TYPE = ParameterDescriptor(dynamic_typing=True)  # 1 for 1.0; parameters.py checks


def ros_of(node):
    """As of grouser_ros/node.py."""
    return types.SimpleNamespace(
        get=lambda name, default: node.declare_parameter(name, default, ANY_TYPE).value,
        publisher=lambda name, kind, latched: node.create_publisher(kind, f"~/{name}", LATCHED if latched else QUEUE),
        subscribe=lambda topic, kind, callback: node.create_subscription(
            kind, topic, callback, QUEUE if topic == "soil" else SENSOR),
        now=lambda: node.get_clock().now().to_msg(),
        info=lambda text: node.get_logger().info(text),
        error=lambda text: node.get_logger().error(text, throttle_duration_sec=1.0))


def main():
    rclpy.init()
    try:
        node = rclpy.create_node("grouser")
        Node(ros_of(node))
        rclpy.spin(node)
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
