#!/usr/bin/python3
"""Vehicles in Python: the C++ library's bits, motions by twist and by rim speeds, plans, refusals, threads."""

import unittest

import numpy as np
from common import differ_in_threads, reference

import grouser
from grouser import Binding, Error, Margins, Motions, Path, Reason, Solutions, SpeedOptions, Vehicle, VehicleSolver

VEHICLES = sorted(grouser.VEHICLE_DIR.glob("*.vehicle.yaml"))
HUSKY = grouser.VEHICLE_DIR / "husky.vehicle.yaml"
OPTIONS = SpeedOptions(speed_limit=1)


class VehicleTest(unittest.TestCase):
    def test_same_bits_as_the_library(self):
        rng = np.random.default_rng(2)
        n = 12
        self.assertEqual(len(VEHICLES), 6)
        for file in VEHICLES:
            vehicle = Vehicle.open(file)
            motions = Motions(v_x=rng.uniform(0.02, 0.5, n), yaw_rate=rng.uniform(-0.1, 0.1, n))
            motions.v_x[3] = np.nan
            solver = VehicleSolver(vehicle)
            s, p = solver.solve(motions), solver.energy(motions)
            least, most = solver.probability_to_go(motions)
            path = Path.of(0.1 * np.arange(n), motions.yaw_rate)
            plan = grouser.SpeedPlanner(vehicle, n).plan(path, OPTIONS)
            got = [s.residual, s.rim_speed, s.wheel.load, p.electric, p.joules_per_metre_low, p.joules_per_metre_high,
                   least, most, plan.speed, plan.safe]
            expected = reference("vehicle", file, motions.v_x, motions.yaw_rate)
            self.assertEqual(np.concatenate([a.ravel() for a in got]).tobytes(), expected.tobytes(), file)
            self.assertEqual(s.reasons[3], Reason.INPUT)
            self.assertEqual(s.wheel.load.shape, (n, vehicle.wheels))
            self.assertEqual(plan.not_held, int((~plan.holds).sum()))

    def test_properties(self):
        husky = Vehicle.open(HUSKY)
        self.assertEqual((husky.name, husky.wheels, husky.drives, husky.steered), ("husky", 4, 2, False))
        self.assertEqual(husky.soils, ["asphalt", "floor", "ice"])
        self.assertEqual(husky.soil("ice"), 2)
        self.assertEqual(husky.wheel_names[1], "front_right")
        with self.assertRaisesRegex(Error, "asfalt.*asphalt"):
            husky.soil("asfalt")

    def test_rim_speeds_give_the_twist_back(self):
        husky = Vehicle.open(HUSKY)
        solver = VehicleSolver(husky)
        asked = Motions.of(v_x=[[0.5, 0.4], [0.3, 0.6]], yaw_rate=0.2, soil=1, grade=0.05)
        there = solver.solve(asked)
        self.assertEqual(there.rim_speed.shape, (2, 2, 2))
        self.assertFalse(there.reasons.any())
        back = solver.solve(Motions.of(rim_speed=there.rim_speed, soil=np.full((2, 2, 4), 1), grade=0.05))
        np.testing.assert_allclose(back.v_x, asked.v_x, rtol=1e-4)
        np.testing.assert_allclose(back.yaw_rate, 0.2, rtol=1e-3)
        np.testing.assert_allclose(there.wheel.load.sum(-1), 70 * 9.81 * np.cos(0.05), rtol=1e-3)
        p = solver.energy(asked)
        parts = p.drive + p.rolling + p.slip + p.scrub + p.grade + p.acceleration + p.imbalance
        np.testing.assert_allclose(parts, p.electric, rtol=1e-9)
        self.assertTrue((p.electric_low < p.electric).all() and (p.electric < p.electric_high).all())

    def test_writes_in_place_and_only_what_is_asked(self):
        husky = Vehicle.open(HUSKY)
        motions = Motions.of(v_x=[0.5, 0.6])
        out = Solutions.empty(2, husky.wheels, husky.drives, ("wheel.slip", "v_y"))
        slip = out.wheel.slip
        self.assertIs(VehicleSolver(husky).solve(motions, out), out)
        self.assertIs(out.wheel.slip, slip)
        self.assertIsNone(out.residual)
        np.testing.assert_array_equal(slip, VehicleSolver(husky).solve(motions).wheel.slip)

    def test_plan_grades_constants_draws(self):
        husky = Vehicle.open(HUSKY)
        planner = grouser.SpeedPlanner(husky, 100)
        path = Path.of(0.1 * np.arange(100), 0.5 * np.sin(0.1 * np.arange(100)), soil=2)
        plan = planner.plan(path, SpeedOptions(speed_limit=1, margins=Margins(tip=0.2)))
        self.assertEqual(plan.not_held, 0)
        self.assertLessEqual({Binding(b) for b in plan.binding}, set(Binding))
        self.assertGreater(plan.speed.max(), 0.3)
        with self.assertRaisesRegex(Error, "use_draws before"):
            planner.plan_by_draws(path, OPTIONS, plan)
        planner.use_draws(20)
        share, at = planner.plan_by_draws(path, OPTIONS, plan, by_point := np.empty(100)), by_point
        self.assertTrue(0 <= share <= at.min() <= at.max() <= 1)
        grades = planner.grades(0.5, husky.soil("asphalt"))
        self.assertTrue(grades.any and grades.down < 0 < grades.up)
        self.assertIsInstance(Binding(grades.binding_up), Binding)
        constants = husky.constants([0.5], [1, 5])
        self.assertEqual([(c.soil, c.radius) for c in constants[:2]], [("asphalt", 1.0), ("asphalt", 5.0)])
        self.assertGreater(constants[0].separation_multiplier, 1)
        solver = VehicleSolver(husky)
        motions = Motions.of(v_x=0.5, grade=[0, 0.3], soil=2)
        with self.assertRaisesRegex(Error, "use_draws before"):
            solver.probability_by_draws(motions)
        solver.use_draws(50)
        least, most = solver.probability_by_draws(motions, Margins())
        self.assertTrue((least <= most).all() and least[0] > least[1])

    def test_refusals(self):
        husky = Vehicle.open(HUSKY)
        solver, planner = VehicleSolver(husky), grouser.SpeedPlanner(husky, 10)
        path = Path.of(np.arange(10.0))
        refused = [
            ("v_x: NoneType, expected", solver.solve, Motions()),
            ("yaw_rate: shape", solver.solve, Motions(np.zeros(3), np.zeros(2))),
            ("rim_speed: shape \\(3, 3\\), expected \\(3, 2\\)", solver.solve, Motions(rim_speed=np.zeros((3, 3)))),
            ("rim_speed: shape \\(\\), expected one dimension more", solver.solve, Motions(rim_speed=np.zeros(()))),
            ("v_x", solver.solve, Motions(np.zeros(3), rim_speed=np.zeros((3, 2)))),
            ("steering", solver.solve, Motions(np.zeros(3), steering=np.zeros(3))),
            ("draw: dtype int64, expected int32", solver.solve, Motions(np.zeros(3), draw=np.zeros(3, int))),
            ("soil: shape \\(3, 5\\), expected", solver.solve, Motions(np.zeros(3), soil=np.zeros((3, 5), np.uint8))),
            ("soil: dtype float64, expected uint8", solver.energy, Motions(np.zeros(3), soil=np.zeros(3))),
            ("int has no rim_speed", solver.energy, 3),
            ("wheel.load: shape", solver.solve, Motions(np.zeros(3)),
             Solutions(np.zeros(3, np.uint32), wheel=grouser.WheelArrays(load=np.zeros(3)))),
            ("points: 11", planner.plan, Path.of(np.arange(11.0)), OPTIONS),
            ("points: 1\\.", planner.plan, Path.of([0.0]), OPTIONS),
            ("s: shape \\(2, 5\\), expected \\(n,\\)", planner.plan, Path(np.zeros((2, 5))), OPTIONS),
            ("s\\[1\\]: 0.0*, expected", planner.plan, Path.of(np.zeros(5)), OPTIONS),
            ("curvature\\[0\\]: ", planner.plan, Path.of(np.arange(5.0), np.nan), OPTIONS),
            ("speed_limit: ", planner.plan, path, SpeedOptions(speed_limit=0)),
            ("margins.tip: ", planner.plan, path, SpeedOptions(speed_limit=1, margins=Margins(tip=2))),
            ("speed: ", planner.grades, np.nan),
            ("soil: ", planner.grades, 0.5, 77),
            ("", husky.constants, [0.5], []),
            ("", husky.constants, [np.nan], [1]),
            ("1024", solver.use_draws, 1025),
            ("larger than", grouser.SpeedPlanner, husky, 2**62),
        ]
        for text, call, *arguments in refused:
            with self.assertRaisesRegex(Error, text, msg=text):
                call(*arguments)
        with self.assertRaisesRegex(Error, "sds: "):
            solver.energy(Motions(np.zeros(3)), sds=-1)
        for call, arguments in ((VehicleSolver, [None]), (planner.plan, [path, None]), (planner.plan, [path]),
                                (grouser.SpeedPlanner, [husky, -1]), (planner.grades, [0.5, 256])):
            with self.assertRaises(TypeError):
                call(*arguments)
        self.assertTrue(VehicleSolver(husky).solve(Motions(np.zeros(3), soil=np.full(3, 9, np.uint8))).reasons.all())

    def test_threads_share_a_solver(self):
        husky = Vehicle.open(HUSKY)
        solver = VehicleSolver(husky)
        motions = Motions.of(v_x=np.linspace(0.1, 1, 300), yaw_rate=0.3)
        self.assertEqual(differ_in_threads(lambda: solver.solve(motions).residual.tobytes()), 0)


if __name__ == "__main__":
    unittest.main()
