#!/usr/bin/python3
"""What the Python package refuses: always with grouser.Error (or Python's own TypeError), never by a crash, and
having written nothing."""

import os
import pathlib
import tempfile
import unittest

import numpy as np
from common import ALL, PAIR, SHIPPED, SOURCE, some_states

import grouser
from grouser import AccuracyRequest, Answers, Error, Model, ModelSelector, States

N = 8


def wrongs(n, dtype):
    """Arrays that are no contiguous one of this dtype and n entries, each with what the text says."""
    other = np.float32 if dtype != np.float32 else np.float64
    yield np.zeros(n, other), "dtype float32, expected"
    yield np.zeros(n, np.dtype(dtype).newbyteorder()), "dtype [<>].*, expected"
    yield np.zeros(n, object), "dtype object, expected"
    yield np.zeros(n, complex), "dtype complex128, expected"
    yield np.zeros(n + 1, dtype), rf"shape \({n + 1},\), expected \({n},\)"
    yield np.zeros(0, dtype), r"shape \(0,\), expected"
    yield np.zeros((n, 1), dtype), rf"shape \({n}, 1\), expected"
    yield np.zeros(2 * n, dtype)[::2], "strided or not aligned"
    yield np.zeros(n, dtype)[::-1], "strided or not aligned"
    yield np.frombuffer(bytearray(n * np.dtype(dtype).itemsize + 1), np.uint8)[1:].view(dtype), "not aligned"
    yield [0.0] * n, "list, expected a NumPy array"
    yield 0.0, "float, expected a NumPy array"
    yield "text", "str, expected a NumPy array"


class RefusalTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.model = Model.open(SHIPPED)

    def refuses(self, pattern, call, *arguments, **named):
        with self.assertRaisesRegex(Error, pattern):
            call(*arguments, **named)

    def test_states(self):
        for name in ("v_x", "v_y", "rim_speed", "load"):
            for wrong, text in wrongs(N, np.float64):
                states = some_states(N)
                setattr(states, name, wrong)
                # The shape of load is that of all: with another, all others are wrong.
                wrong_name = "[a-z_]+" if name == "load" else name
                self.refuses(f"^{wrong_name}: ", self.model.evaluate, states)
                if name != "load":
                    self.refuses(text, self.model.evaluate, states)
            states = some_states(N)
            setattr(states, name, None)
            self.refuses(f"{name}", self.model.evaluate, states)

    def test_answers(self):
        states = some_states(N)
        places = [("", "flags", np.uint32), ("", "slip", np.float64), ("f_x", "low", np.float64),
                  ("sinkage", "measured_high", np.float64), ("m_z", "d_load", np.float64)]
        for output, part, dtype in places:
            for wrong, text in wrongs(N, dtype):
                out = Answers.empty(N, ALL)
                out.f_y.value[:] = 77
                setattr(getattr(out, output) if output else out, part, wrong)
                self.refuses(f"^{output + '.' if output else ''}{part}: .*{text}", self.model.evaluate, states, out)
                np.testing.assert_array_equal(out.f_y.value, 77.0)
        out = Answers.empty(N)
        out.f_x.value.setflags(write=False)
        self.refuses("f_x.value: read-only", self.model.evaluate, states, out)
        out = Answers.empty(N)
        out.flags = None
        self.refuses("flags: 0 entries, expected 8", self.model.evaluate, states, out)
        self.refuses("int has no flags", self.model.evaluate, states, 3)
        self.refuses("ndarray has no v_x|has no load", self.model.evaluate, np.zeros((4, N)))
        self.refuses("fields: given with out", self.model.evaluate, states, Answers.empty(N), fields="f_x")
        self.refuses("fields: 'f_x.lwo', did you mean 'f_x.low'", self.model.evaluate, states, fields="f_x.lwo")

    def test_overlaps(self):
        states = some_states(N)
        out = Answers.empty(N)
        out.f_x.low = out.f_x.high
        self.refuses("overlaps", self.model.evaluate, states, out)
        out = Answers.empty(N)
        out.torque.value = states.load
        self.refuses("torque.value: overlaps load", self.model.evaluate, states, out)
        room = np.zeros(N + 1)
        out = Answers.empty(N)
        out.slip, out.attack_angle = room[:-1], room[1:]
        self.refuses("overlaps", self.model.evaluate, states, out)
        states.v_y = states.v_x  # what is only read may be shared
        self.model.evaluate(states)

    def test_files(self):
        with tempfile.TemporaryDirectory() as folder:
            bad = pathlib.Path(folder, "bad.model")
            self.refuses(f"{bad}: .*No such file", Model.open, bad)
            self.refuses("\udcff.*No such file", Model.open, os.fsencode(folder) + b"/\xff.model")  # no UTF-8
            bad.write_text("no model")
            self.refuses(f"{bad}: .*not a Grouser model file", Model.open, str(bad))
            bad.write_bytes(SHIPPED.read_bytes()[:-100])
            self.refuses(f"^{bad}: ", Model.open, os.fsencode(bad))
            self.refuses(f"^{folder}: ", Model.open, folder)
            self.refuses(f"^{bad}: ", ModelSelector.open, [SHIPPED, bad])
            bad.write_text("name: [")
            self.refuses(f"^{bad}", grouser.Vehicle.open, bad)
            self.refuses("none.vehicle.yaml", grouser.Vehicle.open, pathlib.Path(folder, "none.vehicle.yaml"))
        self.refuses("expected", ModelSelector.open, [])
        atv = SOURCE / "surrogate/pairs/atv-20x10-lugged-20mm/hybrid.model"
        self.refuses("another wheel|wheel or soil", ModelSelector.open, [SHIPPED, atv])
        for nothing in (None, 3, [], object()):
            with self.assertRaises(TypeError):
                Model.open(nothing)
        with self.assertRaises(TypeError):
            Model()  # from files alone

    def test_numbers(self):
        model = self.model
        for count in (0, 1025):
            self.refuses("draws: got .*, expected 1 to 1024", grouser.Draws, "sand", count)
        for radius, gravity in ((0, 9.81), (-1, 9.81), (0.1, np.nan), (np.inf, 9.81)):
            self.refuses("", model.scaled, radius, gravity)
        self.refuses("mixture: ", Model.mixture, [], [])
        self.refuses("mixture: ", Model.mixture, [model], [0.5, 0.5])
        self.refuses("mixture: ", Model.mixture, [model, model], [1, np.nan])
        for models in ([None], [3], None):
            with self.assertRaises(TypeError):
                Model.mixture(models, [1])
        self.refuses("tolerance: 'f_q', expected f_x", AccuracyRequest, tolerance={"f_q": 1})
        self.refuses("target: 'both', expected", AccuracyRequest, target="both")
        selector, states = ModelSelector.open([PAIR / "hybrid.model"]), some_states(N)
        self.refuses("share_of_load|finite|negative|-1", selector.evaluate, states, AccuracyRequest(share_of_load=-1))
        self.refuses("answered_by: dtype", selector.evaluate, states, AccuracyRequest(), answered_by=np.zeros(N))
        draws = grouser.Draws("sand", 3)
        for wrong, text in wrongs(N, np.uint32):
            self.refuses(f"k: .*{text}", model.evaluate_draws, states, draws, wrong)
        self.refuses("k: None", model.evaluate_draws, states, draws, None)

    def test_of(self):
        self.refuses("shapes that do not go together: v_x", States.of, [1, 2], [1, 2, 3], 0, 24)
        self.refuses("v_y: dtype <U1, expected real numbers", States.of, 1, "a", 1, 24)
        self.refuses("load: dtype complex128", States.of, 1, 1, 1, 1j)
        self.refuses("soil: expected whole numbers from 0 to 255", grouser.Path.of, [0, 1], soil=[0, 300])
        self.refuses("soil: expected whole numbers", grouser.Path.of, [0, 1], soil=0.5)
        self.refuses("Motions: 'speed', expected v_x", grouser.Motions.of, speed=1)
        self.refuses("state 0: slip nan", States.from_slip, np.nan, 0, 0.1, 24)
        self.refuses("speed 0 m/s", States.from_slip, 0.1, 0, 0, 24)

    def test_error_is_an_exception_of_its_own(self):
        self.assertTrue(issubclass(Error, Exception))
        self.assertFalse(issubclass(Error, (ValueError, RuntimeError)))
        self.assertEqual(f"{Error.__module__}.{Error.__name__}", "grouser.Error")


if __name__ == "__main__":
    unittest.main()
