#!/usr/bin/python3
"""Stands for grouser-dem where only the order, the resuming and the failing of runs is tested: no physics, but numbers
that grow with friction and packing.

Its folder holds `calls`, a line for each run it made, and may hold texts: `refuse`, a run whose arguments contain it
fails; `no_wheels`, a campaign whose soil contains it is refused; `status` of wheel runs; `engine`, its version."""

import hashlib
import json
import os
import re
import sys

HERE = os.path.dirname(os.path.abspath(__file__))


def note(text):
    with open(os.path.join(HERE, "calls"), "a", encoding="utf-8") as file:
        file.write(text + "\n")


def said(name, otherwise):
    path = os.path.join(HERE, name)
    if not os.path.exists(path):
        return otherwise
    with open(path, encoding="utf-8") as file:
        return file.read().strip()


def refused(text, by="refuse"):
    word = said(by, None)
    return word is not None and word in text


def numerics():
    return {"engine_version": said("engine", "6")}


def run(arguments):
    sets = [arguments[k + 1] for k, word in enumerate(arguments) if word == "--set"]
    out = arguments[arguments.index("--out") + 1]
    note("run " + os.path.basename(out))
    if refused(" ".join(arguments)):
        print("grouser-dem: the bed cannot be packed", file=sys.stderr)
        return 1
    with open(arguments[0], encoding="utf-8") as file:
        text = file.read()
    friction = float(re.search(r"friction: ([0-9.]+)", " ".join(sets)).group(1))
    packing = float(re.search(r"solid_fraction: ([0-9.]+)", " ".join(sets)).group(1))
    force = 0.02 * (0.5 + friction) * (1 + 20 * (packing - 0.55))
    body = "wheel" if "wheel_press" in arguments[0] else "plate"
    with open(out.removesuffix(".run.h5") + ".series.csv", "w", encoding="utf-8") as file:
        file.write(f"time_s,{body}.sinkage_m,{body}.f_z_n\n")
        file.writelines(f"{k},{1e-4 * k},{force * k}\n" for k in range(400))
    write(out, {"status": "RUN_STATUS_DONE", "experiment_spec": {"yaml": text, "sets": sets, "others": []},
                "numerics": numerics(), "bed": {"solid_fraction": packing, "preparation_friction": 1.0}})
    return 0


def campaign(arguments):
    path, folder = arguments[1], arguments[arguments.index("--out") + 1]
    import yaml
    with open(path, encoding="utf-8") as file:
        plan = yaml.safe_load(file)
    os.makedirs(os.path.join(folder, "runs"), exist_ok=True)
    with open(os.path.join(os.path.dirname(path), plan["soil"]), encoding="utf-8") as file:
        text = file.read()
    if refused(text, "no_wheels"):
        print("grouser-dem: campaign refused", file=sys.stderr)
        return 2
    grains = yaml.safe_load(text)["grains"]
    planned = []
    for state in plan["extra"]:
        seed = state.pop("seed")
        run_id = hashlib.sha256(json.dumps([seed, state]).encode()).hexdigest()[:16]
        planned.append({"run_id": run_id})
        out = os.path.join(folder, "runs", run_id + ".run.h5")
        if os.path.exists(out):
            continue
        note(f"wheel {state['slip']} seed {seed}")
        angle = state["attack_angle_deg"] * 3.141592653589793 / 180
        write(out, {"status": "RUN_STATUS_" + said("status", "STEADY"), "numerics": numerics(),
                    "bed": {"solid_fraction": grains["solid_fraction"]},
                    "spec": {"seed": str(seed), "state": {**state, "attack_angle_rad": angle}},
                    "equal_travel": {"outputs": [{"name": "f_x", "mean": grains["friction"] + seed,
                                                  "standard_error": 0.1},
                                                 {"name": "sinkage", "mean": 0.02, "standard_error": 1e-4}]}})
    write(os.path.join(folder, "campaign.json"), {"runs": planned})
    return 0


def write(path, content):
    with open(path, "w", encoding="utf-8") as file:
        json.dump(content, file)


def main(arguments):
    if arguments[0] == "--version":
        print(f"grouser-dem 0 (engine {said('engine', '6')}, none)")
        return 0
    if arguments[0] == "check":
        return 0
    if arguments[0] == "run":
        return run(arguments[1:])
    if arguments[:2] == ["campaign", "run"]:
        return campaign(arguments[1:])
    if arguments[0] == "show":
        records = []
        for path in arguments[2:]:
            with open(path, encoding="utf-8") as file:
                records.append(json.load(file))
        print(json.dumps(records))
        return 0
    return 2


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
