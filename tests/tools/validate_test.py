#!/usr/bin/python3
"""./grouser validate: what a measured table says, and one validation from table to page.

Usage: validate_test.py BIN"""

import json
import math
import os
import sys
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path[:0] = [os.path.join(ROOT, "dem_offline", "validate"), os.path.join(ROOT, "clients", "common")]

import forked  # noqa: E402
import measured_table as measured  # noqa: E402
import validate  # noqa: E402
import wheel_campaign as campaigns  # noqa: E402

TABLE = os.path.join(ROOT, "dem_offline", "campaigns", "measured", "cmu_smooth_wheel.csv")
SMOKE = os.path.join(ROOT, "dem_offline", "campaigns", "smoke.scene.yaml")


class Tables(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def table(self, text):
        path = os.path.join(self.folder.name, "table.csv")
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
        return path

    def read(self, path, columns=()):
        return measured.read(os.path.join(BIN, "grouser-calibrate"), path, (0.0625, 0.05), columns)

    def complaint(self, text, columns=()):
        with self.assertRaises(measured.TableError) as caught:
            self.read(self.table(text), columns)
        return str(caught.exception)

    def test_regions_of_the_measured_wheel(self):
        rows = self.read(TABLE)
        names = measured.find_regions(os.path.join(BIN, "grouser-fit"), [])
        counts = {name: sum(name in row.regions for row in rows) for name in names}
        self.assertEqual(counts, {"braking <= 0.2, driving": 18, "straight of these": 6, "not locked": 24, "locked": 3})

    def test_maps_columns_and_their_units(self):
        path = self.table("beta_deg,rim,V,Fz,DP,DP_sd,z,n\n60,3,10,20.55,-20.81,0.53,41.81,3\n")
        row, = self.read(path, ["beta_deg=attack_angle:deg,rim=rim_speed:mm/s", "V=travel_speed:mm/s,Fz=load:N",
                                "DP=f_x:N,DP_sd=f_x_sd:N,z=sinkage:mm,n=repeats"])
        self.assertAlmostEqual(row.slip, -0.2)  # against V cos(beta), not V
        self.assertAlmostEqual(row.value["sinkage"], 0.04181)
        self.assertAlmostEqual(row.error("f_x"), 0.53 / math.sqrt(3))
        self.assertTrue(math.isnan(row.error("sinkage")))

    def test_says_what_is_wrong_and_where(self):
        head = "slip,attack_angle_deg,load_n,f_x_n\n"
        self.assertIn("table.csv:2: column 'f_x_n': got 'much', expected a finite number",
                      self.complaint(head + "0,0,20,much\n"))
        self.assertIn("3 fields, expected 4", self.complaint(head + "0,0,20\n"))
        self.assertIn("load: got 0 N", self.complaint(head + "0,0,0,1\n"))
        self.assertIn("table.csv:2: no motion", self.complaint(head + "30,0,20,1\n"))
        self.assertIn("has no load", self.complaint("slip,attack_angle_deg,f_x_n\n0,0,1\n"))
        self.assertIn("one measured output at least", self.complaint("slip,attack_angle_deg,load_n\n0,0,1\n"))
        self.assertIn("'pull' is nothing that a wheel test has", self.complaint(head + "0,0,20,1\n", ["f_x_n=pull:N"]))
        self.assertIn("unit 'kg' of column 'f_x_n'", self.complaint(head + "0,0,20,1\n", ["f_x_n=f_x:kg"]))
        self.assertIn("no column 'F'", self.complaint(head + "0,0,20,1\n", ["F=f_x:N"]))
        with self.assertRaisesRegex(measured.TableError, "expected rows 1 to 2"):
            measured.choose([1, 2], "1,3")

    def test_errors_by_region(self):
        def row(measured_value, dem_value):
            return {"regions": ["not locked"], "measured": {"f_x": {"value": measured_value, "standard_error": None}},
                    "dem": {"outputs": {"f_x": {"value": dem_value, "standard_error": 0.5}}}}
        one, = validate.errors_by_region([row(1.0, 4.0), row(2.0, -2.0)], ["not locked"])
        self.assertAlmostEqual(one["rms"], math.sqrt((9 + 16) / 2))
        self.assertAlmostEqual(one["mean"], -0.5)
        self.assertAlmostEqual(one["standard_error"], math.sqrt(2.25 + 4) / (2 * one["rms"]))

    def test_beds_are_averaged_and_their_spread_is_the_error(self):
        def record(value, error):
            return campaigns.summary_of({"status": "RUN_STATUS_STEADY", "spec": {}, "equal_travel": {"outputs": [
                {"name": "f_x", "mean": value, "standard_error": error}]}})
        mean = campaigns.over_beds([record(1.0, 0.1), record(3.0, 0.1)])
        self.assertAlmostEqual(mean["outputs"]["f_x"]["value"], 2.0)
        self.assertAlmostEqual(mean["outputs"]["f_x"]["standard_error"], 1.0)
        self.assertTrue(mean["equal_travel"])
        own = campaigns.summary_of({"status": "RUN_STATUS_OVERLOAD", "spec": {}, "outputs": [
            {"name": "f_x", "mean": 5.0, "standard_error": 0.2}]})
        self.assertFalse(campaigns.over_beds([record(1.0, 0.1), own])["equal_travel"])


class WholeWay(unittest.TestCase):
    def run_it(self, out, *more):
        return forked.call(validate.main, "validate.py", "--bin", BIN, os.path.join(out, "table.csv"), "--soil",
                           os.path.join(out, "s.soil.yaml"), "--scene", SMOKE, "--beds", "1", "--jobs", "1", "--out",
                           os.path.join(out, "v"), *more)

    def test_from_table_to_page_and_again(self):
        with tempfile.TemporaryDirectory() as out:
            with open(os.path.join(out, "table.csv"), "w", encoding="utf-8") as file:
                file.write("slip,attack_angle_deg,load_n,f_x_n,sinkage_mm\n0.3,0,1.5,0.1,4\n-1,0,1.5,-1,\n")
            import yaml
            with open(SMOKE, encoding="utf-8") as file:
                soil = yaml.safe_load(file)["soil"]
            soil["name"] = "from-a-file"
            with open(os.path.join(out, "s.soil.yaml"), "w", encoding="utf-8") as file:
                yaml.safe_dump(soil, file)
            first = self.run_it(out)
            self.assertEqual(first.returncode, 0, first.stderr)
            with open(os.path.join(out, "v", "rows.json"), encoding="utf-8") as file:
                result = json.load(file)
            self.assertEqual(result["soil"], "from-a-file")
            self.assertEqual([row["row"] for row in result["rows"]], [1, 2])
            self.assertNotIn("sinkage", result["rows"][1]["measured"])
            self.assertEqual({one["region"] for one in result["errors"] if one["output"] == "f_x"},
                             {"braking <= 0.2, driving", "straight of these", "not locked", "locked"})
            with open(os.path.join(out, "v", "report.html"), encoding="utf-8") as file:
                self.assertIn("Error by region", file.read())
            runs = os.path.join(out, "v", "campaign", "runs")
            before = {name: os.stat(os.path.join(runs, name)).st_mtime_ns for name in os.listdir(runs)}
            again = self.run_it(out, "--rows", "1")
            self.assertEqual(again.returncode, 0, again.stderr)
            after = {name: os.stat(os.path.join(runs, name)).st_mtime_ns for name in os.listdir(runs)}
            self.assertEqual(before, after)  # nothing is run again
            self.goes_on_from_its_table(out, result)

    def test_treads_at_any_angle(self):
        """15, 45, 75 and 90 degrees with lugs: another scene and other rows, nothing else."""
        import yaml
        with tempfile.TemporaryDirectory() as out:
            with open(SMOKE, encoding="utf-8") as file:
                scene = yaml.safe_load(file)
            scene["wheel"]["treads"] = [{"count": 6, "height_m": 0.005, "root_thickness_m": 0.004}]
            for name, content in (("lugs.scene.yaml", scene), ("s.soil.yaml", scene["soil"])):
                with open(os.path.join(out, name), "w", encoding="utf-8") as file:
                    yaml.safe_dump(content, file)
            with open(os.path.join(out, "table.csv"), "w", encoding="utf-8") as file:
                file.write("slip,attack_angle_deg,load_n,f_y_n\n0.3,15,1.5,-0.3\n0.2,45,1.5,-0.6\n0.2,75,1.5,-1\n0.5,90,1.5,-1\n")
            done = self.run_it(out, "--scene", os.path.join(out, "lugs.scene.yaml"))
            self.assertEqual(done.returncode, 0, done.stderr)
            with open(os.path.join(out, "v", "rows.json"), encoding="utf-8") as file:
                rows = json.load(file)["rows"]
            self.assertEqual([round(row["attack_angle_deg"], 6) for row in rows], [15, 45, 75, 90])
            side = [row["dem"]["outputs"]["f_y"]["value"] for row in rows]
            self.assertLess(side[-1], side[0])  # pushed sideways it is held by more
            self.assertLess(max(side), 0)

    def goes_on_from_its_table(self, out, first):
        """Where the folder of the runs is gone: what its rows.json has is not run again, another row is."""
        kept = os.path.join(out, "kept.json")
        with open(kept, "w", encoding="utf-8") as file:
            json.dump({**first, "rows": first["rows"][:1]}, file)
        elsewhere = os.path.join(out, "elsewhere")
        done = self.run_it(out, "--known", kept, "--out", elsewhere)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("2 runs, 1 of them known", done.stderr)
        self.assertEqual(len(os.listdir(os.path.join(elsewhere, "campaign", "runs"))), 1)
        with open(os.path.join(elsewhere, "rows.json"), encoding="utf-8") as file:
            again = json.load(file)
        for row, other in zip(first["rows"], again["rows"]):
            self.assertEqual(row["dem"]["outputs"], other["dem"]["outputs"])
        with open(os.path.join(out, "s.soil.yaml"), "a", encoding="utf-8") as file:
            file.write("# another\n")
        done = self.run_it(out, "--known", kept, "--out", elsewhere)
        self.assertEqual((done.returncode, "soil_sha256" in done.stderr), (2, True), done.stderr)
        with open(kept, "w", encoding="utf-8") as file:
            file.write("{}")
        done = self.run_it(out, "--known", kept)
        self.assertEqual((done.returncode, "expected rows.json of" in done.stderr), (2, True), done.stderr)

    def test_refuses_a_file_that_is_not_there(self):
        with tempfile.TemporaryDirectory() as out:
            done = self.run_it(out)
            self.assertEqual(done.returncode, 2)
            self.assertIn("s.soil.yaml: no such file", done.stderr)


if __name__ == "__main__":
    BIN = os.path.abspath(sys.argv.pop())
    unittest.main()
