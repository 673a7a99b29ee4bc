#!/usr/bin/python3
"""Models in Python: the C++ library's bits, arrays shared, gradients, draws, selection, threads."""

import threading
import time
import unittest

import numpy as np
from common import ALL, PAIR, PARTS, SHIPPED, differ_in_threads, reference, some_states

import grouser
from grouser import Answers, Flag, Model, States

MODEL = Model.open(SHIPPED)
FILES = [SHIPPED, *sorted(PAIR.glob("*.model"))]


def flat(answers):
    """The arrays of an answer in the reference's order."""
    parts = [getattr(getattr(answers, o), p) for o in grouser.OUTPUTS for p in PARTS]
    return np.concatenate([answers.flags.astype(float), answers.slip, answers.attack_angle, *parts])


class ModelTest(unittest.TestCase):
    def test_same_bits_as_the_library(self):
        states = some_states()
        for file in FILES:
            expected = reference("model", file, states.v_x, states.v_y, states.rim_speed, states.load)
            got = flat(Model.open(file).evaluate(states, fields=ALL))
            self.assertEqual(got.tobytes(), expected.tobytes(), file)
            self.assertGreater(np.isfinite(got).mean(), 0.5)

    def test_flags_of_single_states(self):
        flags = MODEL.evaluate(some_states()).flags
        self.assertEqual(Flag(int(flags[0])) & Flag.AIRBORNE, Flag.AIRBORNE)
        for bad in (1, 2, 3):
            self.assertTrue(flags[bad] & Flag.INVALID)
        self.assertTrue(flags[4] & Flag.STATIC)
        self.assertFalse((flags[5:] & Flag.INVALID).any())

    def test_writes_in_place_and_only_what_is_asked(self):
        model, states = MODEL, some_states()
        table = np.full((4, states.load.size), 77.0)
        out = Answers(np.zeros(states.load.size, np.uint32))
        out.f_x.value, out.f_x.low = table[1], table[2]  # rows of one table: contiguous
        self.assertIs(model.evaluate(states, out), out)
        whole = model.evaluate(states)
        np.testing.assert_array_equal(table[1], whole.f_x.value)
        np.testing.assert_array_equal(table[2], whole.f_x.low)
        np.testing.assert_array_equal(table[[0, 3]], 77.0)
        self.assertIsNone(out.slip)
        self.assertTrue(np.shares_memory(out.f_x.value, table))

    def test_reads_states_where_they_are(self):
        table = np.array([[0.08, 0.08], [0, 0.03], [0.1, 0.1], [24.0, 24.0]])
        table.setflags(write=False)
        states = States(*table)
        self.assertTrue(all(np.shares_memory(a, table) for a in (states.v_x, states.load)))
        self.assertEqual(MODEL.evaluate(states).f_x.value.shape, (2,))

    def test_any_shape(self):
        model, states = MODEL, some_states(24)
        square = States(*(a.reshape(2, 3, 4) for a in (states.v_x, states.v_y, states.rim_speed, states.load)))
        answers = model.evaluate(square)
        np.testing.assert_array_equal(answers.f_x.high.ravel(), model.evaluate(states).f_x.high)
        self.assertEqual(answers.f_x.high.shape, (2, 3, 4))
        self.assertEqual(model.evaluate(States.of([], [], [], [])).flags.size, 0)

    def test_from_slip_is_the_inverse_of_the_echo(self):
        slip, angle = (a.ravel() for a in np.meshgrid(np.linspace(-2, 2, 41), np.linspace(-np.pi, np.pi, 37)))
        c = np.cos(angle)
        possible = (slip > -1 - np.maximum(c, 0)) & (slip < 1 + np.maximum(-c, 0))
        slip, angle = slip[possible], angle[possible]
        states = States.from_slip(slip, angle, 0.1, 24)
        echo = MODEL.evaluate(states)
        np.testing.assert_allclose(echo.slip, slip, atol=1e-12)
        moving = np.hypot(states.v_x, states.v_y) > 1e-9
        np.testing.assert_allclose(np.cos(echo.attack_angle - angle)[moving], 1, atol=1e-12)
        speed = np.maximum(np.abs(states.rim_speed), np.hypot(states.v_x, states.v_y))
        np.testing.assert_allclose(speed, 0.1, rtol=1e-12)
        with self.assertRaisesRegex(grouser.Error, "state 1: slip 1.5 at attack angle 0 rad"):
            States.from_slip([0.1, 1.5], 0, 0.1, 24)

    def test_gradients_against_differences(self):
        model = MODEL
        self.assertTrue(model.has_gradients)
        rng = np.random.default_rng(3)
        base = States.from_slip(rng.uniform(0.05, 0.4, 40), rng.uniform(-0.4, 0.4, 40), 0.1, rng.uniform(16, 32, 40))
        exact = model.evaluate(base, fields="*.d_*")
        for name, step in (("v_x", 1e-4), ("v_y", 1e-4), ("rim_speed", 1e-4), ("load", 1e-2)):
            ends = []
            for by in (-step, step):
                moved = States.of(base.v_x, base.v_y, base.rim_speed, base.load)
                setattr(moved, name, getattr(base, name) + by)
                ends.append(model.evaluate(moved, fields="*.value"))
            for output in grouser.OUTPUTS:
                low, high = (getattr(e, output).value for e in ends)
                derivative = getattr(getattr(exact, output), f"d_{name}")
                # What the vertical balance leaves over is of the forces, not of the derivative of f_z.
                scale = np.abs(getattr(exact.f_x, f"d_{name}")).max() if output[0] == "f" else np.abs(derivative).max()
                np.testing.assert_allclose((high - low) / (2 * step), derivative, atol=1e-3 * scale, rtol=1e-3,
                                           err_msg=f"{output} by {name}")

    def test_draws(self):
        model, states = MODEL, some_states(45)
        good = States(*(a[5:].copy() for a in (states.v_x, states.v_y, states.rim_speed, states.load)))
        draws = grouser.Draws(model.soil, 200)
        self.assertEqual(len(draws), 200)
        n = good.load.size
        values = np.array([model.evaluate_draws(good, draws, np.full(n, k, np.uint32)).f_y.value for k in range(200)])
        whole = model.evaluate(good)
        sd = (whole.f_y.high - whole.f_y.value) / 1.6448536269514722
        np.testing.assert_allclose(values.std(0) / sd, 1, atol=0.35)
        with self.assertRaisesRegex(grouser.Error, "none of the 200 draws"):
            model.evaluate_draws(good, draws, np.full(n, 200, np.uint32))

    def test_scaled_and_mixture(self):
        model = MODEL
        larger = model.scaled(2 * model.radius_m, model.gravity_m_per_s2)
        small = States.from_slip([0.2], 0.1, 0.05, 24)
        large = States.of(small.v_x * 2**0.5, small.v_y * 2**0.5, small.rim_speed * 2**0.5, small.load * 8)
        np.testing.assert_allclose(larger.evaluate(large).f_x.value, 8 * model.evaluate(small).f_x.value, rtol=1e-12)
        pair = [Model.open(PAIR / f"{kind}.model") for kind in ("hybrid", "bekker")]
        mixed = Model.mixture(pair, [3, 1]).evaluate(small, fields="f_x")
        a, b = (m.evaluate(small).f_x.value for m in pair)
        np.testing.assert_allclose(mixed.f_x.value, 0.75 * a + 0.25 * b, rtol=1e-12)
        np.testing.assert_allclose(mixed.f_x.sd_soil, np.abs(a - b) * (3 / 16) ** 0.5, rtol=1e-9)

    def test_selection(self):
        selector = grouser.ModelSelector.open(FILES[1:])
        self.assertEqual(len(selector.models), len(selector))
        self.assertTrue(all(1 < cost < 1e6 for cost in selector.cost_ns))
        states = States.from_slip(np.linspace(0, 0.5, 50), 0, 0.05, 24)
        by = np.full(50, 99, np.uint32)
        loose = grouser.AccuracyRequest(tolerance={"f_x": 1000, "sinkage": 10})
        answers = selector.evaluate(states, loose, answered_by=by)
        self.assertTrue((by == 0).all() and not (answers.flags & Flag.TOLERANCE_UNMET).any())
        np.testing.assert_array_equal(answers.f_x.value, selector.models[0].evaluate(states).f_x.value)
        tight = selector.evaluate(states, grouser.AccuracyRequest(tolerance={"f_x": 1e-6}))
        self.assertTrue((tight.flags & Flag.TOLERANCE_UNMET).all())

    def test_another_thread_runs_meanwhile(self):
        model, n = MODEL, 400_000
        states = States.of(np.full(n, 0.08), 0, 0.1, 24)
        out = Answers.empty(n, "f_x")
        begin, end, ticks = [], [], []

        def evaluate():
            begin.append(time.perf_counter())
            for _ in range(3):
                model.evaluate(states, out)
            end.append(time.perf_counter())

        thread = threading.Thread(target=evaluate)
        thread.start()
        while thread.is_alive():
            ticks.append(time.perf_counter())
        # With Python's lock held there would be a gap as long as one call.
        seen = [begin[0], *(t for t in ticks if begin[0] < t < end[0]), end[0]]
        self.assertLess(max(np.diff(seen)), 0.8 * (end[0] - begin[0]) / 3)

    def test_many_threads_get_the_same(self):
        model, states = MODEL, some_states(500)
        self.assertEqual(differ_in_threads(lambda: flat(model.evaluate(states, fields=ALL)).tobytes()), 0)


if __name__ == "__main__":
    unittest.main()
