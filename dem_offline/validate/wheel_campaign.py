"""A campaign of measured wheel states on a few beds: its file, its command, the records of its runs."""

import json
import math
import os
import statistics
import subprocess

import measured_table as measured
from processes import ProgramFailed

FAILED = "RUN_STATUS_FAILED"


def state_of(row):
    """As the campaign file has it, rounded alike wherever it is looked up."""
    return (round(row.slip, 6), round(math.degrees(row.angle), 4), round(row.load, 3))


def text_of(author, name, scene, soil, rows, beds, folder):
    """Every state once on seeds 1 to `beds`; paths from the folder of the file."""
    lines = [f"# Written by {author}.", f"name: {name}",
             "scene: " + json.dumps(os.path.relpath(scene, folder)),
             "soil: " + json.dumps(os.path.relpath(soil, folder)),
             f"seeds: [{', '.join(str(k + 1) for k in range(beds))}]", "extra:"]
    lines += [f"  - {{slip: {slip!r}, attack_angle_deg: {angle!r}, load_n: {load!r}}}"
              for slip, angle, load in dict.fromkeys(state_of(row) for row in rows)]
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
        state = record["spec"]["state"]
        key = (round(float(state.get("slip", 0)), 6), round(math.degrees(float(state.get("attack_angle_rad", 0))), 4),
               round(float(state["load_n"]), 3))
        records.setdefault(key, []).append(record)
    return records


def outputs_of(record):
    """({output: (mean, standard error)}, whether it is the stretch of equal travel)."""
    equal = record.get("equal_travel", {}).get("outputs")
    source = equal or record.get("outputs", [])
    return ({one["name"]: (float(one.get("mean", 0)), float(one.get("standard_error", 0))) for one in source},
            bool(equal))


def wall_of(records):
    """Mean wall time of a run [s], its own; None: not told."""
    times = [record["numerics"]["wall_s"] for record in records if "wall_s" in record.get("numerics", {})]
    return statistics.fmean(float(time) for time in times) if times else None


def over_beds(records):
    """Means over beds, with their standard errors: of the spread between beds where there are two or
    more, but not less than the runs' own."""
    each = [outputs_of(record) for record in records if record["status"] != FAILED]
    each = [one for one in each if one[0]]
    result = {}
    for output in measured.OUTPUTS:
        values = [one[0][output] for one in each if output in one[0]]
        if not values:
            continue
        own = math.sqrt(sum(v[1] ** 2 for v in values)) / len(values)
        spread = statistics.stdev(v[0] for v in values) / math.sqrt(len(values)) if len(values) > 1 else 0.0
        result[output] = {"value": statistics.fmean(v[0] for v in values), "standard_error": max(own, spread)}
    return {"outputs": result, "beds": len(each), "wall_s": wall_of(records),
            "equal_travel": bool(each) and all(one[1] for one in each),
            "statuses": [record["status"].replace("RUN_STATUS_", "") for record in records],
            "reasons": sorted({record.get("reason", "") for record in records} - {""})}
