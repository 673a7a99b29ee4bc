#!/usr/bin/python3
"""What each switch of the reduced domain does to a wheel test, as Markdown tables.

    scene_study.py --dem build/.../grouser-dem [--file TSV] [--seeds N] [--table]

The same wheel, soil and seeds with one switch changed at a time, against the full model; each
finished run is a line of the file, so that a study that was stopped goes on where it was. Beds
are kept beside it. Rows that change the time step or the stiffness settle beds of their own.
Standard library only.
"""
import argparse
import copy
import json
import math
import os
import statistics
import subprocess
import sys
import tempfile

STATES = {"drive": (0.3, 0, 24), "lateral": (0.2, 60, 24), "locked": (-1, 0, 24)}
OUTPUTS = ("f_x", "f_y", "torque", "sinkage")
COLUMNS = ("steps", "particle_steps", "active", "deep", "cpu_s", "end_s", "p99", "residual")
WINDOW = {"bed": "SCENE_BED_WINDOW"}
REDUCED = {**WINDOW, "freeze": True, "freeze_box": 1.25, "freeze_speed": 0.01, "largest_step": True}


def full_model(options, state, seed):
    """Coarse and soft, smooth wheel of the CMU testbed (campaigns/cmu_smooth_demo.scene.yaml)."""
    slip, angle_deg, load_n = STATES[state]
    d = options.diameter
    grains = {"grain_density_kg_per_m3": 2293.1, "youngs_modulus_pa": 5e6, "poisson_ratio": 0.3,
              "restitution": 0.5, "friction": 0.55, "rolling_friction": 0.3, "solid_fraction": 0.58,
              "sizes": [{"diameter_m": k * d, "mass_fraction": share}
                        for k, share in ((0.9, 0.25), (1, 0.5), (1.1, 0.25))]}
    return {"soil": {"gravity_m_per_s2": 9.81, "grains": grains},
            "wheel": {"radius_m": 0.0625, "width_m": 0.05, "restitution": 0.5, "friction": 0.5,
                      "rolling_friction": 0.3},
            "rig": {"bed_length_m": 0.28, "bed_width_m": 0.2, "bed_depth_m": 0.1,
                    "speed_m_per_s": 0.1, "max_time_s": options.time, "rayleigh_fraction": 0.2,
                    "target_relative_error": 1e-9,  # to the end
                    "stress_bin_rad": math.radians(5), "width_bins": 5,
                    "scene": {"bed": "SCENE_BED_FULL", "window_ahead": 0.5, "freeze_box": 2.5,
                              "freeze_speed": 0.01, "look_steps": 100}},
            "state": {"mode": "RIG_MODE_RIM_SPEED", "slip": slip, "load_n": load_n,
                      "attack_angle_rad": math.radians(angle_deg)},
            "seed": seed}


def scene(**switches):
    return lambda spec: spec["rig"]["scene"].update(switches)


def rig(**numbers):
    return lambda spec: spec["rig"].update(numbers)


def window(tiles):
    return scene(**WINDOW, window_length_m=tiles * 0.28)


def freeze(box, speed):
    return scene(freeze=True, freeze_box=box, freeze_speed=speed)


def stiffer(spec):
    spec["soil"]["grains"]["youngs_modulus_pa"] *= 4


def slower(spec):
    spec["rig"]["speed_m_per_s"] *= 0.5
    spec["rig"]["max_time_s"] *= 2


def reduced_to_the_target(spec):
    scene(**REDUCED)(spec)
    rig(target_relative_error=0.02)(spec)


ROWS = {
    "full": lambda spec: None, "periodic": scene(bed="SCENE_BED_PERIODIC"),
    "window": scene(**WINDOW), "window x2": window(2), "window x1.5": window(1.5),
    "window x1": window(1), "window x0.8": window(0.8),
    **{f"freeze box {box:g}, {speed:g}": freeze(box, speed)
       for box, speed in ((2.5, 0.01), (1.75, 0.01), (1.25, 0.01), (1, 0.01), (2.5, 0.1),
                          (1.25, 0.03), (1, 0.03), (1, 0.1), (1, 0.3))},
    "window + freeze": scene(**WINDOW, freeze=True, freeze_box=1.25, freeze_speed=0.01),
    "stop at 2 %": rig(target_relative_error=0.02), "step x0.5": rig(rayleigh_fraction=0.1),
    "step x1.15": rig(rayleigh_fraction=0.23), "step x1.5": rig(rayleigh_fraction=0.3),
    "largest step": scene(largest_step=True), "stiffness x4": stiffer, "speed x0.5": slower,
    "reduced, to the end": scene(**REDUCED), "reduced": reduced_to_the_target,
}


def load(file):
    """Finished runs by "row|state|seed": status, why it stopped, numbers by name."""
    runs = {}
    if not os.path.exists(file):
        return runs
    with open(file, encoding="utf-8") as lines:
        for line in lines:
            words = line.rstrip("\n").split("\t")
            if len(words) != 3 + 2 * len(OUTPUTS) + len(COLUMNS):
                continue  # a line that was cut off
            names = [n for output in OUTPUTS for n in (output, output + " se")] + list(COLUMNS)
            runs[words[0]] = (words[1], words[2], dict(zip(names, map(float, words[3:]))))
    return runs


def record_of(options, spec):
    """The record of one wheel test, and its CPU seconds: the machine may be shared."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "spec.json")
        with open(path, "w", encoding="utf-8") as out:
            json.dump(spec, out)
        command = [options.dem, "run", "--spec", path, "--tiles", options.file + ".tiles", "--json",
                   "--out", os.path.join(folder, "a.run.h5")]
        before = os.times()
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        after = os.times()
    if done.returncode != 0:
        sys.exit(f"scene_study.py: {json.dumps(spec)}\n{done.stderr}")
    return json.loads(done.stdout), (after.children_user + after.children_system -
                                     before.children_user - before.children_system)


def settle(options, spec, settled):
    """The bed of a run, apart: the time that it takes is not the run's."""
    bed = json.dumps([spec["soil"], spec["rig"]["rayleigh_fraction"], spec["seed"]])
    if bed in settled:
        return
    settled.add(bed)
    brief = copy.deepcopy(spec)
    brief["rig"]["max_time_s"] = 1e-3
    record_of(options, brief)


def run(options, spec):
    """One wheel test: status, why it stopped, numbers as text."""
    record, cpu_s = record_of(options, spec)
    means = {o["name"]: o for o in record.get("outputs", [])}
    numbers = [means.get(name, {}).get(key, 0) for name in OUTPUTS
               for key in ("mean", "standard_error")]
    n, energy = record["numerics"], record["energy"]
    given = energy.get("input_j", 0)
    numbers += [int(n["steps"]), n["particle_steps"], n["awake_particle_steps"],
                n.get("deep_particle_steps", 0), cpu_s, record.get("window_end_s", 0),
                n.get("overlap_p99_over_radius", 0),
                abs(energy.get("residual_j", 0)) / given if given > 0 else 0]
    status = record["status"].removeprefix("RUN_STATUS_").lower()
    reason = record.get("reason", "")
    return (status + (f" ({reason})" if reason else ""), record.get("stopped_by", ""),
            [f"{x:.8g}" for x in numbers])


def wanted(names, name):
    return not names or name in names.split(";")


def study(options, done):
    settled = set()
    for seed in seeds_of(options):
        for state in (s for s in STATES if wanted(options.states, s)):
            for row, change in ROWS.items():
                key = f"{row}|{state}|{seed}"
                if key in done or not wanted(options.rows, row):
                    continue
                spec = full_model(options, state, seed)
                change(spec)
                settle(options, spec, settled)
                status, stopped, numbers = run(options, spec)
                with open(options.file, "a", encoding="utf-8") as out:
                    out.write("\t".join([key, status, stopped] + numbers) + "\n")
                print(f"{key}: {status}, {stopped}", file=sys.stderr)


def seeds_of(options):
    return range(options.first_seed, options.first_seed + options.seeds)


def print_table(options, done, state):
    slip, angle_deg, load_n = STATES[state]
    print(f"\n### {state}: slip {slip:.2g}, attack angle {angle_deg:.0f} degrees, {load_n:.0f} N\n")
    print("| switch | runs | F_x N | F_y N | torque N m | sinkage mm | own SE F_x, F_y | steps | "
          "particle-steps | active | deep of active | CPU s | full/this | residual | not steady |"
          "\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|")
    full_cpu = 0
    for row in ROWS:
        runs = [done[k] for k in (f"{row}|{state}|{seed}" for seed in seeds_of(options)) if k in done]
        if not runs:
            continue
        mean = {name: statistics.fmean(r[2][name] for r in runs) for name in runs[0][2]}
        if row == "full":
            full_cpu = mean["cpu_s"]
        cells = [row, str(len(runs))]
        for name in OUTPUTS:
            # Scatter over seeds; of one run its own standard error.
            error = mean[name + " se"]
            if len(runs) > 1:
                error = statistics.stdev(r[2][name] for r in runs) / math.sqrt(len(runs))
            unit, digits = 1e3 if name == "sinkage" else 1, 4 if name == "torque" else 2
            cells.append(f"{mean[name] * unit:.{digits}f} +- {error * unit:.{digits}f}")
        active = mean["active"]
        cells += [f"{mean['f_x se']:.2f}, {mean['f_y se']:.2f}", f"{mean['steps']:.3g}",
                  f"{mean['particle_steps']:.3g}", f"{active / mean['particle_steps']:.2f}",
                  f"{mean['deep'] / active if active else 0:.2f}", f"{mean['cpu_s']:.1f}",
                  f"{full_cpu / mean['cpu_s']:.2f}", f"{max(r[2]['residual'] for r in runs):.2g}",
                  str(sum(not r[0].startswith("steady") for r in runs))]
        print("| " + " | ".join(cells) + " |")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--dem", default="build/release/bin/grouser-dem")
    parser.add_argument("--file", default="scene_study.tsv")
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--diameter", type=float, default=0.009, help="mean of the grains [m]")
    parser.add_argument("--time", type=float, default=1.6, help="of a run [s]")
    parser.add_argument("--rows", default="", help="'A;B': these alone")
    parser.add_argument("--states", default="", help="'A;B': these alone")
    parser.add_argument("--table", action="store_true", help="print what is there, run nothing")
    options = parser.parse_args()
    if not options.table:
        study(options, load(options.file))
    done = load(options.file)
    for state in STATES:
        if wanted(options.states, state):
            print_table(options, done, state)


if __name__ == "__main__":
    main()
