#!/usr/bin/python3
"""Campaigns, fits and calibrations by the real programs: progress, results, what they refuse."""

import copy
import os
import pathlib
import pickle
import tempfile
import unittest
from unittest import mock

import numpy as np
from common import SOURCE

import grouser
from grouser import Error, ProgramError

CAMPAIGN = """name: tiny
scene: smoke.scene.yaml
seeds: [1]
grid:
  slip: [0.2, 0.4]
  attack_angle_deg: [0]
  load_n: [1.5]
"""


# A program that says its number, and does at the signal to end what stands in {at_end}.
STUBBORN = """#!/bin/sh
trap '{at_end}' TERM
echo $$ >&2
for i in $(seq 600); do sleep 0.1; done
"""


class ProgramsTest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))

    def test_campaign_says_how_far_it_is_and_goes_on(self):
        file = self.folder / "tiny.campaign.yaml"
        scenes = SOURCE / "dem_offline/campaigns"
        file.write_text(CAMPAIGN.replace("smoke.scene.yaml", str(scenes / "smoke.scene.yaml")))
        seen = []

        def stop(fraction, eta, what):
            seen.append((fraction, eta, what))
            raise KeyboardInterrupt

        with self.assertRaises(KeyboardInterrupt):  # which ends the program: else its folder were in use
            grouser.run_campaign(file, self.folder / "out", jobs=1, on_progress=stop)
        self.assertEqual(len(seen), 1)
        told = []
        status = grouser.run_campaign(file, self.folder / "out", jobs=2,
                                      on_progress=lambda *progress: told.append(progress))
        self.assertEqual((status["name"], status["total"], status["done"]), ("tiny", 2, 2))
        self.assertEqual(told[-1][0], 1)
        self.assertEqual([t[0] for t in told], sorted(t[0] for t in told))
        self.assertRegex(told[-1][2], "2 of 2 runs")
        # Two runs are too few for a model: what the program says of that is the exception's text.
        with self.assertRaises(ProgramError) as caught:
            grouser.fit(self.folder / "out", "tiny", self.folder / "tiny.model", kind="bekker")
        self.assertIn("grouser-fit fit --runs=", str(caught.exception))
        self.assertGreater(len(str(caught.exception).splitlines()), 1)
        self.assertFalse((self.folder / "tiny.model").exists())

    def test_fit_gives_the_model(self):
        said = []
        model = grouser.fit([SOURCE / "surrogate/pairs/atv-20x10-lugged-20mm/runs.json"], "mine", self.folder / "mine.model",
                            kind="bekker", profile_weight=0.0, reason="a test", on_line=said.append)
        self.assertEqual((model.name, model.kind), ("mine", "bekker"))
        self.assertTrue(any("mine.model" in line for line in said), said)

    def test_calibration(self):
        found = grouser.calibrate_soil(SOURCE / "surrogate/calibrate/measured/cmu_plates.yaml", name="sand",
                                       out=self.folder / "sand", form="bekker")
        self.assertEqual((found["soil"], found["form"]), ("sand", "bekker"))
        self.assertIn("sand", (self.folder / "sand/soil.csv").read_text())

    def test_programs_are_gone_when_a_function_ends_early(self):
        def stop(line):
            pids.append(int(line))
            raise KeyboardInterrupt  # after which Python itself waits a quarter of a second

        program = self.folder / "grouser-calibrate"
        pids = []
        for at_end, grace in ((f"sleep 1; touch {self.folder}/tidy; exit", 60), ("", 0.2)):
            program.write_text(STUBBORN.format(at_end=at_end))
            program.chmod(0o755)
            with mock.patch.object(grouser.programs, "_END_S", grace), self.assertRaises(KeyboardInterrupt):
                grouser.calibrate_soil("a.yaml", programs=self.folder, on_line=stop)
            with self.assertRaises(ProcessLookupError):
                os.kill(pids[-1], 0)
            self.assertTrue((self.folder / "tidy").exists())  # it had the time
        self.assertEqual(len(pids), 2)

    def test_numbers_as_words(self):
        class Later(float):  # NumPy 2 writes its numbers so
            def __repr__(self):
                return f"np.float64({float(self)})"

        words = grouser.programs._options(profile_weight=Later(0.5), jobs=np.int64(2), known=["a", self.folder],
                                          on=True, off=False, none=None)
        self.assertEqual(words, ["--profile-weight=0.5", "--jobs=2", "--known=a", f"--known={self.folder}", "--on"])

    def test_errors_are_pickled(self):
        error = ProgramError("what\nlast", 3)
        for made in (pickle.loads(pickle.dumps(error)), copy.copy(error)):
            self.assertEqual((type(made), str(made), made.exit_code), (ProgramError, "what\nlast", 3))

    def test_refusals(self):
        with self.assertRaises(ProgramError) as caught:
            grouser.calibrate_soil("/nobody.yaml")
        self.assertEqual(caught.exception.exit_code, 2)
        self.assertIn("/nobody.yaml", str(caught.exception).splitlines()[-1])
        with self.assertRaisesRegex(Error, "grouser-fit: not in .*expected Grouser's programs"):
            grouser.fit("runs", "a", "a.model", programs=self.folder)
        with mock.patch.object(grouser.programs, "_BUILT", self.folder), mock.patch.dict(os.environ, PATH="/nobody"):
            with self.assertRaisesRegex(Error, "not in the PATH"):
                grouser.run_campaign("a", "b")


if __name__ == "__main__":
    unittest.main()
