#!/usr/bin/python3
"""grouser.client: trajectories, grades and constants beside the library in this process, bit for bit; what is refused.
Exit code 77: there is no grpcio."""

import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

from servers import Client, ServerError, serving  # first: exits where there is no grpcio

import grpc
import numpy as np
from common import SOURCE

import grouser
from grouser import Error, Motions, Reason
from grouser.client import Trajectories

RNG = np.random.default_rng(3)
K, M = 5, 7


class TrajectoriesTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = cls.enterClassContext(tempfile.TemporaryDirectory())
        cls.address = cls.enterClassContext(serving(
            "grouser-server", cls.folder, "--no-lcm", "--shipped", str(SOURCE / "surrogate/shipped"), "--vehicles",
            str(SOURCE / "surrogate/vehicle/shipped")))
        cls.client = cls.enterClassContext(Client(cls.address, deadline=60))
        cls.husky = grouser.Vehicle.open(grouser.VEHICLE_DIR / "husky.vehicle.yaml")
        cls.solver = grouser.VehicleSolver(cls.husky)

    def check(self, costs, motions, duration, shape):
        """Costs beside sums of the library's own powers of all steps, in their order; shape (K, M)."""
        powers, solved = self.solver.energy(motions), self.solver.solve(motions)
        self.assertEqual(costs.steps.electric.tobytes(), powers.electric.tobytes())
        self.assertEqual(costs.steps.electric_high.tobytes(), powers.electric_high.tobytes())
        self.assertEqual(costs.steps.reasons.tobytes(), powers.reasons.tobytes())
        for k in range(shape[0]):
            sums = np.zeros(4)  # as C++ adds them
            for j in range(shape[1]):
                row = np.array([powers.electric[k, j], powers.electric_low[k, j], powers.electric_high[k, j], 1])
                if powers.residual[k, j] <= grouser.BALANCED_RESIDUAL and np.isfinite(row).all():
                    sums = sums + row * duration[k, j]
            ours = [costs.energy[k], costs.energy_low[k], costs.energy_high[k], costs.energy_duration[k]]
            self.assertEqual(ours, sums.tolist(), k)
            self.assertEqual(costs.reasons[k], np.bitwise_or.reduce(powers.reasons[k]))
            some = np.flatnonzero(powers.reasons[k])
            self.assertEqual(costs.first_step[k], some[0] if some.size else -1)
            self.assertEqual(costs.first_reasons[k], powers.reasons[k, some[0]] if some.size else 0)
            if not some.size:  # margins of a solve less refined agree to its tolerance
                margins = np.array([solved.tip_margin[k], solved.torque_margin[k], solved.sinkage_margin[k]])
                self.assertAlmostEqual(costs.least_margin[k], margins.min(), 5)
                which = (Reason.TIP, Reason.TORQUE, Reason.SINKAGE)[np.unravel_index(margins.argmin(), margins.shape)[0]]
                self.assertEqual(costs.least_margin_of[k], which)
        self.assertIn(0, costs.reasons)

    def test_same_bits_as_in_process(self):
        v_x, yaw_rate = RNG.uniform(0.1, 0.8, (K, M)), RNG.uniform(-0.6, 0.6, (K, M))
        soil, grade = RNG.integers(0, 3, (K, M)), RNG.uniform(-0.1, 0.1, M)
        soil[0] = 0
        grade[3] = 0.6  # more than ice bears, or asphalt
        costs = self.client.evaluate_trajectories(
            Trajectories(v_x=v_x, yaw_rate=yaw_rate, duration=0.1, grade=grade, soil=soil, bank=0.02), "husky", steps=True)
        motions = Motions.of(v_x=v_x, yaw_rate=yaw_rate, grade=grade, bank=0.02, soil=soil)
        grade[3] = 0.06
        calm = self.client.evaluate_trajectories(
            Trajectories(v_x=v_x, yaw_rate=yaw_rate, duration=0.1, grade=grade, soil=soil, bank=0.02), "husky", steps=True)
        self.assertTrue((costs.reasons != 0).any())
        self.assertEqual(costs.steps.reasons.shape, (K, M))
        powers = self.solver.energy(motions)
        self.assertEqual(costs.steps.electric.tobytes(), powers.electric.tobytes())
        self.assertEqual(costs.steps.residual.tobytes(), powers.residual.tobytes())
        self.check(calm, Motions.of(v_x=v_x, yaw_rate=yaw_rate, grade=grade, bank=0.02, soil=soil), np.full((K, M), 0.1),
                   (K, M))
        alone = self.client.evaluate_trajectories(
            Trajectories(v_x=v_x, yaw_rate=yaw_rate, duration=0.1, grade=grade, soil=soil, bank=0.02), "husky", sds=0)
        self.assertIsNone(alone.steps)
        np.testing.assert_array_equal(alone.energy_low, alone.energy)
        np.testing.assert_allclose(alone.energy[0], calm.energy[0], rtol=1e-9)
        self.assertGreater(alone.latency, 0)

    def test_trajectories_of_different_lengths(self):
        steps, n = np.array([2, 4, 1]), 7
        curvature, length = RNG.uniform(-0.5, 0.5, n), RNG.uniform(0.1, 0.2, n)
        costs = self.client.evaluate_trajectories(
            Trajectories(v_x=[0.5, 0.4, 0.3, 0.2], curvature=curvature, length=length, steps=steps), "husky", steps=True)
        self.assertEqual((costs.energy.shape, costs.steps.electric.shape), ((3,), (n,)))
        v_x = np.array([0.5, 0.4, 0.5, 0.4, 0.3, 0.2, 0.5])
        powers = self.solver.energy(Motions.of(v_x=v_x, yaw_rate=v_x * curvature))
        self.assertEqual(costs.steps.electric.tobytes(), powers.electric.tobytes())
        duration = length / v_x
        first = 0
        for k, count in enumerate(steps):
            of = slice(first, first + count)
            np.testing.assert_allclose(costs.energy[k], (powers.electric[of] * duration[of]).sum(), rtol=1e-14)
            np.testing.assert_allclose(costs.duration[k], duration[of].sum(), rtol=1e-14)
            first += count
        self.assertIsNone(costs.go_probability_least)
        drawn = self.client.evaluate_trajectories(
            Trajectories(v_x=0.5, length=0.1, grade=[0.489, 0, 1.2], soil=self.husky.soil("floor"), steps=[1, 2, 3]),
            "husky", draws=100, margins=grouser.Margins(tip=0.05))
        self.solver.use_draws(100)
        own, _ = self.solver.probability_by_draws(
            Motions.of(v_x=0.5, grade=[0.489], soil=self.husky.soil("floor")), grouser.Margins(tip=0.05))
        self.assertEqual(drawn.go_probability_least.tolist(), [own[0], own[0], 0])
        self.assertTrue(0.3 < own[0] < 1)
        worse = self.client.evaluate_trajectories(
            Trajectories(v_x=v_x, curvature=curvature, length=length, steps=steps), "husky", worse_by_sd=1, steps=True)
        own = self.solver.energy(Motions.of(v_x=v_x, yaw_rate=v_x * curvature, worse_by_sd=1.0))
        self.assertEqual(worse.steps.electric.tobytes(), own.electric.tobytes())

    def test_refusals(self):
        good = {"v_x": np.full((2, 3), 0.5), "duration": 0.1}
        for text, change in (
                (r"trajectories.v_x_m_per_s\[4\]: nan", {"v_x": np.array([[0.5] * 3, [0.5, np.nan, 0.5]])}),
                (r"trajectories.duration_s\[0\]: 0.0", {"duration": 0}),
                ("trajectories.duration_s: none, and no length_m", {"duration": None}),
                ("trajectories.length_m: 1 entries beside duration_s", {"length": 1}),
                ("trajectories.curvature_per_m: 1 entries beside yaw_rate", {"curvature": 1, "yaw_rate": 1}),
                ("trajectories.v_x_m_per_s: none", {"v_x": None, "yaw_rate": np.zeros((2, 3))}),
                ("at step 0 of all: 0.0", {"v_x": np.zeros((2, 3)), "duration": None, "length": 1}),
                (r"trajectories.soil\[0\]: 9, expected below 3", {"soil": 9})):
            with self.assertRaisesRegex(ServerError, text) as caught:
                self.client.evaluate_trajectories(Trajectories(**{**good, **change}), "husky")
            self.assertEqual(caught.exception.code, grpc.StatusCode.INVALID_ARGUMENT)
        with self.assertRaisesRegex(ServerError, "30001 entries, at most 30000"):
            self.client.evaluate_trajectories(Trajectories(v_x=1, duration=1, steps=[30001]), "husky")
        for text, change in ((r"grade: shape \(2,\), expected \(2, 3\)", {"grade": np.zeros(2)}),
                             (r"shapes \(1, 3\), \(2, 3\), expected one", {"grade": np.zeros((1, 3))}),
                             ("of one dimension alone, expected one shape", {"v_x": 1}),
                             ("steps: float64 of shape", {"steps": [0.5]}),
                             ("v_x: dtype <U1, expected real", {"v_x": np.array([["a"]])})):
            with self.assertRaisesRegex(Error, text):
                self.client.evaluate_trajectories(Trajectories(**{**good, **change}), "husky")

    def test_grades_and_constants_have_the_same_bits(self):
        planner = grouser.SpeedPlanner(self.husky, 2)
        of_all = self.client.grades("husky")
        self.assertEqual([g.soil for g in of_all], self.husky.soils)
        for grades in (of_all, self.client.grades("husky", soils=["ice"], speed=0.3, worse_by_sd=0,
                                                  margins=grouser.Margins(tip=0.3))):
            for g in grades:
                soil = self.husky.soil(g.soil)
                own = planner.grades(0, soil) if grades is of_all else planner.grades(
                    0.3, soil, 0, grouser.Margins(tip=0.3))
                self.assertEqual((g.any, g.down, g.up, g.binding_down, g.binding_up),
                                 (own.any, own.down, own.up, own.binding_down, own.binding_up))
        served = self.client.constants([0.3, 0.8], np.array([1, 5]), "husky")
        own = self.husky.constants([0.3, 0.8], [1, 5])
        self.assertEqual(len(served), len(own))
        for s, o in zip(served, own):
            theirs = [getattr(o, name) for name in s._fields]
            self.assertEqual(repr(list(s)), repr(theirs))  # NaN is no other than NaN
        with self.assertRaisesRegex(ServerError, "steered") as caught:
            self.client.constants([1], [1], "cart")
        self.assertEqual(caught.exception.code, grpc.StatusCode.FAILED_PRECONDITION)
        with self.assertRaisesRegex(ServerError, r"soils\[0\]: 'mud'"):
            self.client.grades("husky", soils=["mud"])

    def test_the_example_reaches_its_goal(self):
        picture = pathlib.Path(self.folder, "trajectories.png")
        done = subprocess.run([sys.executable, SOURCE / "clients/python/examples/sample_trajectories.py", picture,
                               self.address], check=True, text=True, stdout=subprocess.PIPE, env=os.environ)
        self.assertRegex(done.stdout, r"^\d+ J \(90 %: \d+ to \d+\), 0\.[0-4]\d m beside the goal\n$")
        self.assertGreater(picture.stat().st_size, 10000)


if __name__ == "__main__":
    unittest.main()
