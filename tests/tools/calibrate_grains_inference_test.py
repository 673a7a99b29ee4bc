#!/usr/bin/python3
"""./grouser calibrate grains: emulator, posterior and what is said of them, on a made-up table of runs.

Usage: calibrate_grains_inference_test.py [--coverage] BIN
--coverage: 100 trials alone (a minute): the emulator as truth, seeds fixed; how often the 90 % region holds it."""

import json
import math
import os
import subprocess
import sys
import tempfile
import types
import unittest

import numpy

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path[:0] = [os.path.join(ROOT, *folder) for folder in (
    ("dem_offline", "calibrate_grains"), ("dem_offline", "bevameter"), ("dem_offline", "validate"),
    ("clients", "common"))]

import check  # noqa: E402
import emulator  # noqa: E402
import evidence as evidences  # noqa: E402
import grains_page  # noqa: E402
import identify  # noqa: E402
import outcome  # noqa: E402
import posterior as bayes  # noqa: E402
import predict  # noqa: E402
import targets as measured  # noqa: E402
import vary as varied  # noqa: E402
from experiment_runs import Refused  # noqa: E402

CAMPAIGNS = os.path.join(ROOT, "dem_offline", "campaigns")
SOIL = os.path.join(CAMPAIGNS, "cmu_loose.soil.yaml")
SCENE = os.path.join(CAMPAIGNS, "cmu_validate.scene.yaml")
DATA = os.path.join(ROOT, "surrogate", "calibrate", "measured", "cmu_wheel.yaml")
POINTS, SAMPLES, TRIALS = 20, 600, 100


def made_up(row, u, error):
    """A smooth answer at u = (friction, rolling friction, wheel friction, solid fraction): no physics."""
    friction, rolling, wheel, packing = u
    sunk = 0.022 * math.exp(-0.9 * (packing - 0.5) - 0.5 * (friction - 0.5) - 0.4 * (rolling - 0.5))
    if row.kind != "wheel":
        size = 1.0 if row.kind == "press" else (row.at["mm"] / 60)**2.3
        own = 0.3 * (wheel - 0.5) if row.kind == "press" else 0.0
        return size * 22 * (row.at["sinkage"] / 0.01)**(1.2 + 0.3 * (packing - 0.5)) * math.exp(
            (packing - 0.5) + 0.5 * (friction - 0.5) + 0.3 * (rolling - 0.4) + own + 0.06 * error)
    if row.measured == "sinkage":
        return sunk * (1 + 0.3 * abs(row.at["slip"])) + 0.0007 * error
    if row.measured == "f_x":
        return row.at["load"] * (0.35 * math.tanh(3 * row.at["slip"]) * (0.5 + wheel) - 6 * sunk) + 0.4 * error
    return -row.at["load"] * math.sin(math.radians(row.at["angle"])) * (0.6 + 0.5 * wheel + 5 * sunk) + 0.4 * error


def made_up_table(targets, vary, count=POINTS, predict_="plates"):
    random, points = numpy.random.default_rng(3), []
    for k, values in enumerate(vary.points(count), 1):
        u, errors, outputs = vary.to_unit(values), {}, {}
        for row in targets.chosen(predict_):
            run = row.test if row.kind != "wheel" else row.key.rsplit(" ", 1)[0]
            error = 0.9 * errors.setdefault(run, random.standard_normal()) + 0.4 * random.standard_normal()
            outputs[row.key] = {"value": made_up(row, u, error), "standard_error": None, "beds": {}}
        points.append({"label": f"s{k:03d}", "values": {**vary.fixed, **values}, "asked": "", "status": "done",
                       "seconds": {"tests": 1.0, "wheels": 1.0}, "outputs": outputs, "reasons": [],
                       "solid_fraction": {"tests": values["solid_fraction"], "wheels": values["solid_fraction"]}})
    file = {"file": "made up", "sha256": "0" * 64}
    return {"version": 1, "soil": file, "scene": file, "beds": 1, "fixed": vary.fixed, "points": points,
            "ranges": {name: list(ends) for name, ends in vary.ranges.items()}}


def cmu():
    targets = measured.read(os.path.join(BIN, "grouser-calibrate"), DATA, 0.008)
    return targets, varied.read(os.path.join(CAMPAIGNS, "cmu_grains.vary.yaml"))


def evidence_of(targets, table, vary, runs=None):
    runs = runs or evidences.Runs(table, vary)
    blocks = evidences.blocks_of(targets, 0.0625)
    return runs, evidences.Evidence(blocks, [runs.process(block) for block in blocks])


def draw_of(target, random):
    """(unit parameters, measured values) as the model says that they come about."""
    e = target.evidence
    z = target.draw(1, random)
    mean, sd = e.at(z[:, :target.p])
    runs = numpy.linalg.cholesky(e.correlation) @ random.standard_normal(len(mean[0])) * numpy.sqrt(sd[0]**2 + e.noise)
    form = numpy.exp(z[0, target.p:])[e.group] * e.scale
    return z[0, :target.p], mean[0] + runs + random.standard_normal(len(runs)) * numpy.sqrt(e.sd**2 + form**2)


class Emulator(unittest.TestCase):
    def setUp(self):
        import openturns
        random = numpy.random.default_rng(1)
        self.x = numpy.array(openturns.SobolSequence(2).generate(24))
        self.truth = lambda x: numpy.sin(3 * x[:, 0]) + x[:, 0] * x[:, 1]
        self.process = emulator.fit(self.x, self.truth(self.x) + 0.02 * random.standard_normal(24))

    def test_leaves_out_as_a_fit_without_that_run(self):
        mean, sd = self.process.left_out()
        p = self.process
        for k in (0, 11):
            others = emulator.Process(numpy.delete(self.x, k, 0), numpy.delete(p.y, k), p.lengths, p.variance, p.noise)
            value, error = others.at(self.x[k:k + 1])
            self.assertAlmostEqual(value[0], mean[k], places=8)
            self.assertAlmostEqual(math.hypot(error[0], math.sqrt(p.noise)), sd[k], places=8)

    def test_depends_on_the_columns_that_are_named(self):
        random = numpy.random.default_rng(4)
        wide = numpy.column_stack([self.x[:, 0], random.random(24), self.x[:, 1]])
        one = emulator.fit(wide, self.process.y, [0, 2])
        at = random.random((6, 3))
        for got, expected in zip(one.at(at), self.process.at(at[:, [0, 2]])):
            numpy.testing.assert_allclose(got, expected, rtol=1e-9)
        numpy.testing.assert_allclose(one.covariance(at, at), self.process.covariance(at[:, [0, 2]], at[:, [0, 2]]),
                                      atol=1e-12)
        self.assertEqual(one.log_likelihood(), self.process.log_likelihood())
        mean, _ = emulator.fit(wide, self.process.y, []).at(at)  # on none: the mean
        numpy.testing.assert_allclose(mean, self.process.y.mean())

    def test_finds_the_surface_and_its_error(self):
        at = numpy.random.default_rng(2).random((500, 2))
        mean, sd = self.process.at(at)
        error = mean - self.truth(at)
        self.assertLess(numpy.sqrt(numpy.mean(error**2)), 0.05)
        self.assertGreater(numpy.mean(abs(error) < 1.645 * sd), 0.7)
        own = numpy.diag(self.process.covariance(at[:5], at[:5]))
        numpy.testing.assert_allclose(numpy.sqrt(own), sd[:5], atol=1e-6)

    def test_is_the_kriging_of_openturns(self):
        import openturns
        p = self.process
        model = openturns.MaternModel(list(p.lengths), [math.sqrt(p.variance)], 2.5)
        model.setNuggetFactor(p.noise / p.variance)
        algorithm = openturns.KrigingAlgorithm(openturns.Sample(self.x.tolist()), openturns.Sample([[y] for y in p.y]),
                                               model, openturns.LinearBasisFactory(2).build())
        algorithm.setOptimizeParameters(False)
        algorithm.run()
        at = [[0.3, 0.6], [0.9, 0.1]]
        theirs = algorithm.getResult().getConditionalMean(openturns.Sample(at))
        numpy.testing.assert_allclose(p.at(numpy.array(at))[0], numpy.array(theirs)[:, 0], rtol=1e-5)


class Sampling(unittest.TestCase):
    def test_is_the_integral_in_one_dimension(self):
        x = numpy.linspace(0, 1, 12)[:, None]
        process = emulator.Process(x, 2 * x[:, 0]**2, numpy.array([0.7]), 1.0, 1e-4)
        block = types.SimpleNamespace(run="a", group="plate", value=0.8, sd=0.1, scale=1.0)
        evidence = evidences.Evidence([block], [process])
        target = bayes.Target(evidence)
        got = bayes.sample(target, seed=4, count=4000)
        u, share = numpy.meshgrid(numpy.linspace(0, 1, 301), numpy.linspace(-5, 2, 301), indexing="ij")
        z = numpy.column_stack([u.ravel(), share.ravel()])
        density = numpy.exp(target.log_prior(z) + target.log_likelihood(z))
        mean = float((density * z[:, 0]).sum() / density.sum())
        sd = math.sqrt(float((density * (z[:, 0] - mean)**2).sum() / density.sum()))
        self.assertAlmostEqual(float(got.u.mean()), mean, delta=0.01)
        self.assertAlmostEqual(float(got.u.std()), sd, delta=0.01)

    def test_the_typical_error_counts_as_two_rows(self):
        evidence = types.SimpleNamespace(typical=numpy.array([0.1]), value=numpy.zeros(1), noise=0, groups=["plate"],
                                         clusters=lambda: [], processes=[types.SimpleNamespace(x=numpy.zeros((1, 1)))])
        target = bayes.Target(evidence)
        drawn = target.draw(20000, numpy.random.default_rng(1))
        grid = numpy.column_stack([numpy.full(2001, 0.5), numpy.linspace(-6, 4, 2001)])
        density = numpy.exp(target.log_prior(grid))
        mean = float((density * grid[:, 1]).sum() / density.sum())
        self.assertAlmostEqual(float(drawn[:, 1].mean()), mean, delta=0.02)
        v = 0.01 * 2 / numpy.random.default_rng(2).chisquare(2, 20000)  # scaled inverse chi-squared
        self.assertAlmostEqual(float(drawn[:, 1].mean()), float(0.5 * numpy.log(v).mean()), delta=0.02)


class Words(unittest.TestCase):
    def test_directions_are_named(self):
        random = numpy.random.default_rng(1)
        vary = varied.Vary({"friction": (0.3, 0.8), "rolling_friction": (0.05, 0.5), "solid_fraction": (0.5, 0.6)}, {})
        along = random.random(2000)
        u = numpy.column_stack([along, 1 - along + 0.02 * random.standard_normal(2000),
                                0.5 + 0.02 * random.standard_normal(2000)])
        first, = identify.directions_of(vary, types.SimpleNamespace(u=u))
        self.assertIn("the tests cannot tell", first["text"])
        self.assertIn("with less", first["text"])
        self.assertIn("a shear ring would", first["text"])
        self.assertNotIn("solid_fraction", first["text"])
        told = {one["name"]: one["identified"] for one in identify.parameters_of(vary, types.SimpleNamespace(u=u))}
        self.assertEqual(told, {"friction": False, "rolling_friction": False, "solid_fraction": True})

    def test_a_direction_of_many_small_parts_has_names(self):
        weights = {name: 1 / math.sqrt(len(varied.KNOWN)) for name in varied.KNOWN}
        weights["solid_fraction"] *= 1.05
        self.assertIn("the tests cannot tell solid_fraction from friction (", identify.in_words(weights))

    def test_ends_of_a_logarithmic_range(self):
        stand_in = types.SimpleNamespace(
            targets=types.SimpleNamespace(notes=[]), runs=types.SimpleNamespace(notes=[]),
            evidence=types.SimpleNamespace(unanswered=[]),
            vary=varied.Vary({"youngs_modulus_pa": (1e6, 1e8)}, {}))

        def notes(low, high):
            return outcome.Inference._notes(stand_in, {}, [{
                "name": "youngs_modulus_pa", "range": [1e6, 1e8], "low90": low, "high90": high}])
        self.assertEqual(notes(2e6, 5e7), [])  # 2e6 is 1 % of the range's width, but 15 % of its decades
        self.assertIn("reaches the end 1e+06", notes(1.05e6, 5e7)[0])
        self.assertIn("reaches the end 1e+08", notes(2e6, 9.5e7)[0])

    def test_motions(self):
        def row(slip, angle):
            return types.SimpleNamespace(at={"slip": slip, "angle": angle})
        numpy.testing.assert_allclose(predict.motion(row(0, 0)), [math.sqrt(0.5), 0, math.sqrt(0.5)], atol=1e-12)
        numpy.testing.assert_allclose(predict.motion(row(-1, 0)), [1, 0, 0], atol=1e-12)
        driven = numpy.array([0.1, 0, 1]) / math.hypot(0.1, 1)
        numpy.testing.assert_allclose(predict.motion(row(0.9, 0)), driven, atol=1e-12)
        numpy.testing.assert_allclose(predict.motion(row(0, 90)), [0, 1, 0], atol=1e-12)


class WholeWay(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.targets, cls.vary = cmu()
        cls.table = made_up_table(cls.targets, cls.vary)
        cls.runs, cls.evidence = evidence_of(cls.targets, cls.table, cls.vary)

    def test_curves_count_as_the_file_says(self):
        names = [block.name for block in self.evidence.blocks]
        self.assertEqual(sum(name.startswith("plate 60") for name in names), 6)
        self.assertEqual(sum(name.startswith("pressed wheel") for name in names), 3)
        self.assertEqual(sum(name.startswith("wheel") for name in names), 7)  # no side force where it goes straight
        self.assertFalse(any("80" in name for name in names))

    def test_rows_that_are_held_out_change_nothing(self):
        before = bayes.sample(bayes.Target(self.evidence), seed=2, count=100)
        other, _ = cmu()
        for row in other.rows:
            if row.held_out:
                row.value *= 3
        _, evidence = evidence_of(other, self.table, self.vary, self.runs)
        numpy.testing.assert_array_equal(bayes.sample(bayes.Target(evidence), seed=2, count=100).u, before.u)

    def test_next_points_take_variance_where_the_posterior_is(self):
        got = bayes.sample(bayes.Target(self.evidence), seed=2, count=200)
        chosen = identify.next_points(self.vary, self.evidence, got, 3)
        self.assertEqual(len(chosen), 3)
        for values, gain in chosen:
            self.assertEqual(list(values), self.vary.names)
            self.assertTrue(0 < gain < 1)
        again = identify.next_points(self.vary, self.evidence, got, 1)
        self.assertEqual(again[0], chosen[0])

    def test_points_of_the_design_come_back_from_their_own_runs(self):
        checked = check.dem_as_truth(types.SimpleNamespace(runs=self.runs, evidence=self.evidence), 2)
        self.assertEqual([one["label"] for one in checked], ["s001", "s002"])
        self.assertTrue(all(one["distance"] <= 1 for one in checked), checked)

    def test_a_test_is_emulated_by_what_acts_on_it_where_it_was_run(self):
        place = self.vary.names.index("wheel_friction")
        by_kind = {block.kind: process.columns for block, process in zip(self.evidence.blocks, self.evidence.processes)}
        self.assertEqual(by_kind, {"plate": [0, 1, 3], "press": [0, 1, 2, 3], "wheel": [0, 1, 2, 3]})
        self.assertEqual(place, 2)
        self.assertEqual(self.runs.notes, [])
        points = [{**one, "known": {"ran_at": {"press": {"wheel_friction": 0.45}}}} if k < 20 else one
                  for k, one in enumerate(self.table["points"])]
        runs = evidences.Runs({**self.table, "points": points}, self.vary)
        own, press = runs.unit("wheel"), runs.unit("press")
        numpy.testing.assert_allclose(press[:20, place], 0.5)
        numpy.testing.assert_array_equal(press[20:], own[20:])
        numpy.testing.assert_array_equal(numpy.delete(press, place, 1), numpy.delete(own, place, 1))
        numpy.testing.assert_array_equal(runs.unit("plate"), own)

    def test_what_the_runs_of_a_test_held_is_left_out_and_said(self):
        points = [{**one, "known": {"ran_at": {"press": {"wheel_friction": 0.45}}}} for one in self.table["points"]]
        runs, evidence = evidence_of(self.targets, {**self.table, "points": points[:12]}, self.vary)
        columns = {block.kind: process.columns for block, process in zip(evidence.blocks, evidence.processes)}
        self.assertEqual(columns, {"plate": [0, 1, 3], "wheel": [0, 1, 2, 3]})
        self.assertEqual({block.kind for block in evidence.unanswered}, {"press"})
        got = bayes.sample(bayes.Target(evidence), seed=2, count=100)
        for row in predict.rows_of(self.targets, runs, evidence, got, 0.0625):
            if row["kind"] == "press":
                self.assertNotIn("model", row)
        self.assertEqual(len(runs.notes), 1)
        self.assertIn("press: 12 of its 12 runs have one wheel_friction", runs.notes[0])
        self.assertIn("is not seen: neither fitted nor predicted", runs.notes[0])
        stand_in = types.SimpleNamespace(targets=self.targets, runs=runs, evidence=evidence, vary=self.vary)
        said = [note for note in outcome.Inference._notes(stand_in, {}, []) if note not in self.targets.notes]
        self.assertEqual([note for note in said if "press" in note], runs.notes)
        checked = check.dem_as_truth(types.SimpleNamespace(runs=runs, evidence=evidence), 1)
        self.assertEqual([one["label"] for one in checked], ["s001"])

    def test_what_a_point_was_not_run_for_is_not_its_truth(self):
        blocks = self.evidence.blocks
        given = [1.0] * len(blocks)
        moved = {"known": {"ran_at": {"press": {"wheel_friction": 0.45}}}}
        own = check.own_blocks(moved, given, self.evidence)
        self.assertEqual({blocks[k].kind for k in own}, {"plate", "wheel"})
        given = [math.nan if block.kind == "wheel" else 1.0 for block in blocks]
        self.assertEqual(check.own_blocks(moved, given, self.evidence), [])  # plates do not tell the wheel's friction
        self.assertEqual({blocks[k].kind for k in check.own_blocks({}, given, self.evidence)}, {"plate", "press"})

    def test_a_run_that_alone_tells_a_parameter_has_no_leave_one_out(self):
        points = [{**one, "known": {"ran_at": {"press": {"wheel_friction": 0.45}}}} if k < 11 else one
                  for k, one in enumerate(self.table["points"][:12])]
        runs, evidence = evidence_of(self.targets, {**self.table, "points": points}, self.vary)
        self.assertTrue(numpy.isfinite(evidence.correlation).all())
        for block, process in zip(evidence.blocks, evidence.processes):
            mean, sd = process.left_out()
            self.assertEqual(numpy.flatnonzero(~numpy.isfinite(sd)).tolist(), [11] if block.kind == "press" else [])
            self.assertEqual(numpy.isnan(mean).tolist(), numpy.isinf(sd).tolist())
        for one in outcome.Inference._left_out(types.SimpleNamespace(evidence=evidence, vary=self.vary)):
            self.assertEqual(len(one["predicted"]), 11 if one["group"] == "press" else 12)
            self.assertTrue(math.isfinite(one["rms"]))

    def test_the_band_of_counts_is_exact(self):
        self.assertEqual([check.band(n) for n in (1, 3, 13, 100)], [(0, 1), (1, 3), (9, 13), (84, 95)])
        checked = [{"label": f"s{k:03d}", "distance": at} for k, at in enumerate((0.5, 1.0, 1.3))]
        words = grains_page.truth_words(checked)
        self.assertIn("of 3 points", words)
        self.assertIn("2 lie in their 90 % region (of regions that hold 90 %: 1 to 3 in 95 % of cases)", words)
        self.assertIn("over the region's edge: s002 (1.3)", words)

    def test_what_too_few_runs_of_a_small_design_tell_is_left_out_and_said(self):
        def columns(count, own):
            points = [{**one, "known": {"ran_at": {"press": {"wheel_friction": 0.45}}}} if k < count - own else one
                      for k, one in enumerate(self.table["points"][:count])]
            runs = evidences.Runs({**self.table, "points": points}, self.vary)
            process = runs.process(next(one for one in self.evidence.blocks if one.kind == "press"))
            return process and process.columns, runs.notes
        few, notes = columns(11, 1)
        self.assertIsNone(few)
        self.assertIn("press: 10 of its 11 runs have one wheel_friction", notes[0])
        self.assertEqual(columns(12, 1), ([0, 1, 2, 3], []))
        for count in (1, 4, 9):  # too few stay too few
            with self.assertRaisesRegex(Refused, f"{count} points of the design gave it, expected at least 12"):
                columns(count, count)

    def test_refuses_a_design_that_is_too_small(self):
        small = {**self.table, "points": self.table["points"][:8]}
        with self.assertRaisesRegex(Refused, "8 points of the design gave it, expected at least 10"):
            evidence_of(self.targets, small, self.vary)

    def test_a_row_that_is_held_out_and_few_points_reached_is_not_predicted(self):
        held = [row.key for row in self.targets.rows if row.key.startswith("plate 80 mm") and row.held_out]
        key = held[0]  # a candidate of next_tests, too
        points = [{**one, "outputs": {name: value for name, value in one["outputs"].items() if name != key or k < 5}}
                  for k, one in enumerate(self.table["points"])]
        runs, evidence = evidence_of(self.targets, {**self.table, "points": points}, self.vary)
        got = bayes.sample(bayes.Target(evidence), seed=2, count=100)
        rows = {row["key"]: row for row in predict.rows_of(self.targets, runs, evidence, got, 0.0625)}
        self.assertNotIn("model", rows[key])
        self.assertIn("model", rows[held[1]])
        direction = {"weights": dict.fromkeys(self.vary.names, 0.5), "share_left": 1.0}
        told = identify.next_tests(self.targets, runs, evidence, got, 0.0625, [direction])
        self.assertTrue(told)
        block = evidences.Block([row for row in self.targets.rows if row.key == key], 0.0625)
        with self.assertRaisesRegex(Refused, "5 points of the design gave it, expected at least 10"):
            runs.process(block)

    def test_tests_on_one_plate_are_of_one_run(self):
        def run_of(kind, test, **at):
            return evidences.Block([measured.Row("key", test, kind, "force", 2.0, None, False, **at)], 0.06).run
        first = run_of("plate", "first", mm=60.0, sinkage=0.01)
        self.assertEqual(first, run_of("plate", "again", mm=60.0, sinkage=0.01))
        self.assertNotEqual(first, run_of("plate", "first", mm=80.0, sinkage=0.01))
        self.assertEqual(run_of("press", "first", sinkage=0.01), run_of("press", "again", sinkage=0.02))

    def test_writes_a_soil_that_the_bench_reads(self):
        with tempfile.TemporaryDirectory() as out:
            path = os.path.join(out, "design.json")
            with open(path, "w", encoding="utf-8") as file:
                json.dump(self.table, file)
            program = os.path.join(ROOT, "dem_offline", "calibrate_grains", "calibrate_grains.py")
            done = subprocess.run([sys.executable, program, "--bin", BIN, DATA, "--soil", SOIL, "--scene", SCENE,
                                   "--design", path, "--out", out], capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 0, done.stderr)
            with open(os.path.join(out, "calibration.json"), encoding="utf-8") as file:
                found = json.load(file)
            fitted = {row["key"] for row in found["rows"] if not row["held_out"]}
            self.assertNotIn("plate 80 mm @ 10 mm", fitted)
            by_test = {one["test"]: one for one in found["errors"] if one["measured"] == "force"}
            self.assertEqual((by_test["plate 80 mm"]["fitted"]["n"], by_test["plate 80 mm"]["held_out"]["n"]), (0, 18))
            from grain_soil import GrainSoil
            soil = GrainSoil(os.path.join(out, "calibrated.soil.yaml"))
            self.assertEqual(soil.grains["friction"], found["best"]["values"]["friction"])
            self.assertIn(found["files"][0]["sha256"][:12], soil.source)
            with open(os.path.join(out, "report.html"), encoding="utf-8") as file:
                self.assertIn("What the data do not tell", file.read())
            self.assertIn("rows not run", outcome.summary(found))


class Coverage(unittest.TestCase):
    def test_the_region_holds_the_truth(self):
        targets, vary = cmu()
        _, evidence = evidence_of(targets, made_up_table(targets, vary), vary)
        target, inside = bayes.Target(evidence), 0
        for trial in range(TRIALS):
            truth, target.value = draw_of(target, numpy.random.default_rng(1000 + trial))
            got = bayes.sample(target, seed=trial, count=SAMPLES)
            inside += bayes.region_distance(got, truth) <= 1
        print(f"inside the 90 % region: {inside} of {TRIALS}", file=sys.stderr)
        self.assertTrue(85 <= inside <= 95, inside)


if __name__ == "__main__":
    BIN = os.path.abspath(sys.argv.pop())
    if "--coverage" in sys.argv:
        sys.argv.remove("--coverage")
        sys.argv.append("Coverage")
    else:
        del Coverage
    unittest.main()
