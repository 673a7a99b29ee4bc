"""What every stage of the demo uses: its files, its programs, its findings."""

import json
import math
import os
import sys


class StageFailed(Exception):
    """What went wrong, in words."""


def expect(condition, text):
    if not condition:
        raise StageFailed(text)


class Demo:
    def __init__(self, arguments, processes):
        self.arguments = arguments
        self.processes = processes
        self.data = {}       # becomes data.json
        self.runs = []       # of the campaign
        self.load_n = None   # that most training runs have
        self.model_file = None
        self.services = {}   # name -> process
        self.addresses = []  # options of grouser-client
        self.lcm_url = None

    def path(self, *parts):
        return os.path.join(self.arguments.out, *parts)

    def program(self, name):
        return os.path.join(self.arguments.bin, name)

    @staticmethod
    def print(text):
        sys.stdout.write(text)
        sys.stdout.flush()

    def run(self, name, *argv, show=False):
        """Runs one of the programs, returns its stdout; `show`: its progress
        goes to our stderr instead of logs/NAME.log."""
        return self.processes.run(name, [self.program(argv[0]), *argv[1:]], show)

    def run_json(self, name, *argv, show=False):
        return json.loads(self.run(name, *argv, "--json", show=show))

    def show_runs(self, *files):
        """The records of run files."""
        shown = self.run_json("show", "grouser-dem", "show", *files)
        return shown if isinstance(shown, list) else [shown]

    def client(self, *argv):
        return self.run("client", "grouser-client", *argv, *self.addresses)

    def client_json(self, *argv):
        return json.loads(self.client(*argv, "--json"))

    def address(self, service):
        return self.addresses[self.addresses.index("--" + service) + 1]

    @staticmethod
    def state_options(*states):
        """[{"slip", "angle_deg", "load"}] as options of grouser-client."""
        options = []
        for key in ("slip", "angle_deg", "load"):
            options += ["--" + key.replace("_", "-"), *(repr(float(state[key])) for state in states)]
        return options

    def query(self, states):
        return self.client_json("query", *self.state_options(*states))

    def lcm_query(self, velocity, load_n):
        """`velocity`: the echo of a gRPC answer, so that both ask the same."""
        options = []
        for option, field in (("--vx", "v_x_m_per_s"), ("--vy", "v_y_m_per_s"),
                              ("--rim", "rim_speed_m_per_s")):
            options += [option, repr(float(velocity[field][0]))]
        return json.loads(self.run("client", "grouser-client", "lcm-query", *options, "--load",
                                   repr(float(load_n)), "--lcm-url", self.lcm_url, "--json"))


def distance(run, state):
    """How far a run's state is from another: 1 is 0.1 of slip or 10 degrees or
    10 % of load."""
    return math.hypot((run.slip - state["slip"]) / 0.1, (run.angle_deg - state["angle_deg"]) / 10,
                      (run.load_n / state["load"] - 1) / 0.1)
