#!/usr/bin/python3
"""clients/ros without ROS: the library's forces bit by bit, slips, margins and covariance beside the vehicle's
constants, bad input."""

import array
import math
import pathlib
import tempfile
import types
import unittest

import numpy as np
from grouser_ros import monitor, parameters
from vehicles import ROVER, SAND, SPEEDS, Turn, quaternion, relative, shipped

import grouser
from grouser import Error, Model, Motions, Reason, States, Vehicle, VehicleSolver

FORCES = ("f_x", "f_y", "torque", "m_z", "sinkage")


class MonitorTest(unittest.TestCase):
    def test_same_forces_as_the_model(self):
        """The wheel's answers are the model's at the state that stands beside them."""
        rover, sand = Vehicle.open(ROVER), Model.open(SAND)
        for v_x, yaw_rate in ((0.05, 0.0), (0.05, 0.04), (0.08, -0.03)):
            turn = Turn(rover, v_x, yaw_rate)
            out = turn.ask(turn.monitor(rover, margins=False))
            self.assertEqual(len(out.wheels), 4)
            states = States.of(*([getattr(w, n) for w in out.wheels]
                                 for n in ("model_v_x", "model_v_y", "model_rim_speed", "load")))
            own = sand.evaluate(states)
            for name in FORCES:
                self.assertLess(relative([getattr(w, name) for w in out.wheels], getattr(own, name).value), 1e-12, name)
            self.assertGreater(abs(out.wheels[0].f_x) + abs(out.wheels[0].torque), 0.01)
            self.assertEqual([w.flags for w in out.wheels], own.flags.tolist())

    def test_same_answers_as_the_solver(self):
        for name, speed in SPEEDS.items():
            vehicle = shipped(name)
            turn = Turn(vehicle, speed, 0.1 * speed, soil=len(vehicle.soils) - 1, grade=0.02, bank=-0.01)
            m = turn.monitor(vehicle, soil=vehicle.soils[-1])
            m.set_orientation(*quaternion(0.02, -0.01))
            out = turn.ask(m)
            self.assertAlmostEqual(out.grade, 0.02, delta=1e-12)
            self.assertAlmostEqual(out.bank, -0.01, delta=1e-12)
            asked = Motions.of(v_x=[speed], yaw_rate=0.1 * speed, soil=len(vehicle.soils) - 1, grade=out.grade,
                               bank=out.bank)
            solver = VehicleSolver(vehicle)
            s, e, p = solver.solve(asked), solver.energy(asked), solver.probability_to_go(asked)
            self.assertEqual([w.load for w in out.wheels], s.wheel.load[0].tolist())
            self.assertEqual([w.f_x for w in out.wheels], s.wheel.f_x[0].tolist())
            self.assertEqual((out.electric_power, out.electric_power_low, out.electric_power_high),
                             (e.electric[0], e.electric_low[0], e.electric_high[0]))
            self.assertEqual((out.joules_per_metre, out.p_go_least, out.p_go_most),
                             (e.joules_per_metre[0], p[0][0], p[1][0]))
            self.assertEqual((out.shaft_power, out.tip_margin, out.torque_margin, out.sinkage_margin, out.reasons),
                             (s.shaft_power[0], s.tip_margin[0], s.torque_margin[0], s.sinkage_margin[0], 0))
            self.assertEqual((out.vehicle, out.soil, out.motion_from, out.problem),
                             (vehicle.name, vehicle.soils[-1], monitor.TWIST, ""))

    def test_measured_slips(self):
        """Of wheels that turn as the solver has them they are the solver's; faster ones slip more."""
        for name, speed in SPEEDS.items():
            vehicle = shipped(name)
            turn = Turn(vehicle, speed, 0.2 * speed)
            m = turn.monitor(vehicle, margins=False)
            for wheel in turn.ask(m).wheels:
                self.assertAlmostEqual(wheel.slip, wheel.model_slip, delta=1e-9, msg=name)
                self.assertAlmostEqual(wheel.slip_angle, wheel.model_slip_angle, delta=1e-9, msg=name)
            out = turn.ask(m, velocity=[2 * v for v in turn.velocity])
            for wheel, place in zip(out.wheels, vehicle.wheel_places):
                self.assertGreater(wheel.slip, 0.4)
                self.assertAlmostEqual(wheel.rim_speed, 2 * wheel.model_rim_speed, delta=1e-12)
        rest = Turn(vehicle, 0.0, 0.0).ask(m)
        self.assertTrue(all(math.isnan(w.slip) for w in rest.wheels))
        self.assertTrue(math.isnan(rest.joules_per_metre))

    def test_joint_states_alone_give_the_twist_back(self):
        for name, speed in SPEEDS.items():
            vehicle = shipped(name)
            turn = Turn(vehicle, speed, 0.15 * speed)
            out = turn.ask(turn.monitor(vehicle, margins=False), with_twist=False)
            self.assertEqual((out.motion_from, out.predicted_reasons), (monitor.JOINT_STATES, 0), name)
            self.assertEqual((out.v_x, out.v_y, out.yaw_rate),
                             (out.predicted_v_x, out.predicted_v_y, out.predicted_yaw_rate))
            self.assertAlmostEqual(out.v_x / speed, 1, delta=1e-4, msg=name)
            self.assertAlmostEqual(out.yaw_rate / (0.15 * speed), 1, delta=1e-3, msg=name)

    def test_covariance_is_that_of_the_constants(self):
        """To first order in the ground's deviation: constants turn the multipliers' intervals into variances."""
        for name in ("husky", "warthog"):
            vehicle, speed = shipped(name), SPEEDS[name]
            for soil, c in enumerate(vehicle.constants([speed], [5.0])):
                turn = Turn(vehicle, speed, speed / 5, soil=soil)
                out = turn.ask(turn.monitor(vehicle, soil=vehicle.soils[soil], margins=False,
                                            least_variance=[1e-20] * 3))
                covariance = np.reshape(out.predicted_covariance, (3, 3))
                np.testing.assert_array_equal(covariance, covariance.T)
                self.assertLess(np.linalg.eigvalsh(covariance)[1], 1e-9 * np.trace(covariance))  # one deviation
                np.testing.assert_allclose(np.sqrt(np.diag(covariance)[[0, 2]]),
                                           np.sqrt([c.variance_speed, c.variance_yaw_rate]), rtol=0.1)
        turn = Turn(vehicle, 1.0, 0.2)
        bare, more = (turn.ask(turn.monitor(vehicle, margins=False, least_variance=v)).predicted_covariance
                      for v in ([1e-20] * 3, (1e-4, 2e-4, 3e-4)))
        np.testing.assert_allclose(np.subtract(more, bare), [1e-4, 0, 0, 0, 2e-4, 0, 0, 0, 3e-4], atol=1e-18)

    def test_traction_margin_is_the_constants_pull(self):
        for name in ("husky", "warthog"):
            vehicle, speed = shipped(name), SPEEDS[name]
            for soil, c in enumerate(vehicle.constants([speed], [5.0])):
                for sense in (1, -1):
                    turn = Turn(vehicle, sense * speed, 0.0, soil=soil)
                    out = turn.ask(turn.monitor(vehicle, soil=vehicle.soils[soil]))
                    got = (out.traction_margin, out.traction_margin_low)
                    if sense > 0:
                        self.assertEqual(got, (c.pull_over_weight, c.pull_low), (name, c.soil))
                    self.assertTrue(0 <= got[1] <= got[0] < 1)

    def test_traction_margin_of_a_tall_vehicle_and_of_a_slope(self):
        text = (grouser.VEHICLE_DIR / "husky.vehicle.yaml").read_text()
        file = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()), "tall.vehicle.yaml")
        file.write_text(text.replace("centre_m: [0, 0, 0.25]", "centre_m: [0, 0, 0.5]"))
        tall = Vehicle.open(file)
        turn = Turn(tall, 0.5, 0.0)
        out = turn.ask(turn.monitor(tall))
        self.assertLess(out.traction_margin, 0.256 / 0.5)  # it tips over its rear wheels before they slip
        self.assertEqual(out.traction_margin, tall.constants([0.5], [5.0])[0].pull_over_weight)
        husky, margins = shipped("husky"), []
        for v_x, grade in ((0.5, 0.1), (0.5, -0.1), (-0.5, 0.1)):  # up, down, down backwards
            turn = Turn(husky, v_x, 0.0)
            m = turn.monitor(husky)
            m.set_orientation(*quaternion(grade, 0.0))
            margins.append(turn.ask(m).traction_margin)
        self.assertAlmostEqual(margins[1] - margins[0], 2 * math.sin(0.1), delta=0.002)
        self.assertAlmostEqual(margins[1], margins[2], delta=0.002)

    def test_no_traction_is_in_words(self):
        husky = shipped("husky")
        turn = Turn(husky, 0.5, 0.0, soil=husky.soil("ice"))
        m = turn.monitor(husky, soil="ice")
        m.set_orientation(*quaternion(0.3, 0.0))  # 17 degrees of ice
        out = turn.ask(m)
        self.assertTrue(out.reasons & Reason.BALANCE)
        self.assertTrue(math.isnan(out.traction_margin) and math.isnan(out.traction_margin_low))
        self.assertEqual(out.problem, "")
        self.assertLess(out.p_go_most, 0.01)
        m = turn.monitor(husky, soil="ice")
        m.set_orientation(*quaternion(0.3, 0.0))
        out = turn.ask(m, with_twist=False)  # nor do these rim speeds give a twist
        self.assertTrue(out.reasons & Reason.BALANCE and not out.reasons & Reason.INPUT)
        self.assertEqual((out.problem, out.predicted_reasons, out.wheels), ("", out.reasons, []))
        self.assertTrue(all(math.isnan(getattr(out, n)) for n in monitor.NUMBERS if n not in ("grade", "bank")))

    def test_covariance_where_worse_ground_has_no_solution(self):
        """Then of mean and better ground; where neither has one there is none, and a reason."""
        husky, z = shipped("husky"), grouser.WORSE_BY_SD
        turn = Turn(husky, 0.5, 0.0, soil=husky.soil("ice"), grade=0.1)
        m = turn.monitor(husky, soil="ice", margins=False, least_variance=[1e-20] * 3)
        m.set_orientation(*quaternion(0.1, 0.0))
        out = turn.ask(m)
        sides = [m.reader.drive_speeds(np.array([w.rim_speed for w in out.wheels]), 0.0)] * 3
        s = m.solver.solve(Motions.of(rim_speed=sides, worse_by_sd=[0, z, -z], soil=husky.soil("ice"), grade=out.grade,
                                      bank=out.bank))
        solved = s.residual <= grouser.BALANCED_RESIDUAL
        self.assertEqual(solved.tolist(), [True, False, True])
        self.assertEqual((out.predicted_reasons, out.predicted_v_x), (0, s.v_x[0]))
        slope = np.array([(v[2] - v[0]) / -z for v in (s.v_x, s.v_y, s.yaw_rate)])
        np.testing.assert_allclose(np.reshape(out.predicted_covariance, (3, 3)), np.outer(slope, slope), rtol=1e-9,
                                   atol=1e-18)
        whole = m.solver.solve

        def mean_alone(motions, **named):
            found = whole(motions, **named)
            if motions.worse_by_sd is not None and np.size(motions.worse_by_sd) == 3:
                found.residual[1:] = 1.0
            return found

        m.solver = types.SimpleNamespace(solve=mean_alone, energy=m.solver.energy)
        out = turn.ask(m)
        self.assertEqual((out.predicted_v_x, out.predicted_reasons), (s.v_x[0], Reason.BALANCE))
        self.assertTrue(np.isnan(out.predicted_covariance).all())

    def test_rest(self):
        """Below least_speed a motion is rest; wheels that turn at rest slip all the same."""
        husky = shipped("husky")
        turn = Turn(husky, 0.5, 0.0)
        m = turn.monitor(husky, margins=False)
        m.set_twist(1e-6, 0, 0)
        out = turn.ask(m, with_twist=False, velocity=[1e-6, -1e-6, 0.0, 1.0])
        self.assertEqual((out.motion_from, out.v_x, out.reasons), (monitor.TWIST, 0.0, 0))
        self.assertTrue(all(math.isnan(getattr(out, n)) for n in monitor.ENERGY if "joules" in n))
        self.assertEqual([math.isnan(w.slip) for w in out.wheels], [True, True, True, False])
        self.assertEqual(out.wheels[3].slip, 1.0)
        self.assertTrue(all(math.isnan(w.slip_angle) for w in out.wheels))
        m.set_twist(1e-6, 0, 0.3)  # in place: its wheels move
        out = turn.ask(m, with_twist=False)
        self.assertEqual(out.yaw_rate, 0.3)
        self.assertTrue(math.isnan(out.joules_per_metre) and math.isfinite(out.wheels[0].slip_angle))
        m = turn.monitor(husky, margins=False, least_speed=1e-7)
        m.set_twist(1e-6, 0, 0)
        self.assertEqual(turn.ask(m, with_twist=False).v_x, 1e-6)

    def test_soil_changes(self):
        husky = shipped("husky")
        turn = Turn(husky, 0.5, 0.2)
        m = turn.monitor(husky)
        firm = turn.ask(m)
        m.set_soil("ice")
        self.assertLess(turn.ask(m).traction_margin, 0.5 * firm.traction_margin)
        with self.assertRaisesRegex(Error, "iec.*ice"):
            m.set_soil("iec")
        self.assertEqual(turn.ask(m).soil, "ice")


class BadInputTest(unittest.TestCase):
    def setUp(self):
        self.husky = shipped("husky")
        self.turn = Turn(self.husky, 0.5, 0.2)
        self.monitor = self.turn.monitor(self.husky)

    def refuses(self, pattern, **changed):
        out = self.turn.ask(self.monitor, **changed)
        self.assertRegex(out.problem, pattern)
        self.assertEqual((out.reasons, out.wheels), (Reason.INPUT, []))
        self.assertTrue(all(math.isnan(getattr(out, n)) for n in monitor.NUMBERS))
        self.assertTrue(np.isnan(out.predicted_covariance).all())
        self.assertEqual(self.turn.ask(self.monitor).problem, "")  # the next one is answered

    def test_joint_states(self):
        turn = self.turn
        spins = list(turn.velocity)
        spins[1] = math.nan
        self.refuses("velocity of 'front_right_spin': got nan, expected a finite number", velocity=spins)
        self.refuses("velocity: got 0 entries, expected 4, one a name", velocity=[])
        self.refuses("got no joint 'rear_left_spin' among front_left_spin, front_right_spin, expected it$",
                     names=turn.names[:2], velocity=spins[:2])
        others = [n.replace("rear_left", "raer_left") for n in turn.names]
        self.refuses("got no joint 'rear_left_spin' .* did you mean 'raer_left_spin'", names=others)
        self.assertIsNone(turn.ask(self.monitor, names=["elbow", "wrist"], velocity=[0, 0], position=[0, 0]))
        self.assertIsNone(turn.ask(self.monitor, names=[], velocity=[], position=[]))

    def test_twist_and_orientation(self):
        with self.assertRaisesRegex(Error, "twist: got v_x nan"):
            self.monitor.set_twist(math.nan, 0, 0)
        self.refuses("twist: got v_x nan, v_y 0, yaw rate 0, expected finite", with_twist=False)
        with self.assertRaisesRegex(Error, r"imu: orientation: got \(0, 0, 0, 0\), expected a quaternion of length 1"):
            self.monitor.set_orientation(0, 0, 0, 0)
        self.assertRegex(self.turn.ask(self.monitor).problem, "imu: orientation")
        for bank in (math.radians(170), math.radians(-91), math.pi):
            with self.assertRaisesRegex(Error, "orientation: got .* whose z axis points down"):
                self.monitor.set_orientation(*quaternion(0.0, bank))
            self.assertRegex(self.turn.ask(self.monitor).problem, "whose z axis points down")
        for grade, bank in ((0.1, 1.5), (-1.2, -1.4)):
            self.monitor.set_orientation(*quaternion(grade, bank))
            out = self.turn.ask(self.monitor)
            self.assertAlmostEqual(out.grade, grade, delta=1e-12)
            self.assertAlmostEqual(out.bank, bank, delta=1e-12)
        self.monitor.set_orientation(0, 0, 0, 1)
        self.assertEqual(self.turn.ask(self.monitor).problem, "")

    def test_free_wheels_need_no_joint(self):
        cart = shipped("cart")
        turn = Turn(cart, 1.0, 0.1)
        names = [n for n in turn.names if n != "front_left_spin"]
        keep = [turn.names.index(n) for n in names]
        out = turn.ask(turn.monitor(cart, margins=False), names=names, velocity=[turn.velocity[i] for i in keep],
                       position=[turn.position[i] for i in keep])
        self.assertEqual((out.problem, out.reasons), ("", 0))
        self.assertTrue(math.isnan(out.wheels[0].slip))
        self.assertTrue(math.isfinite(out.wheels[1].slip))
        spins = list(turn.velocity)
        spins[turn.names.index("front_left_spin")] = math.inf
        out = turn.ask(turn.monitor(cart, margins=False), velocity=spins)
        self.assertEqual((out.problem, out.reasons), ("", 0))
        self.assertTrue(math.isnan(out.wheels[0].slip) and math.isfinite(out.wheels[1].slip))

    def test_steering_joints_that_disagree(self):
        cart = shipped("cart")
        turn = Turn(cart, 1.0, 0.1)
        m = turn.monitor(cart, margins=False)
        at = turn.names.index("front_left_steer")
        for off, problem in ((0.4, "position of '.*_steer': got .*, expected .* by the mean of all steering joints"),
                             (0.1, "^$")):
            angles = list(turn.position)
            angles[at] += off
            self.assertRegex(turn.ask(m, position=angles).problem, problem)

    def test_parameters(self):
        def make(**given):
            return parameters.make(parameters.checked(lambda name, default: given.get(name, default)))

        husky = str(grouser.VEHICLE_DIR / "husky.vehicle.yaml")
        cart = str(grouser.VEHICLE_DIR / "cart.vehicle.yaml")
        self.assertEqual(make(vehicle=husky, soil="ice")[0].soil, "ice")
        numbers = array.array("d", [1e-4, 1e-4, 1e-4])  # as ROS 2 gives them
        self.assertEqual(make(vehicle=husky, least_variance=numbers)[0].least_variance[0, 0], 1e-4)
        sides = [f"{w}:{w.split('_')[1]}_chain" for w in ("front_left", "front_right", "rear_left", "rear_right")]
        self.assertEqual(make(vehicle=husky, joints=sides)[0].reader.spin, ["left_chain", "right_chain"] * 2)
        self.assertEqual(make(vehicle=cart, steering_joints=["front_left:steer"])[0].reader.steers, {0: "steer"})
        for pattern, given in (
                ("got neither vehicle nor map", {}),
                ("gone.vehicle.yaml", {"vehicle": "/gone.vehicle.yaml"}),
                ("soil: got mud, expected", {"vehicle": husky, "soil": "mud"}),
                ("joints: got 'front_left', expected WHEEL:JOINT", {"vehicle": husky, "joints": ["front_left"]}),
                ("joints: got wheel 'middle', expected of front_left, ", {"vehicle": husky, "joints": ["middle:a"]}),
                ("steering_joints: got none, expected one or more of the wheels front_left, front_right",
                 {"vehicle": cart}),
                ("steering_joints: got wheel 'rear_left', expected of front_left", {
                    "vehicle": cart, "steering_joints": ["rear_left:a"]}),
                ("steering_joints: got wheel 'rear_left', expected of none", {
                    "vehicle": husky, "steering_joints": ["rear_left:a"]}),
                ("joints: got 'a' of wheel 'front_right' and of another, expected one for each drive", {
                    "vehicle": husky, "joints": [f"{w}:a" for w in ("front_left", "front_right", "rear_left",
                                                                    "rear_right")]}),
                ("joints: got 'a' of wheel 'rear_left' and of another, .* others for steering", {
                    "vehicle": cart, "joints": ["rear_left:a"], "steering_joints": ["front_left:a"]}),
                ("joints: got wheel 'front_left' twice", {
                    "vehicle": husky, "joints": ["front_left:a", "front_left:b"]}),
                ("twist_type: got 'Pose', expected of Twist, TwistStamped, Odometry", {
                    "vehicle": husky, "twist_type": "Pose"}),
                ("max_age: got 'long', expected one like 0.5", {"vehicle": husky, "max_age": "long"}),
                ("max_age: got -1, expected a number above 0", {"vehicle": husky, "max_age": -1}),
                ("max_age: got nan, expected one like 0.5", {"vehicle": husky, "max_age": math.nan}),
                ("least_speed: got 0, expected a number above 0", {"vehicle": husky, "least_speed": 0}),
                (r"least_variance: got \[0, 0, 0\], expected 3 numbers above 0", {
                    "vehicle": husky, "least_variance": [0, 0, 0]}),
                (r"datum: got \[nan, 0.0\]", {"vehicle": husky, "datum": [math.nan, 0.0]}),
                ("way: got 37, expected one like 'least'; text that reads as a number takes quotes: \"'045'\"", {
                    "vehicle": husky, "way": 37}),
                ("margins: got 1, expected one like True", {"vehicle": husky, "margins": 1}),
                (r"least_variance: got \[0, 0\], expected 3 numbers", {"vehicle": husky, "least_variance": [0, 0]}),
                (r"datum: got \[1.0\]", {"vehicle": husky, "datum": [1.0]}),
                ("/gone: got .*expected a folder of ./grouser map|python3-gdal", {"map": "/gone"})):
            with self.assertRaisesRegex(Error, pattern):
                make(**given)


if __name__ == "__main__":
    unittest.main()
