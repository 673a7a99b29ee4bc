#!/usr/bin/python3
"""Node for ROS 1: a vehicle's twist and joint states in; slips, power, margins, odometry's covariance, masks out.

Parameters (private): ../grouser_ros/parameters.py. Topics and meaning: docs/ros.md. Exit codes: 0 ended by a signal or
the master's order, 1 no master, or it went away, 2 a parameter or file is refused."""

import http.client
import pathlib
import sys
import threading
import xmlrpc.client

import rosgraph
import rospy
from geometry_msgs.msg import Twist, TwistStamped, TwistWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid, Odometry
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import String

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))  # in place; an installation has it in its path
import grouser  # noqa: E402
from grouser_msgs.msg import VehicleAnswer, WheelAnswer  # noqa: E402
from grouser_ros import parameters  # noqa: E402
from grouser_ros.speed_mask import fill_grid  # noqa: E402

TWISTS = {"Twist": Twist, "TwistStamped": TwistStamped, "Odometry": Odometry}
QUEUE = 10  # joint states that wait while one is answered
ASK_MASTER = 2.0  # seconds between questions whether it is there


class _Timed(xmlrpc.client.Transport):
    """A master that does not answer is none."""

    def make_connection(self, host):
        connection = super().make_connection(host)
        connection.timeout = 3
        return connection


def master_is_there(uri):
    try:
        return xmlrpc.client.ServerProxy(uri, _Timed()).getPid("/grouser")[0] == 1
    except (OSError, http.client.HTTPException, xmlrpc.client.Error):
        return False


class Node:
    """Subscriptions and publishers of what the parameters ask for."""

    def __init__(self, values):
        self.values = values
        self.monitor, mask = parameters.make(values)
        if mask:
            self.masks = [rospy.Publisher(f"~{name}", OccupancyGrid, queue_size=1, latch=True)
                          for name in ("speed_mask", "keepout_mask")]
            for publisher, cells in zip(self.masks, (mask.speed, mask.keepout)):
                grid = fill_grid(OccupancyGrid(), mask, cells, values["map_frame"])
                grid.header.stamp = rospy.Time.now()
                publisher.publish(grid)
            rospy.loginfo("grouser: speed_mask: m/s = %.9g times the cell", mask.limit / 100)
        if self.monitor:
            self.answers = rospy.Publisher("~answer", VehicleAnswer, queue_size=QUEUE)
            self.twists = rospy.Publisher("~twist", TwistWithCovarianceStamped, queue_size=QUEUE)
            set_twist = lambda m: self.monitor.set_twist(*parameters.twist_of(m))  # noqa: E731
            set_slope = lambda m: self.monitor.set_orientation(  # noqa: E731
                m.orientation.x, m.orientation.y, m.orientation.z, m.orientation.w)
            for topic, kind, take in (("twist", TWISTS[values["twist_type"]], set_twist), ("imu", Imu, set_slope),
                                      ("soil", String, lambda m: self.monitor.set_soil(m.data))):
                rospy.Subscriber(topic, kind, self.reporting(take), queue_size=1)
            rospy.Subscriber("joint_states", JointState, self.answer, queue_size=QUEUE)

    @staticmethod
    def reporting(take):
        """A callback that logs what `take` refuses."""

        def callback(message):
            try:
                take(message)
            except grouser.Error as error:
                rospy.logerr_throttle_identical(1, f"grouser: {error}")

        return callback

    def answer(self, joints):
        out = VehicleAnswer()
        if not self.monitor.answer(out, WheelAnswer, joints.name, joints.position, joints.velocity):
            return
        out.header.stamp, out.header.frame_id = joints.header.stamp, self.values["base_frame"]
        if out.problem:
            rospy.logerr_throttle_identical(1, f"grouser: {out.problem}")
        twist = TwistWithCovarianceStamped()
        twist.header = out.header
        if parameters.fill_twist(twist, out):
            self.twists.publish(twist)
        self.answers.publish(out)


def main():
    uri = rosgraph.get_master_uri()
    if not master_is_there(uri):
        print(f"grouser: no ROS master at {uri} (ROS_MASTER_URI): expected roscore or rosmaster there", file=sys.stderr)
        return 1
    rospy.init_node("grouser")
    try:
        Node(parameters.checked(lambda name, default: rospy.get_param(f"~{name}", default)))
    except grouser.Error as error:
        rospy.logfatal(f"grouser: {error}")
        return 2
    rospy.loginfo("grouser: ready")
    missed, over = 0, threading.Event()
    rospy.on_shutdown(over.set)
    while not over.wait(ASK_MASTER):
        missed = 0 if master_is_there(uri) else missed + 1
        if missed == 2:
            rospy.logfatal(f"grouser: the ROS master at {uri} went away")
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
