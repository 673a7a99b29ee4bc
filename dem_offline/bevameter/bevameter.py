#!/usr/bin/python3
"""Virtual bevameter: the parameters of a soil of DEM grains.

SOIL.yaml: a soil file of grains (*.soil.yaml). Plates, a wheel pressed down, a shear ring under three
loads and a cone go into beds of it; a heap, poured and tapped grains stand beside. ./grouser calibrate
soil then finds Bekker's (or Reece's), Mohr-Coulomb and Janosi-Hanamoto parameters with intervals.
Tests, separated by commas: {tests}. Left out: all, with two plates that the grains allow.

OUT gets runs/, the CSVs and measurements.yaml for ./grouser calibrate soil, calibrated/ (its answer, with soil.csv
for ./grouser model make --soil), bevameter_soil.csv and cone_index.csv (for ./grouser model show --bevameters,
--cones), bevameter.json and report.html. A run that is done with the same values is not repeated: kill it at any time,
start it again.

Exit codes: 0 done, 1 a run or the calibration failed, 2 bad usage or input, 130 Ctrl-C.

Examples:
  ./grouser bevameter dem_offline/campaigns/cmu_loose.soil.yaml --quick
  ./grouser bevameter dem_offline/campaigns/cmu_loose.soil.yaml --tests plate60,plate80,shear --beds 2 \\
    --beside surrogate/calibrate/measured/cmu_plates.yaml --out out/loose
"""

import argparse
import contextlib
import hashlib
import json
import os
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [HERE, os.path.join(ROOT, "clients", "common")]

import matplotlib  # noqa: E402

matplotlib.use("Agg")

import bench as benches  # noqa: E402
import beside as measured_beside  # noqa: E402
import bevameter_page as page  # noqa: E402
import html_page  # noqa: E402
import measured as measurement  # noqa: E402
import soil_rows  # noqa: E402
from experiment_runs import Execution, Refused, check_plans, lock_of  # noqa: E402
from grain_soil import GrainSoil  # noqa: E402
from processes import Processes, ProgramFailed, exit_code_of, raise_on_signals, write_atomically  # noqa: E402

matplotlib.rcParams.update(html_page.STYLE)


def say(text):
    print(f"bevameter: {text}", file=sys.stderr, flush=True)


def parse_arguments():
    parser = argparse.ArgumentParser(prog="./grouser bevameter", formatter_class=argparse.RawDescriptionHelpFormatter,
                                     description=__doc__.format(tests=benches.TEST_NAMES))
    parser.add_argument("soil", metavar="SOIL.yaml")
    parser.add_argument("--tests", default="", metavar="NAMES",
                        help="as plate40,plate60,press,shear,cone,repose,density")
    parser.add_argument("--out", default=os.path.join(ROOT, "out", "bevameter"), help="folder of all results")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="runs at once (default: cores)")
    parser.add_argument("--beds", type=int, help="beds of every test (default: 3; --quick: 1)")
    parser.add_argument("--quick", action="store_true", help="one bed, two loads of the ring, half as many "
                        "grains in heap and density: minutes")
    parser.add_argument("--tool-friction", type=float, metavar="MU", help="of plate, wheel, ring and cone against "
                        "grains (default: that of the grains)")
    parser.add_argument("--depth", type=float, metavar="METRES",
                        help="of the beds (default: 0.12, or 15 grains, or more for wide plates)")
    parser.add_argument("--kind", default="sand", choices=("sand", "loam", "clay", "snow"),
                        help="published soils that say what is typical (default: sand)")
    parser.add_argument("--form", default="auto", choices=("auto", "bekker", "reece"),
                        help="of pressure against sinkage")
    parser.add_argument("--beside", action="append", default=[], metavar="DATA.yaml",
                        help="measured tests: what they calibrate to, and their forces at the same sinkage, stand beside; "
                        "their pressed wheel is pressed here, too")
    parser.add_argument("--bin", default=os.path.join(ROOT, "build", "release", "bin"), help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    for option in ("jobs", "beds"):
        value = getattr(arguments, option)
        if value is not None and value < 1:
            raise Refused(f"--{option} {value}: expected at least 1")
    for path in arguments.beside:
        if not os.path.exists(path):
            raise Refused(f"--beside {path}: no such file")
    if arguments.depth is not None and not arguments.depth > 0:
        raise Refused(f"--depth {arguments.depth:g}: expected more than 0 m")
    if arguments.tool_friction is not None and not 0 <= arguments.tool_friction <= 10:
        raise Refused(f"--tool-friction {arguments.tool_friction:g}: expected 0 to 10")
    arguments.beds = arguments.beds or (1 if arguments.quick else 3)
    for name in ("out", "bin"):
        setattr(arguments, name, os.path.abspath(getattr(arguments, name)))
    return arguments


def run_all(bench, execution, program):
    """{(name, bed): Result}. One test of a bed finds its preparation, the others repeat it."""
    names, seeds = list(bench.bed_tests()), range(1, bench.beds + 1)
    off_bed = [plan for plan in bench.off_bed() if plan.name.endswith("_bed1")]
    check_plans(program, [bench.on_bed(name, 1) for name in names] + off_bed)
    first = [benches.first_on(bench, seed, execution) for seed in seeds] if names else []
    results = execution.run(first + bench.off_bed())
    later = []
    for plan, seed in zip(first, seeds):
        packing = benches.packing_of(results[plan.name])
        others = [name for name in names if f"{name}_bed{seed}" != plan.name]
        later += [bench.on_bed(name, seed, packing) for name in others]
    if later:
        results.update(execution.run(later))
    keyed = {}
    for name, result in results.items():
        test, bed = name.rsplit("_bed", 1)
        keyed[test, int(bed)] = result
    return keyed


def calibrate(arguments, processes, files, folder, form):
    """Runs ./grouser calibrate soil; its calibration.json."""
    command = [sys.executable, os.path.join(ROOT, "surrogate", "calibrate", "calibrate.py"), "--bin", arguments.bin,
               "soil", *map(os.path.relpath, files), "--out", os.path.relpath(folder), "--form", form]
    write_atomically(folder + ".txt", processes.run("calibrate", command))
    with open(os.path.join(folder, "calibration.json"), encoding="utf-8") as file:
        return json.load(file)


def read_beside(arguments, processes):
    """Beside of the files of --beside."""
    program = os.path.join(arguments.bin, "grouser-calibrate")
    try:
        return measured_beside.Beside([json.loads(processes.run("rows", [program, "rows", path]))
                                       for path in arguments.beside])
    except ProgramFailed as error:
        raise Refused("--beside: " + str(error).rsplit("grouser-calibrate: ", 1)[-1]) from None


def report(arguments, bench, results, measured, processes):
    """Measures, calibrates, writes; whether every run ended."""
    got = measurement.Measured(bench, results)
    engine = next(iter(results.values())).numerics["engine_version"]
    path = measurement.write_measurements(got, arguments.out, arguments.kind, engine)
    found = beside = None
    if path:
        found = calibrate(arguments, processes, [path], os.path.join(arguments.out, "calibrated"), arguments.form)
        if arguments.beside:
            beside = calibrate(arguments, processes, arguments.beside, os.path.join(arguments.out, "beside"),
                               arguments.form)
    cone, curves = got.cone()
    summary = {"soil": bench.soil.name, "soil_file": os.path.basename(arguments.soil),
               "soil_sha256": bench.soil.identity, "engine_version": engine,
               "grain_diameter_m": bench.soil.diameter, "quick": arguments.quick, "beds": bench.beds,
               "tool_friction": bench.tool_friction,
               "bed": {"length_m": bench.side, "width_m": bench.side, "depth_m": bench.depth},
               "tests": bench.names, "bulk_density": got.density(), "cone_index": cone, "angle_of_repose": got.repose(),
               "parameters": page.parameters_of(found), "reece_parameters": page.reece_of(found),
               "beside": page.parameters_of(beside), "forces": measured.forces(bench, results),
               "form": found["form"] if found else None,
               "large_overlaps": measurement.large_overlaps(results),
               "failed": [{"run": r.plan.name, "reason": r.reason} for r in results.values() if not r.done]}
    text = json.dumps(summary, indent=1) + "\n"
    write_atomically(os.path.join(arguments.out, "bevameter.json"), text)
    digest = hashlib.sha256(text.encode()).hexdigest()
    for name in ("cone_index.csv", "bevameter_soil.csv"):  # of an earlier call: their hash is of its bevameter.json
        with contextlib.suppress(FileNotFoundError):
            os.remove(os.path.join(arguments.out, name))
    if cone:
        write_atomically(os.path.join(arguments.out, "cone_index.csv"), soil_rows.cone_table(summary, digest))
    if found and not summary["failed"]:
        write_atomically(os.path.join(arguments.out, "bevameter_soil.csv"),
                         soil_rows.parameter_table(summary, digest))
    write_atomically(os.path.join(arguments.out, "report.html"),
                     page.render(summary, bench, results, found, beside, curves,
                                 ["./grouser", "bevameter", *sys.argv[1:]]))
    print(page.markdown(summary, bench, found, beside))
    for run, overlap in summary["large_overlaps"].items():
        say(f"run {run}: {page.overlap_words(overlap)}")
    for one in summary["failed"]:
        say(f"run {one['run']} FAILED: {one['reason']}")
    say(os.path.join(arguments.out, "report.html"))
    return not summary["failed"]


def work():
    arguments = parse_arguments()
    soil = GrainSoil(arguments.soil)
    names = benches.choose(arguments.tests, soil)
    arguments.beside = [os.path.abspath(path) for path in arguments.beside]
    os.chdir(ROOT)  # where the table of published soils is looked for
    lock = lock_of(arguments.out)
    logs = os.path.join(arguments.out, "logs")
    os.makedirs(logs, exist_ok=True)
    with Processes(logs, inherited=[lock.fileno()]) as processes:
        measured = read_beside(arguments, processes)
        bench = benches.Bench(soil, names, arguments.beds, arguments.quick, arguments.tool_friction, arguments.depth,
                              wheel=benches.wheel_for(soil, measured.press_wheel))
        program = os.path.join(arguments.bin, "grouser-dem")
        execution = Execution(arguments.out, program, arguments.jobs, processes, say)
        return report(arguments, bench, run_all(bench, execution, program), measured, processes)


if __name__ == "__main__":
    raise_on_signals()
    sys.exit(exit_code_of(work, Refused, say))
