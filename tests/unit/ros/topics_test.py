#!/usr/bin/python3
"""The node's inputs through ROS 1: Twist, Odometry, Imu, soil; which twist belongs to a joint state; what ~twist
claims. Exit code 77: there is no ROS 1."""

import math
import os
import queue
import unittest

from ros_processes import master, node, output, wait_for  # first: exits

import rospy
from geometry_msgs.msg import Twist, TwistWithCovarianceStamped
from grouser_msgs.msg import VehicleAnswer
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import String
from vehicles import quaternion

import grouser

HUSKY = grouser.VEHICLE_DIR / "husky.vehicle.yaml"
WHEELS = ("front_left", "front_right", "rear_left", "rear_right")
TOPICS = {"twist": Twist, "odom": Odometry, "imu": Imu, "soil": String, "joint_states": JointState}


class TopicsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        env, cls.folder, _ = cls.enterClassContext(master())
        os.environ.update({k: v for k, v in env.items() if k.startswith("ROS_")})
        rospy.init_node("topics_test", disable_signals=True)
        cls.addClassCleanup(rospy.signal_shutdown, "the tests are over")
        cls.send = {name: rospy.Publisher(f"/{name}", kind, queue_size=20) for name, kind in TOPICS.items()}
        cls.answers = {"plain": queue.Queue(), "odometry": queue.Queue()}
        cls.twists, heard = queue.Queue(), []
        for name, given in (("plain", ()), ("odometry", ("_twist_type:=Odometry", "twist:=odom"))):
            cls.enterClassContext(node(env, cls.folder, f"_vehicle:={HUSKY}", "_margins:=false", *given, name=name))
            heard.append(rospy.Subscriber(f"/{name}/answer", VehicleAnswer, cls.answers[name].put))
        heard.append(rospy.Subscriber("/plain/twist", TwistWithCovarianceStamped, cls.twists.put))
        wait_for("the nodes' topics", lambda: all(s.get_num_connections() for s in heard) and all(
            p.get_num_connections() == (1 if name in ("twist", "odom") else 2) for name, p in cls.send.items()))

    def answer(self, accept=lambda answer: True, before=lambda: None, stamp=100.0, node="plain"):
        """The first answer of a node to a joint state of this stamp that is accepted; before() is called before each."""
        joints, found = JointState(name=WHEELS, velocity=[3.0] * 4), []
        joints.header.stamp = rospy.Time.from_sec(stamp)

        def accepted():
            before()
            self.send["joint_states"].publish(joints)
            while not self.answers[node].empty():
                answer = self.answers[node].get()
                if answer.header.stamp == joints.header.stamp and accept(answer):
                    found.append(answer)
            return bool(found)

        wait_for(f"an answer of node {node}", accepted)
        return found[0]

    def imu(self, stamp, orientation, first_covariance=0.0):
        message = Imu()
        message.header.stamp = rospy.Time.from_sec(stamp)
        q = message.orientation
        q.x, q.y, q.z, q.w = orientation
        message.orientation_covariance[0] = first_covariance
        self.send["imu"].publish(message)

    def test_plain_twist(self):
        twist = Twist()
        twist.linear.x, twist.angular.z = 0.4, 0.1
        out = self.answer(lambda a: a.motion_from == a.TWIST, lambda: self.send["twist"].publish(twist))
        self.assertEqual((out.v_x, out.v_y, out.yaw_rate, out.problem), (0.4, 0.0, 0.1, ""))
        self.answer(lambda a: a.motion_from == a.JOINT_STATES)  # none comes any more

    def test_odometry_nearest_by_stamp(self):
        def send():
            for k in range(11):
                odometry = Odometry()
                odometry.header.stamp = rospy.Time.from_sec(200 + 0.1 * k)
                odometry.twist.twist.linear.x = 0.3 + 0.01 * k
                self.send["odom"].publish(odometry)

        self.answer(lambda a: a.v_x == 0.3 + 0.01 * 10, send, 201.0, "odometry")  # the last one has come
        for k in (2, 7):
            out = self.answer(stamp=200 + 0.1 * k, node="odometry")
            self.assertEqual((out.motion_from, out.v_x), (out.TWIST, 0.3 + 0.01 * k))
        self.assertEqual(self.answer(stamp=202.0, node="odometry").motion_from, VehicleAnswer.JOINT_STATES)

    def test_imu(self):
        out = self.answer(lambda a: a.slope_from == a.IMU, lambda: self.imu(300, quaternion(0.1, -0.05)), 300)
        self.assertAlmostEqual(out.grade, 0.1, delta=1e-12)
        self.assertAlmostEqual(out.bank, -0.05, delta=1e-12)

        def without_orientation():
            self.imu(400, (0, 0, 0, 0), -1.0)
            self.imu(401, quaternion(0.2, 0))  # when this one is answered, the one before has been read

        self.answer(lambda a: abs(a.grade - 0.2) < 1e-12, without_orientation, 401)
        out = self.answer(stamp=400.1)
        self.assertEqual((out.problem, out.slope_from), ("", out.LEVEL))
        refused = self.answer(lambda a: a.problem, lambda: self.imu(500, quaternion(0.0, math.radians(170))), 500)
        self.assertRegex(refused.problem, "imu: orientation: .* z axis points down")
        self.assertEqual(self.answer(stamp=500.6).problem, "")  # for no longer than it counts

    def test_soil(self):
        self.answer(lambda a: a.soil == "ice", lambda: self.send["soil"].publish("ice"))
        wait_for("the node's log", lambda: self.send["soil"].publish("mud") or (
            "soil: got mud, expected" in output(self.folder, "plain")))
        out = self.answer()
        self.assertEqual((out.soil, out.problem), ("ice", ""))
        self.answer(lambda a: a.soil == "asphalt", lambda: self.send["soil"].publish("asphalt"))

    def test_no_twist_is_claimed_to_be_certain(self):
        """By default: straight on, where the ground has no say in the yaw rate."""
        out, found = self.answer(stamp=600), []

        def came():
            while not self.twists.empty():
                found.append(self.twists.get())
            return any(t.header.stamp == out.header.stamp for t in found)

        wait_for("a twist", came)
        covariance = next(t for t in found if t.header.stamp == out.header.stamp).twist.covariance
        self.assertTrue(all(1e-4 <= covariance[k] < 1e-2 for k in (0, 7, 35)))
        self.assertEqual([covariance[k] for k in (14, 21, 28)], [1e6] * 3)


if __name__ == "__main__":
    unittest.main()
