#!/usr/bin/python3
"""./grouser bevameter: soil files and tests that it refuses, its measures, and one soil from grains to
parameters, killed on its way.

Usage: bevameter_test.py BIN"""

import csv
import glob
import hashlib
import json
import math
import os
import signal
import subprocess
import sys
import tempfile
import types
import unittest
from types import SimpleNamespace

import numpy
import yaml

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path[:0] = [os.path.join(ROOT, "dem_offline", "bevameter"), os.path.join(ROOT, "clients", "common")]

import bench as benches  # noqa: E402
import beside as measured_beside  # noqa: E402
import bevameter_page as page  # noqa: E402
import measured as measurement  # noqa: E402
import soil_rows  # noqa: E402
from experiment_runs import Plan, Refused, engine_of, record_of  # noqa: E402
from grain_soil import GrainSoil, identity_of  # noqa: E402
from processes import ProgramFailed  # noqa: E402

LOOSE = os.path.join(ROOT, "dem_offline", "campaigns", "cmu_loose.soil.yaml")
MEASURED = os.path.join(ROOT, "surrogate", "calibrate", "measured", "cmu_plates.yaml")
SOILS = os.path.join(ROOT, "surrogate", "soils")
CONE_HEADER = ("soil,soil_sha256,cone_index_kPa,cone_index_se_kPa,gradient_kPa_per_m,gradient_se_kPa_per_m,beds,to_depth_mm,"
               "cone_diameter_mm,cone_angle_deg,speed_mm_per_s,grain_mm,bevameter_sha256,source")
TINY = {"name": "tiny", "bulk_density_kg_per_m3": 1450, "gravity_m_per_s2": 9.81, "source": "a test",
        "grains": {"grain_density_kg_per_m3": 2500, "youngs_modulus_pa": 1e6, "poisson_ratio": 0.3,
                   "restitution": 0.5, "friction": 0.5, "rolling_friction": 0.1, "solid_fraction": 0.58,
                   "sizes": [{"diameter_m": 0.0108, "mass_fraction": 0.25}, {"diameter_m": 0.012, "mass_fraction": 0.5},
                             {"diameter_m": 0.0132, "mass_fraction": 0.25}]}}


def bench_of(soil, names, beds=1, **more):
    return benches.Bench(soil, names, beds, False, **more)


def result_of(series, **bed):
    return types.SimpleNamespace(done=True, series={k: numpy.array(v, dtype=float) for k, v in series.items()},
                                 record={"bed": {"solid_fraction": 0.5, **bed}})


class InFolder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def soil_file(self, **changes):
        path = os.path.join(self.folder, "tiny.soil.yaml")
        with open(path, "w", encoding="utf-8") as file:
            yaml.safe_dump({**TINY, "grains": {**TINY["grains"], **changes}}, file)
        return path


class Plans(InFolder):
    def test_every_value_of_the_soil_reaches_every_experiment(self):
        soil = GrainSoil(self.soil_file(contact={"rolling": "constant_torque", "wheel": {"rolling_friction": 0.02},
                                                 "floor": {"friction": 0.9}}, top_layer={"thickness_m": 0.03,
                                                                                         "solid_fraction": 0.56}))
        bench = bench_of(soil, ["plate60", "press", "shear", "cone", "repose", "density"], tool_friction=0.3)
        plans = [bench.on_bed(name, 2) for name in bench.bed_tests()] + bench.off_bed()
        self.assertEqual([plan.name for plan in plans], [
            "plate60_bed2", "press_bed2", "shear1_bed2", "shear2_bed2", "shear3_bed2", "cone_bed2", "repose_bed1",
            "poured_bed1", "tapped_bed1"])
        for plan in plans:
            sets = dict(one.split("=", 1) for one in plan.sets)
            value = {key: yaml.safe_load(text) for key, text in sets.items()}
            self.assertEqual(float(value["materials"][0]["youngs_modulus_pa"]), 1e6)
            self.assertEqual([(one["between"][1], one["friction"]) for one in value["interfaces"]],
                             [("any", 0.5), ("tool", 0.3), ("steel", 0.9)])
            self.assertEqual(value["interfaces"][1]["rolling_friction"], 0.02)
            self.assertEqual(value["laws"], {"rolling": "constant_torque"})
            self.assertEqual(value["grains"]["sizes"][2], {"diameter_m": 0.0132, "mass_fraction": 0.25})
            if "_bed2" in plan.name:
                self.assertEqual((value["grains"]["solid_fraction"], value["grains"]["top_layer"]["solid_fraction"]),
                                 (0.58, 0.56))
                self.assertEqual(value["bodies[0].material"], "tool")

    def test_all_tests_of_a_bed_stand_on_the_same_grains(self):
        bench = bench_of(GrainSoil(LOOSE), ["plate40", "plate100", "press", "shear", "cone"])
        beds = {tuple(one for one in bench.on_bed(name, 1).sets if one.split("=")[0] in (
            "seed", "grains", "box.length_m", "box.width_m", "materials", "interfaces")) for name in bench.bed_tests()}
        self.assertEqual(len(beds), 1)
        self.assertEqual((bench.side, bench.depth), (2.25 * 0.1, 1.25 * 0.1))

    def test_the_box_of_the_cone_grows_with_the_grains(self):
        coarse = os.path.join(ROOT, "dem_offline", "campaigns", "cmu_sand_20mm.soil.yaml")
        for soil in (GrainSoil(LOOSE), GrainSoil(coarse)):
            bench = bench_of(soil, ["cone"])
            self.assertAlmostEqual(bench.side / bench.cone_radius, 0.18 / 0.016)

    def test_frictions_that_made_two_layers_make_them_again(self):
        soil = GrainSoil(self.soil_file(top_layer={"thickness_m": 0.04, "solid_fraction": 0.56}))
        record = {"preparation_friction": 0.25, "preparation_rolling_friction": 0.5, "top_solid_fraction": 0.56,
                  "top_preparation_friction": 0.75, "top_preparation_rolling_friction": 1}
        packing = benches.packing_of(SimpleNamespace(record={"bed": record}))
        bed = soil.bed(0.2, packing)
        self.assertEqual(bed["preparation"], {"friction": "0.25", "rolling_friction": "0.5"})
        self.assertEqual(bed["top_layer"]["preparation"], {"friction": "0.75", "rolling_friction": "1.0"})
        one = SimpleNamespace(record={"bed": {**record, "top_solid_fraction": 0}})
        self.assertEqual(len(benches.packing_of(one)), 1)
        bed = soil.bed(0.2, benches.packing_of(one))  # of runs before the top layer's were told
        self.assertEqual((bed["preparation"]["friction"], "preparation" in bed["top_layer"]), ("0.25", False))
        self.assertIsNone(benches.packing_of(SimpleNamespace(record={"bed": {}})))

    def test_a_wheel_as_it_was_measured(self):
        bench = bench_of(GrainSoil(LOOSE), ["press", "plate60"], tool_friction=0.5, wheel=(0.0625, 0.05),
                         sinkages={"press": 0.022, "plate60": 0.028}, wheel_friction=0.4)
        sets = dict(one.split("=", 1) for one in bench.on_bed("press", 1).sets)
        part = yaml.safe_load(sets["bodies[0].parts"])
        self.assertEqual((part["radius_m"], part["width_m"]), (0.0625, 0.05))
        self.assertEqual(yaml.safe_load(sets["interfaces"])[1]["friction"], 0.4)
        self.assertAlmostEqual(bench.chord, 2 * math.sqrt(0.0625**2 - 0.0405**2))
        self.assertAlmostEqual(bench.side, 2 * bench.chord)
        self.assertAlmostEqual(yaml.safe_load(sets["bodies[0].motion"])[0]["distance_m"], 0.022 + 0.001 + 0.0088)
        plate = dict(one.split("=", 1) for one in bench.on_bed("plate60", 1).sets)
        self.assertEqual(yaml.safe_load(plate["interfaces"])[1]["friction"], 0.5)

    def test_sizes_go_with_the_grains(self):
        self.assertEqual(benches.default_plates(0.008), [40, 60])
        self.assertEqual(benches.default_plates(0.012), [60, 80])
        self.assertEqual(benches.default_plates(0.002), [40, 60])
        soil = GrainSoil(self.soil_file())
        self.assertAlmostEqual(soil.diameter, 0.012)
        bench = bench_of(soil, ["press", "shear"])
        self.assertAlmostEqual(bench.depth, 0.18)
        self.assertAlmostEqual(bench.wheel_radius, 0.06)
        self.assertAlmostEqual(bench.ring_radii[1] - bench.ring_radii[0], 3.5 * 0.012)
        area = math.pi * (0.084**2 - 0.042**2)
        self.assertAlmostEqual(bench.ring_area * bench.pressures[1], area * 0.16 * 1450 * 9.81)


class Engines(InFolder):
    def test_a_run_of_another_engine_is_not_done(self):
        path = self.soil_file()
        plan = Plan("one", path, {})
        with open(path, encoding="utf-8") as file:
            spec = {"yaml": file.read(), "sets": []}
        engine = engine_of(os.path.join(BIN, "grouser-dem"))
        self.assertRegex(engine, "^[0-9]+$")
        record = {"status": "RUN_STATUS_DONE", "experiment_spec": spec, "numerics": {"engine_version": engine}}
        self.assertTrue(plan.is_done_in(record, engine))
        self.assertFalse(plan.is_done_in({**record, "numerics": {"engine_version": "1"}}, engine))
        self.assertFalse(plan.is_done_in({**record, "numerics": {}}, engine))
        with self.assertRaisesRegex(ProgramFailed, "(?s)--version: got .*expected 'grouser-dem VERSION"):
            engine_of("/bin/true")


class Measures(InFolder):
    def test_curves(self):
        bench = bench_of(GrainSoil(LOOSE), ["plate40", "press", "shear", "cone"])
        z = numpy.linspace(-0.005, 0.04, 2000)
        turn = numpy.linspace(0, 0.7, 500)
        tip = numpy.linspace(0, 0.08, 2000)
        results = {("plate40", 1): result_of({"plate.sinkage_m": z, "plate.f_z_n": 1e3 * z}),
                   ("plate40", 2): result_of({"plate.sinkage_m": z, "plate.f_z_n": 2e3 * z}),
                   ("shear1", 1): result_of({"ring.turned_z_rad": turn, "ring.t_z_n_m": -0.2 * turn}),
                   ("cone", 1): result_of({"cone.sinkage_m": tip, "cone.f_z_n": tip})}
        got = measurement.Measured(bench, results)
        rows = got.sinkage_rows("plate40", "plate", bench.plate_sinkage(40))
        self.assertEqual([row[0] for row in rows], [1] * 15 + [2] * 15)
        self.assertGreater(rows[0][1], 0.004)  # half a grain
        self.assertLess(rows[-1][1], 0.03)
        for bed, sinkage, force in rows:
            self.assertAlmostEqual(force, bed * 1e3 * sinkage)
        for _, angle, torque in got.shear_rows("shear1"):
            self.assertAlmostEqual(torque, 0.2 * angle)
        cone, _ = got.cone()
        base = bench.cone_radius * math.sqrt(3)
        self.assertAlmostEqual(cone["to_depth_m"], 0.08 - base)
        self.assertAlmostEqual(cone["value"], 0.5 * (base + 0.08) / (math.pi * bench.cone_radius**2), delta=1)
        self.assertAlmostEqual(cone["gradient"]["value"], 1 / (math.pi * bench.cone_radius**2), places=3)
        self.assertEqual((cone["diameter_m"], cone["angle_deg"], cone["speed_m_per_s"]), (0.032, 60, 0.05))
        self.assertAlmostEqual(got.density()["bed"]["value"], 0.5 * 2495.3)

    def test_forces_beside_measured_ones(self):
        read = json.loads(subprocess.run([os.path.join(BIN, "grouser-calibrate"), "rows", MEASURED], capture_output=True,
                                         text=True, check=True).stdout)
        measured = measured_beside.Beside([read])
        self.assertEqual(measured.press_wheel, (0.0625, 0.05))
        self.assertEqual(sorted(measured.curves), ["plate60", "plate80", "press"])
        self.assertAlmostEqual(dict(measured.curves["plate60"])[0.01], 22.5)
        soil = GrainSoil(LOOSE)
        wheel = benches.wheel_for(soil, measured.press_wheel)
        bench = bench_of(soil, ["plate60", "press"], wheel=wheel)
        z = numpy.linspace(-0.005, 0.0175, 2000)
        results = {("plate60", bed): result_of({"plate.sinkage_m": z, "plate.f_z_n": force * z})
                   for bed, force in ((1, 2e3), (2, 4e3))}
        rows = measured.forces(bench, results)
        self.assertEqual([(one["test"], one["sinkage_m"]) for one in rows],
                         [("plate60", 0.005), ("plate60", 0.01), ("plate60", 0.015)])
        self.assertAlmostEqual(rows[1]["value"], 30)
        self.assertAlmostEqual(rows[1]["measured_n"], 22.5)
        self.assertAlmostEqual(rows[1]["sd_of_beds"], 20 / math.sqrt(2))
        self.assertIn(("plate60 at 10 mm", "22.5", "30 ± 14", 2, "+33 %"), page.force_rows({"forces": rows})[1])
        press = {("press", 1): result_of({"wheel.sinkage_m": z, "wheel.f_z_n": 1e3 * z})}
        self.assertEqual(len(measured.forces(bench, press)), 3)
        coarse = GrainSoil(self.soil_file())  # the measured wheel is narrower than five of its grains
        self.assertIsNone(benches.wheel_for(coarse, measured.press_wheel))
        self.assertEqual(measured.forces(bench_of(coarse, ["press"]), press), [])
        other = json.loads(json.dumps(read).replace('"radius_m": 0.0625', '"radius_m": 0.058'))
        with self.assertRaisesRegex(Refused, "a second pressed wheel"):
            measured_beside.Beside([read, other])

    def test_a_cone_index_is_a_row_of_the_table(self):
        cone = {"value": 18e3, "sd_of_beds": 600.0, "beds": 2, "unit": "Pa", "to_depth_m": 0.049, "diameter_m": 0.032,
                "angle_deg": 60, "speed_m_per_s": 0.05,
                "gradient": {"value": 4e5, "sd_of_beds": 4e3, "beds": 2, "unit": "Pa/m"}}
        summary = {"soil": "a, b", "soil_sha256": "0" * 64, "soil_file": "a.soil.yaml", "engine_version": "6",
                   "grain_diameter_m": 0.008, "tool_friction": 0.364, "cone_index": cone}
        header, line = soil_rows.cone_table(summary, "f" * 64).splitlines()
        self.assertEqual(header, CONE_HEADER)
        self.assertEqual(line, '"a, b",' + "0" * 64 + ",18,0.424264,400,2.82843,2,49,32,60,50,8," + "f" * 64
                         + ',"virtual bevameter, a.soil.yaml, engine 6, friction of the cone 0.364"')
        one_bed = {**cone, "sd_of_beds": None, "beds": 1, "gradient": {**cone["gradient"], "sd_of_beds": None, "beds": 1}}
        self.assertIn(",18,,400,,1,49,", soil_rows.cone_table({**summary, "cone_index": one_bed}, "f" * 64))
        for name in ('#1 "sharp"', 'a "b"', "two\nlines", " #2", "plain"):
            header, line = soil_rows.cone_table({**summary, "soil": name}, "f" * 64).splitlines()
            self.assertFalse(line.startswith("#"))
            self.assertEqual(next(csv.reader([line]))[0], name.replace("\n", " "))

    def test_parameters_are_a_row_of_the_table(self):
        def one(name, value, low, high, identified=True):
            return {"name": name, "value": value, "low90": low, "high90": high, "identified": identified}
        rest = [one("friction_angle", math.radians(25.5), None, math.radians(28.3)),
                one("shear_modulus", 0.004, 0.003, 0.005)]
        bekker = [one("n", 0.9, 0.84, 0.96), one("k_c", -4600.0, -9900.0, 500.0, False),
                  one("k_phi", 7.2e5, 5.3e5, 9.6e5), one("cohesion", 240.0, 140.0, 330.0), *rest]
        reece = [one("n", 0.91, 0.85, 0.97), one("reece_k_c", -12.0, -30.0, 6.0, False),
                 one("reece_k_phi", 55.0, 40.0, 72.0), one("cohesion", 250.0, 150.0, 340.0), *rest]
        summary = {"soil": "a", "soil_sha256": "0" * 64, "soil_file": "a.soil.yaml", "engine_version": "6",
                   "quick": False, "grain_diameter_m": 0.008, "tool_friction": 0.364, "beds": 3,
                   "tests": ["plate60", "plate80", "shear"], "form": "bekker",
                   "bulk_density": {"bed": {"value": 1340.0}}, "parameters": bekker, "reece_parameters": reece}
        header, line = soil_rows.parameter_table(summary, "f" * 64).splitlines()
        with open(os.path.join(SOILS, "bevameter_soils.csv"), encoding="utf-8") as table:
            self.assertIn(header, table.read().splitlines())
        end = ("1340,bekker,k_c reece_k_c,3,8," + "f" * 64 + ',"virtual bevameter, a.soil.yaml, engine 6, friction of '
               'the tools 0.364, tests plate60 plate80 shear"')
        self.assertEqual(line, "a," + "0" * 64 + ",0.9,0.84,0.96,-4.6,-9.9,0.5,720,530,960,0.24,0.14,0.33,25.5,,28.3,"
                         "4,3,5,0.91,0.85,0.97,-12,-30,6,55,40,72,0.25,0.15,0.34," + end)
        summary.update(reece_parameters=None, quick=True)
        line = soil_rows.parameter_table(summary, "f" * 64).splitlines()[1]
        self.assertIn(",4,3,5" + 12 * "," + ",1340,bekker,k_c,3,8,", line)
        self.assertIn('shear, quick"', line)

    def test_the_tables_have_the_shipped_runs(self):
        """Each of their lines is what a bevameter.json says, which stands beside a soil file."""
        lines = {"cone_indices.csv": [], "bevameter_soils.csv": []}
        folder = os.path.join(ROOT, "dem_offline", "campaigns")
        for path in glob.glob(os.path.join(folder, "**", "*.json"), recursive=True):
            if not path.endswith(("cone.json", "bevameter.json")):
                continue
            with open(path, encoding="utf-8") as file:
                text = file.read()
            summary, digest = json.loads(text), hashlib.sha256(text.encode()).hexdigest()
            if summary["cone_index"] and path.endswith("cone.json"):
                lines["cone_indices.csv"].append(soil_rows.cone_table(summary, digest).splitlines()[1])
            if summary["parameters"]:
                lines["bevameter_soils.csv"].append(soil_rows.parameter_table(summary, digest).splitlines()[1])
        for name, own in lines.items():
            with open(os.path.join(SOILS, name), encoding="utf-8") as table:
                shipped = [line for line in table.read().splitlines() if not line.startswith("#")]
            self.assertEqual(sorted(shipped[1:]), sorted(own), name)

    def test_models_and_soil_files_name_the_same_soil(self):
        for soil, pair in (("cmu_wheel/calibrated", "cmu-smooth-62.5-8mm"), ("cmu_sand_20mm", "atv-20x10-lugged-20mm")):
            with open(os.path.join(ROOT, "surrogate", "pairs", pair, "runs.json"), encoding="utf-8") as file:
                ran = json.load(file)["scene"]["soil"]
            path = os.path.join(ROOT, "dem_offline", "campaigns", f"{soil}.soil.yaml")
            self.assertEqual(GrainSoil(path).identity, identity_of(ran))
        self.assertNotEqual(GrainSoil(LOOSE).identity, GrainSoil(self.soil_file()).identity)

    def test_what_is_not_told_does_not_agree(self):
        def told(low, high, identified=True):
            return {"low90": low, "high90": high, "identified": identified}
        self.assertEqual(page.meet(told(0, 1), told(0.5, 2)), "yes")
        self.assertEqual(page.meet(told(0, 1), told(1.5, None)), "NO")
        self.assertEqual(page.meet(told(0, 1), told(None, None, False)), "not told")

    def test_overlaps_that_are_too_large_are_named(self):
        runs = {name: types.SimpleNamespace(plan=types.SimpleNamespace(name=name),
                                            numerics={"overlap_p99_over_radius": overlap})
                for name, overlap in (("soft", 0.08), ("stiff", 0.03))}
        self.assertEqual(measurement.large_overlaps(runs), {"soft": 0.08})

    def test_independent_rows(self):
        self.assertEqual(measurement.counts_as(0.024, 0.008, 1), 3)
        self.assertEqual(measurement.counts_as(0.024, 0.008, 3), 9)
        self.assertEqual(measurement.counts_as(0.001, 0.008, 1), 1)
        self.assertEqual(measurement.counts_as(0.024, 0.0001, 2), 2 * measurement.BINS)


class Refusals(InFolder):
    def complaint(self, path):
        with self.assertRaises(Refused) as caught:
            GrainSoil(path)
        return str(caught.exception)

    def test_soil_files(self):
        self.assertIn("grains: got none, expected a soil of DEM grains", self.complaint(MEASURED))
        self.assertIn("no such file", self.complaint("nowhere.yaml"))
        self.assertIn("got no mapping", self.complaint(os.path.join(ROOT, "surrogate", "soils", "bekker_soils.csv")))
        self.assertIn("grains.frictoin: got an unknown key", self.complaint(self.soil_file(frictoin=1)))
        self.assertIn("grains.friction: got 'much', expected a number", self.complaint(self.soil_file(friction="much")))
        self.assertIn("grains.sizes: got []", self.complaint(self.soil_file(sizes=[])))
        half = self.soil_file(sizes=[{"diameter_m": 1}])
        self.assertIn("grains.sizes[0].mass_fraction: got none", self.complaint(half))

    def test_tests(self):
        soil = GrainSoil(LOOSE)
        for text, said in (("plate", "unknown test 'plate', expected plateNN"), ("plate60,tilt", "unknown test 'tilt'"),
                           ("plate30", "30 mm across, expected at least 40 mm, 5 grains of 8 mm"), (",", "none")):
            with self.assertRaisesRegex(Refused, said):
                benches.choose(text, soil)

    def test_exit_code_2_before_anything_runs(self):
        out = os.path.join(self.folder, "out")
        for words, said in (([MEASURED], "grains: got none"), ([LOOSE, "--tests", "tilt"], "unknown test 'tilt'"),
                            ([LOOSE, "--beds", "0"], "--beds 0: expected at least 1"),
                            ([LOOSE, "--beside", "x.yaml"], "--beside x.yaml: no such file"),
                            ([LOOSE, "--beside", LOOSE], "--beside: "),
                            ([self.soil_file(poisson_ratio=0.7), "--tests", "plate60"], "poisson_ratio")):
            done = subprocess.run(command(out, *words), capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn(said, done.stderr)
            self.assertFalse(os.path.exists(os.path.join(out, "runs", "plate60_bed1.run.h5")))


def command(out, *words):
    return [sys.executable, os.path.join(ROOT, "dem_offline", "bevameter", "bevameter.py"), *words, "--bin", BIN,
            "--out", out, "--jobs", "1"]


class WholeWay(InFolder):
    def test_from_grains_to_parameters_over_a_kill(self):
        out = os.path.join(self.folder, "out")
        words = command(out, self.soil_file(), "--tests", "plate60,press", "--beds", "1", "--depth", "0.06", "--beside",
                        self.measured())
        child = subprocess.Popen(words, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
        while "run press_bed1" not in child.stderr.readline():
            self.assertIsNone(child.poll())
        child.send_signal(signal.SIGKILL)
        child.wait()
        child.stderr.close()
        self.assertFalse(os.path.exists(os.path.join(out, "bevameter.json")))
        plate = os.path.join(out, "runs", "plate60_bed1.run.h5")
        before = os.stat(plate).st_mtime_ns
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(os.stat(plate).st_mtime_ns, before)
        self.assertIn("1 runs, 1 of them done before", done.stderr)
        self.check_files(out)
        self.check_beside(out)
        first, second = (record_of(os.path.join(BIN, "grouser-dem"), os.path.join(out, "runs", name + ".run.h5"))
                         for name in ("plate60_bed1", "press_bed1"))
        for key in ("solid_fraction", "grains", "preparation_friction", "preparation_rolling_friction"):
            self.assertEqual(first["bed"][key], second["bed"][key], key)  # the same bed, not searched again
        found = f"friction: {first['bed']['preparation_friction']!r}"
        self.assertIn(found, " ".join(second["experiment_spec"]["sets"]))

    def measured(self):
        """A measurement file of a plate, and of a pressed wheel that is as wide as these grains ask for."""
        path = os.path.join(self.folder, "measured.yaml")
        with open(os.path.join(self.folder, "measured.csv"), "w", encoding="utf-8") as file:
            file.write("body,z_mm,F_N\n" + "".join(f"{body},{z},{k * z}\n" for body, k in (("plate", 3), ("wheel", 2))
                                                  for z in range(6, 20, 2)))
        with open(path, "w", encoding="utf-8") as file:
            yaml.safe_dump({"soil": "measured", "source": "made up", "kind": "sand", "density_kg_per_m3": 1450, "tests": [
                {"name": name, "kind": kind, "file": "measured.csv", "where": {"body": body}, "sd": {"force": "5 %"},
                 "columns": {"sinkage": "z_mm", "force": "F_N"}, "constants": constants} for name, kind, body, constants in (
                    ("disc", "plate", "plate", {"diameter": "60 mm"}),
                    ("pressed", "press", "wheel", {"radius": "70 mm", "width": "65 mm"}))]}, file)
        return path

    def check_beside(self, out):
        """The measured wheel went down, and both have forces beside what was measured, from half a grain on."""
        record = record_of(os.path.join(BIN, "grouser-dem"), os.path.join(out, "runs", "press_bed1.run.h5"))
        self.assertIn("radius_m: 0.07, width_m: 0.065", " ".join(record["experiment_spec"]["sets"]))
        with open(os.path.join(out, "bevameter.json"), encoding="utf-8") as file:
            forces = json.load(file)["forces"]
        self.assertEqual([(one["test"], one["sinkage_m"], one["measured_n"]) for one in forces],
                         [("plate60", 0.01, 30), ("plate60", 0.015, 45), ("press", 0.01, 20), ("press", 0.015, 30)])
        for one in forces:
            self.assertGreater(one["value"], 0)
        with open(os.path.join(out, "report.html"), encoding="utf-8") as file:
            self.assertIn("Forces beside measured ones", file.read())

    def check_files(self, out):
        with open(os.path.join(out, "bevameter.json"), encoding="utf-8") as file:
            summary = json.load(file)
        self.assertEqual([one["name"] for one in summary["parameters"]],
                         ["n", "k_c", "k_phi", "cohesion", "friction_angle", "shear_modulus"])
        self.assertAlmostEqual(summary["bulk_density"]["bed"]["value"], 1450, delta=2500 * 0.008)
        with open(os.path.join(out, "measurements.yaml"), encoding="utf-8") as file:
            tests = yaml.safe_load(file)["tests"]
        self.assertEqual([one["name"] for one in tests], ["plate60", "pressed wheel"])
        with open(os.path.join(out, "calibrated", "soil.csv"), encoding="utf-8") as file:
            self.assertIn("tiny, DEM", file.read())
        soil = GrainSoil(self.soil_file())
        shown = subprocess.run([os.path.join(BIN, "grouser-soil"), "show", "tiny", "--json", "--bevameters",
                                os.path.join(out, "bevameter_soil.csv")], capture_output=True, text=True, check=True)
        found = json.loads(shown.stdout)[0]["bevameter"]
        self.assertEqual((found["soil_sha256"], found["beds"]), (soil.identity, 1))
        self.assertAlmostEqual(found["grain_m"], 0.012)
        for one in summary["parameters"]:
            told = found["parameters"][one["name"]]
            self.assertEqual((told["unit"], told["identified"]), (one["unit"], one["identified"]))
            for key in ("value", "low90", "high90"):
                if one[key] is None:
                    self.assertIsNone(told[key])
                else:
                    self.assertAlmostEqual(told[key], one[key], delta=1e-5 * abs(one[key]))
        with open(os.path.join(out, "report.html"), encoding="utf-8") as file:
            text = file.read()
        self.assertIn("data:image/png;base64,", text)
        self.assertIn("mean grain diameters", text)


if __name__ == "__main__":
    BIN = os.path.abspath(sys.argv.pop())
    unittest.main()
