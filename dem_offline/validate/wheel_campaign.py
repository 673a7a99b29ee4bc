"""A campaign of measured wheel states on a few beds: its file, its command, the records of its runs."""

import json
import math
import os
import statistics
import subprocess

import measured_table as measured
from processes import ProgramFailed

FAILED = "FAILED"


def rounded(slip, angle_deg, load):
    """A state as the campaign file has it, the same wherever it is looked up."""
    return round(slip, 6), round(angle_deg, 4), round(load, 3)


def state_of(row):
    """Of a row of measured_table."""
    return rounded(row.slip, math.degrees(row.angle), row.load)


def state_of_record(record):
    state = record["spec"]["state"]
    return rounded(float(state.get("slip", 0)), math.degrees(float(state.get("attack_angle_rad", 0))),
                   float(state["load_n"]))


def runs_of(rows, beds):
    """Every state once on seeds 1 to `beds`: [(state, seed)]."""
    return [(state, seed) for state in dict.fromkeys(state_of(row) for row in rows) for seed in range(1, beds + 1)]


def text_of(author, name, scene, soil, runs, folder):
    """runs: as runs_of gives them; paths from the folder of the file."""
    lines = [f"# Written by {author}.", f"name: {name}",
             "scene: " + json.dumps(os.path.relpath(scene, folder)),
             "soil: " + json.dumps(os.path.relpath(soil, folder)), "seeds: [1]", "extra:"]
    lines += [f"  - {{slip: {slip!r}, attack_angle_deg: {angle!r}, load_n: {load!r}, seed: {seed}}}"
              for (slip, angle, load), seed in runs]
    return "\n".join(lines) + "\n"


def command(program, path, folder, jobs, device):
    """program: grouser-dem."""
    return [program, "campaign", "run", path, "--out", folder, "--jobs", str(jobs), "--device", device, "--json"]


def capture(argv):
    """What a program prints as JSON."""
    done = subprocess.run(argv, stdout=subprocess.PIPE, stderr=subprocess.PIPE, stdin=subprocess.DEVNULL,
                          check=False, text=True)
    if done.returncode != 0:
        raise ProgramFailed(f"{' '.join(argv)}\nended with {done.returncode}: {done.stderr.strip()}")
    return json.loads(done.stdout)


def records_in(program, folder):
    """{state: records of its runs}, as the campaign in a folder planned them; of runs without a file none."""
    with open(os.path.join(folder, "campaign.json"), encoding="utf-8") as file:
        planned = json.load(file)["runs"]
    files = [os.path.join(folder, "runs", one["run_id"] + ".run.h5") for one in planned]
    files = [path for path in files if os.path.exists(path)]
    records = {}
    for record in capture([program, "show", "--json", *files]) if files else []:
        records.setdefault(state_of_record(record), []).append(record)
    return records


def outputs_of(record):
    """({output: (mean, standard error)}, whether it is the stretch of equal travel)."""
    equal = record.get("equal_travel", {}).get("outputs")
    source = equal or record.get("outputs", [])
    return ({one["name"]: (float(one.get("mean", 0)), float(one.get("standard_error", 0))) for one in source},
            bool(equal))


def summary_of(record):
    """What a comparison needs of a run: small enough to be kept without its file."""
    outputs, equal = outputs_of(record)
    return {"seed": int(record["spec"].get("seed", 0)), "status": record["status"].replace("RUN_STATUS_", ""),
            "reason": record.get("reason", ""), "equal_travel": equal,
            "wall_s": float(record["numerics"]["wall_s"]) if "wall_s" in record.get("numerics", {}) else None,
            "outputs": {name: {"mean": mean, "standard_error": error} for name, (mean, error) in outputs.items()}}


def over_beds(runs):
    """Means over beds of summaries, with their standard errors: of the spread between beds where there are two or
    more, but not less than the runs' own. wall_s: mean of a run [s], its own; none: not told."""
    each = [run for run in runs if run["status"] != FAILED and run["outputs"]]
    result = {}
    for output in measured.OUTPUTS:
        values = [run["outputs"][output] for run in each if output in run["outputs"]]
        if not values:
            continue
        own = math.sqrt(sum(v["standard_error"] ** 2 for v in values)) / len(values)
        means = [v["mean"] for v in values]
        spread = statistics.stdev(means) / math.sqrt(len(means)) if len(means) > 1 else 0.0
        result[output] = {"value": statistics.fmean(means), "standard_error": max(own, spread)}
    times = [run["wall_s"] for run in runs if run["wall_s"] is not None]
    return {"outputs": result, "beds": len(each), "wall_s": statistics.fmean(times) if times else None,
            "equal_travel": bool(each) and all(run["equal_travel"] for run in each),
            "statuses": [run["status"] for run in runs], "reasons": sorted({run["reason"] for run in runs} - {""}),
            "runs": runs}
