#!/usr/bin/python3
"""How much of a wheel test's result is its time step, its box and its window.

A few states of CAMPAIGN.yaml run as the campaign's scene has them and, on as many beds, with half the time step, with
a bed twice as long and wide, and with twice as long a window (where the scene has one: there the bed becomes wider
alone, since its length only says after what way the same grains come again). The table gives each difference with its
standard error, from the spread of the beds but not less than the runs' own: beds of another size are other beds.
States: --at, or the campaign's first driven ones.

OUT gets a folder for each variant and converge.json. What is done is not run again.

Exit codes: 0 done, 1 a run failed, 2 bad usage or input, 130 Ctrl-C.

Example:
  ./grouser campaign converge dem_offline/campaigns/atv_lugged.campaign.yaml --beds 2 --out out/converge
"""

import argparse
import copy
import json
import math
import os
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "clients", "common"))

import plain_yaml  # noqa: E402
from experiment_runs import Refused, lock_of, run_or_refuse  # noqa: E402
from processes import Processes, exit_code_of, raise_on_signals, write_atomically  # noqa: E402

STATE = ("slip", "attack_angle_deg", "load_n", "speed_m_per_s")
OUTPUTS = ("f_x", "f_y", "torque", "sinkage")
UNITS = {"f_x": ("N", 1), "f_y": ("N", 1), "torque": ("N m", 1), "sinkage": ("mm", 1000)}
PLACES = {"f_x": 0, "f_y": 1, "torque": 3, "sinkage": 5}  # in a summary's mean
ENDED = ("RUN_STATUS_STEADY", "RUN_STATUS_UNSTEADY")


def say(text):
    print(f"campaign converge: {text}", file=sys.stderr, flush=True)


def state_of(text):
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        values = []
    if len(values) not in (3, 4) or not all(map(math.isfinite, values)):
        raise argparse.ArgumentTypeError(f"got {text!r}, expected SLIP,ANGLE_DEG,LOAD_N[,SPEED]")
    return dict(zip(STATE, values))


def number_of(path, key, text):
    try:
        value = float(text)
    except (TypeError, ValueError):
        value = math.nan
    if not math.isfinite(value):
        raise Refused(f"{path}: {key}: got {text!r}, expected a number")
    return value


def parse_arguments():
    parser = argparse.ArgumentParser(prog="./grouser campaign converge", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("campaign", metavar="CAMPAIGN.yaml")
    parser.add_argument("--out", required=True, help="folder of all results")
    parser.add_argument("--at", action="append", type=state_of, metavar="SLIP,ANGLE_DEG,LOAD_N[,SPEED]",
                        help="a state, once each, braked ones as --at=-0.2,0,600 (default: the first three driven ones of "
                        "the campaign)")
    parser.add_argument("--beds", type=int, default=2, metavar="N", help="beds of each (default: 2)")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="runs at once (default: cores)")
    parser.add_argument("--json", action="store_true", help="converge.json on stdout instead of the table")
    parser.add_argument("--bin", default=os.path.join(ROOT, "build", "release", "bin"), help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    for option in ("beds", "jobs"):
        if getattr(arguments, option) < 1:
            raise Refused(f"--{option} {getattr(arguments, option)}: expected at least 1")
    return arguments


class Convergence:
    def __init__(self, arguments, processes):
        self.arguments, self.processes = arguments, processes
        self.out = os.path.abspath(arguments.out)
        self.dem, self.fit = (os.path.join(arguments.bin, name) for name in ("grouser-dem", "grouser-fit"))
        campaign = plain_yaml.mapping(arguments.campaign, "a campaign file")
        if not isinstance(campaign.get("scene"), str) or not campaign["scene"]:
            raise Refused(f"{arguments.campaign}: scene: expected the name of a file, as in "
                          "dem_offline/campaigns/demo.campaign.yaml")
        folder = os.path.dirname(os.path.abspath(arguments.campaign))
        self.scene_path = os.path.join(folder, campaign["scene"])
        self.scene = plain_yaml.mapping(self.scene_path, "a scene file")
        if not isinstance(self.scene.get("rig"), dict):
            raise Refused(f"{self.scene_path}: expected a rig")
        soil = campaign.get("soil")  # of the campaign, in place of the scene's
        self.soil = os.path.join(folder, soil) if isinstance(soil, str) else None
        self.states = arguments.at or self._first_states(campaign)

    def _first_states(self, campaign):
        extra = campaign.get("extra") or []
        if not isinstance(extra, list):
            raise Refused(f"{self.arguments.campaign}: extra: expected a list")
        driven = [one for one in extra if isinstance(one, dict) and "slip" in one]
        if len(driven) < 3:
            raise Refused(f"{self.arguments.campaign}: {len(driven)} driven states in `extra`, expected 3, or --at")
        path = self.arguments.campaign
        return [{key: number_of(path, f"extra: {key}", one.get(key)) for key in STATE if key in one or key != STATE[-1]}
                for one in driven[:3]]

    def run(self, name, scene):
        """[[mean, own standard error by output] a bed] by state, of the campaign of one variant."""
        folder = os.path.join(self.out, name)
        os.makedirs(folder, exist_ok=True)
        scene = copy.deepcopy(scene)
        if isinstance(scene.get("soil"), str):
            there = os.path.join(os.path.dirname(self.scene_path), scene["soil"])
            scene["soil"] = os.path.relpath(there, folder)
        beds = range(1, self.arguments.beds + 1)
        campaign = {"name": f"{self.scene.get('name', 'scene')}-{name}", "scene": "variant.scene.yaml", "seeds": [1],
                    "extra": [{**state, "seed": bed} for state in self.states for bed in beds]}
        if self.soil:
            campaign["soil"] = os.path.relpath(self.soil, folder)
        for file, content in (("variant.scene.yaml", scene), ("variant.campaign.yaml", campaign)):
            write_atomically(os.path.join(folder, file), plain_yaml.text_of(content))
        say(f"{name}: {len(campaign['extra'])} runs")
        runs, summary = os.path.join(folder, "runs"), os.path.join(folder, "runs.json")
        self.child(name, [self.dem, "campaign", "run", os.path.join(folder, "variant.campaign.yaml"), "--out", runs,
                          "--jobs", self.arguments.jobs, "--json"])
        self.child(name, [self.fit, "summarise", "--runs", runs, "--out", summary])
        with open(summary, encoding="utf-8") as file:
            found = json.load(file)["runs"]
        return [[one for one in found if is_of(one, state)] for state in self.states], runs

    def child(self, name, argv):
        return run_or_refuse(self.processes, name, argv, show=True)

    def step_of(self, runs):
        """Time step over Rayleigh time of one run of a folder."""
        files = sorted(f for f in os.listdir(os.path.join(runs, "runs")) if f.endswith(".run.h5"))
        text = self.child("show", [self.dem, "show", "--json", os.path.join(runs, "runs", files[0])])
        numerics = json.loads(text)[0]["numerics"]
        return numerics["dt_s"] / numerics["rayleigh_time_s"]

    def variants(self, step):
        """{name: scene}"""
        half, box = copy.deepcopy(self.scene), copy.deepcopy(self.scene)
        half["rig"]["rayleigh_fraction"] = step / 2
        if isinstance(half["rig"].get("scene"), dict):
            half["rig"]["scene"].pop("largest_step", None)
        window = self.scene["rig"].get("scene")
        windowed = isinstance(window, dict) and window.get("bed") == "window"
        for key in ("bed_width_m",) if windowed else ("bed_length_m", "bed_width_m"):
            box["rig"][key] = 2 * number_of(self.scene_path, f"rig: {key}", box["rig"].get(key))
        found = {"half_step": half, "double_width" if windowed else "double_box": box}
        if windowed:
            longer = copy.deepcopy(self.scene)
            longer["rig"]["scene"]["window_length_m"] = 2 * self.length()
            found["double_window"] = longer
        return found

    def length(self):
        """Of the window of the scene as it is."""
        text = self.child("check", [self.dem, "campaign", "check", "--lengths",
                                    os.path.join(self.out, "as_it_is", "variant.campaign.yaml")])
        return max(json.loads(text.splitlines()[-1])["lengths_m"])

    def all(self):
        as_is, runs = self.run("as_it_is", self.scene)
        results = {"as_it_is": as_is}
        for name, scene in self.variants(self.step_of(runs)).items():
            results[name], _ = self.run(name, scene)
        table = []
        for k, state in enumerate(self.states):
            table += rows_of(state, {name: runs[k] for name, runs in results.items()})
        kept = {"campaign": self.arguments.campaign, "beds": self.arguments.beds, "rows": table}
        write_atomically(os.path.join(self.out, "converge.json"), json.dumps(kept, indent=1) + "\n")
        print(json.dumps(kept) if self.arguments.json else text_of(table))
        return all(row["beds"] == self.arguments.beds for row in table)


def is_of(run, state):
    return (abs(run.get("slip", 0) - state["slip"]) < 1e-6 and abs(run.get("load_n", 0) - state["load_n"]) < 1e-6
            and abs(math.degrees(run.get("attack_angle_rad", 0)) - state["attack_angle_deg"]) < 1e-6
            and abs(run["speed_m_per_s"] - state.get("speed_m_per_s", run["speed_m_per_s"])) < 1e-9)


def mean_of(runs, output):
    """(mean over beds, its standard error)"""
    k = PLACES[output]
    values = [run["mean"][k] for run in runs]
    mean = sum(values) / len(values)
    own = math.sqrt(sum(run["standard_error"][k] ** 2 for run in runs)) / len(runs)
    spread = math.sqrt(sum((v - mean) ** 2 for v in values) / (len(runs) - 1) / len(runs)) if len(runs) > 1 else 0
    return mean, max(own, spread)


def rows_of(state, variants):
    ended = {name: [run for run in runs if run["status"] in ENDED] for name, runs in variants.items()}
    rows = []
    for name, runs in ended.items():
        row = {"state": state, "variant": name, "beds": len(runs)}
        if runs and ended["as_it_is"]:
            for output in OUTPUTS:
                mean, error = mean_of(runs, output)
                base, base_error = mean_of(ended["as_it_is"], output)
                changed = name != "as_it_is"
                row[output] = {"value": mean - base if changed else mean,
                               "standard_error": math.hypot(error, base_error) if changed else error}
        rows.append(row)
    return rows


def text_of(table):
    lines = ["| state | variant | beds | " + " | ".join(f"{o} [{UNITS[o][0]}]" for o in OUTPUTS) + " |",
             "| --- | --- | --- |" + " --- |" * len(OUTPUTS)]
    for row in table:
        state = row["state"]
        place = (f"slip {state['slip']:g}, {state['attack_angle_deg']:g} deg, {state['load_n']:g} N"
                 + (f", {state['speed_m_per_s']:g} m/s" if "speed_m_per_s" in state else ""))
        changed = row["variant"] != "as_it_is"
        cells = []
        for output in OUTPUTS:
            unit = UNITS[output][1]
            one = row.get(output)
            cells.append(f"{unit * one['value']:{'+' if changed else ''}.3g} +- {unit * one['standard_error']:.2g}"
                         if one else "-")
        name = row["variant"].replace("_", " ")
        lines.append(f"| {'' if changed else place} | {name} | {row['beds']} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def command_of(kept):
    """The command that makes a converge.json again."""
    states = [row["state"] for row in kept["rows"] if row["variant"] == "as_it_is"]
    at = [" --at=" + ",".join(f"{one[key]:g}" for key in STATE if key in one) for one in states]
    return f"./grouser campaign converge {kept['campaign']}{''.join(at)} --beds {kept['beds']} --out out/converge"


def work():
    arguments = parse_arguments()
    lock = lock_of(arguments.out)
    logs = os.path.join(arguments.out, "logs")
    os.makedirs(logs, exist_ok=True)
    with Processes(logs, inherited=[lock.fileno()]) as processes:
        return Convergence(arguments, processes).all()


if __name__ == "__main__":
    raise_on_signals()
    sys.exit(exit_code_of(work, Refused, say))
