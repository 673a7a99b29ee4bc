#!/usr/bin/python3
"""A campaign that goes on where its model is least sure, until it is sure enough or a budget is used up.

CAMPAIGN.yaml: a campaign with some 20 training states to begin with, test states (held_out) and repeats on other
beds (patch). It runs, a model is fitted to all runs, and the states where that model's sd of the fit (`sd_fit`,
relative to the load, load times radius, or radius: the largest of f_x, f_y, torque and sinkage) is largest are run
next, --batch at once, apart from each other and from what has run. The ranges are those of the campaign's training
states. Test states never train, and judge every model on the way. It ends when 95 % of the ranges are known to --error,
or when --budget hours of wall time are used up, earlier calls counted; CAMPAIGN's own runs and a batch that has begun
always finish. Wheels are driven at a given slip and the rig's speed, attack angles are from 0 on.

OUT gets adapted.campaign.yaml (the campaign as it has grown: `./grouser campaign run` repeats it), runs/, NAME.model
and adapt.json, with a line for every model. What is done is not run again: kill it at any time, start it again.

Exit codes: 0 as sure as asked, 1 a run or fit failed or the budget ended before, 2 bad usage or input, 130 Ctrl-C.

Example:
  ./grouser campaign adapt dem_offline/campaigns/demo.campaign.yaml --budget 1 --error 0.05 --out out/adapted
"""

import argparse
import json
import math
import os
import subprocess
import sys
import time

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [HERE, os.path.join(ROOT, "clients", "common")]

import yaml  # noqa: E402

import plain_yaml  # noqa: E402
import states  # noqa: E402
from experiment_runs import Refused, lock_of, read_kept, run_or_refuse  # noqa: E402
from processes import Processes, ProgramFailed, exit_code_of, raise_on_signals, write_atomically  # noqa: E402

CANDIDATES = 256
SHARE = 0.95  # of the ranges that are to be known
KEPT_EVERY_S = 30  # the time that counts
KINDS = {"campaign": dict, "added": list, "models": list, "seconds": (int, float)}  # of adapt.json


def say(text):
    print(f"campaign adapt: {text}", file=sys.stderr, flush=True)


def parse_arguments():
    parser = argparse.ArgumentParser(prog="./grouser campaign adapt", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("campaign", metavar="CAMPAIGN.yaml")
    parser.add_argument("--out", required=True, help="folder of all results")
    parser.add_argument("--budget", type=float, required=True, metavar="HOURS",
                        help="of wall time, then no new batch starts; the campaign itself and a batch that has begun "
                        "always finish")
    parser.add_argument("--error", type=float, default=0.05, metavar="SHARE",
                        help="sd of the fit over load (load times radius, radius) that is enough (default: 0.05)")
    parser.add_argument("--batch", type=int, default=8, metavar="N", help="new states at once (default: 8)")
    parser.add_argument("--kind", default="hybrid", choices=("hybrid", "lookup", "bekker"), help="of the model")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="runs at once (default: cores)")
    parser.add_argument("--json", action="store_true", help="adapt.json on stdout at the end")
    parser.add_argument("--bin", default=os.path.join(ROOT, "build", "release", "bin"), help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    for option, least in (("budget", 0), ("error", 0), ("batch", 1), ("jobs", 1)):
        value = getattr(arguments, option)
        if not least <= value < math.inf:
            raise Refused(f"--{option} {value:g}: expected at least {least}")
    return arguments


def number(text):
    """Of a text as a file has it; nan: none (the engine says what is wrong)."""
    try:
        return float(text)
    except (TypeError, ValueError):
        return math.nan


class Adaptive:
    """The state of one adaptive campaign in its folder."""

    def __init__(self, arguments, processes):
        self.arguments, self.processes = arguments, processes
        self.out = os.path.abspath(arguments.out)
        self.dem, self.fit = (os.path.join(arguments.bin, name) for name in ("grouser-dem", "grouser-fit"))
        self.path = os.path.join(self.out, "adapted.campaign.yaml")
        self.record = os.path.join(self.out, "adapt.json")
        self.base = self._base()
        self.name = str(self.base.get("name", "adapted"))
        self.model = os.path.join(self.out, self.name + ".model")
        self.history = self._history()
        self.counted = time.monotonic()

    def _base(self):
        """The campaign, its files named from OUT."""
        path = self.arguments.campaign
        expected = "a campaign file with a scene, as dem_offline/campaigns/demo.campaign.yaml"
        base = plain_yaml.mapping(path, expected)
        if "scene" not in base:
            raise Refused(f"{path}: expected {expected}")
        self._expect_driven(path, base)
        for key in ("scene", "soil"):
            if isinstance(base.get(key), str):
                there = os.path.join(os.path.dirname(os.path.abspath(path)), base[key])
                base[key] = os.path.relpath(there, self.out)
        return base

    @staticmethod
    def _expect_driven(path, base):
        """States that are added have slip, attack angle from 0 on and load alone: the others have no more."""
        sections = [("", base)]
        for name in ("grid", "extra"):
            entries = base.get(name)
            sections += [(f"{name}[{k}].", one) for k, one in enumerate(entries if isinstance(entries, list) else [])]
        for at, section in sections:
            if not isinstance(section, dict):
                continue  # the engine says what is wrong
            if section.get("mode", "rim") != "rim":
                raise Refused(f"{path}: {at}mode: got {section['mode']!r}, expected rim or none: new states have a "
                              "slip")
            if "speed_m_per_s" in section:
                raise Refused(f"{path}: {at}speed_m_per_s: got {section['speed_m_per_s']}, expected none: new states "
                              "have the rig's speed (rig.speed_m_per_s of the scene)")
            angles = section.get("attack_angle_deg", [])
            for angle in angles if isinstance(angles, list) else [angles]:
                if number(angle) < 0:
                    raise Refused(f"{path}: {at}attack_angle_deg: got {angle}, expected 0 or more: a model answers "
                                  "the other side by symmetry")

    def _history(self):
        history = read_kept(self.record, KINDS)
        fresh = {"campaign": self.base, "added": [], "models": [], "seconds": 0.0}
        if not history:
            return fresh
        if history["campaign"] != self.base:
            if not history["models"] and not history["added"]:
                return {**fresh, "seconds": history["seconds"]}  # one that did not get as far as a model, mended
            raise Refused(f"--out {self.arguments.out}: holds another campaign, expected an empty folder or the same")
        return history

    def child(self, name, argv, show=False):
        """What a program prints; its time counts while it runs. What it calls bad input is bad input here."""
        return run_or_refuse(self.processes, name, argv, show=show, meanwhile=self.count, every_s=KEPT_EVERY_S)

    def keep(self):
        write_atomically(self.record, json.dumps(self.history, indent=1) + "\n")

    def write_campaign(self):
        grown = dict(self.base)
        grown["extra"] = [*(self.base.get("extra") or []), *self.history["added"]]
        text = plain_yaml.text_of(grown)
        write_atomically(self.path, f"# Written by ./grouser campaign adapt from {self.name}.\n" + text)

    def run(self):
        """All runs of the campaign as it is now."""
        self.write_campaign()
        self.child("campaign", [self.dem, "campaign", "run", self.path, "--out", os.path.join(self.out, "runs"),
                                "--jobs", self.arguments.jobs, "--json"], show=True)

    def refit(self):
        """The model of all runs, as `grouser-fit fit --json` tells it."""
        text = self.child("fit", [
            self.fit, "fit", "--runs", os.path.join(self.out, "runs"), "--name", self.name, "--kind",
            self.arguments.kind, "--out", self.model, "--json", "--reason", "adaptive campaign"])
        return json.loads(text)["model"]

    def candidates(self, model, ranges):
        """[(state, how unsure)] over the ranges."""
        slip, angle, load = ranges.all
        drawn = self.child("draw", [
            self.dem, "campaign", "draw", "--sobol", "--states", CANDIDATES, "--seed", 1 + len(self.history["added"]),
            "--slip", *map(repr, slip), "--angle-deg", *map(repr, angle), "--load", *map(repr, load)])
        radius = float(model["wheel"]["radius_m"])
        found = []
        for one in yaml.safe_load(drawn):
            state = (float(one["slip"]), float(one["attack_angle_deg"]), float(one["load_n"]))
            answer = self._eval(state)
            if answer:
                found.append((state, states.unsure(answer, radius)))
        return found

    def _eval(self, state):
        """An answer; none where no motion has this slip, or beyond the border where the wheel sinks in."""
        slip, angle, load = state
        done = subprocess.run([self.fit, "eval", self.model, "--json", f"--slip={slip!r}", f"--angle-deg={angle!r}",
                               f"--load={load!r}"], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                              stdin=subprocess.DEVNULL, text=True, check=False)
        if done.returncode != 0:
            return None
        answer = json.loads(done.stdout)
        return None if "OVERLOAD" in answer["flag_names"] else answer

    def next_batch(self):
        """Fits, writes a line of history; the states to run next, or None when sure enough."""
        model = self.refit()
        runs = model["provenance"]["runs"]
        trained = [(float(r["slip"]), math.degrees(float(r["attack_angle_rad"])), float(r["load_n"])) for r in runs
                   if r["role"] == "RUN_ROLE_TRAIN"]
        ranges = self._ranges(trained)
        found = self.candidates(model, ranges)
        values = [value for _, value in found if not math.isnan(value)]
        if not values:
            raise ProgramFailed(f"{self.model}: answers no state of the campaign's ranges")
        line = {"runs": len(runs), "trained": len(trained), "seconds": round(self.history["seconds"], 1),
                "unsure_median": states.quantile(values, 0.5), "unsure_95": states.quantile(values, SHARE),
                "unsure_most": max(values), "test_rmse": test_errors(model)}
        models = self.history["models"]
        if models and models[-1]["runs"] == line["runs"]:
            models.pop()  # the same runs again: a call that goes on
        models.append(line)
        self.keep()
        say(text_of(line))
        if line["unsure_95"] <= self.arguments.error:
            return None
        there = trained + [(one["slip"], one["attack_angle_deg"], one["load_n"]) for one in self.history["added"]]
        return states.choose(found, there, ranges, self.arguments.batch)

    def _ranges(self, trained):
        """Of the campaign's own training states: kept, so that a batch that fails does not narrow them."""
        if "ranges" not in self.history:
            self.history["ranges"] = [[min(column), max(column)] for column in zip(*trained)]
        return states.Ranges(*self.history["ranges"])

    def add(self, chosen):
        seeds = [int(number(one)) for one in self.base.get("seeds") or [1]]
        for k, (slip, angle, load) in enumerate(chosen, len(self.history["added"])):
            self.history["added"].append({"slip": round(slip, 4), "attack_angle_deg": round(angle, 2),
                                          "load_n": round(load, 3), "seed": seeds[k % len(seeds)]})
        self.keep()

    def count(self):
        """Keeps the time until now."""
        now = time.monotonic()
        self.history["seconds"] += now - self.counted
        self.counted = now
        self.keep()

    def timed(self, work):
        """Its result; its wall time counts."""
        self.counted = time.monotonic()
        try:
            return work()
        finally:
            self.count()

    def all(self):
        """Whether the model is as sure as asked."""
        while True:
            self.timed(self.run)
            chosen = self.timed(self.next_batch)
            if chosen is None:
                return True
            if not chosen:
                say("no state is left that has not run: more runs would be of beds, not of states")
                return False
            if self.history["seconds"] >= 3600 * self.arguments.budget:
                say(f"the budget is used up: {100 * SHARE:g} % of the ranges are known to "
                    f"{self.history['models'][-1]['unsure_95']:.3g}, {self.arguments.error:g} was asked for")
                return False
            self.add(chosen)


def test_errors(model):
    """{output: rms error on the test states}; empty where there are none."""
    return {one["output"]: one["rmse"] for one in model["errors"]
            if one["region"] == "REGION_ALL" and one["set"] == "held_out" and one["output"] in states.OUTPUTS}


def text_of(line):
    errors = ", ".join(f"{name} {value:.3g}" for name, value in line["test_rmse"].items())
    return (f"{line['runs']} runs, {line['trained']} train, {line['seconds'] / 60:.1f} min: sd of the fit over scale "
            f"median {line['unsure_median']:.3g}, {100 * SHARE:g} % within {line['unsure_95']:.3g}, most "
            f"{line['unsure_most']:.3g}" + (f"; rms on test states: {errors}" if errors else ""))


def work():
    arguments = parse_arguments()
    lock = lock_of(arguments.out)
    logs = os.path.join(arguments.out, "logs")
    os.makedirs(logs, exist_ok=True)
    with Processes(logs, inherited=[lock.fileno()]) as processes:
        adaptive = Adaptive(arguments, processes)
        sure = adaptive.all()
        if arguments.json:
            print(json.dumps(adaptive.history))
        say(adaptive.model)
        return sure


def main():
    raise_on_signals()
    return exit_code_of(work, Refused, say)


if __name__ == "__main__":
    sys.exit(main())
