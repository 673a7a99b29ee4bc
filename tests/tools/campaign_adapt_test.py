#!/usr/bin/python3
"""./grouser campaign adapt: which states are next, when it ends, how it goes on. Scripted programs stand for
grouser-dem and grouser-fit: the model's sd falls with every run, and is largest at large attack angles."""

import json
import math
import os
import stat
import sys
import tempfile
import time
import types
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "dem_offline", "adaptive"))

import adapt  # noqa: E402  (it finds the others)
import forked  # noqa: E402
import states  # noqa: E402
from processes import Processes  # noqa: E402

DEM = """#!/usr/bin/python3
import json, os, sys, yaml
words = sys.argv[1:]
if words[:2] == ["campaign", "run"]:
    campaign = yaml.safe_load(open(words[2]))
    if campaign.get("refuse"):
        sys.exit(2)
    assert os.path.exists(os.path.join(os.path.dirname(words[2]), campaign["scene"])), campaign["scene"]
    os.makedirs(words[words.index("--out") + 1], exist_ok=True)
    path = os.path.join(words[words.index("--out") + 1], "runs.json")
    if campaign.get("slow"):
        import time
        time.sleep(0.8)
        kept = json.load(open(os.path.join(os.path.dirname(words[2]), "adapt.json")))
        json.dump(kept["seconds"], open(os.path.join(os.path.dirname(words[2]), "seen.json"), "w"))
    json.dump(campaign["extra"], open(path, "w"))
else:
    slip, angle, load = (words[words.index(one) + 1:][:2] for one in ("--slip", "--angle-deg", "--load"))
    passed = int(words[words.index("--seed") + 1])
    for k in range(10):
        u = ((k + 0.5) / 10 + 0.37 * passed) % 1
        v = (k * 0.618 + 0.21 * passed) % 1
        at = [float(low) + w * (float(high) - float(low)) for (low, high), w in ((slip, v), (angle, u), (load, v))]
        print("- {slip: %r, attack_angle_deg: %r, load_n: %r, seed: 1}" % tuple(at))
"""
FIT = """#!/usr/bin/python3 -SE
import json, math, os, sys
words = sys.argv[1:]
if words[0] == "fit":
    runs = json.load(open(os.path.join(words[words.index("--runs") + 1], "runs.json")))
    path = words[words.index("--out") + 1]
    json.dump(len(runs), open(path, "w"))
    told = [{"role": "RUN_ROLE_TRAIN", "slip": r["slip"], "load_n": r["load_n"],
             "attack_angle_rad": math.radians(r["attack_angle_deg"])} for r in runs]
    print(json.dumps({"model": {"wheel": {"radius_m": 0.1}, "provenance": {"runs": told}, "errors": []}}))
else:
    said = {w.split("=")[0]: float(w.split("=")[1]) for w in words if "=" in w}
    runs = json.load(open(words[1]))
    load, sd = said["--load"], (1 + said["--angle-deg"] / 60) / runs
    print(json.dumps({"load_n": load, "flag_names": ["OVERLOAD"] if said["--slip"] < -0.3 else [], "outputs": {
        "f_x": {"sd_fit": sd * load}, "f_y": {"sd_fit": 0}, "torque": {"sd_fit": 0}, "sinkage": {"sd_fit": 0}}}))
"""
CAMPAIGN = """name: small
scene: s.scene.yaml
seeds: [1, 2]
extra:
  - {slip: -0.4, attack_angle_deg: 0, load_n: 10}
  - {slip: 0.8, attack_angle_deg: 60, load_n: 20}
"""


class Choice(unittest.TestCase):
    ranges = states.Ranges((0.0, 1.0), (0.0, 1.0), (1.0, 1.0))

    def test_takes_the_most_unsure_but_none_beside_a_run_or_each_other(self):
        candidates = [((0.5, 0.5, 1.0), 3.0), ((0.51, 0.5, 1.0), 2.9), ((0.9, 0.9, 1.0), 2.0), ((0.0, 0.0, 1.0), 9.0),
                      ((0.2, 0.8, 1.0), math.nan)]
        chosen = states.choose(candidates, [(0.0, 0.0, 1.0)], self.ranges, 2)
        self.assertEqual(chosen, [(0.5, 0.5, 1.0), (0.9, 0.9, 1.0)])

    def test_gives_no_state_that_has_run(self):
        self.assertEqual(states.choose([((0.0, 0.0, 1.0), 9.0)], [(0.0, 0.0, 1.0)], self.ranges, 3), [])

    def test_unsure_is_the_largest_over_its_scale(self):
        outputs = {name: {"sd_fit": value} for name, value in
                   (("f_x", 1.0), ("f_y", 2.0), ("torque", 3.0), ("sinkage", 0.01))}
        self.assertAlmostEqual(states.unsure({"load_n": 20.0, "outputs": outputs}, 0.1), 1.5)
        outputs["f_x"]["sd_fit"] = "NaN"
        self.assertTrue(math.isnan(states.unsure({"load_n": 20.0, "outputs": outputs}, 0.1)))


class Loop(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        for name, text in (("grouser-dem", DEM), ("grouser-fit", FIT), ("c.yaml", CAMPAIGN), ("s.scene.yaml", "")):
            path = os.path.join(self.folder, name)
            with open(path, "w", encoding="utf-8") as file:
                file.write(text)
            os.chmod(path, os.stat(path).st_mode | stat.S_IXUSR)
        self.out = os.path.join(self.folder, "deep", "out")

    def file(self, name, text):
        with open(os.path.join(self.folder, name), "w", encoding="utf-8") as file:
            file.write(text)

    def adapt(self, *more, campaign="c.yaml"):
        return forked.call(adapt.main, "adapt.py", os.path.join(self.folder, campaign), "--out", self.out, "--bin",
                           self.folder, "--batch", "4", "--json", *more)

    def test_goes_on_until_sure(self):
        done = self.adapt("--budget", "1", "--error", "0.15")
        self.assertEqual(done.returncode, 0, done.stderr)
        history = json.loads(done.stdout)
        self.assertEqual([line["runs"] for line in history["models"]], [2, 6, 10, 14])
        self.assertLessEqual(history["models"][-1]["unsure_95"], 0.15)
        self.assertGreater(history["models"][-2]["unsure_95"], 0.15)
        self.assertGreater(history["added"][0]["attack_angle_deg"], 40)  # where the scripted model is least sure
        self.assertTrue(all(one["slip"] >= -0.3 for one in history["added"]))  # not beyond the border
        self.assertEqual({one["seed"] for one in history["added"]}, {1, 2})

    def test_ends_with_the_budget_and_goes_on_with_a_larger_one(self):
        self.assertEqual(self.adapt("--budget", "0", "--error", "0.15").returncode, 1)
        with open(os.path.join(self.out, "adapt.json"), encoding="utf-8") as file:
            first = json.load(file)
        self.assertEqual((len(first["models"]), first["added"]), (1, []))
        done = self.adapt("--budget", "1", "--error", "0.15")
        self.assertEqual(done.returncode, 0, done.stderr)
        history = json.loads(done.stdout)
        self.assertEqual([line["runs"] for line in history["models"]], [2, 6, 10, 14])
        self.assertGreater(history["seconds"], first["seconds"])

    def test_is_not_sure_because_nothing_is_left_to_run(self):
        self.file("grouser-dem", DEM.replace("passed = int", "passed = 0 * int"))  # the same candidates each time
        done = self.adapt("--budget", "1", "--error", "0")
        self.assertEqual((done.returncode, "no state is left that has not run" in done.stderr), (1, True), done.stderr)
        states_run = [(one["slip"], one["load_n"]) for one in json.loads(done.stdout)["added"]]
        self.assertEqual(len(states_run), len(set(states_run)))

    def test_what_the_campaign_says_comes_out_as_it_stood(self):
        self.file("words.yaml", CAMPAIGN.replace("name: small", "name: off") + "note: 6e2\n")
        self.adapt("--budget", "0", campaign="words.yaml")
        with open(os.path.join(self.out, "adapted.campaign.yaml"), encoding="utf-8") as file:
            text = file.read()
        self.assertIn("name: off\n", text)
        self.assertIn("note: 6e2\n", text)
        self.assertIn("slip: -0.4\n", text)

    def test_refuses(self):
        for more, words in ((("--budget", "-1"), "--budget -1: expected at least 0"),
                            (("--budget", "nan"), "--budget nan: expected at least 0"),
                            (("--budget", "1", "--batch", "0"), "--batch 0: expected at least 1")):
            done = self.adapt(*more)
            self.assertEqual((done.returncode, words in done.stderr), (2, True), done.stderr)
        done = self.adapt("--budget", "1", campaign="none.yaml")
        self.assertEqual((done.returncode, "none.yaml" in done.stderr), (2, True), done.stderr)
        done = self.adapt("--budget", "1", campaign="s.scene.yaml")
        self.assertIn("expected a campaign file with a scene", done.stderr)
        for text, words in (
                ("mode: towed", "mode: got 'towed', expected rim or none"),
                ("speed_m_per_s: 0.1", "speed_m_per_s: got 0.1, expected none"),
                ("grid: [{slip: [0], attack_angle_deg: [0, -5], load_n: [9]}]", "grid[0].attack_angle_deg: got -5, "
                 "expected 0 or more"),
                ("grid: [{mode: free, drawbar_n: [1], load_n: [9]}]", "grid[0].mode: got 'free'"),
                ("", "extra[2].attack_angle_deg: got -1, expected 0 or more")):
            more = "" if text else "  - {slip: 0, attack_angle_deg: -1, load_n: 15}\n"
            self.file("bad.yaml", CAMPAIGN + more + text + "\n")
            done = self.adapt("--budget", "1", campaign="bad.yaml")
            self.assertEqual((done.returncode, words in done.stderr), (2, True), done.stderr)
        self.assertEqual(self.adapt("--budget", "0").returncode, 1)
        with open(os.path.join(self.folder, "c.yaml"), "a", encoding="utf-8") as file:
            file.write("  - {slip: 0, attack_angle_deg: 0, load_n: 15}\n")
        done = self.adapt("--budget", "1")
        self.assertEqual((done.returncode, "holds another campaign" in done.stderr), (2, True), done.stderr)
        self.file("deep/out/adapt.json", '{"campaign": {')
        done = self.adapt("--budget", "1")
        self.assertEqual((done.returncode, "adapt.json: JSONDecodeError" in done.stderr), (2, True), done.stderr)
        self.file("deep/out/adapt.json", '{"campaign": {}, "added": 1}')
        done = self.adapt("--budget", "1")
        self.assertEqual((done.returncode, "added: got 1, expected a list" in done.stderr), (2, True), done.stderr)

    def test_a_campaign_that_was_refused_can_be_mended(self):
        self.file("c.yaml", CAMPAIGN + "refuse: true\n")
        done = self.adapt("--budget", "0")
        self.assertEqual((done.returncode, "ended with 2" in done.stderr), (2, True), done.stderr)
        self.file("c.yaml", CAMPAIGN)
        self.assertEqual(self.adapt("--budget", "0").returncode, 1)

    def test_time_counts_while_the_campaign_runs(self):
        self.file("c.yaml", CAMPAIGN + "slow: true\n")
        arguments = types.SimpleNamespace(campaign=os.path.join(self.folder, "c.yaml"), out=self.out, bin=self.folder,
                                          jobs=1)
        os.makedirs(self.out)
        before, adapt.KEPT_EVERY_S = adapt.KEPT_EVERY_S, 0.1
        self.addCleanup(setattr, adapt, "KEPT_EVERY_S", before)
        with Processes(self.out) as processes:
            adaptive = adapt.Adaptive(arguments, processes)
            began = time.monotonic()
            adaptive.timed(adaptive.run)
            took = time.monotonic() - began
        with open(os.path.join(self.out, "seen.json"), encoding="utf-8") as file:
            self.assertGreater(json.load(file), 0.3)
        self.assertAlmostEqual(adaptive.history["seconds"], took, delta=0.1)  # and once


if __name__ == "__main__":
    unittest.main()
