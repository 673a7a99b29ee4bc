#!/usr/bin/python3
"""ROS 2's own readers (python3-rosidl) take the message definitions: .msg to IDL, and the IDL parsed. Nothing is
compiled. Exit code 77: they are not here."""

import pathlib
import sys
import tempfile
import unittest

try:
    from rosidl_adapter.msg import convert_msg_to_idl
    from rosidl_parser.definition import IdlLocator, Message
    from rosidl_parser.parser import parse_idl_file
except ImportError as missing:
    print(f"skipped: no readers of ROS 2's definitions ({missing}), which the package python3-rosidl has")
    sys.exit(77)
from definitions import NAMES, PACKAGES, constants_of, fields_of


class MessagesTest(unittest.TestCase):
    def test_ros_2_reads_the_definitions(self):
        folder = self.enterContext(tempfile.TemporaryDirectory())
        for name in NAMES:
            out = pathlib.Path(folder, name)
            convert_msg_to_idl(PACKAGES / "grouser_msgs", "grouser_msgs", pathlib.Path("msg", f"{name}.msg"), out)
            idl = parse_idl_file(IdlLocator(out, pathlib.Path(f"{name}.idl")))
            (message,) = idl.content.get_elements_of_type(Message)
            self.assertEqual([m.name for m in message.structure.members], fields_of(name))
            self.assertEqual({c.name: c.value for c in message.constants}, constants_of(name))


if __name__ == "__main__":
    unittest.main()
