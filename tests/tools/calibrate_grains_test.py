#!/usr/bin/python3
"""./grouser calibrate grains: what it refuses, its design, and how it resumes.

Usage: calibrate_grains_test.py BIN"""

import fcntl
import json
import math
import os
import re
import shutil
import sys
import tempfile
import threading
import time
import types
import unittest

import numpy
import yaml

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [os.path.join(ROOT, *folder) for folder in (
    ("dem_offline", "calibrate_grains"), ("dem_offline", "bevameter"), ("dem_offline", "validate"),
    ("clients", "common"))]

import beside  # noqa: E402
import calibrate_grains  # noqa: E402
import design  # noqa: E402
import forked  # noqa: E402
import plain_yaml  # noqa: E402
import point as points  # noqa: E402
import table_check  # noqa: E402
import targets as measured  # noqa: E402
import vary as varied  # noqa: E402
from experiment_runs import Refused  # noqa: E402
from processes import Processes  # noqa: E402

CAMPAIGNS = os.path.join(ROOT, "dem_offline", "campaigns")
SOIL = os.path.join(CAMPAIGNS, "cmu_loose.soil.yaml")
SCENE = os.path.join(CAMPAIGNS, "cmu_validate.scene.yaml")
WHEEL = os.path.join(ROOT, "surrogate", "calibrate", "measured", "cmu_wheel.yaml")
POINT = {"label": "s001", "values": {"friction": 0.4}, "status": "done", "seconds": {}, "outputs": {}}
PLATE = "plate 60 mm @ 10 mm"
DATA = """soil: a test
tests:
  - {name: plate, kind: plate, file: p.csv, columns: {sinkage: z_mm, force: F_N}, constants: {diameter: 60 mm}, \
counts_as: 2}
  - {name: pressed, kind: press, file: p.csv, columns: {sinkage: z_mm, force: F_N}, constants: {radius: 62.5 mm, \
width: 50 mm}, fitted: {z_mm: [6]}}
  - {name: wheel, kind: wheel, file: w.csv, columns: {slip: slip, attack_angle: attack_angle_deg, load: load_n, \
f_x: f_x_n, sinkage: sinkage_mm}, constants: {radius: 62.5 mm, width: 50 mm}, held_out: {lines: [3]}}
"""


def call(*words):
    return forked.call(calibrate_grains.main, "calibrate_grains.py", *words)


class InFolder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def file(self, name, text):
        path = os.path.join(self.folder, name)
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
        return path


class Vary(InFolder):
    def complaint(self, text):
        with self.assertRaises(Refused) as caught:
            varied.read(self.file("v.yaml", text))
        return str(caught.exception)

    def test_says_what_is_wrong_and_what_was_expected(self):
        self.assertIn("unknown parameter 'fricton', expected one of friction,", self.complaint("fricton: [0.3, 0.8]"))
        self.assertIn("the nearest: friction", self.complaint("fricton: [0.3, 0.8]"))
        self.assertIn("friction: got [0.8, 0.3], expected [LOW, HIGH] with LOW < HIGH",
                      self.complaint("friction: [0.8, 0.3]"))
        self.assertIn("solid_fraction: got 0.9, expected a number from 0.4 to 0.66",
                      self.complaint("solid_fraction: [0.5, 0.9]"))
        self.assertIn("every parameter is fixed", self.complaint("friction: 0.5"))
        self.assertIn("denser_below without top_layer_m", self.complaint("denser_below: [0, 0.02]"))
        self.assertIn("got no mapping", self.complaint("- 1"))

    def test_the_design_stays_when_more_points_are_asked_for(self):
        vary = varied.read(os.path.join(CAMPAIGNS, "cmu_grains.vary.yaml"))
        many = vary.points(64)
        self.assertEqual(vary.points(17), many[:17])
        for name, (low, high) in vary.ranges.items():  # in each eighth about eight
            cells = [min(7, int(8 * (one[name] - low) / (high - low) + 0.01)) for one in many]
            self.assertTrue(all(7 <= cells.count(k) <= 9 for k in range(8)), name)

    def test_a_parameter_more_leaves_the_others_where_they_were(self):
        one = varied.read(os.path.join(CAMPAIGNS, "cmu_plates", "vary.yaml"))
        path = os.path.join(CAMPAIGNS, "cmu_wheel", "vary.yaml")
        more = varied.read(path, one.names)
        self.assertEqual(more.names, ["friction", "rolling_friction", "solid_fraction", "wheel_friction"])
        points = more.points(64)
        self.assertEqual([{name: at[name] for name in one.names} for at in points], one.points(64))
        self.assertGreater(len({at["wheel_friction"] for at in points}), 60)
        self.assertNotEqual([at["solid_fraction"] for at in varied.read(path).points(64)],
                            [at["solid_fraction"] for at in points])

    def test_what_depends_on_what(self):
        vary = varied.read(os.path.join(CAMPAIGNS, "cmu_wheel", "vary.yaml"))
        acting = {kind: [vary.names[k] for k in vary.acting_on(kind)] for kind in varied.TESTS}
        self.assertEqual(acting["plate"], ["friction", "rolling_friction", "solid_fraction"])
        self.assertEqual(acting["press"], vary.names)
        self.assertEqual(acting["wheel"], vary.names)

    def test_logarithmic_ranges_and_back(self):
        vary = varied.Vary({"youngs_modulus_pa": (1e6, 1e8), "friction": (0.2, 0.6)}, {})
        at = vary.at([0.5, 0.25])
        self.assertEqual(at, {"youngs_modulus_pa": 1e7, "friction": 0.3})
        numpy.testing.assert_allclose(vary.to_unit(at), [0.5, 0.25])


class Made(unittest.TestCase):
    def setUp(self):
        self.start = varied.Start(plain_yaml.load(SOIL), plain_yaml.load(SCENE))

    def test_the_start_is_untouched_and_the_bulk_stays(self):
        before = plain_yaml.text_of(self.start.soil), plain_yaml.text_of(self.start.scene)
        values = {"friction": 0.4, "rolling_friction": 0.2, "wheel_friction": 0.6, "solid_fraction": 0.55,
                  "grain_diameter_m": 0.006, "surface_energy_j_per_m2": 0.5}
        soil, scene, tool, wheel = self.start.made(values, "one")
        self.assertEqual((plain_yaml.text_of(self.start.soil), plain_yaml.text_of(self.start.scene)), before)
        grains = soil["grains"]
        self.assertAlmostEqual(grains["grain_density_kg_per_m3"] * 0.55, 1330, delta=0.02)
        self.assertEqual((grains["friction"], scene["wheel"]["friction"], tool, wheel), (0.4, 0.6, None, 0.6))
        self.assertEqual(scene["wheel"]["rolling_friction"], 0.2)
        self.assertEqual(grains["sizes"][0]["diameter_m"], 0.0054)
        self.assertEqual(grains["contact"], {"surface_energy_j_per_m2": 0.5, "cohesion": "jkr"})

    def test_two_layers(self):
        soil, *_ = self.start.made({"solid_fraction": 0.53, "denser_below": 0.03, "top_layer_m": 0.04}, "two")
        grains = soil["grains"]
        self.assertAlmostEqual(grains["grain_density_kg_per_m3"] * 0.53, 1330, delta=0.02)  # of what is tested
        self.assertEqual(grains["solid_fraction"], 0.56)
        self.assertEqual(grains["top_layer"], {"thickness_m": 0.04, "solid_fraction": 0.53})
        self.assertAlmostEqual(soil["bulk_density_kg_per_m3"] / grains["grain_density_kg_per_m3"], 0.56, places=4)
        thin, *_ = self.start.made({"solid_fraction": 0.53, "denser_below": 0.03, "top_layer_m": 0.004}, "thin")
        self.assertNotIn("top_layer", thin["grains"])
        for diameter, layer in ((0.004, {"thickness_m": 0.02, "solid_fraction": 0.53}), (0.016, None)):
            values = {"solid_fraction": 0.53, "denser_below": 0.03, "top_layer_m": 0.02, "grain_diameter_m": diameter}
            self.assertEqual(self.start.made(values, "sized")[0]["grains"].get("top_layer"), layer)

    def test_words_of_yaml_come_out_as_they_stood(self):
        text = plain_yaml.text_of(self.start.scene)
        self.assertIn("freeze: on", text)
        with open(SCENE, encoding="utf-8") as file:
            self.assertEqual(yaml.safe_load(text), yaml.safe_load(file))


class Targets(InFolder):
    def test_of_the_measured_sand(self):
        targets = measured.read(os.path.join(BIN, "grouser-calibrate"), WHEEL, 0.008)
        self.assertEqual(targets.plates("none"), {60: 0.027})
        self.assertEqual(targets.plates("plates"), {60: 0.027, 80: 0.021})
        self.assertEqual((targets.press_wheel, targets.press_sinkage("plates")), ((0.0625, 0.05), 0.02))
        self.assertAlmostEqual(targets.press_sinkage("tests"), 0.036)
        self.assertEqual([len(targets.wheel_states(one)) for one in ("plates", "all")], [3, 27])
        row = next(one for one in targets.rows if one.key == "plate 60 mm @ 10 mm")
        self.assertAlmostEqual(row.value, 22.5)
        self.assertAlmostEqual(row.sd, 1.2)
        self.assertIn("wheel slip -0.5 angle 0 load 23.24 f_x", [one.key for one in targets.chosen("none")])
        self.assertFalse(any(one.at.get("sinkage", 1) < 0.004 for one in targets.rows))

    def test_a_force_is_read_from_a_line(self):
        z = numpy.linspace(0, 0.03, 300)
        series = {"plate.sinkage_m": z, "plate.f_z_n": 1000 * z + 0.1 * (-1.0)**numpy.arange(300)}
        self.assertAlmostEqual(beside.force_at(series, "plate", 0.01, 0.002), 10.0, delta=0.02)
        self.assertIsNone(beside.force_at(series, "plate", 0.031, 0.002))

    def test_means_over_beds(self):
        both = points.over_beds({1: (2.0, 0.1), 2: (4.0, 0.1)})
        self.assertAlmostEqual(both["value"], 3.0)
        self.assertAlmostEqual(both["standard_error"], 1.0)
        self.assertIsNone(points.over_beds({1: (2.0, None)})["standard_error"])


class Tables(InFolder):
    def complaint(self, **changes):
        file = {"file": "a", "sha256": "0"}
        table = {"version": 1, "soil": file, "scene": file, "beds": 1, "fixed": {}, "ranges": {"friction": [0.3, 0.8]},
                 "points": [POINT], **changes}
        path = self.file("design.json", json.dumps(table))
        try:
            return table_check.read_table(path) and None
        except Refused as error:
            return str(error)

    def test_says_what_is_wrong(self):
        self.assertIsNone(self.complaint())
        for changes, words in (
                ({"version": 2}, "version 2, not 1"), ({"soil": {}}, "soil: no file and sha256"),
                ({"scene": None}, "scene: got None, expected a mapping"), ({"beds": "x"}, "beds: got 'x'"),
                ({"fixed": {"mass": 1}}, "unknown parameter 'mass', not one of friction,"),
                ({"ranges": {"fricton": [0, 1]}}, "unknown parameter 'fricton'"),
                ({"ranges": {"friction": [0.8, 0.3]}}, "ranges: friction: got [0.8, 0.3], not [LOW, HIGH]"),
                ({"ranges": {"wheel_friction": [0.2, 0.7]}}, "points[0]: values: no number for wheel_friction"),
                ({"points": [{**POINT, "known": {"ran_at": {"press": {"mass": 1}}}}]}, "points[0]: known: no ran_at"),
                ({"fixed": {"tool_friction": 0.5}}, "points[0]: values: no number for tool_friction"),
                ({"rows": 3}, "rows: no list of keys"), ({"rows": [[1]]}, "rows: no list of keys"),
                *(({"points": [{**POINT, **what}]}, "points[0]: " + words) for what, words in (
                    ({"outputs": {PLATE: 3}}, f"outputs: {PLATE}: no value that is a number"),
                    ({"outputs": {PLATE: {"value": -1.5}}}, f"outputs: {PLATE}: force -1.5 N, not more than 0"),
                    ({"outputs": {PLATE: {"value": math.nan}}}, f"outputs: {PLATE}: no value that is a number"),
                    ({"outputs": {PLATE: {"value": 1, "standard_error": "x"}}}, f"outputs: {PLATE}: standard_error: got"),
                    ({"outputs": {PLATE: {"value": 1, "beds": {"1": "x"}}}}, f"outputs: {PLATE}: beds: no numbers"),
                    ({"outputs": {"cone": {"value": 1}}}, "outputs: unknown row 'cone'"),
                    ({"status": "good"}, "status: got 'good', not one of done, part, failed"),
                    ({"seconds": {"tests": "3"}}, "seconds: no numbers"),
                    ({"solid_fraction": {"tests": "x"}}, "solid_fraction: no numbers"),
                    ({"reasons": 3}, "reasons: no list of texts"),
                    ({"known": 3}, "known: no ran_at"),
                    ({"known": {"ran_at": {}, "seconds": 3}}, "known: seconds: no numbers"))),
                ({"points": [1]}, "points[0]: no label"), ({"points": None}, "points: got None, expected a list")):
            self.assertIn(words, self.complaint(**changes) or "taken", changes)


class Children(InFolder):
    def test_one_that_has_ended_is_forgotten(self):
        processes = Processes(self.folder)
        self.addCleanup(processes.stop_all)
        stand_in = types.SimpleNamespace(processes=processes, counted=0.0, counts=0)

        def work():
            yield processes.start("first", ["true"])
            yield processes.start("second", ["sleep", "60"])

        def count():
            stand_in.counts += 1
            stand_in.counted = time.monotonic()
        stand_in.work, stand_in.count = work, count
        at_work = design.Work(stand_in)
        first = at_work.child
        first.wait()
        self.assertTrue(at_work.goes_on())
        self.assertEqual((processes._running, stand_in.counts), ([at_work.child], 1))
        self.assertIsNot(at_work.child, first)
        stand_in.counted -= 2 * design.KEPT_EVERY_S
        self.assertTrue(at_work.goes_on())
        self.assertEqual(stand_in.counts, 2)  # while it runs, too


class Runs(InFolder):
    """With a script in place of grouser-dem: it counts its calls and knows no physics."""

    def setUp(self):
        super().setUp()
        self.bin = os.path.join(self.folder, "bin")
        os.makedirs(self.bin)
        os.symlink(os.path.join(BIN, "grouser-calibrate"), os.path.join(self.bin, "grouser-calibrate"))
        shutil.copy(os.path.join(HERE, "calibrate_grains_runs.py"), os.path.join(self.bin, "grouser-dem"))
        os.chmod(os.path.join(self.bin, "grouser-dem"), 0o755)
        self.data = self.file("data.yaml", DATA)
        self.file("p.csv", "z_mm,F_N\n5,5\n6,6\n8,9\n")
        self.file("w.csv", "slip,attack_angle_deg,load_n,f_x_n,sinkage_mm\n0.3,0,15,1,20\n-1,0,15,-1,\n")
        self.vary = self.file("vary.yaml", "friction: [0.3, 0.8]\nsolid_fraction: [0.53, 0.57]\n")
        self.out = os.path.join(self.folder, "out")

    def run_it(self, *more, only=("--design-only",)):
        return call("--bin", self.bin, self.data, "--soil", SOIL, "--scene", SCENE, "--vary", self.vary,
                    "--out", self.out, *only, *more)

    def calls(self):
        path = os.path.join(self.bin, "calls")
        if not os.path.exists(path):
            return []
        with open(path, encoding="utf-8") as file:
            found = file.read().splitlines()
        os.unlink(path)
        return found

    def table(self):
        with open(os.path.join(self.out, "design.json"), encoding="utf-8") as file:
            return json.load(file)

    def test_runs_once_and_goes_on(self):
        done = self.run_it("--points", "2", "--jobs", "1", "--beds", "2")
        self.assertEqual(done.returncode, 0, done.stderr)
        each = ["run plate60_bed1.run.h5", "run press_bed1.run.h5", "run plate60_bed2.run.h5", "run press_bed2.run.h5",
                "wheel 0.3 seed 1", "wheel 0.3 seed 2"]
        self.assertEqual(self.calls(), 2 * each)  # cheap tests of a point first; the state that is held out never
        table = self.table()
        self.assertEqual([one["status"] for one in table["points"]], ["done", "done"])
        outputs = table["points"][0]["outputs"]
        self.assertEqual(sorted(outputs), ["plate 60 mm @ 5 mm", "plate 60 mm @ 6 mm", "plate 60 mm @ 8 mm",
                                           "press 62.5 x 50 mm @ 6 mm", "wheel slip 0.3 angle 0 load 15 f_x",
                                           "wheel slip 0.3 angle 0 load 15 sinkage"])
        self.assertAlmostEqual(outputs["plate 60 mm @ 8 mm"]["value"], 80 * 0.02 * 1.05)
        self.assertEqual(outputs["wheel slip 0.3 angle 0 load 15 f_x"]["beds"], {"1": 1.55, "2": 2.55})
        self.assertEqual(table["points"][0]["solid_fraction"], {"tests": 0.55, "wheels": 0.55})
        again = self.run_it("--points", "2", "--jobs", "1", "--beds", "2")
        self.assertEqual((again.returncode, self.calls()), (0, []), again.stderr)
        self.assertEqual(self.table(), table)
        more = self.run_it("--points", "3", "--jobs", "2", "--beds", "2")
        self.assertEqual((more.returncode, self.calls()), (0, each))
        self.assertEqual(self.table()["points"][:2], table["points"])

    def test_a_point_that_was_cut_short_goes_on_where_it_stood(self):
        self.run_it("--points", "2", "--jobs", "1")
        self.calls()
        point = os.path.join(self.out, "points", "s002")
        os.unlink(os.path.join(point, "point.json"))
        os.unlink(os.path.join(point, "runs", "press_bed1.run.h5"))
        done = self.run_it("--points", "2", "--jobs", "1")
        self.assertEqual((done.returncode, self.calls()), (0, ["run press_bed1.run.h5"]))

    def test_waits_for_the_runs_of_a_call_that_was_killed(self):
        os.makedirs(self.out)
        with open(os.path.join(self.out, ".lock"), "w", encoding="utf-8") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            late = self.run_it("--points", "2", "--jobs", "1", "--wait", "0.2")
            self.assertEqual(late.returncode, 1, "no bad input: the same call may go on later")
            self.assertIn(f"--out {self.out}: another call is running there, waited 0.2 s", late.stderr)
            timer = threading.Timer(1, fcntl.flock, (lock, fcntl.LOCK_UN))
            timer.start()
            self.addCleanup(timer.join)
            done = self.run_it("--points", "2", "--jobs", "1", "--wait", "60")
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_another_soil_is_another_design(self):
        self.run_it("--points", "2", "--jobs", "1")
        self.calls()
        self.file("vary.yaml", "friction: [0.3, 0.8]\nsolid_fraction: [0.53, 0.57]\nrolling_friction: 0.2\n")
        self.run_it("--points", "2", "--jobs", "1")
        self.assertEqual(sum(one.startswith("run") for one in self.calls()), 4)

    def test_more_points_are_chosen_once(self):
        done = self.run_it("--points", "8", "--jobs", "1", "--more", "1", only=())
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual([one["label"] for one in self.table()["points"]][7:], ["s008", "m001"])
        self.assertEqual(sum(one.startswith("run plate") for one in self.calls()), 9)
        with open(os.path.join(self.out, "calibration.json"), encoding="utf-8") as file:
            self.assertEqual(json.load(file)["design"]["used"], 9)
        again = self.run_it("--points", "8", "--jobs", "1", "--more", "1")
        self.assertEqual((again.returncode, self.calls()), (0, []))

    def known_design(self):
        """A design of plates and pressed wheel alone at three points, the second of which cannot be packed; then the
        files ask for wheel states and the wheel's friction, too. The path of its table."""
        self.file("data.yaml", DATA.replace("{lines: [3]}", "true"))
        ranges = "friction: [0.3, 0.8]\nsolid_fraction: [0.53, 0.57]\n"
        self.file("vary.yaml", ranges + "wheel_friction: 0.45\n")
        self.file("bin/refuse", "friction: 0.675")
        self.assertEqual(self.run_it("--points", "3", "--jobs", "1").returncode, 0)
        self.assertEqual(len(self.calls()), 5)
        table = os.path.join(self.out, "design.json")
        self.data, self.out = self.file("data.yaml", DATA), os.path.join(self.folder, "more")
        self.file("vary.yaml", "wheel_friction: [0.2, 0.7]\n" + ranges)
        return table

    def test_what_an_earlier_design_knows_is_not_run(self):
        path = self.known_design()
        with open(path, encoding="utf-8") as file:
            before = json.load(file)["points"]
        plan = self.run_it("--known", path, "--points", "4", "--jobs", "1", "--dry-run")
        self.assertEqual((plan.returncode, self.calls()), (0, []), plan.stderr)
        self.assertFalse(os.path.exists(self.out))
        self.assertIn("4 points, 0 of them done\nplates and pressed wheel: 2 runs at 1 points, ", plan.stdout)
        self.assertIn("wheel states: 3 runs at 3 points, no time recorded before a first point is done", plan.stdout)
        self.assertIn("1 points are known to fail", plan.stdout)
        self.assertNotIn("--more", plan.stdout)
        plan = self.run_it("--known", path, "--points", "4", "--more", "2", "--dry-run")
        self.assertRegex(plan.stdout, r"\n2 points more that the emulators will choose \(--more\): 4 runs of plates and "
                         r"pressed wheel, 2 runs of wheel states, \d+ core-minutes without wheel states: no time "
                         "recorded\n$")
        done = self.run_it("--known", path, "--points", "4", "--jobs", "1")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(self.calls(), ["wheel 0.3 seed 1", "wheel 0.3 seed 1", "run plate60_bed1.run.h5",
                                        "run press_bed1.run.h5", "wheel 0.3 seed 1"])
        table = self.table()
        self.assertEqual(list(table["ranges"]), ["friction", "solid_fraction", "wheel_friction"])
        first, second, third, fourth = table["points"]
        self.assertEqual([one["status"] for one in table["points"]], ["done", "failed", "done", "done"])
        self.assertEqual({key: value for key, value in third["outputs"].items() if key[0] == "p"}, before[2]["outputs"])
        self.assertEqual(third["known"]["ran_at"], {"press": {"wheel_friction": 0.45}})
        self.assertEqual((third["values"]["wheel_friction"], first["known"]["ran_at"]), (0.325, {}))  # 0.45: its own
        self.assertEqual(third["solid_fraction"], {"tests": 0.56, "wheels": 0.56})
        self.assertEqual(second["reasons"], before[1]["reasons"])
        self.assertNotIn("known", fourth)
        self.check_that_a_dry_run_writes_nothing(path)
        self.check_that_taken_outputs_count(path)
        path, self.out = os.path.join(self.out, "design.json"), os.path.join(self.folder, "third")
        again = self.run_it("--known", path, "--points", "4", "--jobs", "1")  # one that knows all
        self.assertEqual((again.returncode, self.calls()), (0, []), again.stderr)
        for one, other in zip(self.table()["points"], table["points"]):
            self.assertEqual(one["outputs"], other["outputs"])
            self.assertEqual(one["known"]["ran_at"], other.get("known", {"ran_at": {}})["ran_at"])

    def check_that_a_dry_run_writes_nothing(self, path):
        """Where all is done, and other grains are asked for."""
        def contents():
            found = {}
            for folder, _, names in os.walk(self.out):
                for name in names:
                    with open(os.path.join(folder, name), "rb") as file:
                        found[folder, name] = file.read()
            return found
        before, vary = contents(), os.path.join(self.folder, "vary.yaml")
        with open(vary, encoding="utf-8") as file:
            text = file.read()
        self.file("vary.yaml", text.replace("[0.2, 0.7]", "[0.2, 0.6]"))
        plan = self.run_it("--known", path, "--points", "5", "--dry-run")
        self.assertIn("5 points, 0 of them done", plan.stdout)
        self.assertEqual(contents(), before)
        self.file("vary.yaml", text)

    def check_that_taken_outputs_count(self, path):
        """An output of the table that is another number now: the points that took it are made again."""
        with open(path, encoding="utf-8") as file:
            table = json.load(file)
        output = next(iter(table["points"][2]["outputs"].values()))
        output["value"] *= 2
        other = self.file("other.json", json.dumps(table))
        plan = self.run_it("--known", other, "--points", "4", "--dry-run")
        self.assertIn("4 points, 3 of them done", plan.stdout)

    def test_survives_runs_that_fail(self):
        with open(os.path.join(self.bin, "refuse"), "w", encoding="utf-8") as file:
            file.write("friction: 0.675")  # the second point's
        done = self.run_it("--points", "3", "--jobs", "1")
        self.assertEqual(done.returncode, 0, done.stderr)
        table = self.table()
        self.assertEqual([one["status"] for one in table["points"]], ["done", "failed", "done"])
        self.assertEqual(table["points"][1]["reasons"], ["plate60_bed1: grouser-dem: the bed cannot be packed"])
        self.assertIn("3/3 points, 1 failed", done.stderr)

    def test_a_refused_wheel_campaign_gives_none_of_an_earlier_one(self):
        self.run_it("--points", "2", "--jobs", "1")
        self.assertIn("wheel slip 0.3 angle 0 load 15 f_x", self.table()["points"][0]["outputs"])
        self.file("bin/no_wheels", "friction")
        self.file("vary.yaml", "friction: [0.3, 0.8]\nsolid_fraction: [0.53, 0.57]\nrolling_friction: 0.2\n")
        self.run_it("--points", "2", "--jobs", "1")
        for one in self.table()["points"]:
            self.assertEqual((one["status"], one["reasons"]), ("part", ["wheels: grouser-dem: campaign refused"]))
            self.assertFalse(any(key.startswith("wheel") for key in one["outputs"]))

    def test_wheels_that_failed_tell_nothing(self):
        self.file("bin/status", "FAILED")  # they have outputs all the same
        self.run_it("--points", "2", "--jobs", "1")
        one = self.table()["points"][0]
        self.assertEqual((one["status"], one["reasons"]), ("part", ["wheel slip 0.3 angle 0 bed 1: FAILED"]))
        self.assertFalse(any(key.startswith("wheel") for key in one["outputs"]))

    def test_runs_of_another_engine_are_not_done(self):
        self.run_it("--points", "2", "--jobs", "1")
        self.assertEqual(sum(one.startswith("run") for one in self.calls()), 4)
        self.file("bin/engine", "7")
        self.run_it("--points", "2", "--jobs", "1")
        self.assertEqual(sum(one.startswith("run") for one in self.calls()), 4)

    def test_the_time_of_a_point_that_was_cut_short_counts_once(self):
        self.run_it("--points", "2", "--jobs", "1")
        point = os.path.join(self.out, "points", "s002")
        self.assertFalse(os.path.exists(os.path.join(point, "spent.json")))
        values = self.table()["points"][1]["values"]
        os.unlink(os.path.join(point, "point.json"))
        self.file(os.path.join(point, "spent.json"),
                  json.dumps({"values": values, "seconds": {"tests": 3000.0, "wheels": 500.0}}))
        done = self.run_it("--points", "2", "--jobs", "1", "--budget", "0.9")
        self.assertIn("the budget is used up: 1 points were not run", done.stderr)
        done = self.run_it("--points", "3", "--jobs", "1", "--budget", "1.1")
        self.assertNotIn("budget is used up", done.stderr)  # 58 minutes, not twice that
        self.assertIn("1 of them done before (58.", done.stderr)
        seconds = self.table()["points"][1]["seconds"]
        self.assertTrue(3000 <= seconds["tests"] < 3100 and 500 <= seconds["wheels"] < 600, seconds)
        self.assertFalse(os.path.exists(os.path.join(point, "spent.json")))
        done = self.run_it("--points", "4", "--jobs", "1", "--budget", "1.1")
        self.assertNotIn("budget is used up", done.stderr)

    def test_the_budget_ends_it_and_counts_each_point_once(self):
        self.run_it("--points", "2", "--jobs", "1")
        spent = sum(sum(one["seconds"].values()) for one in self.table()["points"])
        self.calls()
        done = self.run_it("--points", "9", "--jobs", "1", "--budget", repr(max(spent, 0.01) / 3600 * 0.9))
        self.assertIn("the budget is used up: 7 points were not run", done.stderr)
        self.assertEqual(self.calls(), [])
        self.assertEqual(len(self.table()["points"]), 2)

    def test_refuses(self):
        def said(*more):
            done = self.run_it(*more)
            self.assertEqual(done.returncode, 2, done.stderr)
            return done.stderr
        self.assertIn("--beds 0: expected at least 1", said("--beds", "0"))
        self.assertIn("--budget -1: expected more than 0 hours", said("--budget", "-1"))
        self.assertIn("--wait nan: expected 0 or more seconds", said("--wait", "nan"))
        self.assertIn("nowhere.yaml: no such file", said("--soil", "nowhere.yaml"))
        with open(SCENE, encoding="utf-8") as file:
            scene = file.read()
        self.assertIn("wheel.radius_m: got 'abc', expected a number",
                      said("--scene", self.file("radius.yaml", re.sub("radius_m: [0-9.]+", "radius_m: abc", scene))))
        self.assertIn("name: got None, expected the name of the scene",
                      said("--scene", self.file("name.yaml", re.sub("(?m)^name: ", "called: ", scene))))
        words = ["--design", self.file("d.json", '{"version": 1}')]
        done = call("--bin", self.bin, self.data, "--soil", SOIL, "--scene", SCENE, "--out", self.out, *words)
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn("soil: got None, expected a mapping: the design.json of ./grouser calibrate grains", done.stderr)
        self.file("data.yaml", DATA.replace("62.5 mm", "58 mm"))
        self.assertIn("wheel of 0.0625 m by 0.05 m, expected the measured one of 0.058 m by 0.05 m", said())
        self.file("data.yaml", DATA.replace("diameter:", "diametr:"))
        self.assertIn("data.yaml", said())
        self.assertEqual(self.calls(), [])


if __name__ == "__main__":
    BIN = os.path.abspath(sys.argv.pop())
    unittest.main()
