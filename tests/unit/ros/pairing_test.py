#!/usr/bin/python3
"""clients/ros without ROS: which twist and orientation belong to a joint state, by stamps and by arrival; how long they
count; several threads."""

import math
import sys
import threading
import time
import types
import unittest
from unittest import mock

from grouser_ros import history, monitor, parameters
from vehicles import Turn, quaternion, shipped

from grouser import Error, Motions, VehicleSolver

CLOCK = "grouser_ros.monitor.time.monotonic"


def message(stamp=None, **fields):
    """As ROS 2 has it; without a header where there is no stamp."""
    header = {}
    if stamp is not None:
        whole = math.floor(stamp)
        header["header"] = types.SimpleNamespace(stamp=types.SimpleNamespace(
            sec=whole, nanosec=round((stamp - whole) * 1e9)))
    return types.SimpleNamespace(**header, **fields)


def twist_message(v_x, stamp=None):
    plain = types.SimpleNamespace(linear=types.SimpleNamespace(x=v_x, y=0.0), angular=types.SimpleNamespace(z=0.1))
    return plain if stamp is None else message(stamp, twist=plain)


def imu_message(x, y, z, w, first_covariance=0.0, stamp=None):
    return message(stamp, orientation=types.SimpleNamespace(x=x, y=y, z=z, w=w),
                   orientation_covariance=[first_covariance] + [0.0] * 8)


class PairingTest(unittest.TestCase):
    def setUp(self):
        self.husky = shipped("husky")
        self.turn = Turn(self.husky, 0.5, 0.1)
        self.monitor = self.turn.monitor(self.husky, margins=False)

    def ask(self, stamp=None):
        return self.turn.ask(self.monitor, with_twist=False, stamp=stamp)

    def twist(self, v_x, stamp=None):
        parameters.set_twist(self.monitor, twist_message(v_x, stamp))

    def test_stamps(self):
        ros_1 = types.SimpleNamespace(header=types.SimpleNamespace(stamp=types.SimpleNamespace(to_sec=lambda: 7.25)))
        for of, expected in ((message(7.25), 7.25), (message(0.0), None), (message(), None), (ros_1, 7.25)):
            self.assertEqual(history.stamp_of(of), expected)

    def test_twists_of_all_types(self):
        plain = twist_message(1.0)
        for number, m in enumerate((plain, message(5.0, twist=plain),
                                    message(5.0, twist=types.SimpleNamespace(twist=plain)))):
            set_twist = mock.Mock()
            parameters.set_twist(types.SimpleNamespace(set_twist=set_twist), m)
            set_twist.assert_called_once_with(1.0, 0.0, 0.1, 5.0 if number else None)

    def test_twist_nearest_by_stamp(self):
        """However late the joint state is answered, and however fast a bag is played."""
        for seconds_between in (0.0, 10.0):
            with mock.patch(CLOCK, side_effect=[k * seconds_between for k in range(100)]):
                self.monitor = self.turn.monitor(self.husky, margins=False)
                for k in range(10):
                    self.twist(0.3 + 0.01 * k, 1000 + 0.1 * k)
                for stamp, k in ((1000.32, 3), (1000.0, 0), (1000.9, 9), (1001.3, 9), (999.6, 0)):
                    out = self.ask(stamp)
                    self.assertEqual((out.motion_from, out.v_x), (monitor.TWIST, 0.3 + 0.01 * k))
                for stamp in (1001.5, 999.4):  # more than max_age from all
                    self.assertEqual(self.ask(stamp).motion_from, monitor.JOINT_STATES)

    def test_time_that_jumps_back(self):
        for k in range(5):
            self.twist(0.3 + 0.01 * k, 1000 + 0.1 * k)
        self.twist(0.6, 1000.0)  # the bag again
        for stamp in (1000.0, 1000.4):
            self.assertEqual(self.ask(stamp).v_x, 0.6)

    def test_by_arrival_without_stamps(self):
        for twist_stamp, joint_stamp in ((None, None), (None, 1000.0), (1000.0, None)):
            with mock.patch(CLOCK, side_effect=[10.0, 10.4, 10.6]):
                self.twist(0.4, twist_stamp)
                self.assertEqual(self.ask(joint_stamp).v_x, 0.4)
                self.assertEqual(self.ask(joint_stamp).motion_from, monitor.JOINT_STATES)

    def test_arrival_is_before_the_lock(self):
        self.monitor = self.turn.monitor(self.husky, margins=False, max_age=0.3)
        waiting = threading.Thread(target=self.twist, args=(0.4,))
        with self.monitor._lock:
            waiting.start()
            time.sleep(0.5)
        waiting.join()
        self.assertEqual(self.ask().motion_from, monitor.JOINT_STATES)

    def test_orientation_ages(self):
        self.monitor.set_orientation(*quaternion(0.1, 0.0), 1000.0)
        self.assertEqual(self.ask(1000.4).slope_from, monitor.IMU)
        out = self.ask(1000.6)
        self.assertEqual((out.slope_from, out.grade), (monitor.LEVEL, 0.0))
        with self.assertRaisesRegex(Error, "imu"):
            self.monitor.set_orientation(0, 0, 0, 0, 1001.0)
        self.assertRegex(self.ask(1001.1).problem, "imu")
        self.assertEqual(self.ask(1001.6).problem, "")
        with mock.patch(CLOCK, side_effect=[10.0, 10.4, 10.6]), self.assertRaisesRegex(Error, "imu"):
            try:
                self.monitor.set_orientation(0, 0, 0, 0)
            finally:
                self.assertEqual([bool(self.ask().problem) for _ in range(2)], [True, False])

    def test_imu_without_orientation_is_passed_over(self):
        parameters.set_orientation(self.monitor, imu_message(0, 0, 0, 0, -1.0))
        out = self.ask()
        self.assertEqual((out.problem, out.slope_from), ("", monitor.LEVEL))
        parameters.set_orientation(self.monitor, imu_message(*quaternion(0.1, 0.0)))
        parameters.set_orientation(self.monitor, imu_message(0, 0, 0, 0, -1.0))
        out = self.ask()
        self.assertEqual((out.problem, out.slope_from), ("", monitor.IMU))
        self.assertAlmostEqual(out.grade, 0.1, delta=1e-12)

    def test_other_vehicles_joints_are_passed_over_beside_a_bad_twist(self):
        with self.assertRaises(Error):
            self.twist(math.nan)
        self.assertIsNone(self.turn.ask(self.monitor, with_twist=False, names=["elbow"], velocity=[0], position=[0]))

    def test_several_threads(self):
        """Twists and soils while joint states are answered: every answer is the library's of what it says it is of."""
        self.addCleanup(sys.setswitchinterval, sys.getswitchinterval())
        sys.setswitchinterval(1e-6)
        over, answers, failures = threading.Event(), [], []

        def thread(body):
            def run():
                try:
                    k = 0
                    while not over.is_set():
                        body(k)
                        k += 1
                except Exception as error:  # noqa: BLE001  of any kind
                    failures.append(error)

            started = threading.Thread(target=run)
            started.start()
            return started

        self.twist(0.4, 1000.0)
        threads = [thread(lambda k: self.twist(0.4 + 1e-6 * k, 1000.0 + 1e-9 * k)),
                   thread(lambda k: self.monitor.set_soil(("asphalt", "ice")[k % 2])),
                   *(thread(lambda k: answers.append(self.ask(1000.0))) for _ in range(2))]
        time.sleep(1.5)
        over.set()
        for started in threads:
            started.join()
        self.assertEqual(failures, [])
        self.assertGreater(len(answers), 20)
        self.assertEqual({a.soil for a in answers}, {"asphalt", "ice"})
        solver = VehicleSolver(self.husky)
        for a in answers:
            s = solver.solve(Motions.of(v_x=[a.v_x], yaw_rate=a.yaw_rate, soil=self.husky.soil(a.soil)))
            self.assertEqual((a.motion_from, a.shaft_power), (monitor.TWIST, s.shaft_power[0]))
            self.assertEqual([w.f_x for w in a.wheels], s.wheel.f_x[0].tolist())


if __name__ == "__main__":
    unittest.main()
