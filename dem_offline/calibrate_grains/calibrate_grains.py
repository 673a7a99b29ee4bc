#!/usr/bin/python3
"""Grains from measured plates, pressed wheel and wheel tests: a design of DEM runs, an emulator, a posterior.

DATA.yaml: a measurement file (docs/calibration.md). START.soil.yaml: the grains that the design changes; SCENE.yaml:
the measured wheel and its rig. VARY.yaml: what is varied, PARAMETER: [LOW, HIGH], or held, PARAMETER: VALUE, of
  {known}
(left out: {usual}).

Every point of the design presses plates and wheel to the measured sinkages and drives the wheel states that are
fitted, at their own loads, on the same beds. OUT gets points/, design.json (all that the inference needs: --design
FILE repeats it without a run) and, unless --design-only, calibration.json, report.html, calibrated.soil.yaml and
calibrated.scene.yaml. What is done is not run again: kill it at any time, start it again. More points can be asked
for later: those of before stay.

Exit codes: 0 done, 1 failed, 2 bad usage or input, 130 Ctrl-C.

Example:
  ./grouser calibrate grains surrogate/calibrate/measured/cmu_wheel.yaml \\
    --soil dem_offline/campaigns/cmu_loose.soil.yaml --scene dem_offline/campaigns/cmu_validate.scene.yaml \\
    --vary dem_offline/campaigns/cmu_grains.vary.yaml --budget 1.5 --out out/grains
"""

import argparse
import hashlib
import json
import math
import os
import shlex
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [HERE] + [os.path.join(ROOT, *folder) for folder in (
    ("dem_offline", "bevameter"), ("dem_offline", "validate"), ("clients", "common"))]

import design  # noqa: E402
import known  # noqa: E402
import known_rows  # noqa: E402
import outcome  # noqa: E402
import plain_yaml  # noqa: E402
import table_check  # noqa: E402
import targets as measured  # noqa: E402
import vary as varied  # noqa: E402
from experiment_runs import Refused, engine_of, lock_of, read_kept  # noqa: E402
from grain_soil import GrainSoil  # noqa: E402
from measured_table import TableError  # noqa: E402
from point import Point, Setting  # noqa: E402
from processes import exit_code_of, raise_on_signals, write_atomically  # noqa: E402

PER_PARAMETER = 10  # points, by a rule of thumb for kriging


def say(text):
    print(f"calibrate grains: {text}", file=sys.stderr, flush=True)


def say_progress(fraction, eta_s, stage):
    """For the program that follows this one."""
    print(f"progress {fraction:.4f} eta={eta_s:.0f} {stage}", file=sys.stderr, flush=True)


class PrintParameters(argparse.Action):
    def __call__(self, parser, *_):
        print(varied.markdown(), end="")
        parser.exit()


def parse_arguments():
    text = __doc__.format(known=", ".join(varied.KNOWN), usual=", ".join(
        f"{name} {one.usual[0]:g} to {one.usual[1]:g}" for name, one in varied.KNOWN.items() if one.usual))
    parser = argparse.ArgumentParser(prog="./grouser calibrate grains", description=text,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", metavar="DATA.yaml")
    parser.add_argument("--soil", required=True, metavar="START.soil.yaml")
    parser.add_argument("--scene", required=True, metavar="SCENE.yaml")
    parser.add_argument("--vary", metavar="VARY.yaml", help="parameters and their ranges")
    parser.add_argument("--parameters", nargs=0, action=PrintParameters,
                        help="print the table of what VARY.yaml may name (docs/scene-files.md) and end")
    parser.add_argument("--out", default=os.path.join(ROOT, "out", "grains"), help="folder of all results")
    parser.add_argument("--points", type=int, metavar="N",
                        help=f"that fill the space (default: {PER_PARAMETER} for each parameter that is varied)")
    parser.add_argument("--budget", type=float, metavar="HOURS",
                        help="of wall time for the runs of the design, earlier calls counted: then no new point starts "
                        "and those that have begun finish")
    parser.add_argument("--beds", type=int, default=1, metavar="N",
                        help="of every test, the same at every point (default: 1)")
    parser.add_argument("--predict", default="plates", choices=list(measured.PREDICT),
                        help="rows that are held out and are run as well: plates (default); tests: the pressed wheel, "
                        "too, for which beds grow with its sinkage; all: wheel states, too")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="points at once (default: cores)")
    parser.add_argument("--more", type=int, default=0, metavar="N",
                        help="points in all that the emulators choose, where runs tell most, beside those that fill "
                        "the space")
    parser.add_argument("--known", metavar="FILE", action="append", default=[],
                        help="design.json of an earlier design of the same soil, scene and tests: its outputs are "
                        "taken, what they lack is run; points nearest to the measured curves first. A parameter that "
                        "it held and that is varied here is the last of the sequence. Or rows.json of ./grouser "
                        "validate, beside its soil and scene file: a point more")
    parser.add_argument("--dry-run", action="store_true", help="say what would be run and how long it takes by the "
                        "times recorded so far; nothing is written")
    parser.add_argument("--design", metavar="FILE", help="infer from this design.json; nothing is run")
    parser.add_argument("--check", action="store_true", help="calibrate every point of the design from its own runs by "
                        "all others, too: how often the 90 %% region holds DEM's truth (a second or two a point)")
    parser.add_argument("--design-only", action="store_true", help="run the design and stop before the inference")
    parser.add_argument("--progress-lines", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--wait", type=float, default=10, metavar="S", help="how long for another call in OUT to end, "
                        "such as the runs of one that was killed [s] (default: 10)")
    parser.add_argument("--bin", default=os.path.join(ROOT, "build", "release", "bin"), help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    for option, least in (("points", 2), ("beds", 1), ("jobs", 1), ("more", 0)):
        value = getattr(arguments, option)
        if value is not None and value < least:
            raise Refused(f"--{option} {value}: expected at least {least}")
    if not 0 <= arguments.wait < math.inf:
        raise Refused(f"--wait {arguments.wait:g}: expected 0 or more seconds")
    if arguments.budget is not None and not arguments.budget > 0:
        raise Refused(f"--budget {arguments.budget:g}: expected more than 0 hours")
    if arguments.design and (arguments.design_only or arguments.more or arguments.vary or arguments.known
                             or arguments.dry_run):
        raise Refused("--design: it with --design-only, --dry-run, --known, --more or --vary, expected none of them: "
                      "nothing is run")
    for path in (arguments.data, arguments.soil, arguments.scene, arguments.vary, arguments.design, *arguments.known):
        if path and not os.path.exists(path):
            raise Refused(f"{path}: no such file")
    for name in ("out", "bin", "soil", "scene"):
        setattr(arguments, name, os.path.abspath(getattr(arguments, name)))
    return arguments


def scene_of(path):
    """The document of a scene, checked as far as it is changed here."""
    scene = plain_yaml.load(path)
    wheel = scene.get("wheel") if isinstance(scene, dict) else None
    if not isinstance(wheel, dict) or not {"radius_m", "width_m", "friction"} <= set(wheel):
        raise Refused(f"{path}: wheel: expected a mapping with radius_m, width_m and friction")
    for key in ("radius_m", "width_m", "friction"):
        try:
            good = math.isfinite(float(wheel[key]))
        except (TypeError, ValueError):
            good = False
        if not good:
            raise Refused(f"{path}: wheel.{key}: got {wheel[key]!r}, expected a number")
    if not isinstance(scene.get("name"), str):
        raise Refused(f"{path}: name: got {scene.get('name')!r}, expected the name of the scene")
    return scene


def check_match(arguments, targets, soil, scene):
    """The measured wheel is the scene's, the gravity the soil's."""
    wheel = float(scene["wheel"]["radius_m"]), float(scene["wheel"]["width_m"])
    if targets.wheel and any(abs(a - b) > 1e-6 for a, b in zip(targets.wheel, wheel)):
        raise Refused(f"{arguments.scene}: wheel of {wheel[0]:g} m by {wheel[1]:g} m, expected the measured one of "
                      f"{targets.wheel[0]:g} m by {targets.wheel[1]:g} m ({arguments.data})")
    if abs(soil.gravity - targets.gravity) > 0.01 * targets.gravity:
        raise Refused(f"{arguments.soil}: gravity_m_per_s2: got {soil.gravity:g}, expected the measured "
                      f"{targets.gravity:g} ({arguments.data})")


def hash_of(path):
    with open(path, "rb") as file:
        return hashlib.sha256(file.read()).hexdigest()


def head_of(arguments, vary, setting):
    """What a table says before its points. rows: keys of all that a point was asked for; engine: its version."""
    soil, scene, *before = ({"file": os.path.basename(path), "sha256": hash_of(path)}
                            for path in (arguments.soil, arguments.scene, *arguments.known))
    return {"soil": soil, "scene": scene, "known": before,
            "engine": engine_of(setting.program), "beds": arguments.beds, "fixed": vary.fixed,
            "ranges": {name: list(ends) for name, ends in vary.ranges.items()}, "rows": setting.keys}


def read_known(paths):
    """([(path, rows.json)], [(path, table)]): of tables one at most."""
    rows, tables = [], []
    for path in paths:
        kept = read_kept(path, {})
        if known_rows.is_rows(kept):
            rows.append((path, kept))
        else:
            tables.append((path, table_check.read_table(path)))
    if len(tables) > 1:
        raise Refused(f"--known {tables[1][0]}: a second design.json, expected one: where the later design went on from "
                      "the earlier by --known, its table has the points of both")
    return rows, tables


class Design:
    """The points of this call, run or kept."""

    def __init__(self, arguments, start, targets, lock):
        rows, tables = read_known(arguments.known)
        vary = varied.read(arguments.vary, tables[0][1]["ranges"] if tables else ())
        self.arguments, self.vary = arguments, vary
        self.setting = Setting(start, targets, arguments.predict, arguments.beds,
                               os.path.join(arguments.bin, "grouser-dem"), os.path.join(arguments.out, "points"),
                               lock and lock.fileno(), say)
        self.chosen_file = os.path.join(arguments.out, "more.json")
        count = arguments.points or PER_PARAMETER * len(vary.names)
        self.filling = [{**vary.fixed, **values} for values in vary.points(count)]
        self.head = head_of(arguments, vary, self.setting)
        self.beside = [known_rows.point_of(path, kept, f"v{k:03d}", start, self.head, vary)
                       for k, (path, kept) in enumerate(rows, 1)]
        if tables:
            self.setting.known = known.Known(*tables[0], self.head, vary, say)
            self.setting.known.check(self.filling)
            self.beside += self.setting.known.own_points(self.filling + self._chosen_here())

    def chosen(self):
        """Points that the emulators have asked for in this and earlier calls."""
        if not os.path.exists(self.chosen_file):
            return []
        with open(self.chosen_file, encoding="utf-8") as file:
            return [one for one in json.load(file) if set(one) == set(self.vary.names)]

    def choose(self, points):
        write_atomically(self.chosen_file, json.dumps(self.chosen() + points, indent=1) + "\n")

    def _chosen_here(self):
        return [{**self.vary.fixed, **one} for one in self.chosen()]

    def _runner(self):
        table = design.Table(os.path.join(self.arguments.out, "design.json"), self.head)
        table.points = list(self.beside)
        return design.Runner(self.setting, table, self.arguments.jobs, self.arguments.budget, say,
                             say_progress if self.arguments.progress_lines else None)

    def _in_order(self):
        """Labelled points: of what is known those nearest to the measured curves first, for they tell most of a
        posterior while few are done."""
        points = design.labelled("s", self.filling) + design.labelled("m", self._chosen_here())
        if not self.setting.known:
            return points
        return sorted(points, key=lambda one: known.misfit(self.setting.known.of(one[1]), self.setting.targets.rows))

    def plan(self):
        """What is to be run, in words. Writes nothing to OUT."""
        runner = self._runner()
        with tempfile.TemporaryDirectory() as self.setting.scratch:
            waiting = runner.waiting(self._in_order())
            return design.plan_text(waiting, runner.table.points, self.arguments.more - len(self.chosen()),
                                    Point("m", self.filling[0], self.setting).of_all())

    def run(self):
        """The table, and whether every point was run."""
        runner = self._runner()
        complete = runner.run(self._in_order())
        return table_check.read_table(runner.table.path), complete


def infer(arguments, table, targets, start):
    found = outcome.Inference(table, targets, start, say)
    command = "./grouser calibrate grains " + shlex.join(sys.argv[1:])
    done = outcome.write(found, command, arguments.out, arguments.check)
    sys.stdout.write(outcome.summary(done))
    say(os.path.join(arguments.out, "report.html"))
    return found


def work():
    arguments = parse_arguments()
    soil, scene = GrainSoil(arguments.soil), scene_of(arguments.scene)
    targets = measured.read(os.path.join(arguments.bin, "grouser-calibrate"), arguments.data, soil.diameter)
    check_match(arguments, targets, soil, scene)
    start = varied.Start(plain_yaml.load(arguments.soil), scene)
    lock = None if arguments.dry_run else lock_of(arguments.out, arguments.wait)
    if arguments.design:
        table = table_check.read_table(arguments.design)
        for what, path in (("soil", arguments.soil), ("scene", arguments.scene)):
            if table[what]["sha256"] != hash_of(path):
                targets.notes.append(f"{os.path.basename(path)} is not the {what} file that the design changed "
                                     f"({table[what]['file']} {table[what]['sha256'][:12]})")
        infer(arguments, table, targets, start)
        return True
    for note in targets.notes:
        say(note)
    runs = Design(arguments, start, targets, lock)
    if arguments.dry_run:
        sys.stdout.write(runs.plan())
        return True
    table, complete = runs.run()
    if arguments.design_only:
        return any(one["status"] != "failed" for one in table["points"])
    found = infer(arguments, table, targets, start)
    missing = arguments.more - len(runs.chosen())
    if complete and missing > 0:
        runs.choose([values for values, _ in found.next_points(missing)])
        infer(arguments, runs.run()[0], targets, start)
    return True


def main():
    raise_on_signals()
    return exit_code_of(work, (Refused, TableError), say)


if __name__ == "__main__":
    sys.exit(main())
