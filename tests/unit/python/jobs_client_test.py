#!/usr/bin/python3
"""Jobs by grouser.client with the real grouser-jobs and its programs. Exit code 77: there is no grpcio."""

import contextlib
import sqlite3
import tempfile
import unittest

from servers import JobsClient, ServerError, serving_jobs  # first: exits where there is no grpcio

import grpc
from common import SOURCE

import grouser
from grouser.v1alpha1 import jobs_service_pb2 as v1

SMOKE = SOURCE / "dem_offline/campaigns/smoke.campaign.yaml"


class JobsClientTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = cls.enterClassContext(tempfile.TemporaryDirectory())
        cls.jobs = cls.enterClassContext(JobsClient(cls.enterClassContext(serving_jobs(folder)), deadline=60))

    def test_refinements_and_campaigns_are_joined_cancelled_and_listed(self):
        first = self.jobs.submit_refinement(load=24, slip=0.2, attack_angle=0.3, priority=-5, max_time=0.5)
        again = self.jobs.submit_refinement(load=24, slip=0.2, attack_angle=0.3, priority=-5, max_time=0.5)
        self.assertEqual((again.joined, again.job.job_id), (True, first.job.job_id))
        campaign = self.jobs.submit_campaign(SMOKE)  # its scene and soil come along
        self.assertEqual(campaign.job.campaign.runs, 8)
        self.assertEqual(campaign.job.campaign.file, SMOKE.name)
        listed = self.jobs.jobs(limit=2)
        self.assertEqual(listed[0].job_id, campaign.job.job_id)
        pages = self.jobs._all_pages(self.jobs._jobs.ListJobs, v1.ListJobsRequest(page_size=1), "jobs", None)
        self.assertEqual([j.job_id for j in pages][:2], [j.job_id for j in listed])
        self.assertEqual(len(self.jobs.jobs(limit=1)), 1)
        self.assertNotEqual(self.jobs.cancel(first.job.job_id, again.request_id).job_state, v1.JOB_STATE_CANCELLED)
        for submitted in (first, campaign):
            self.jobs.cancel(submitted.job.job_id, submitted.request_id)
            job = self.jobs.wait(submitted.job.job_id, deadline=60)
            self.assertEqual(self.jobs.job(job.job_id).job_state, v1.JOB_STATE_CANCELLED)

    def test_refusals(self):
        for code, text, call, arguments, named in (
                (grpc.StatusCode.NOT_FOUND, "no-such", self.jobs.job, ["no-such"], {}),
                (grpc.StatusCode.NOT_FOUND, "no-such", self.jobs.wait, ["no-such"], {}),
                (grpc.StatusCode.INVALID_ARGUMENT, "load", self.jobs.submit_refinement, [], {"load": -1}),
                (grpc.StatusCode.INVALID_ARGUMENT, "smoke", self.jobs.submit_soil_calibration, [SMOKE], {})):
            with self.assertRaisesRegex(ServerError, text) as caught:
                call(*arguments, **named)
            self.assertEqual(caught.exception.code, code)
        with self.assertRaisesRegex(grouser.Error, "mode: 'flying', expected rim_speed, towed, free_slip"):
            self.jobs.submit_refinement(load=24, mode="flying")
        with self.assertRaisesRegex(grouser.Error, "/nobody.yaml: No such file"):
            self.jobs.submit_campaign("/nobody.yaml")
        with self.assertRaisesRegex(grouser.Error, "limit: 0"):
            self.jobs.jobs(0)

    def test_a_promotion_names_the_candidate_that_was_shown(self):
        with tempfile.TemporaryDirectory() as folder:
            with serving_jobs(folder):
                pass  # makes its store
            here, shown = "a" * 64, "b" * 64
            stored = v1.Job(job_id="job-1", model="cmu-smooth-62.5@sha256:" + "c" * 64, candidate_digest=here,
                            job_state=v1.JOB_STATE_AWAITING_PROMOTION, lease_epoch=1)
            with contextlib.closing(sqlite3.connect(f"{folder}/grouser-jobs/jobs/jobs.sqlite")) as store, store:
                store.execute("INSERT INTO jobs (job_id, join_key, state, lease_epoch, retries, job, spec, pending) "
                              "VALUES ('job-1','',5,1,0,?,'','')", (stored.SerializeToString(),))
            with serving_jobs(folder) as address, JobsClient(address, deadline=60) as jobs:
                job = jobs.job("job-1")
                self.assertEqual(job.candidate_digest, here)
                job.candidate_digest = shown  # a refit has replaced it since
                with self.assertRaisesRegex(ServerError, f"{here} now, expected {shown}") as caught:
                    jobs.promote(job, who="me", why="better")
                self.assertEqual(caught.exception.code, grpc.StatusCode.FAILED_PRECONDITION)
        with self.assertRaisesRegex(grouser.Error, "job-2: has no candidate"):
            self.jobs.promote(v1.Job(job_id="job-2"), who="me", why="better")

    def test_arguments_that_make_no_message(self):
        submit = self.jobs.submit_refinement
        for text, call, named in (
                ("priority: 1099511627776: ", submit, {"load": 24, "priority": 2**40}),
                ("seed: -1: ", submit, {"load": 24, "seed": -1}),
                ("model: ", submit, {"load": 24, "model": "\ud800"}),
                ("request_id: ", submit, {"load": 24, "request_id": "\ud800"}),
                *(("time_limit: ", submit, {"load": 24, "time_limit": limit})
                  for limit in (float("nan"), float("inf"), -float("inf"), 1e300)),
                ("priority: ", self.jobs.submit_campaign, {"file": SMOKE, "priority": -2**40}),
                ("file: ", self.jobs.submit_campaign, {"file": "\ud800", "from_server": True}),
                ("points: -1: ", self.jobs.submit_grain_calibration,
                 {"data": SMOKE, "soil": SMOKE, "scene": SMOKE, "budget_hours": 1, "points": -1}),
                ("job_id: ", self.jobs.wait, {"job_id": "\ud800"})):
            with self.subTest(text, **named), self.assertRaisesRegex(grouser.Error, "^" + text) as caught:
                call(**named)
            self.assertNotIsInstance(caught.exception, ServerError)


if __name__ == "__main__":
    unittest.main()
