#!/usr/bin/python3
"""Campaigns, fits and calibrations by the real programs: progress, results, what they refuse."""

import os
import pathlib
import tempfile
import unittest
from unittest import mock

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
        model = grouser.fit([SOURCE / "surrogate/pairs/atv-20x10-20mm/runs.json"], "mine", self.folder / "mine.model",
                            kind="bekker", profile_weight=0.0, reason="a test", on_line=said.append)
        self.assertEqual((model.name, model.kind), ("mine", "bekker"))
        self.assertTrue(any("mine.model" in line for line in said), said)

    def test_calibration(self):
        found = grouser.calibrate_soil(SOURCE / "surrogate/calibrate/measured/cmu_plates.yaml", name="sand",
                                       out=self.folder / "sand", form="bekker")
        self.assertEqual((found["soil"], found["form"]), ("sand", "bekker"))
        self.assertIn("sand", (self.folder / "sand/soil.csv").read_text())

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
