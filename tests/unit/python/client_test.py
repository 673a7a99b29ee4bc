#!/usr/bin/python3
"""grouser.client beside the library in this process, bit for bit; errors, limits of time, TLS, tokens, a server that
comes back. Exit code 77: there is no grpcio."""

import hashlib
import inspect
import json
import os
import pathlib
import re
import socket
import subprocess
import sys
import tempfile
import unittest

from servers import Client, JobsClient, ServerError, make_certificates, serving  # first: exits where there is no grpcio

import grpc
import numpy as np
from common import ALL, PAIR, SOURCE, differ_in_threads, some_states

import grouser
from grouser import Error, Motions, Path, States, messages, names
from grouser.v1alpha1 import state_pb2, terrain_service_pb2, vehicle_pb2

EVERYTHING = tuple(name for name in ALL if name not in grouser.OUTPUTS) + tuple(
    n for n in messages.ANSWERED if "." in n)
OPTIONS = grouser.SpeedOptions(speed_limit=1, margins=grouser.Margins(tip=0.2, trained_only=False), start=0.1)


def bits(answers, fields):
    """Of these arrays, by name."""
    out = {}
    for name in fields:
        value = answers
        for part in name.split("."):
            value = getattr(value, part)
        out[name] = value.tobytes()
    return out


class ClientTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = cls.enterClassContext(tempfile.TemporaryDirectory())
        cls.address = cls.enterClassContext(serving(
            "grouser-server", folder, "--no-lcm", "--shipped", str(PAIR), "--vehicles",
            str(SOURCE / "surrogate/vehicle/shipped"), grpc=f"unix:{folder}/socket"))
        cls.client = cls.enterClassContext(Client(cls.address, deadline=60))
        cls.files = {m.digest: file for file in PAIR.glob("*.model") for m in [grouser.Model.open(file)]}

    def refuses(self, code, text, call, *arguments, **named):
        with self.assertRaisesRegex(ServerError, text) as caught:
            call(*arguments, **named)
        self.assertEqual(caught.exception.code, code)
        self.assertTrue(str(caught.exception).startswith(code.name))

    def test_same_bits_as_in_process(self):
        infos = self.client.models()
        self.assertEqual({m.digest for m in infos}, set(self.files))
        states = some_states()
        square = States(*(a.reshape(20, 15) for a in (states.v_x, states.v_y, states.rim_speed, states.load)))
        for info in infos:
            served = self.client.evaluate(square, f"{info.name}@sha256:{info.digest}", fields=EVERYTHING)
            model = grouser.Model.open(self.files[info.digest])
            own = model.evaluate(square, fields=EVERYTHING)
            self.assertEqual(served.flags.tobytes(), own.flags.tobytes())
            self.assertEqual(bits(served, EVERYTHING), bits(own, EVERYTHING), info.name)
            self.assertGreater(np.isfinite(served.f_x.value).mean(), 0.5)
            self.assertEqual(served.model, f"{info.name}@sha256:{info.digest}")
            self.assertEqual((served.f_x.low.shape, served.interval_level), ((20, 15), model.interval_level))

    def test_same_numbers_as_the_cpp_client(self):
        name = self.client.models()[0].name
        done = subprocess.run([f"{os.environ['GROUSER_BIN']}/grouser-client", "query", "--server", self.address,
                               "--model", name, "--vx", "0.08", "--vy", "0.0462", "--rim", "0.1", "--load", "24",
                               "--json"], check=True, stdout=subprocess.PIPE)
        theirs = json.loads(done.stdout)["responses"]
        ours = self.client.evaluate(States.of(0.08, 0.0462, 0.1, 24), name)
        for output in grouser.OUTPUTS:
            for part in ("value", "low", "high"):
                self.assertEqual(getattr(getattr(ours, output), part)[()], theirs[output][part][0], f"{output}.{part}")

    def test_only_what_is_asked(self):
        name = self.client.models()[0].name
        states = States.of(0.08, [0, 0.03], 0.1, 24)
        answers = self.client.evaluate(states, name, fields=("f_x", "sinkage.high", "attack_angle"))
        self.assertIsNone(answers.f_y.value)
        self.assertIsNone(answers.sinkage.low)
        self.assertIsNone(answers.slip)
        self.assertIsNone(answers.f_x.sd_soil)
        self.assertEqual((answers.f_x.d_load.shape, answers.attack_angle.shape), ((2,), (2,)))
        self.assertIsNone(self.client.evaluate(states, name).f_x.sd_fit)
        self.assertIsNone(self.client.evaluate(states, name, fields=()).f_x.value)
        for text, wanted in (("'f_z.lo', did you mean 'f_z.low'", "f_z.lo"), ("'f_x.sd_soil'", "f_x.sd_soil")):
            with self.assertRaisesRegex(Error, text):
                self.client.evaluate(states, name, fields=wanted)

    def test_accuracy(self):
        states = States.from_slip(np.linspace(0, 0.5, 50), 0, 0.05, 24)
        name = self.client.models()[0].name
        request = grouser.AccuracyRequest(tolerance={"f_x": 1000, "sinkage": 10}, share_of_load=7, budget_us=1e6,
                                          target="measured")
        self.assertEqual((request.tolerance, request.share_of_load, request.budget_us, request.target),
                         ({"f_x": 1000, "sinkage": 10}, 7, 1e6, "measured"))
        loose = self.client.evaluate(states, name, accuracy=grouser.AccuracyRequest(tolerance={"f_x": 1000}))
        self.assertTrue((loose.answered_by == 0).all() and not (loose.flags & grouser.Flag.TOLERANCE_UNMET).any())
        cheapest = self.client.evaluate(states, loose.selectable_models[0])
        self.assertEqual(loose.f_x.value.tobytes(), cheapest.f_x.value.tobytes())
        tight = self.client.evaluate(states, name, accuracy=grouser.AccuracyRequest(tolerance={"sinkage": 1e-9}))
        self.assertTrue((tight.flags & grouser.Flag.TOLERANCE_UNMET).all())

    def test_models_by_pages_and_explanation(self):
        infos = self.client.models()
        page = terrain_service_pb2.ListModelsRequest(page_size=1)
        self.assertEqual(self.client._all_pages(self.client._terrain.ListModels, page, "models", None), infos)
        name = infos[0].name
        self.assertEqual(self.client.model(name).model.digest, infos[0].digest)
        state = States.of(0.08, 0.02, 0.1, 24)
        why, answers = self.client.explain(state, name, max_runs=2), self.client.evaluate(state, name)
        self.assertEqual([o.value for o in why.outputs], [getattr(answers, o).value[()] for o in grouser.OUTPUTS])
        self.assertEqual(why.flags, answers.flags[()])
        self.assertEqual(self.client.build_info().program, "grouser-server")

    def test_vehicles_have_the_same_bits(self):
        rng = np.random.default_rng(2)
        self.assertEqual([v.name for v in self.client.vehicles()], ["atv", "cart", "husky", "rover", "rover_lugged", "warthog"])
        for file in sorted(grouser.VEHICLE_DIR.glob("*.vehicle.yaml")):
            vehicle = grouser.Vehicle.open(file)
            self.assertEqual(list(self.client.vehicle(vehicle.name).soils), vehicle.soils)
            solver, n = grouser.VehicleSolver(vehicle), 6
            motions = Motions.of(v_x=rng.uniform(0.02, 0.5, (2, 3)), yaw_rate=rng.uniform(-0.1, 0.1, (2, 3)),
                                 grade=0.02)
            motions.v_x[0, 1] = np.nan
            for given in (motions, Motions.of(rim_speed=np.full((n, vehicle.drives), 0.3),
                                              soil=np.zeros((n, vehicle.wheels), int), worse_by_sd=0.5)):
                served, own = self.client.solve(given, vehicle.name), solver.solve(given)
                fields = grouser.arrays.SOLUTION_NAMES
                self.assertEqual(bits(served, ("reasons", *fields)), bits(own, ("reasons", *fields)), file)
                self.assertEqual(served.wheel.load.shape, own.wheel.load.shape)
            fields = ("reasons", *grouser.arrays.POWER_NAMES)
            for sds in (None, 0.5):
                own = solver.energy(motions) if sds is None else solver.energy(motions, sds=sds)
                self.assertEqual(bits(self.client.energy(motions, vehicle.name, sds=sds), fields), bits(own, fields))
            for served, own in zip(self.client.probability_to_go(motions, grouser.Margins(tip=0.3), vehicle.name),
                                   solver.probability_to_go(motions, grouser.Margins(tip=0.3))):
                self.assertEqual(served.tobytes(), own.tobytes())
            path = Path.of(0.1 * np.arange(n), rng.uniform(-0.1, 0.1, n), bank=0.01, soil=0)
            planner = grouser.SpeedPlanner(vehicle, n)
            plan = planner.plan(path, OPTIONS)
            served = self.client.plan_speed(path, OPTIONS, vehicle.name, draws=20)
            fields = ("speed", "acceleration", "safe", "shortfall", "safe_binding", "binding", "holds")
            self.assertEqual(bits(served, fields), bits(plan, fields), file)
            self.assertEqual(served.not_held, plan.not_held)
            planner.use_draws(20)
            by_point = np.empty(n)
            self.assertEqual(served.hold_probability, planner.plan_by_draws(path, OPTIONS, plan, by_point))
            np.testing.assert_array_equal(served.point_hold_probability, by_point)
        self.assertIsNone(self.client.solve(Motions.of(v_x=0.5), "husky", fields="wheel.load").v_y)

    def test_names_on_the_wire(self):
        for bit in names.Flag:
            self.assertEqual(state_pb2.StateFlag.Value(f"STATE_FLAG_{bit.name}"), bit)
        for bit in names.Reason:
            self.assertEqual(vehicle_pb2.MotionReason.Value(f"MOTION_REASON_{bit.name}"), bit)
        self.assertEqual(sorted(messages.BINDINGS.values()), sorted(names.Binding))
        self.assertEqual(messages.binding_of(99), names.Binding.INPUT)

    def test_code_of_the_page(self):
        blocks = re.findall(r"```python\n(.*?)```", (SOURCE / "docs/python.md").read_text(), re.S)
        code = next(b for b in blocks if "import Client" in b)
        self.assertEqual(code.count("127.0.0.1:50151"), 1)
        folder = self.enterContext(tempfile.TemporaryDirectory())
        address = self.enterContext(serving("grouser-server", folder, "--no-lcm", "--shipped",
                                            str(SOURCE / "surrogate/shipped"), "--vehicles",
                                            str(SOURCE / "surrogate/vehicle/shipped")))
        text = subprocess.run([sys.executable, "-c", code.replace("127.0.0.1:50151", address)], check=True, text=True,
                              stdout=subprocess.PIPE).stdout
        self.assertIn("cmu-smooth-62.5@sha256:", text)
        self.assertIn("NOT_FOUND: ", text)

    def test_every_public_thing_has_a_docstring(self):
        for name in grouser.client.__all__:
            thing = getattr(grouser.client, name)
            for member in [thing, *(v for k, v in vars(thing).items() if inspect.isfunction(v) and k[0] != "_")]:
                self.assertTrue(inspect.getdoc(member), f"{name}: {member}")

    def test_threads_share_a_client(self):
        states, name = some_states(50), self.client.models()[0].name
        self.assertEqual(differ_in_threads(lambda: self.client.evaluate(states, name).f_x.high.tobytes()), 0)

    def test_refusals(self):
        code, states, client = grpc.StatusCode, States.of(0.08, 0, 0.1, 24), self.client
        name = client.models()[0].name
        self.refuses(code.NOT_FOUND, "no-such", client.evaluate, states, "no-such")
        self.refuses(code.INVALID_ARGUMENT, "model", client.evaluate, states, "a@b@c")
        many = States.of(np.full(10001, 0.08), 0, 0.1, 24)
        self.refuses(code.RESOURCE_EXHAUSTED, "10001", client.evaluate, many, name)
        self.refuses(code.NOT_FOUND, "no-such", client.energy, Motions.of(v_x=0.5), "no-such")
        for text, call, *arguments in (
                (r"v_y: shape \(2,\), expected \(3,\)", client.evaluate, States(*map(np.zeros, (3, 2, 3, 3))), name),
                ("v_x: dtype <U1, expected real", client.evaluate, States("a", "b", "c", "d"), name),
                ("expected v_x .*or rim_speed", client.solve, Motions(), "husky"),
                ("rim_speed with v_x", client.solve, Motions(np.zeros(2), rim_speed=np.zeros((2, 2))), "husky"),
                ("soil: ", client.solve, Motions(np.zeros(2), soil=np.full(2, -1)), "husky"),
                (r"s: shape \(2, 2\)", client.plan_speed, Path(np.zeros((2, 2))), OPTIONS, "husky")):
            with self.assertRaisesRegex(Error, text):
                call(*arguments)
        for text, call in (("max_runs: -1: ", lambda: client.explain(states, name, max_runs=-1)),
                           ("draws: -1: ", lambda: client.plan_speed(Path.of([0, 1.0]), OPTIONS, "husky", draws=-1)),
                           ("model: .*surrogates", lambda: client.evaluate(states, "\ud800"))):
            with self.assertRaisesRegex(Error, text):
                call()
        for deadline in (0, -1, np.nan, np.inf, 1e10):
            with self.assertRaisesRegex(Error, "deadline: .*above 0"):
                client.evaluate(states, name, deadline=deadline)

    def test_servers_that_are_not_there(self):
        states = States.of(0.08, 0, 0.1, 24)
        with Client("unix:/nobody/here") as client:
            self.refuses(grpc.StatusCode.UNAVAILABLE, "unix:/nobody/here; is it running", client.evaluate, states)
        with socket.create_server(("127.0.0.1", 0)) as silent, \
                Client("127.0.0.1:%d" % silent.getsockname()[1], deadline=0.2) as client:
            self.refuses(grpc.StatusCode.DEADLINE_EXCEEDED, "", client.evaluate, states)
            self.refuses(grpc.StatusCode.DEADLINE_EXCEEDED, "", client.models)
        with Client("unix:/nobody/here") as client:
            pass
        with self.assertRaisesRegex(Error, "unix:/nobody/here: .*closed"):
            client.models()
        for address in ("robot", "robot:x", ""):
            with self.assertRaisesRegex(Error, "expected HOST:PORT or unix:PATH"):
                Client(address)

    def test_a_server_that_comes_back(self):
        with tempfile.TemporaryDirectory() as folder:
            socket_path, options = f"unix:{folder}/socket", ("--no-lcm", "--shipped", str(PAIR))
            with serving("grouser-server", folder, *options, grpc=socket_path) as address:
                client = self.enterContext(Client(address))
                models = client.models()
            # (The first call may find the connection closed, which then stood.)
            self.refuses(grpc.StatusCode.UNAVAILABLE, r"\(server unix:", client.models)
            with serving("grouser-server", folder, *options, grpc=socket_path):
                for _ in range(100):  # it is tried again every second
                    try:
                        self.assertEqual(client.models(deadline=1), models)
                        return
                    except ServerError:
                        pass
            self.fail("not reached any more")


class AccessTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = folder = cls.enterClassContext(tempfile.TemporaryDirectory())
        make_certificates(folder)
        pathlib.Path(folder, "token").write_text("a-long-word\n")
        rights = pathlib.Path(folder, "rights.yaml")
        token = hashlib.sha256(b"a-long-word").hexdigest()
        rights.write_text("format: grouser-rights/1\ncallers:\n  - {name: one, role: read, certificate: caller}\n"
                          f"  - {{name: two, role: read, token_sha256: {token}}}\n")
        cls.address = cls.enterClassContext(serving(
            "grouser-server", folder, "--no-lcm", "--shipped", str(PAIR), "--rights", str(rights), "--tls-cert",
            cls.at("server.pem"), "--tls-key", cls.at("server.key"), "--tls-client-ca", cls.at("ca.pem")))
        cls.mutual = {"tls_cert": cls.at("caller.pem"), "tls_key": cls.at("caller.key")}

    @classmethod
    def at(cls, name):
        return f"{cls.folder}/{name}"

    def refused(self, code, text, address, **access):
        with Client(address, **access) as client, self.assertRaisesRegex(ServerError, text) as caught:
            client.models()
        self.assertEqual(caught.exception.code, code)

    def test_certificates_and_tokens(self):
        localhost = "localhost:" + self.address.rpartition(":")[2]
        for access in (self.mutual, {"token_file": self.at("token")}):
            for address in (self.address, localhost):
                with Client(address, tls_ca=self.at("ca.pem"), **access) as client:
                    self.assertEqual(len(client.models()), len(list(PAIR.glob("*.model"))))
        code = grpc.StatusCode
        self.refused(code.UNAUTHENTICATED, "shows who it is by token_file", self.address, tls_ca=self.at("ca.pem"))
        self.refused(code.UNAVAILABLE, "it speaks TLS: expected tls_ca", self.address)
        self.refused(code.UNAVAILABLE, "its certificate: .*other.pem", self.address, tls_ca=self.at("other.pem"))
        pathlib.Path(self.at("wrong")).write_text("another-word")
        self.refused(code.UNAUTHENTICATED, "", self.address, tls_ca=self.at("ca.pem"), token_file=self.at("wrong"))

    def test_a_token_in_plaintext_stays_on_this_machine(self):
        rights = ("--rights", self.at("rights.yaml"))
        with tempfile.TemporaryDirectory() as folder:
            for grpc_address in ("127.0.0.1:0", f"unix:{folder}/socket"):
                with serving("grouser-server", folder, "--no-lcm", "--shipped", str(PAIR), *rights,
                             grpc=grpc_address) as own:
                    with Client(own, token_file=self.at("token")) as client:
                        self.assertTrue(client.models())
                    self.refused(grpc.StatusCode.UNAUTHENTICATED, "", own)
                    self.refused(grpc.StatusCode.UNAVAILABLE, "it does not speak TLS", own, tls_ca=self.at("ca.pem"))

    def test_options_that_do_not_go_together(self):
        pathlib.Path(self.at("empty")).write_text(" \n")
        pathlib.Path(self.at("two")).write_text("two words")
        for text, access in (
                ("tls_cert: expected with tls_key", {"tls_cert": "a"}),
                ("tls_cert: expected with tls_ca", self.mutual),
                *((f"{name}: an empty path, expected", {name: ""}) for name in ("tls_ca", "token_file")),
                ("tls_key: an empty path", {"tls_ca": self.at("ca.pem"), "tls_cert": "", "tls_key": ""}),
                ("tls_cert: expected with tls_key", {"tls_ca": self.at("ca.pem"), "tls_cert": ""}),
                ("tls_cert: expected with tls_ca", {"tls_cert": "", "tls_key": ""}),
                ("tls_ca: .*null byte", {"tls_ca": "a\0b"}),
                ("tls_ca: /nobody: No such file", {"tls_ca": "/nobody"}),
                ("tls_ca: .*is empty, expected PEM", {"tls_ca": self.at("empty")}),
                ("token_file: .*is empty, expected a token", {"token_file": self.at("empty")}),
                ("token_file: .*one word of ASCII", {"token_file": self.at("two")}),
                ("another machine, and the token would go there in plaintext", {"token_file": self.at("token")})):
            for kind in (Client, JobsClient):
                with self.assertRaisesRegex(Error, text):
                    kind("robot.example:50151", **access)


if __name__ == "__main__":
    unittest.main()
