#!/usr/bin/python3
"""Measured wheel tests beside DEM runs and a model: rms by region, and a page.

TABLE.csv: a row for each state, with columns for slip (or rim_speed and
travel_speed), attack_angle, load and any of f_x, f_y, torque, sinkage, each
named with its unit (load_n, sinkage_mm), or mapped by --columns. Signs and slip
as in docs/glossary.md. Sinkage counts from the undisturbed plane.

Every row runs at its own load on every bed. A row is compared over the stretch
of hub travel that the scene states (rig.travel), or, where its run ended before,
over the run's own window: such rows are marked. Files go to OUT: the campaign,
rows.json, rows.md and report.html. What is done is not run again: kill it at any
time, start it again. rows.json has every run: --known goes on from it where the
folder is gone, with more rows or beds.

Exit codes: 0 done, 1 a run failed, 2 bad usage or input, 130 Ctrl-C.

Example:
  ./grouser validate dem_offline/campaigns/measured/cmu_smooth_wheel.csv \\
    --soil dem_offline/campaigns/cmu_loose.soil.yaml \\
    --scene dem_offline/campaigns/cmu_validate.scene.yaml --rows 5,14 --beds 2
"""

import argparse
import hashlib
import json
import math
import os
import statistics
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [HERE, os.path.join(ROOT, "clients", "common")]

import matplotlib  # noqa: E402
import yaml  # noqa: E402

matplotlib.use("Agg")

import html_page  # noqa: E402
import measured_table as measured  # noqa: E402
import validate_page as page  # noqa: E402
import wheel_campaign as campaigns  # noqa: E402
from processes import Processes, ProgramFailed, exit_code_of, raise_on_signals, write_atomically  # noqa: E402

matplotlib.rcParams.update(html_page.STYLE)


def say(text):
    print(f"validate: {text}", file=sys.stderr, flush=True)


def parse_arguments():
    parser = argparse.ArgumentParser(prog="./grouser validate", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("table", metavar="TABLE.csv")
    parser.add_argument("--soil", required=True, help="soil file (*.soil.yaml)")
    parser.add_argument("--scene", required=True, help="scene file: the wheel and the rig")
    parser.add_argument("--model", help="model file: its answers beside them")
    parser.add_argument("--columns", action="append", default=[], metavar="SOURCE=QUANTITY:UNIT",
                        help="what a column holds, as DP_N=f_x:N,sinkage_mm=sinkage:mm")
    parser.add_argument("--rows", default="", help="rows of the table, from 1, as 1,3-5 (default: all)")
    parser.add_argument("--beds", type=int, default=3, help="beds of every state (default: 3)")
    parser.add_argument("--known", metavar="ROWS.json", help="of an earlier call with the same soil and scene: "
                        "its runs are taken, the others made")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="runs at once (default: cores)")
    parser.add_argument("--device", default="cpu", help="where wheel tests run: cpu, cuda, auto")
    parser.add_argument("--out", default=os.path.join(ROOT, "out", "validate"), help="folder of all results")
    parser.add_argument("--bin", default=os.path.join(ROOT, "build", "release", "bin"), help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    for option in ("beds", "jobs"):
        if getattr(arguments, option) < 1:
            raise measured.TableError(f"--{option} {getattr(arguments, option)}: expected at least 1")
    for option in ("soil", "scene", "model", "known"):
        path = getattr(arguments, option)
        if path and not os.path.exists(path):
            raise measured.TableError(f"--{option} {path}: no such file")
    return arguments


def run_campaign(arguments, runs, processes):
    """Records of the runs [(state, seed)], by state."""
    path = os.path.join(arguments.out, "validate.campaign.yaml")
    folder = os.path.join(arguments.out, "campaign")
    write_atomically(path, campaigns.text_of("./grouser validate", "validate", arguments.scene, arguments.soil, runs,
                                             arguments.out))
    program = os.path.join(arguments.bin, "grouser-dem")
    child = processes.start_with_output("campaign", campaigns.command(program, path, folder, arguments.jobs,
                                                                      arguments.device), show=True)
    processes.finish("campaign", child)
    return campaigns.records_in(program, folder)


HEAD = ("soil", "soil_sha256", "scene", "scene_sha256", "engine_version", "mean_diameter_m")


def sha256_of(path):
    with open(path, "rb") as file:
        return hashlib.sha256(file.read()).hexdigest()


def head_of(arguments, record):
    """What all runs of a comparison share (HEAD); hashes of the files say whether runs kept before are of the same."""
    return {"soil": record["spec"]["soil"].get("name", ""), "soil_sha256": sha256_of(arguments.soil),
            "scene": record["spec"].get("scene", ""), "scene_sha256": sha256_of(arguments.scene),
            "engine_version": record["numerics"]["engine_version"],
            "mean_diameter_m": float(record["bed"]["mean_diameter_m"])}


def read_known(arguments):
    """(head, beds reached by seed, {state: {seed: summary}}) of --known; none where nothing is known."""
    path = arguments.known
    if not path:
        return None, {}, {}
    try:
        with open(path, encoding="utf-8") as file:
            kept = json.load(file)
        head = {key: kept[key] for key in HEAD}
        runs = {}
        for row in kept["rows"]:
            state = campaigns.rounded(row["slip"], row["attack_angle_deg"], row["load_n"])
            runs.setdefault(state, {}).update({run["seed"]: run for run in row["dem"]["runs"]})
        return head, kept["bed_reached"], runs
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise measured.TableError(f"--known {path}: {type(error).__name__} {error}, expected rows.json of "
                                  "./grouser validate") from None


def all_runs(arguments, rows, processes):
    """(head, beds reached by seed, {state: summaries by seed}): what is known is not run."""
    wanted = campaigns.runs_of(rows, arguments.beds)
    before, beds, known = read_known(arguments)
    if before:
        here = {"soil_sha256": sha256_of(arguments.soil), "scene_sha256": sha256_of(arguments.scene)}
        for key, value in here.items():
            if before[key] != value:
                raise measured.TableError(f"--known {arguments.known}: {key} {before[key][:12]}, expected "
                                          f"{value[:12]}: that of the file given here")
    missing = [(state, seed) for state, seed in wanted if seed not in known.get(state, {})]
    say(f"{len(wanted)} runs, {len(wanted) - len(missing)} of them known")
    head = before
    if missing:
        for records in run_campaign(arguments, missing, processes).values():
            for record in records:
                head = head_of(arguments, record)
                if before and before["engine_version"] != head["engine_version"]:
                    raise measured.TableError(f"--known {arguments.known}: runs of engine {before['engine_version']}, "
                                              f"expected {head['engine_version']}")
                run = campaigns.summary_of(record)
                known.setdefault(campaigns.state_of_record(record), {})[run["seed"]] = run
                beds.setdefault(str(run["seed"]), page.bed_of(record))
    if not head:
        raise ProgramFailed("no run left a record; see logs/campaign.log")
    seeds = range(1, arguments.beds + 1)
    return head, beds, {state: [runs[seed] for seed in seeds if seed in runs] for state, runs in known.items()}


def model_answer(arguments, row):
    answer = campaigns.capture([os.path.join(arguments.bin, "grouser-fit"), "eval", arguments.model, "--json",
                                f"--slip={row.slip!r}", f"--angle-deg={math.degrees(row.angle)!r}",
                                f"--load={row.load!r}"])
    return page.model_outputs(answer)


def compare(arguments, rows, runs):
    """One dictionary a row, as rows.json has it."""
    out = []
    for number, row in rows:
        one = {"row": number, "line": row.line, "slip": row.slip, "attack_angle_deg": math.degrees(row.angle),
               "load_n": row.load, "regions": row.regions,
               "measured": {name: {"value": row.value[name], "standard_error": none_of(row.error(name))}
                            for name in measured.OUTPUTS if name in row.value},
               "dem": campaigns.over_beds(runs.get(campaigns.state_of(row), []))}
        if arguments.model:
            one["model"] = model_answer(arguments, row)
        out.append(one)
    return out


def none_of(value):
    return None if math.isnan(value) else value


def errors_by_region(compared, regions):
    """rms of DEM and model minus measurement, with the standard error of that rms from the errors of
    its rows: sqrt(sum (e_i s_i)^2)/(n rms)."""
    table = []
    for region in regions:
        for output in measured.OUTPUTS:
            for source in ("dem", "model"):
                pairs = []
                for one in compared:
                    got = one.get(source, {}).get("outputs", {}).get(output)
                    truth = one["measured"].get(output)
                    if region not in one["regions"] or not got or not truth:
                        continue
                    pairs.append((got["value"] - truth["value"],
                                  math.hypot(got["standard_error"] or 0, truth["standard_error"] or 0)))
                if not pairs:
                    continue
                rms = math.sqrt(statistics.fmean(e * e for e, _ in pairs))
                error = math.sqrt(sum((e * s) ** 2 for e, s in pairs)) / (len(pairs) * rms) if rms > 0 else 0.0
                table.append({"region": region, "output": output, "of": source, "rows": len(pairs), "rms": rms,
                              "standard_error": error, "mean": statistics.fmean(e for e, _ in pairs)})
    return table


def wheel_of(scene):
    """Radius and width [m] of a scene file's wheel."""
    try:
        with open(scene, encoding="utf-8") as file:
            wheel = yaml.safe_load(file)["wheel"]
        return float(wheel["radius_m"]), float(wheel["width_m"])
    except (yaml.YAMLError, KeyError, TypeError, ValueError) as error:
        raise measured.TableError(f"--scene {scene}: {error}, expected wheel.radius_m and wheel.width_m") from None


def validate(arguments, processes):
    """Whether every run gave something to compare."""
    reader = os.path.join(arguments.bin, "grouser-calibrate")
    all_rows = measured.read(reader, arguments.table, wheel_of(arguments.scene), arguments.columns)
    chosen = measured.choose(list(enumerate(all_rows, 1)), arguments.rows)
    head, beds, runs = all_runs(arguments, [row for _, row in chosen], processes)
    compared = compare(arguments, chosen, runs)
    errors = errors_by_region(compared, measured.find_regions(os.path.join(arguments.bin, "grouser-fit"), []))
    result = {"table": os.path.basename(arguments.table), **head, "beds": arguments.beds, "bed_reached": beds,
              "rows": compared, "errors": errors}
    write_atomically(os.path.join(arguments.out, "rows.json"), json.dumps(result, indent=1) + "\n")
    write_atomically(os.path.join(arguments.out, "rows.md"), page.markdown(result))
    report = os.path.join(arguments.out, "report.html")
    write_atomically(report, page.render(result, ["./grouser", "validate", *sys.argv[1:]]))
    print(page.markdown(result))
    say(report)
    return all(one["dem"]["outputs"] for one in compared)


def work():
    arguments = parse_arguments()
    arguments.out = os.path.abspath(arguments.out)
    logs = os.path.join(arguments.out, "logs")
    os.makedirs(logs, exist_ok=True)
    with Processes(logs) as processes:
        return validate(arguments, processes)


def main():
    raise_on_signals()
    return exit_code_of(work, measured.TableError, say)


if __name__ == "__main__":
    sys.exit(main())
