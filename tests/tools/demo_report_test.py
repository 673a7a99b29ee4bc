#!/usr/bin/python3
"""Renders the demo's report from synthetic runs and checks what it says.

Usage: demo_report_test.py [--keep REPORT.html]
"""

import importlib
import math
import os
import re
import sys
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "clients", "demo"))
report = importlib.import_module("report")
readings = importlib.import_module("readings")
OUTPUTS = ("f_x", "f_y", "f_z", "torque", "m_z", "sinkage")
KEEP = None


def law(slip, angle_deg, load):
    """Something smooth of about the right size."""
    angle = math.radians(angle_deg)
    return {"f_x": load * (0.35 * math.tanh(3 * slip) - 0.1 - 0.3 * math.sin(angle)),
            "f_y": -0.9 * load * math.sin(angle) * (1 - 0.4 * max(slip, 0)),
            "f_z": load, "torque": 0.0625 * load * 0.4 * math.tanh(3 * slip),
            "m_z": 0.02 * load * math.sin(angle),
            "sinkage": 0.012 + 0.01 * abs(slip) + 0.015 * math.sin(angle)}


def record(run_id, slip, angle_deg, load=24.0, shift=0.0, status="STEADY", seed=1):
    mean = law(slip, angle_deg, load)
    profile = [max(0.0, 9000 * math.cos((a - 18) / 30)) for a in range(-90, 90, 5) for _ in range(5)]
    return {
        "run_id": run_id, "status": "RUN_STATUS_" + status, "reason": "",
        "slip": slip, "attack_angle_rad": math.radians(angle_deg), "blocks": 10,
        "spec": {
            "seed": str(seed), "state": {"load_n": load},
            "wheel": {"name": "smooth", "radius_m": 0.0625, "width_m": 0.05},
            "soil": {"name": "sand", "bulk_density_kg_per_m3": 1330.0,
                     "grains": {"youngs_modulus_pa": 5e6}},
            "rig": {"bed_length_m": 0.28, "bed_width_m": 0.2, "bed_depth_m": 0.1,
                    "speed_m_per_s": 0.1}},
        "outputs": [{"name": name, "mean": value + shift * 0.05 * abs(value),
                     "standard_error": 0.03 * abs(value) + 1e-4, "drift": 0.0, "fluctuation": 0.1}
                    for name, value in mean.items()],
        "rules": [{"name": "width/d", "value": 5.6, "limit": 6.0, "kept": False}],
        "energy": {"input_j": 2.0, "residual_j": 0.002},
        "bed": {"solid_fraction": 0.58, "bulk_density_kg_per_m3": 1332.0, "mean_diameter_m": 0.009,
                "grains": "8123"},
        "numerics": {"dt_s": 1e-4, "particle_steps": 1.7e8, "wall_s": 21.0, "inertial_number": 0.004,
                     "overlap_p99_over_radius": 0.06},
        "stress": {"first_angle_rad": -math.pi / 2, "angle_step_rad": math.radians(5), "width_bins": 5,
                   "normal_pa": profile, "shear_tangential_pa": [0.3 * x for x in profile],
                   "entry_angle_rad": 0.7, "exit_angle_rad": -0.2}}


def responses(states, half_width=0.1, shift=0.0):
    message = {"slip": {"slip": [s for s, _ in states],
                        "attack_angle_rad": [math.radians(a) for _, a in states]},
               "flags": [0] * len(states), "interval_level": 0.9}
    for output in OUTPUTS:
        value = [law(s, a, 24.0)[output] * (1 + shift) for s, a in states]
        half = [half_width * abs(v) + 1e-4 for v in value]
        message[output] = {"value": value, "low": [v - h for v, h in zip(value, half)],
                           "high": [v + h for v, h in zip(value, half)]}
    return message


def synthetic_data():
    grid = [(s, a) for a in (0, 30, 60) for s in (-0.3, 0.0, 0.2, 0.5)]
    runs = [{"role": "RUN_ROLE_TRAIN", "record": record(f"train{i}", s, a, shift=(-1) ** i)}
            for i, (s, a) in enumerate(grid)]
    held = [(0.1, 15), (0.35, 45), (-0.1, 30), (0.4, 5)]
    runs += [{"role": "RUN_ROLE_TEST", "record": record(f"test{i}", s, a, shift=0.5)}
             for i, (s, a) in enumerate(held)]
    runs.append({"role": "RUN_ROLE_TRAIN",
                 "record": record("overload", -0.9, 60, status="OVERLOAD")})
    slips = [-0.8 + 0.05 * i for i in range(35)]
    job = {"job_id": "j1", "run": record("job", 0.35, 20), "run_file": "job.run.h5", "run_sha256": "ab" * 32,
           "candidate_digest": "cd" * 32, "gate": [{"name": "held_out", "passed": True, "detail": "no worse"}]}
    nan = {"value": "NaN", "sd": "NaN"}
    row = {"slip": 0.23, "attack_angle_deg": 0.0, "load_n": 24.6, "flags": 4, "region": "driving",
           "measured": {"f_x": {"value": 0.7, "sd": 0.2}, "f_y": {"value": 0.3, "sd": 0.1}, "torque": nan,
                        "sinkage": {"value": 0.018, "sd": 0.001}},
           "surrogate": {o: {"value": 1.9, "low": 1.2, "high": 2.6} for o in OUTPUTS},
           "dem": {o: {"value": 2.0, "standard_error": 0.1} for o in OUTPUTS}}
    errors = [{"region": "driving", "output": "f_x", "n": 1, "mean_measured": 0.7, "rmse": 1.2,
               "rmse_dem": "NaN", "n_dem": 0}]
    return {
        "version": "0.1.0", "load_n": 24.0, "interval_level": 0.9, "runs": runs,
        "model": {"name": "demo", "errors": [
            {"region": "REGION_ALL", "output": "f_x", "set": "held_out", "n": 4, "rmse": 0.2,
             "max_abs": 0.3, "covered90": 0.75}]},
        "curves_over_slip": {str(a): responses([(s, a) for s in slips]) for a in (0, 30, 60)},
        "curves_over_angle": {str(s): responses([(s, a) for a in range(0, 76, 3)]) for s in (0.0, 0.2, 0.5)},
        "held_out": {"run_ids": [f"test{i}" for i in range(len(held))], "responses": responses(held)},
        "compare": {"rows": [row, dict(row, dem=None)], "errors": errors},
        "mission": {"asked": 7, "vehicle": "husky", "job": "job-1",
                    "soil": ["soil,n,source", 'sand,1.27,"measured, here"']},
        "latency": [{"transport": "tcp unary", "states": 4, "fields": "all", "samples": 5000,
                     "p50": {"server_us": 84.0, "ratio": 1.16}, "p99": {"server_us": 160.0}}],
        "refinement": {"before": responses([(0.35, 20)], 0.3, 0.2), "after": responses([(0.35, 20)], 0.1, 0.02),
                       "held_out": record("held", 0.35, 20, shift=0.3, seed=2), "job": job,
                       "promotion": "by hand"},
        "stages": [{"name": "campaign", "seconds": 301.2}]}


class DemoReport(unittest.TestCase):
    def test_whole_report(self):
        page = report.render(synthetic_data())
        if KEEP:
            with open(KEEP, "w") as file:
                file.write(page)
        self.assertEqual(page.count("data:image/png;base64,"), 5)
        text = re.sub(r'src="[^"]*"', "", page)
        self.assertNotRegex(text, r"\b[nN]a[nN]\b|None|Infinity")
        self.assertIn("1 OVERLOAD, 16 STEADY", text)
        self.assertIn("width/d", text)
        self.assertIn("ab" * 32, text)
        self.assertIn("measured, here", text)

    def test_refinement_reading_names_what_got_worse(self):
        before = {o: (1.0, 0.5, 1.5) for o in OUTPUTS}
        after = dict(before, f_x=(2.0, 1.9, 2.1))
        held_out = report.Run(record("held", 0.35, 20))
        held_out.mean = {o: 1.2 for o in OUTPUTS}
        held_out.mean["f_x"] = 1.9
        text = readings.refinement(before, after, held_out)
        self.assertIn("The error fell for f_x; the interval narrowed for f_x", text)
        self.assertIn("4 of 5 outputs before and 5 after", text)

    def test_largest_pull_is_the_largest(self):
        runs = [report.Run(record("light", 0.2, 0, load=12.0)), report.Run(record("heavy", 0.5, 0, load=48.0)),
                report.Run(record("side", 0.5, 60, load=90.0))]
        for run, pull in zip(runs, (6.0, 9.0, 30.0)):
            run.mean["f_x"] = pull
        text = readings.against_slip(runs, 0, 0, 24.0)
        self.assertIn("pull at 0° is 9.00 N (slip 0.50, load 48 N)", text)
        self.assertIn("share of the load 50 % (slip 0.20, load 12 N)", text)

    def test_outputs_and_flag_are_the_models(self):
        records = importlib.import_module("records")
        with open(os.path.join(ROOT, "surrogate", "models", "outputs.h")) as file:
            header = file.read()
        named = re.findall(r'\{"(\w+)", "[^"]+", OutputUnit', header)
        self.assertEqual(records.OUTPUTS, tuple(named))
        self.assertEqual(records.EXTRAPOLATED, int(re.search(r"kExtrapolated = (\d+)", header)[1]))

    def test_nan_written_by_protobuf(self):
        data = synthetic_data()
        data["runs"][-1]["record"]["outputs"][0]["mean"] = "NaN"
        self.assertIn("–", report.render(data))


if __name__ == "__main__":
    if "--keep" in sys.argv:
        at = sys.argv.index("--keep")
        KEEP = sys.argv[at + 1]
        del sys.argv[at:at + 2]
    unittest.main()
