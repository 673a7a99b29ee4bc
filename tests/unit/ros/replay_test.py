#!/usr/bin/python3
"""clients/ros in ROS 1: a bag replayed on loopback to the node, its answers beside direct calls of the library; bad
messages; masks; no master, a silent one, one that goes away. Exit code 77: there is no ROS 1."""

import csv
import math
import os
import pathlib
import queue
import socket
import subprocess
import unittest

from ros_processes import CLIENT, NODE, environment, free_port, master, node, output, running, wait_for  # first: exits

import numpy as np
import rosbag
import rospy
from geometry_msgs.msg import TwistStamped, TwistWithCovarianceStamped
from grouser_msgs.msg import VehicleAnswer
from definitions import skip
from nav_msgs.msg import OccupancyGrid
from sensor_msgs.msg import JointState

import grouser
from grouser import Motions, Reason, Vehicle, VehicleSolver

HUSKY = grouser.VEHICLE_DIR / "husky.vehicle.yaml"
WHEELS = ("front_left", "front_right", "rear_left", "rear_right")
PARAMETERS = (f"_vehicle:={HUSKY}", "_soil:=floor", "_twist_type:=TwistStamped",
              f"_joints:=[{', '.join(f'{w}:{w}_wheel' for w in WHEELS)}]", "_least_variance:=[1.0e-6, 2.0e-6, 3.0e-6]")
SECONDS, RATE = 3, 20  # of the bag


def stamp(message):
    return message.header.stamp.to_nsec()


class ReplayTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.env, folder, _ = cls.enterClassContext(master())
        cls.folder = pathlib.Path(folder)
        os.environ.update({k: v for k, v in cls.env.items() if k.startswith("ROS_")})
        cls.enterClassContext(node(cls.env, cls.folder, *PARAMETERS))
        rospy.init_node("replay_test", disable_signals=True)
        cls.addClassCleanup(rospy.signal_shutdown, "the tests are over")
        cls.answers, cls.twists = queue.Queue(), queue.Queue()
        heard = [rospy.Subscriber("/grouser/answer", VehicleAnswer, cls.answers.put),
                 rospy.Subscriber("/grouser/twist", TwistWithCovarianceStamped, cls.twists.put)]
        wait_for("the node's topics", lambda: all(s.get_num_connections() for s in heard))

    def setUp(self):
        for waiting in (self.answers, self.twists):
            while not waiting.empty():
                waiting.get()

    def replay(self):
        """The bag's twists and joint states by stamp; the answers to them, and the predicted twists."""
        file = self.folder / "drive.bag"
        subprocess.run([CLIENT / "examples/make_bag.py", file, "--seconds", str(SECONDS), "--soil", "floor"],
                       check=True, env=self.env, timeout=60)
        with rosbag.Bag(str(file)) as bag:
            messages = {topic: {stamp(m): m for _, m, _ in bag.read_messages(topic)}
                        for topic in ("twist", "joint_states")}
        self.assertEqual([len(m) for m in messages.values()], [SECONDS * RATE] * 2)
        listing = ["/usr/bin/python3", CLIENT / "examples/print_answers.py", "--count", RATE]
        with running(listing, self.env, self.folder, "listing") as printer:
            wait_for("the example's subscription", lambda: any(
                "print_answers" in n for t, nodes in rospy.client.get_master().getSystemState()[2][1] for n in nodes
                if t == "/grouser/answer"))
            subprocess.run(["/usr/bin/rosbag", "play", "--quiet", "--wait-for-subscribers", "--topics", "twist",
                            "joint_states", "--bags", file], check=True, env=self.env, timeout=60,
                           stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
            last, answers = max(messages["joint_states"]), {}

            def last_is_answered():
                while not self.answers.empty():
                    answer = self.answers.get()
                    answers[stamp(answer)] = answer
                return last in answers

            wait_for("the answer to the last joint state", last_is_answered)
            wait_for("the example's end", lambda: printer.poll() is not None)
            self.assertEqual(printer.returncode, 0, output(self.folder, "listing"))
        twists = {}
        wait_for("the last twist", lambda: not self.twists.empty())
        while not self.twists.empty():
            twist = self.twists.get()
            twists[stamp(twist)] = twist
        return messages, answers, twists

    def test_answers_are_the_librarys(self):
        messages, answers, twists = self.replay()
        self.assertGreater(len(answers), SECONDS * RATE / 2)
        self.assertLessEqual(set(answers), set(messages["joint_states"]))
        husky = Vehicle.open(HUSKY)
        solver, floor, places = VehicleSolver(husky), husky.soil("floor"), husky.wheel_places
        measured = {(m.twist.linear.x, m.twist.linear.y, m.twist.angular.z): at for at, m in messages["twist"].items()}
        by_twist, worst, faster, own = 0, 0.0, [], 0

        def same(got, expected):
            nonlocal worst
            if not (math.isnan(got) and math.isnan(expected)):
                worst = max(worst, abs(got - expected) / max(abs(expected), 1e-9))

        for at, answer in answers.items():
            self.assertEqual((answer.problem, answer.vehicle, answer.soil, answer.header.frame_id),
                             ("", "husky", "floor", "base_link"))
            rims = np.array(messages["joint_states"][at].velocity) * [p.radius_m for p in places]
            # The twist that was answered is one of the bag, but before the first came.
            if answer.motion_from == VehicleAnswer.TWIST:
                by_twist += 1
                twist_at = measured[answer.v_x, answer.v_y, answer.yaw_rate]
                self.assertLessEqual(abs(twist_at - at), 500_000_000)  # max_age [ns]
                own += twist_at == at  # but where its own twist came later than it was answered
            asked = Motions.of(v_x=[answer.v_x], yaw_rate=answer.yaw_rate, soil=floor)
            s, e, p = solver.solve(asked), solver.energy(asked), solver.probability_to_go(asked)
            for i, (wheel, place) in enumerate(zip(answer.wheels, places)):
                for name in ("load", "f_x", "f_y", "torque", "m_z", "sinkage", "shaft_power"):
                    same(getattr(wheel, name), getattr(s.wheel, name)[0, i])
                same(wheel.model_slip, s.wheel.slip[0, i])
                v_x = answer.v_x - answer.yaw_rate * place.y_m
                v_y = answer.v_y + answer.yaw_rate * place.x_m
                same(wheel.slip, (rims[i] - v_x) / max(abs(rims[i]), math.hypot(v_x, v_y)))
            for got, expected in (
                    (answer.electric_power, e.electric), (answer.electric_power_low, e.electric_low),
                    (answer.electric_power_high, e.electric_high), (answer.joules_per_metre, e.joules_per_metre),
                    (answer.shaft_power, s.shaft_power), (answer.torque_margin, s.torque_margin),
                    (answer.p_go_least, p[0]), (answer.p_go_most, p[1])):
                same(got, float(expected[0]))
            self.assertTrue(0.3 < answer.traction_margin_low < answer.traction_margin < 0.61)
            # Of the joint states alone: the sides' rim speeds are the means of two wheels.
            sides = [[(rims[0] + rims[2]) / 2, (rims[1] + rims[3]) / 2]] * 3
            z = grouser.WORSE_BY_SD
            t = solver.solve(Motions.of(rim_speed=sides, worse_by_sd=[0, z, -z], soil=floor))
            same(answer.predicted_v_x, t.v_x[0])
            same(answer.predicted_yaw_rate, t.yaw_rate[0])
            slope = [(a[1] - a[2]) / (2 * z) for a in (t.v_x, t.v_y, t.yaw_rate)]
            covariance = np.outer(slope, slope) + np.diag([1e-6, 2e-6, 3e-6])
            self.assertLess(np.abs(np.reshape(answer.predicted_covariance, (3, 3)) - covariance).max(), 1e-12 * 3e-6)
            if at in twists:
                twist = twists[at].twist
                self.assertEqual((twist.twist.linear.x, twist.twist.angular.z),
                                 (answer.predicted_v_x, answer.predicted_yaw_rate))
                self.assertEqual([twist.covariance[k] for k in (0, 1, 5, 7, 11, 30, 35)],
                                 [answer.predicted_covariance[k] for k in (0, 1, 2, 4, 5, 6, 8)])
                self.assertEqual(sum(c != 0 for c in twist.covariance),
                                 sum(c != 0 for c in answer.predicted_covariance) + 3)
                self.assertEqual([twist.covariance[k] for k in (14, 21, 28)], [1e6] * 3)  # not known
            if answer.motion_from == VehicleAnswer.TWIST:
                faster.append((at, answer.predicted_v_x / answer.v_x))
        print(f"{len(answers)} of {SECONDS * RATE} joint states answered, {by_twist} with a twist; "
              f"largest relative difference {worst:.1e}")
        self.assertLess(worst, 1e-12)
        third = sorted(messages["joint_states"])[2 * SECONDS * RATE // 3]  # from here the wheels turn 10 % faster
        self.assertGreater(np.median([f for at, f in faster if at >= third]), 1.05)
        self.assertLess(np.median([f for at, f in faster if at < third]), 1.03)
        self.assertGreater(by_twist, len(answers) / 2)
        self.assertGreater(own, by_twist / 2)
        self.assertGreaterEqual(len(set(twists) & set(answers)), len(answers) / 2)
        with open(self.folder / "listing.out", newline="") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual(len(rows), RATE)
        rows = [(answers.get(round(float(row["time_s"]) * 1000) * 1_000_000), row) for row in rows]
        self.assertGreater(sum(answer is not None for answer, _ in rows), RATE / 2)
        for answer, row in ((answer, row) for answer, row in rows if answer is not None):
            self.assertAlmostEqual(float(row["electric_power"]) / answer.electric_power, 1, delta=1e-4)  # 5 digits
            self.assertAlmostEqual(float(row["slip_rear_right"]), answer.wheels[3].slip, delta=1e-4)

    def test_bad_messages_are_named(self):
        joints = rospy.Publisher("/joint_states", JointState, queue_size=1)
        twist = rospy.Publisher("/twist", TwistStamped, queue_size=1)
        wait_for("the node's subscriptions", lambda: joints.get_num_connections() and twist.get_num_connections())
        good = JointState(name=[f"{w}_wheel" for w in WHEELS], velocity=[1.0] * 4)

        def problem_of(message):
            """Sends until the answer comes: the one before may have been lost."""
            found = []

            def answered():
                joints.publish(message)
                while not self.answers.empty():
                    answer = self.answers.get()
                    if stamp(answer) == stamp(message):
                        found.append(answer)
                return bool(found)

            wait_for("an answer", answered)
            return found[0]

        for number, (changed, problem) in enumerate((
                ({"velocity": [1.0, math.nan, 1.0, 1.0]}, "velocity of 'front_right_wheel': got nan"),
                ({"velocity": []}, "velocity: got 0 entries, expected 4"),
                ({"name": good.name[:3], "velocity": [1.0] * 3}, "got no joint 'rear_right_wheel'"))):
            bad = JointState(**({"name": good.name, "velocity": good.velocity} | changed))
            bad.header.stamp = rospy.Time(100 + number)
            answer = problem_of(bad)
            self.assertIn(problem, answer.problem)
            self.assertEqual((answer.reasons, answer.wheels), (Reason.INPUT, []))
            self.assertTrue(math.isnan(answer.electric_power) and math.isnan(answer.traction_margin))
            wait_for("the node's log", lambda p=problem: p in output(self.folder, "grouser"))
        bad = TwistStamped()
        bad.twist.linear.x = math.inf

        def twist_is_refused():
            twist.publish(bad)
            good.header.stamp = rospy.Time(200, rospy.Time.from_sec(rospy.get_time()).nsecs)
            return "twist: got v_x inf" in problem_of(good).problem

        wait_for("a refusal of the twist", twist_is_refused)
        bad.twist.linear.x = 0.165

        def twist_is_taken():
            twist.publish(bad)
            good.header.stamp = rospy.Time(300, rospy.Time.from_sec(rospy.get_time()).nsecs)
            return problem_of(good).problem == ""

        wait_for("an answer to a good twist", twist_is_taken)

    def test_masks(self):
        try:
            from mask_test import write_map
        except SystemExit:
            skip(self, "no python3-gdal")
        speed = np.array([[0.8, 0.4, np.nan], [0.2, 0.0, 0.8]])  # north first
        folder = write_map(self.folder / "map", {"": speed})
        got = {}
        with node(self.env, self.folder, f"_map:={folder}", "_map_frame:=site", "_datum:=[499990.0, 5299000.0]",
                  "_way:='045'", name="masks"):
            for name in ("speed_mask", "keepout_mask"):  # latched: whoever comes later hears them
                rospy.Subscriber(f"/masks/{name}", OccupancyGrid, lambda m, n=name: got.update({n: m}))
            wait_for("the masks", lambda: len(got) == 2)
        self.assertEqual(list(got["speed_mask"].data), [25, 1, 100, 100, 50, 1])
        self.assertEqual(list(got["keepout_mask"].data), [0, 100, 0, 0, 0, 100])
        info = got["speed_mask"].info
        self.assertEqual((info.width, info.height, info.resolution), (3, 2, 2.0))
        self.assertEqual((info.origin.position.x, info.origin.position.y, got["speed_mask"].header.frame_id),
                         (10.0, 996.0, "site"))
        self.assertIn("m/s = 0.008 times the cell", output(self.folder, "masks"))

    def test_refused_parameters(self):
        # Each a node of its own name: the master keeps the parameters of one that is gone.
        for number, (parameters, text) in enumerate((
                (("_vehicle:=/gone.yaml",), "/gone.yaml"),
                ((f"_vehicle:={HUSKY}", "_joints:=[middle:a]"), "joints: got wheel 'middle'"),
                (("_map:=/gone", "_way:=045"), "way: got 37, .* takes quotes"))):
            done = subprocess.run(["/usr/bin/python3", NODE, f"__name:=refused{number}", *parameters], env=self.env,
                                  timeout=60, capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertRegex(done.stderr, text)
            self.assertNotIn("Traceback", done.stderr)


class NoMasterTest(unittest.TestCase):
    def refused(self, folder, port):
        done = subprocess.run(["/usr/bin/python3", NODE, *PARAMETERS], env=environment(folder, port), timeout=60,
                              capture_output=True, text=True, check=False)
        self.assertEqual((done.returncode, done.stdout), (1, ""))
        self.assertEqual(done.stderr, f"grouser: no ROS master at http://127.0.0.1:{port} (ROS_MASTER_URI): expected "
                                      "roscore or rosmaster there\n")

    def test_no_master(self):
        self.refused("/nowhere", free_port())

    def test_silent_master(self):
        with socket.create_server(("127.0.0.1", 0)) as server:
            self.refused("/nowhere", server.getsockname()[1])

    def test_master_goes_away(self):
        with master() as (env, folder, process), node(env, folder, *PARAMETERS) as started:
            process.kill()
            process.wait()
            wait_for("the node's end", lambda: started.poll() is not None)
            self.assertEqual(started.returncode, 1)
            self.assertIn(f"the ROS master at {env['ROS_MASTER_URI']} went away", output(folder, "grouser"))


if __name__ == "__main__":
    unittest.main()
