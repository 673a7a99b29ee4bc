#!/usr/bin/python3
"""A calibration by grouser.client with the real grouser-jobs, to its files. Exit code 77: there is no grpcio."""

import json
import tempfile
import unittest

from servers import JobsClient, ServerError, serving_jobs  # first: exits where there is no grpcio

import grpc
from common import SOURCE

import grouser
from grouser.v1alpha1 import jobs_service_pb2 as v1

PLATES = SOURCE / "surrogate/calibrate/measured/cmu_plates.yaml"


class JobsCalibrationTest(unittest.TestCase):
    def test_calibration_to_its_files(self):
        folder = self.enterContext(tempfile.TemporaryDirectory())
        jobs = self.enterContext(JobsClient(self.enterContext(serving_jobs(folder)), deadline=60))
        seen = []
        job, joined, _ = jobs.submit_soil_calibration(PLATES, time_limit=300)
        self.assertFalse(joined)
        self.assertEqual(job.time_limit.seconds, 300)
        with self.assertRaises(ServerError) as caught:
            jobs.wait(job.job_id, deadline=1e-3)
        self.assertEqual(caught.exception.code, grpc.StatusCode.DEADLINE_EXCEEDED)
        job = jobs.wait(job.job_id, seen.append, deadline=300)
        self.assertEqual(job.job_state, v1.JOB_STATE_DONE, job.message)
        self.assertEqual(seen[-1], job)
        self.assertEqual({r.name for r in job.results}, {"soil.csv", "calibration.json"})
        content = jobs.read_file(job.job_id, "calibration.json")
        self.assertEqual([len(content)], [r.bytes for r in job.results if r.name == "calibration.json"])
        self.assertEqual(json.loads(content)["parameters"], grouser.calibrate_soil(PLATES)["parameters"])


if __name__ == "__main__":
    unittest.main()
