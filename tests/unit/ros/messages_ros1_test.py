#!/usr/bin/python3
"""What ROS 1's generator makes of the message definitions: every field, and doubles that come through. Exit code 77: no
ROS 1."""

import io
import unittest

import ros_processes  # noqa: F401  first: exits where there is no ROS 1
from definitions import NAMES, constants_of, fields_of
from grouser_msgs import msg
from vehicles import Turn, shipped


class MessagesTest(unittest.TestCase):
    def test_fields_and_constants(self):
        for name in NAMES:
            message = getattr(msg, name)
            self.assertEqual(message.__slots__, fields_of(name))
            self.assertEqual({c: getattr(message, c) for c in constants_of(name)}, constants_of(name))

    def test_bytes_there_and_back(self):
        husky = shipped("husky")
        turn = Turn(husky, 0.5, 0.2)
        sent = msg.VehicleAnswer()
        m = turn.monitor(husky)
        m.set_twist(*turn.twist)
        self.assertTrue(m.answer(sent, msg.WheelAnswer, turn.names, turn.position, turn.velocity))
        stream = io.BytesIO()
        sent.serialize(stream)
        received = msg.VehicleAnswer().deserialize(stream.getvalue())
        for name in fields_of("VehicleAnswer"):
            if name not in ("header", "wheels", "predicted_covariance"):
                self.assertEqual(getattr(received, name), getattr(sent, name), name)
        self.assertEqual(list(received.predicted_covariance), sent.predicted_covariance)
        for a, b in zip(received.wheels, sent.wheels, strict=True):
            self.assertEqual([getattr(a, n) for n in a.__slots__], [getattr(b, n) for n in a.__slots__])


if __name__ == "__main__":
    unittest.main()
