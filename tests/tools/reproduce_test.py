#!/usr/bin/python3
"""`grouser reproduce` with a tiny system of its own: rows, exit codes, resuming, bad usage.

Usage: reproduce_test.py --bin FOLDER      (of grouser-dem)
"""

import argparse
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
REPRODUCE = os.path.join(ROOT, "dem_offline", "reproduce", "reproduce.py")
sys.path[:0] = [os.path.dirname(REPRODUCE)]

import forked  # noqa: E402
import reproduce  # noqa: E402

BIN = None

EXPERIMENT = """
name: fall
materials:
  - {name: sand, density_kg_per_m3: 2500, youngs_modulus_pa: 5.0e6, poisson_ratio: 0.3}
interfaces:
  - {between: [sand, any], restitution: 0.5, friction: 0.5}
box: {length_m: 0.1, width_m: 0.1, height_m: 0.3, material: sand}
grains: {kind: lattice, material: sand, diameter_m: 0.01, count: 4,
         region: {low_m: [0, 0, 0.1], high_m: [0.1, 0.1, 0.2]}}
duration_s: 0.1
probes: [{kind: rest}, {kind: energy}]
"""
# Free fall from rest: potential energy m g (g t^2/2) of four grains.
SYSTEM = """
import math
from matplotlib import pyplot
from rows import at_most, between, printed
TITLE = "Falling grains"
ABOUT = "Four grains fall."
RUNS = [("short", "fall.yaml", {}), ("late", "fall.yaml", {"duration_s": 0.12})]
FACTOR = 1.0
def runs(level):
    return RUNS
def rows(results, level):
    mass = 4 * 2500 * math.pi * 0.01**3 / 6
    got = []
    for name, result in results.items():
        if not result.done:
            return [at_most("none failed", math.nan, 1, 0, "nothing")]
        s = result.series
        fall = 0.5 * 9.81 * s["time_s"][-1] ** 2
        got.append(-FACTOR * s["energy.potential_j"][-1] / (mass * 9.81 * fall))
    return [between("fall over closed form", got, 0.98, 1.02, 1.0, "nothing"),
            printed("seconds", results["short"].series["time_s"][-1], 0.1, "nothing")]
def changed(level):
    return ["nothing <at all>"]
def figures(results, level):
    figure, axes = pyplot.subplots()
    s = results["short"].series
    axes.plot(s["time_s"], s["energy.potential_j"])
    return [("Fall", figure, "It falls.")]
"""


def files_of(folder):
    runs = os.path.join(folder, "fall", "runs")
    return {name: os.stat(os.path.join(runs, name)).st_mtime_ns
            for name in os.listdir(runs) if name.endswith(".run.h5")}


class Reproduce(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.addCleanup(self.temporary.cleanup)
        self.systems = os.path.join(self.temporary.name, "systems")
        self.out = os.path.join(self.temporary.name, "out")
        os.makedirs(os.path.join(self.systems, "fall"))
        os.makedirs(os.path.join(self.systems, "later"))
        self.write("fall.yaml", EXPERIMENT)
        self.write("system.py", SYSTEM)

    def write(self, name, text):
        with open(os.path.join(self.systems, "fall", name), "w", encoding="utf-8") as file:
            file.write(text)

    def words(self, *words):
        return [REPRODUCE, "--bin", BIN, "--out", self.out, "--systems", self.systems, *words]

    def call(self, *words):
        done = forked.call(reproduce.main, *self.words(*words))
        return done.returncode, done.stdout, done.stderr

    def rows(self):
        with open(os.path.join(self.out, "fall", "rows.json"), encoding="utf-8") as file:
            return json.load(file)["rows"]

    def test_writes_rows_and_a_page_of_its_own(self):
        code, out, err = self.call("fall", "--quick")
        self.assertEqual(code, 0, err)
        first, second = self.rows()
        self.assertEqual({"row", "got", "expected", "limit", "pass", "changed", "standard_error", "beds"},
                         set(first))
        self.assertIs(first["pass"], True)
        self.assertAlmostEqual(first["got"], 1, delta=0.02)
        self.assertGreater(first["standard_error"], 0)
        self.assertEqual(first["beds"], 2)
        self.assertIsNone(second["pass"])
        self.assertIn("holds    fall over closed form", out)
        with open(os.path.join(self.out, "fall", "report.html"), encoding="utf-8") as file:
            page = file.read()
        self.assertIn("data:image/png;base64,", page)
        self.assertIn("nothing &lt;at all&gt;", page)
        self.assertIn("--set duration_s=0.12", page)
        self.assertEqual(re.findall(r'(?:src|href)="(?!data:)', page), [])

    def test_a_broken_row_gives_exit_code_1(self):
        self.write("system.py", SYSTEM.replace("FACTOR = 1.0", "FACTOR = 1.1"))
        code, out, _ = self.call("fall", "--quick")
        self.assertEqual(code, 1)
        self.assertIn("FAILS    fall over closed form", out)
        self.assertIs(self.rows()[0]["pass"], False)

    def test_what_is_done_is_not_run_again(self):
        self.assertEqual(self.call("fall", "--quick")[0], 0)
        before = files_of(self.out)
        code, _, err = self.call("fall", "--quick")
        self.assertEqual(code, 0)
        self.assertIn("2 runs, 2 of them done before", err)
        self.assertEqual(files_of(self.out), before)
        self.write("system.py", SYSTEM.replace("0.12", "0.13"))
        self.assertEqual(self.call("fall", "--quick")[0], 0)
        after = files_of(self.out)
        self.assertEqual(after["short.run.h5"], before["short.run.h5"])
        self.assertNotEqual(after["late.run.h5"], before["late.run.h5"])
        self.write("fall.yaml", EXPERIMENT + "# another text\n")
        self.assertIn("2 runs, 0 of them done before", self.call("fall", "--quick")[2])

    def test_a_file_that_a_value_names_counts(self):
        self.write("system.py", SYSTEM.replace('{"duration_s": 0.12}', '{"grains": '
                                               '{"kind": "file", "material": "sand", "file": "four.csv"}}'))
        places = [f"0.0{2 * k + 1},0.05,0.1,0.005\n" for k in range(4)]
        self.write("four.csv", "".join(places))
        self.assertEqual(self.call("fall", "--quick")[0], 0)
        self.assertIn("2 runs, 2 of them done before", self.call("fall", "--quick")[2])
        self.write("four.csv", "".join(places).replace("0.1,", "0.11,"))
        self.assertIn("2 runs, 1 of them done before", self.call("fall", "--quick")[2])

    def test_a_kill_loses_only_the_run_in_flight(self):
        self.write("system.py", SYSTEM.replace('"duration_s": 0.12', '"duration_s": 40'))
        child = subprocess.Popen([sys.executable, *self.words("fall", "--quick", "--jobs", "1")], stderr=subprocess.PIPE,
                                 stdout=subprocess.DEVNULL, text=True)
        while "run late" not in child.stderr.readline():
            self.assertIsNone(child.poll())
        child.send_signal(signal.SIGKILL)
        child.wait()
        child.stderr.close()
        before = files_of(self.out)
        self.write("system.py", SYSTEM)
        self.assertEqual(self.call("fall", "--quick")[0], 0)
        after = files_of(self.out)
        self.assertEqual(after["short.run.h5"], before["short.run.h5"])
        self.assertIn("late.run.h5", after)

    def test_runs_that_fail_are_named(self):
        self.write("fall.yaml", EXPERIMENT.replace("friction: 0.5", "frictoin: 0.5"))
        code, _, err = self.call("fall", "--quick")
        self.assertEqual(code, 1)
        self.assertIn("run short ended with 2", err)
        self.assertIn("friction", err)

    def test_bad_usage_is_refused(self):
        for words, text in (((), "required: SYSTEM"), (("rise",), "unknown system 'rise'"),
                            (("later",), "later: not there yet"),
                            (("fall", "--device", "cuda"), "CPU only"),
                            (("fall", "--jobs", "0"), "at least 1"),
                            (("fall", "--quick", "--full"), "not allowed with")):
            code, out, err = self.call(*words)
            self.assertEqual(code, 2, words)
            self.assertIn(text, err)
            self.assertEqual(out, "")
        self.assertFalse(os.path.exists(self.out))

    def test_all_names_what_is_not_there(self):
        code, out, err = self.call("all", "--quick")
        self.assertEqual(code, 1)
        self.assertIn("later: not there yet", err)
        self.assertIn("holds    fall over closed form", out)

    def test_the_files_of_every_system_are_accepted(self):
        seen = set()
        for name in reproduce.SYSTEMS:
            module = reproduce.load(reproduce.HERE, name)
            for level in reproduce.LEVELS if module else ():
                for plan in reproduce.plans_of(module, level):
                    keys = tuple(text.split("=")[0] for text in plan.sets)
                    if (plan.file, level, keys) in seen:
                        continue
                    seen.add((plan.file, level, keys))
                    checked = subprocess.run([os.path.join(BIN, "grouser-dem"), "check", plan.file,
                                              *plan.options()], capture_output=True, text=True, check=False)
                    if "built without Simbody" in checked.stderr:
                        continue
                    self.assertEqual(checked.returncode, 0, f"{name} {level} {plan.name}: {checked.stderr}")
        self.assertTrue(seen)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", required=True)
    arguments, rest = parser.parse_known_args()
    BIN = arguments.bin
    unittest.main(argv=[sys.argv[0], *rest])
