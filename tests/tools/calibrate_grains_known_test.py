#!/usr/bin/python3
"""./grouser calibrate grains --known: what of earlier runs enters a design, and what is refused.

Usage: calibrate_grains_known_test.py BIN"""

import json
import math
import os
import shutil
import subprocess
import sys
import tempfile
import unittest

import numpy

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path[:0] = [os.path.join(ROOT, *folder) for folder in (
    ("dem_offline", "calibrate_grains"), ("dem_offline", "bevameter"), ("dem_offline", "validate"),
    ("clients", "common"))]

import evidence  # noqa: E402
import known  # noqa: E402
import known_rows  # noqa: E402
import plain_yaml  # noqa: E402
import table_check  # noqa: E402
import targets as measured  # noqa: E402
import vary as varied  # noqa: E402
from calibrate_grains import hash_of  # noqa: E402
from experiment_runs import Refused  # noqa: E402

CAMPAIGNS = os.path.join(ROOT, "dem_offline", "campaigns")
SOIL = os.path.join(CAMPAIGNS, "cmu_loose.soil.yaml")
SCENE = os.path.join(CAMPAIGNS, "cmu_validate.scene.yaml")
WHEEL = os.path.join(ROOT, "surrogate", "calibrate", "measured", "cmu_wheel.yaml")


class Tables(unittest.TestCase):
    """What of the shipped table of plates and pressed wheel enters the design with wheel states."""

    def setUp(self):
        path = os.path.join(CAMPAIGNS, "cmu_plates", "design.json")
        self.table = table_check.read_table(path)
        self.vary = varied.read(os.path.join(CAMPAIGNS, "cmu_wheel", "vary.yaml"), self.table["ranges"])
        rows = sorted({key for one in self.table["points"] for key in one["outputs"]})
        self.head = {"soil": {"sha256": hash_of(SOIL)}, "scene": {"sha256": hash_of(SCENE)}, "beds": 1,
                     "engine": "6", "rows": [*rows, "wheel slip 0.2308 angle 0 load 20 f_x"]}
        self.said = []

    def known(self, **changes):
        return known.Known("d.json", {**self.table, **changes}, self.head, self.vary, self.said.append)

    def complaint(self, **changes):
        with self.assertRaises(Refused) as caught:
            self.known(**changes)
        return str(caught.exception)

    def test_every_point_is_taken(self):
        taken = [self.known().of({**self.vary.fixed, **values}) for values in self.vary.points(12)]
        self.assertEqual([one.entry["label"] if one else None for one in taken],
                         [f"s{k:03d}" for k in range(1, 12)] + [None])
        self.assertEqual([one.failed for one in taken[:11]], 10 * [False] + [True])
        self.assertEqual(taken[1].entry["ran_at"], {"press": {"wheel_friction": 0.45}})
        self.assertEqual(taken[1].outputs, self.table["points"][1]["outputs"])

    def test_what_a_design_that_was_cut_short_left_is_still_to_be_run(self):
        point = {**self.table["points"][1], "status": "part", "left": True}
        taken = self.known(points=[point], rows=self.head["rows"]).of({**self.vary.fixed, **self.vary.points(2)[1]})
        self.assertEqual(taken.asked, set(point["outputs"]))
        del point["left"]
        taken = self.known(points=[point], rows=self.head["rows"]).of({**self.vary.fixed, **self.vary.points(2)[1]})
        self.assertEqual(taken.asked, set(self.head["rows"]))

    def test_a_design_that_was_cut_short_keeps_what_is_known(self):
        with tempfile.TemporaryDirectory() as folder:
            os.makedirs(os.path.join(folder, "points", "s001"))
            with open(os.path.join(folder, "points", "s001", "spent.json"), "w", encoding="utf-8") as file:
                json.dump({"values": {**self.vary.fixed, **self.vary.points(1)[0]},  # an hour of an earlier call
                           "seconds": {"tests": 3600.0, "wheels": 0.0}}, file)
            program = os.path.join(ROOT, "dem_offline", "calibrate_grains", "calibrate_grains.py")
            call = [sys.executable, program, "--bin", BIN, WHEEL, "--soil", SOIL, "--scene", SCENE, "--vary",
                    os.path.join(CAMPAIGNS, "cmu_wheel", "vary.yaml"), "--points", "12", "--known",
                    os.path.join(CAMPAIGNS, "cmu_plates", "design.json"), "--out", folder, "--budget", "0.5",
                    "--design-only"]
            done = subprocess.run(call, check=False, capture_output=True, text=True, timeout=60)
            self.assertIn("12 points were not run", done.stderr)
            table = table_check.read_table(os.path.join(folder, "design.json"))
        left = [one for one in table["points"] if one.get("left")]
        self.assertEqual([one["label"] for one in left], [f"s{k:03d}" for k in range(1, 11)])
        self.assertEqual(left[1]["outputs"], self.table["points"][1]["outputs"])
        self.assertEqual([one["status"] for one in table["points"]], 10 * ["part"] + ["failed"])

    def test_nearest_to_what_was_measured_comes_first(self):
        rows = measured.read(os.path.join(BIN, "grouser-calibrate"), WHEEL, 0.008).rows
        misfits = [known.misfit(self.known().of({**self.vary.fixed, **at}), rows) for at in self.vary.points(12)]
        self.assertEqual(misfits.index(min(misfits)) + 1, 3)  # the posterior's mean is next to that point
        self.assertEqual(misfits[10:], [math.inf, math.inf])

    def test_refuses_what_was_run_otherwise(self):
        other = {"file": "a", "sha256": "0" * 64}
        self.assertIn("d.json: soil file: 000000000000, expected 976451fdeee0 as here", self.complaint(soil=other))
        self.assertIn("scene file: 000000000000, expected", self.complaint(scene=other))
        self.assertIn("beds: 2, expected 1", self.complaint(beds=2))
        self.assertIn("engine: 7, expected 6", self.complaint(engine="7"))
        self.assertIn("parameters: ['friction', 'rolling_friction', 'solid_fraction'], expected [",
                      self.complaint(fixed={}))
        self.assertIn("rows of plates and pressed wheel, expected the 53 rows that are run here: 1 only there, as "
                      "plate 60 mm @ 99 mm", self.complaint(rows=[*self.head["rows"], "plate 60 mm @ 99 mm"]))
        moved = [{**one, "values": {**one["values"], "friction": 0.31}} for one in self.table["points"]]
        with self.assertRaisesRegex(Refused, "none of its 11 points is one of this design"):
            self.known(points=moved).check([{**self.vary.fixed, **at} for at in self.vary.points(12)])

    def test_points_of_beds_alike_at_all_depths_stand_beside_those_of_two_layers(self):
        layers = {"top_layer_m": (0.02, 0.06), "denser_below": (0.0, 0.04)}
        self.vary = varied.Vary({**{name: tuple(ends) for name, ends in self.table["ranges"].items()}, **layers},
                                self.table["fixed"])
        one = self.known()
        self.assertIsNone(one.of({**self.vary.fixed, **self.vary.points(1)[0]}))  # its own bed has two layers
        beside = one.own_points([])
        self.assertEqual([point["label"] for point in beside], ["k" + point["label"] for point in self.table["points"]])
        self.assertEqual({point["values"]["denser_below"] for point in beside}, {0})
        self.assertGreater(len({point["values"]["top_layer_m"] for point in beside}), 8)
        for point, before in zip(beside, self.table["points"]):
            self.assertEqual({**before["values"], **point["values"]}, point["values"])
            self.assertEqual(point["outputs"], before["outputs"])
        runs = evidence.Runs({**self.table, "points": beside}, self.vary)
        reached = 0.525 + 0.045 * runs.unit("plate")[:, 2]
        numpy.testing.assert_allclose(reached, [point["solid_fraction"]["tests"] for point in beside[:10]], atol=1e-9)
        self.vary = varied.Vary({**self.vary.ranges, "youngs_modulus_pa": (1e6, 1e8)}, self.vary.fixed)
        self.assertIn("parameters:", self.complaint())  # what the soil file has is not in the table

    def test_fixed_layers_are_known_to_be_absent(self):
        ranges = {name: tuple(ends) for name, ends in self.table["ranges"].items()}
        self.vary = varied.Vary({**ranges, "denser_below": (0.0, 0.04)}, {**self.table["fixed"], "top_layer_m": 0.04})
        beside = self.known().own_points([])
        self.assertEqual(len(beside), len(self.table["points"]))
        self.assertEqual({(one["values"]["denser_below"], one["values"]["top_layer_m"]) for one in beside}, {(0, 0.04)})
        self.assertEqual(len(evidence.Runs({**self.table, "points": beside}, self.vary).points), 10)  # one failed
        self.vary = varied.Vary({**ranges, "top_layer_m": (0.02, 0.06)}, {**self.table["fixed"], "denser_below": 0.02})
        self.assertIn("d.json: denser_below: 0, expected 0.02 as here", self.complaint())
        self.vary = varied.Vary(ranges, {**self.table["fixed"], "surface_energy_j_per_m2": 0.0})
        self.assertEqual(self.known().of(self.vary.points(1)[0] | self.vary.fixed).entry["label"], "s001")

    def test_points_that_are_none_of_this_design_stand_beside_it(self):
        one = self.table["points"][0]
        rest = [{**one, "label": label, "values": {**one["values"], "friction": at}}
                for label, at in (("m001", 0.351), ("v001", 0.352), ("ks009", 0.353), ("m002", 0.9))]
        rest.append({**rest[0], "label": "m003", "values": {**rest[0]["values"], "tool_friction": 0.6}})
        points = [{**self.vary.fixed, **at} for at in self.vary.points(10)]
        got = self.known(points=[*self.table["points"], *rest]).own_points(points)
        self.assertEqual([point["label"] for point in got], ["ks011", "km001", "kv001", "kks009"])
        self.assertEqual(got[1]["values"], {**rest[0]["values"], "wheel_friction": 0.45})
        self.assertEqual(got[1]["outputs"], one["outputs"])
        self.assertEqual(self.said, ["--known d.json: 2 points left out: they lie outside the ranges, or have another "
                                     "value of what is held here"])
        again = self.known(points=[*self.table["points"], *rest]).own_points([*points, *(one["values"] for one in got)])
        self.assertEqual(again, [])

    def test_says_that_the_engine_is_not_recorded(self):
        self.known(engine="6")
        self.assertEqual(self.said, [])
        old = {key: value for key, value in self.table.items() if key != "engine"}
        known.Known("d.json", old, self.head, self.vary, self.said.append)
        self.assertIn("its engine version is not recorded, here 6", self.said[0])


class Rows(unittest.TestCase):
    """What ./grouser validate has run at the best point of plates and pressed wheel, as a point of the design."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.rows = os.path.join(CAMPAIGNS, "cmu_plates", "rows.json")
        self.start = varied.Start(plain_yaml.load(SOIL), plain_yaml.load(SCENE))
        self.vary = varied.read(os.path.join(CAMPAIGNS, "cmu_wheel", "vary.yaml"))
        wanted = measured.read(os.path.join(BIN, "grouser-calibrate"), WHEEL, 0.008).chosen("plates")
        self.head = {"engine": "6", "beds": 1, "rows": [row.key for row in wanted]}

    def point(self, path, kept=None, **head):
        if kept is None:
            with open(path, encoding="utf-8") as file:
                kept = json.load(file)
        return known_rows.point_of(path, kept, "v001", self.start, {**self.head, **head}, self.vary)

    def complaint(self, *arguments, **head):
        with self.assertRaises(Refused) as caught:
            self.point(*arguments, **head)
        return str(caught.exception)

    def test_is_a_point_with_wheel_states(self):
        one = self.point(self.rows)
        self.assertEqual(one["values"], {"friction": 0.399, "rolling_friction": 0.431, "solid_fraction": 0.5387,
                                         "wheel_friction": 0.45, "tool_friction": 0.5})
        with open(self.rows, encoding="utf-8") as file:
            by_row = {row["row"]: row["dem"] for row in json.load(file)["rows"]}
        self.assertEqual(set(one["outputs"]), {key for key in self.head["rows"] if key.startswith("wheel")})
        key = next(key for key in one["outputs"] if key.startswith("wheel slip -0.5 ") and key.endswith("f_x"))
        self.assertAlmostEqual(one["outputs"][key]["value"], by_row[3]["outputs"]["f_x"]["value"], places=5)
        self.assertAlmostEqual(one["known"]["seconds"]["wheels"],
                               sum(by_row[k]["runs"][0]["wall_s"] for k in (3, 6, 13)), delta=0.1)
        file = {"file": "", "sha256": ""}
        ranges = {name: list(ends) for name, ends in self.vary.ranges.items()}
        self.assertIsNone(table_check.fault_of({"version": 1, "soil": file, "scene": file, "points": [one], "fixed": {},
                                           "ranges": ranges}))

    def test_refuses_runs_of_something_else(self):
        self.assertIn("engine 6, expected 7 as here", self.complaint(self.rows, engine="7"))
        self.assertIn("no wheel state that is run here was run there on 2 beds", self.complaint(self.rows, beds=2))
        self.assertIn("KeyError 'engine_version', expected rows.json", self.complaint(self.rows, {}))
        with open(self.rows, encoding="utf-8") as file:
            kept = json.load(file)
        folder = os.path.dirname(self.rows)
        shutil.copy(os.path.join(folder, "calibrated.scene.yaml"), self.folder)
        path = os.path.join(self.folder, "rows.json")
        self.assertIn("no soil file of hash 742f509cb024 beside it", self.complaint(path, kept))
        with open(os.path.join(folder, "calibrated.soil.yaml"), encoding="utf-8") as file:
            text = file.read().replace("poisson_ratio: 0.3", "poisson_ratio: 0.25")
        soil = os.path.join(self.folder, "other.soil.yaml")
        with open(soil, "w", encoding="utf-8") as file:
            file.write(text)
        self.assertIn("soil file beside it: grains.poisson_ratio is not what the soil file here has at friction 0.399",
                      self.complaint(path, {**kept, "soil_sha256": hash_of(soil)}))

    def test_refuses_another_value_of_what_is_held(self):
        self.vary = varied.Vary({**self.vary.ranges}, {**self.vary.fixed, "youngs_modulus_pa": 3e6})
        there = self.start.values_of(self.start.soil, self.start.scene)["youngs_modulus_pa"]
        self.assertNotEqual(there, 3e6)
        self.assertIn(f"youngs_modulus_pa: {there:g}, expected 3e+06 as it is held here", self.complaint(self.rows))
        ranges = {name: ends for name, ends in self.vary.ranges.items() if name != "wheel_friction"}
        self.vary = varied.Vary(ranges, {"wheel_friction": 0.5})
        self.assertIn("wheel_friction: 0.45, expected 0.5 as it is held here", self.complaint(self.rows))

    def test_refuses_damaged_rows(self):
        with open(self.rows, encoding="utf-8") as file:
            text = file.read()
        self.assertTrue(self.point(self.rows, json.loads(text))["outputs"])
        for changes in ({"rows": [3]}, {"rows": [{}]}, {"bed_reached": 3}, {"bed_reached": {}}, {"soil_sha256": 3}):
            self.assertIn("expected rows.json", self.complaint(self.rows, {**json.loads(text), **changes}))
        for key, value in (("outputs", 3), ("wall_s", "x"), ("seed", []), ("outputs", {"f_x": {"mean": 1}})):
            kept = json.loads(text)
            for row in kept["rows"]:
                for run in row["dem"]["runs"] if row["dem"] else ():
                    run[key] = value
            self.assertIn("expected rows.json", self.complaint(self.rows, kept), key)
        kept = json.loads(text)
        for row in kept["rows"]:
            for run in row["dem"]["runs"] if row["dem"] else ():
                run["outputs"]["f_x"]["mean"] = math.nan
        self.assertIn("f_x: no value that is a number, expected rows.json", self.complaint(self.rows, kept))

    def test_values_are_read_back_from_what_they_make(self):
        values = {"friction": 0.4, "rolling_friction": 0.2, "wheel_friction": 0.6, "solid_fraction": 0.53,
                  "denser_below": 0.03, "top_layer_m": 0.04, "grain_diameter_m": 0.006, "surface_energy_j_per_m2": 0.5,
                  "youngs_modulus_pa": 2e7}
        soil, scene, *_ = self.start.made(values, "one")
        self.assertEqual(self.start.values_of(soil, scene), values)


if __name__ == "__main__":
    BIN = os.path.abspath(sys.argv.pop())
    unittest.main()
