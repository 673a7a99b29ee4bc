#!/usr/bin/python3
"""The message definitions of clients/ros: constants are the library's, fields what is written; both packages and nodes
are well formed. No ROS is needed."""

import ast
import re
import types
import unittest
import xml.etree.ElementTree

from definitions import MESSAGES, PACKAGES, constants_of, fields_of
from grouser_ros import monitor, parameters
from vehicles import Turn, shipped

from grouser import Flag, Reason


class MessagesTest(unittest.TestCase):
    def test_constants_are_the_librarys(self):
        self.assertEqual(constants_of("WheelAnswer"), {flag.name: flag.value for flag in Flag})
        origins = {"TWIST": monitor.TWIST, "JOINT_STATES": monitor.JOINT_STATES}
        self.assertEqual(constants_of("VehicleAnswer"), {reason.name: reason.value for reason in Reason} | origins)

    def test_every_field_is_written_and_no_other(self):
        husky = shipped("husky")
        turn = Turn(husky, 0.5, 0.2)
        m = turn.monitor(husky)
        for out in (turn.ask(m), turn.ask(m, velocity=[])):
            self.assertEqual(set(vars(out)) | {"header"}, set(fields_of("VehicleAnswer")))
            for wheel in out.wheels:
                self.assertEqual(set(vars(wheel)), set(fields_of("WheelAnswer")))

    def test_plain_python_types(self):
        """ROS 2 refuses numpy's."""
        husky = shipped("husky")
        turn = Turn(husky, 0.5, 0.2)
        m = turn.monitor(husky)
        for out in (turn.ask(m), turn.ask(m, velocity=[]), turn.ask(m).wheels[0]):
            for name, value in vars(out).items():
                self.assertIn(type(value), (float, int, str, list), name)
                if name == "predicted_covariance":
                    self.assertEqual([type(v) for v in value], [float] * 9)

    def test_packages(self):
        for name in ("grouser_msgs", "grouser_ros"):
            root = xml.etree.ElementTree.parse(PACKAGES / name / "package.xml").getroot()
            self.assertEqual((root.tag, root.get("format"), root.findtext("name")), ("package", "3", name))
            self.assertIn(f"project({name})", (PACKAGES / name / "CMakeLists.txt").read_text())
        listed = re.search(r"set\(messages (.*)\)", (PACKAGES / "grouser_msgs/CMakeLists.txt").read_text())[1].split()
        self.assertEqual(sorted(listed), sorted(p.name for p in MESSAGES.glob("*.msg")))

    def test_nodes_are_twins(self):
        """ROS 2's is not run here: at least it is Python, and takes and gives the same topics and parameters."""
        topics = []
        for node in ("ros1_node", "ros2_node"):
            text = (PACKAGES / f"grouser_ros/nodes/{node}.py").read_text()
            constants = [n.value for n in ast.walk(ast.parse(text)) if isinstance(n, ast.Constant)]
            strings = {value for value in constants if isinstance(value, str)}
            known = {"twist", "imu", "soil", "joint_states", "speed_mask", "keepout_mask", *parameters.TWIST_TYPES,
                     *parameters.DEFAULTS}
            topics.append({s.removeprefix("~/").removeprefix("~") for s in strings} & (known | {"answer"}))
        self.assertEqual(*topics)
        self.assertGreaterEqual(topics[0], {"twist", "imu", "soil", "joint_states", "answer", "speed_mask",
                                            "keepout_mask"})

    def test_twists_of_all_types(self):
        plain = types.SimpleNamespace(linear=types.SimpleNamespace(x=1.0, y=2.0), angular=types.SimpleNamespace(z=3.0))
        stamped = types.SimpleNamespace(twist=plain)
        for message in (plain, stamped, types.SimpleNamespace(twist=stamped)):
            self.assertEqual(parameters.twist_of(message), (1.0, 2.0, 3.0))


if __name__ == "__main__":
    unittest.main()
