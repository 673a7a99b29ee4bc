#!/usr/bin/python3
"""grouser.client's streams: the answers of calls, bit for bit; refusals in band; limits of time; servers that go away.
Exit code 77: there is no grpcio."""

import gc
import socket
import tempfile
import threading
import unittest

from servers import Client, ServerError, serving  # first: exits where there is no grpcio

import grpc
import numpy as np
from common import PAIR, some_states

import grouser
from grouser import Error, States
from grouser.queries import _refusal
from grouser.google.rpc import status_pb2

ANSWERED = ("f_x.value", "f_x.high", "sinkage.sd_fit", "slip", "m_z.d_v_x")


def readers():
    return sum(thread.name == "grouser-stream" for thread in threading.enumerate())


class StreamTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = cls.enterClassContext(tempfile.TemporaryDirectory())
        cls.address = cls.enterClassContext(serving("grouser-server", cls.folder, "--no-lcm", "--shipped", str(PAIR)))
        cls.client = cls.enterClassContext(Client(cls.address, deadline=60))
        cls.model = cls.client.models()[0].name

    def same(self, a, b):
        self.assertEqual(a.flags.tobytes(), b.flags.tobytes())
        for name in ANSWERED:
            x, y = a, b
            for part in name.split("."):
                x, y = getattr(x, part), getattr(y, part)
            self.assertEqual(x.tobytes(), y.tobytes(), name)
        self.assertEqual((a.model, a.f_x.value.shape), (b.model, b.f_x.value.shape))

    def test_same_bits_as_calls(self):
        states = some_states()
        square = States(*(a.reshape(20, 15) for a in (states.v_x, states.v_y, states.rim_speed, states.load)))
        with self.client.stream(self.model, fields=ANSWERED) as stream:
            for asked in (states, square, States.of(0.08, 0.01, 0.1, 24), some_states(10)):
                answers = stream.evaluate(asked)
                self.same(answers, self.client.evaluate(asked, self.model, fields=ANSWERED))
                self.assertIsNone(answers.f_y.value)
        self.assertEqual(readers(), 0)
        request = grouser.AccuracyRequest(tolerance={"f_x": 1000})
        with self.client.stream(self.model, accuracy=request) as stream:
            answers = stream.evaluate(States.from_slip(np.linspace(0, 0.5, 50), 0, 0.05, 24))
            self.assertTrue((answers.answered_by == 0).all())

    def test_answers_come_in_the_order_of_the_queries(self):
        asked = [some_states(n) for n in range(10, 60)]
        with self.client.stream(self.model, fields=ANSWERED) as stream:
            for states in asked:
                stream.send(states)
            with self.assertRaisesRegex(Error, "50 answers are left to receive"):
                stream.evaluate(asked[0])
            for states in asked:
                self.same(stream.receive(), self.client.evaluate(states, self.model, fields=ANSWERED))
            with self.assertRaisesRegex(Error, "nothing is left to receive"):
                stream.receive()
            stream.send(asked[0])
        with self.assertRaisesRegex(Error, "stream: is closed"):
            stream.send(asked[0])

    def test_a_refusal_is_in_band(self):
        good = States.of(0.08, 0, 0.1, 24)
        with self.client.stream(self.model) as stream:
            stream.send(good)
            stream.send(States.of(np.full(10001, 0.08), 0, 0.1, 24))
            stream.send(good)
            first = stream.receive()
            with self.assertRaisesRegex(ServerError, "RESOURCE_EXHAUSTED: .*10001") as caught:
                stream.receive()
            self.assertEqual((caught.exception.code, caught.exception.retry_after),
                             (grpc.StatusCode.RESOURCE_EXHAUSTED, None))
            self.assertEqual(stream.receive().f_x.value.tobytes(), first.f_x.value.tobytes())
            with self.assertRaisesRegex(Error, r"v_y: shape"):
                stream.send(States(*map(np.zeros, (3, 2, 3, 3))))
            stream.evaluate(good)
        with self.client.stream("no-such") as stream, self.assertRaisesRegex(ServerError, "NOT_FOUND: .*no-such"):
            stream.evaluate(good)

    def test_hints_in_band(self):
        status = status_pb2.Status(code=8, message="later")
        self.assertIsNone(_refusal(status).retry_after)
        detail = status.details.add(type_url="type.googleapis.com/google.rpc.RetryInfo")
        for seconds, nanos, wire in ((1, 500000000, b"\x08\x01\x10\x80\xca\xb5\xee\x01"), (7, 0, b"\x08\x07"), (0, 0, b"")):
            detail.value = b"\n" + bytes([len(wire)]) + wire
            refusal = _refusal(status)
            self.assertEqual((refusal.code, str(refusal), refusal.retry_after),
                             (grpc.StatusCode.RESOURCE_EXHAUSTED, "RESOURCE_EXHAUSTED: later", seconds + nanos / 1e9))
        for cut_off in (b"", b"\n", b"\n\x03", b"\n\x01\x08"):
            detail.value = cut_off
            self.assertIsNone(_refusal(status).retry_after, cut_off)
        self.assertEqual(_refusal(status_pb2.Status(code=99)).code, grpc.StatusCode.UNKNOWN)

    def test_an_answer_that_does_not_come_ends_the_stream(self):
        good = States.of(0.08, 0, 0.1, 24)
        with socket.create_server(("127.0.0.1", 0)) as silent, \
                Client("127.0.0.1:%d" % silent.getsockname()[1], deadline=0.3) as client, client.stream() as stream:
            with self.assertRaisesRegex(ServerError, "no answer within 0.3 s on the stream") as caught:
                stream.evaluate(good)
            self.assertEqual(caught.exception.code, grpc.StatusCode.DEADLINE_EXCEEDED)
            for again in (stream.receive, lambda: stream.evaluate(good), lambda: stream.send(good)):
                with self.assertRaisesRegex(ServerError, "DEADLINE_EXCEEDED: no answer within 0.3 s"):
                    again()
            with self.assertRaisesRegex(Error, "deadline: "):
                stream.receive(deadline=0)

    def test_what_is_not_received_is_bounded(self):
        good = States.of(0.08, 0, 0.1, 24)
        with self.client.stream(self.model, fields=("f_x.value",)) as stream:
            for _ in range(1000):
                stream.send(good)
            with self.assertRaisesRegex(Error, "1000 answers are left to receive, expected fewer than 1000"):
                stream.send(good)
            stream.receive()
            stream.send(good)

    def test_a_server_that_goes_away(self):
        good = States.of(0.08, 0, 0.1, 24)
        with tempfile.TemporaryDirectory() as folder, Client(f"unix:{folder}/socket", deadline=60) as client:
            with serving("grouser-server", folder, "--no-lcm", "--shipped", str(PAIR), grpc=client.address):
                stream = client.stream(self.model)
                stream.evaluate(good)
            for again in (lambda: stream.evaluate(good), stream.receive, lambda: stream.evaluate(good),
                          lambda: stream.send(good)):
                with self.assertRaisesRegex(ServerError, "UNAVAILABLE"):
                    again()
            stream.close()
        with self.assertRaisesRegex(Error, "closed"), client.stream(self.model) as stream:
            stream.evaluate(good)
        gc.collect()
        self.assertEqual(readers(), 0)


if __name__ == "__main__":
    unittest.main()
