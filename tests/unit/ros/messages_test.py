#!/usr/bin/python3
"""The message definitions of clients/ros: constants are the library's, fields what is written; both packages and nodes
are well formed. No ROS is needed."""

import ast
import re
import sys
import unittest
import xml.etree.ElementTree

from definitions import MESSAGES, PACKAGES, constants_of, fields_of
from grouser_ros import monitor
from vehicles import Turn, shipped

from grouser import Flag, Reason


class MessagesTest(unittest.TestCase):
    def test_constants_are_the_librarys(self):
        self.assertEqual(constants_of("WheelAnswer"), {flag.name: flag.value for flag in Flag})
        origins = {name: getattr(monitor, name) for name in ("TWIST", "JOINT_STATES", "IMU", "LEVEL")}
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

    def test_packages_name_what_nodes_import(self):
        root = xml.etree.ElementTree.parse(PACKAGES / "grouser_ros/package.xml").getroot()
        named = {depend.text for depend in root.iter("exec_depend")}
        used = set()
        for file in ("nodes/ros1_node.py", "nodes/ros2_node.py", "grouser_ros/node.py"):
            for node in ast.walk(ast.parse((PACKAGES / "grouser_ros" / file).read_text())):
                names = [a.name for a in node.names] if isinstance(node, ast.Import) else (
                    [node.module or ""] if isinstance(node, ast.ImportFrom) else [])
                used |= {name.split(".")[0] for name in names}
        used -= {*sys.stdlib_module_names, "", "parameters", "speed_mask", "grouser", "grouser_ros"}  # Python's, ours
        self.assertGreater(used, {"rospy", "rosgraph", "rclpy", "nav_msgs"})
        self.assertLessEqual(used, named)

    def test_ros_2_hears_best_effort_and_numbers_of_any_type(self):
        """As text, since it is not run here."""
        text = (PACKAGES / "grouser_ros/nodes/ros2_node.py").read_text()
        ast.parse(text)
        for part in ("SENSOR = QoSProfile(depth=QUEUE, reliability=ReliabilityPolicy.BEST_EFFORT)",
                     'kind, topic, callback, QUEUE if topic == "soil" else SENSOR)',
                     "ANY_TYPE = ParameterDescriptor(dynamic_typing=True)",
                     "declare_parameter(name, default, ANY_TYPE)"):
            self.assertIn(part, text)


if __name__ == "__main__":
    unittest.main()
