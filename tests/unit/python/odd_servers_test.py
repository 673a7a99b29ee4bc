#!/usr/bin/python3
"""grouser.client and what servers ought not to answer: files that grow, pages without end, times that are no number;
what a failed call costs. Exit code 77: there is no grpcio."""

import pickle
import tempfile
import threading
import unittest
from concurrent import futures
from unittest import mock

from servers import Client, JobsClient, ServerError  # first: exits where there is no grpcio

import grpc

from grouser import Error, channel
from grouser.v1alpha1 import jobs_service_pb2 as v1
from grouser.v1alpha1 import jobs_service_pb2_grpc

FILE = bytes(range(256)) * 5
#: Of files by name: what is told of the size and given, part by part.
PARTS = {
    "whole": [(1280, FILE[:1000]), (1280, FILE[1000:])],
    "empty": [(0, b"")],
    "more": [(1000, FILE[:500]), (1000, FILE[500:])],
    "grows": [(1000, FILE[:500]), (1001, FILE[500:1000])],
    "ends": [(1280, FILE[:1000]), (1280, b"")],
    "nothing": [(1280, b"")],
}


class OddJobs(jobs_service_pb2_grpc.JobsServiceServicer):
    def __init__(self):
        self.pages = 0

    def ReadJobFile(self, request, context):
        at = 0
        for size, data in PARTS[request.name]:
            if at == request.offset:
                return v1.ReadJobFileResponse(data=data, bytes=size)
            at += len(data)
        raise AssertionError(f"{request.name}: asked from {request.offset} on")

    def ListJobs(self, request, context):
        self.pages += 1
        if request.page_size == 1:  # always the same token; else always another
            return v1.ListJobsResponse(jobs=[v1.Job()], next_page_token="again")
        return v1.ListJobsResponse(jobs=[v1.Job()] * (request.page_size - 2), next_page_token=str(self.pages))

    def GetJob(self, request, context):
        context.set_trailing_metadata((("grpc-retry-pushback-ms", request.job_id),))
        context.abort(grpc.StatusCode.UNAVAILABLE, "shutting down")

    def WatchJob(self, request, context):
        yield v1.WatchJobResponse()
        context.abort(grpc.StatusCode.UNAVAILABLE, "shutting down")


class OddServersTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = cls.enterClassContext(tempfile.TemporaryDirectory())
        server = grpc.server(futures.ThreadPoolExecutor(2))
        cls.odd, cls.address = OddJobs(), f"unix:{folder}/socket"
        jobs_service_pb2_grpc.add_JobsServiceServicer_to_server(cls.odd, server)
        server.add_insecure_port(cls.address)
        server.start()
        cls.addClassCleanup(lambda: server.stop(None).wait())
        cls.jobs = cls.enterClassContext(JobsClient(cls.address, deadline=60))

    def test_files_have_the_size_that_was_said_first(self):
        self.assertEqual(self.jobs.read_file("a", "whole"), FILE)
        self.assertEqual(self.jobs.read_file("a", "empty"), b"")
        for name, text in (("more", "gave 1280 bytes of 1000, expected 1000"),
                           ("grows", "gave 1000 bytes of 1001, expected 1000"),
                           ("ends", "gave 1000 bytes of 1280, expected 1280"), ("nothing", "gave 0 bytes of 1280")):
            with self.assertRaisesRegex(Error, f"job a: {name}: the server unix:.* {text}"):
                self.jobs.read_file("a", name)

    def pages(self, size):
        return self.jobs._all_pages(self.jobs._jobs.ListJobs, v1.ListJobsRequest(page_size=size), "jobs", None)

    def test_pages_end(self):
        with self.assertRaisesRegex(Error, "jobs: the server unix:.* gives the page 'again' again and again"):
            self.pages(1)
        with mock.patch.object(channel, "_MOST_ENTRIES", 50):
            for size in (2, 12):  # none or ten a page
                with self.assertRaisesRegex(Error, "jobs: .*more than 50 entries or pages"):
                    self.pages(size)
            self.assertEqual(len(self.jobs.jobs(120)), 120)  # what is asked for is not too much

    def test_times_to_wait(self):
        for word, seconds in (("1500", 1.5), ("999999999", 999999.999), ("9" * 309, None), ("-1", None), ("", None)):
            with self.assertRaises(ServerError) as caught:
                self.jobs.job(word)
            self.assertEqual(caught.exception.retry_after, seconds)
            made = pickle.loads(pickle.dumps(caught.exception))
            self.assertEqual((type(made), str(made), made.code, made.retry_after),
                             (ServerError, str(caught.exception), grpc.StatusCode.UNAVAILABLE, seconds))

    def test_a_server_that_speaks_is_not_probed(self):
        with mock.patch.object(channel, "_tls_problem", return_value="wrong") as probe:
            for call in (self.jobs.job, self.jobs.wait):
                with self.assertRaises(ServerError) as caught:
                    call("1")
                self.assertEqual(str(caught.exception), f"UNAVAILABLE: shutting down (server {self.address})")
            probe.assert_not_called()

    def test_one_that_does_not_is_probed_now_and_then(self):
        for every, times in ((1e9, 1), (0, 3)):
            with mock.patch.object(channel, "_tls_problem", return_value="looked at") as probe, \
                    mock.patch.object(channel, "_PROBE_EVERY_S", every), \
                    Client("unix:/nobody/here", deadline=60) as client:
                for _ in range(3):
                    with self.assertRaisesRegex(ServerError, "unix:/nobody/here; looked at"):
                        client.models()
                self.assertEqual(probe.call_count, times)

    def test_a_probe_ends_with_the_call(self):
        over = threading.Event()
        self.addCleanup(over.set)

        def look(*_):
            over.wait(30)
            return "looked at"

        with mock.patch.object(channel, "_tls_problem", side_effect=look) as probe, \
                mock.patch.object(channel, "_PROBE_S", 20), Client("unix:/nobody/here") as client:
            for _ in range(3):
                with self.assertRaisesRegex(ServerError, "unix:/nobody/here; is it running"):
                    client.models(deadline=0.5)
            self.assertFalse(over.is_set())
            self.assertEqual(probe.call_count, 1)  # the next ones wait for the same


if __name__ == "__main__":
    unittest.main()
