#!/usr/bin/python3
"""Runs a published system, compares row by row, writes a page.

SYSTEM: {systems}, or all. What is not there yet is refused by name.

Files go to OUT/SYSTEM: runs/NAME.run.h5 and its CSVs, rows.md, rows.json (row, got,
expected, limit, pass; pass is null where a row is printed only) and
report.html. A run that is done with the same experiment text and values put
over it is not repeated: kill it at any time, start it again.

Exit codes: 0 every row holds, 1 a row or a run failed, 2 bad usage, 130 Ctrl-C.

Examples:
  ./grouser reproduce ono --quick
  ./grouser reproduce ono --coarse --out /tmp/ono --jobs 2
"""

import argparse
import importlib.util
import json
import os
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [HERE, os.path.join(ROOT, "clients", "common")]

import matplotlib  # noqa: E402

matplotlib.use("Agg")

import html_page  # noqa: E402
import page  # noqa: E402
from experiment_runs import Execution, Plan, Refused, lock_of  # noqa: E402
from processes import Processes, exit_code_of, raise_on_signals, write_atomically  # noqa: E402

matplotlib.rcParams.update(html_page.STYLE)
SYSTEMS = ("shin2020", "atv", "mccarthy2010", "ono", "hpt")
LEVELS = ("quick", "coarse", "full")


def say(text):
    print(f"reproduce: {text}", file=sys.stderr, flush=True)


def parse_arguments():
    parser = argparse.ArgumentParser(
        prog="./grouser reproduce", formatter_class=argparse.RawDescriptionHelpFormatter,
        description=__doc__.format(systems=", ".join(SYSTEMS)))
    parser.add_argument("system", metavar="SYSTEM")
    level = parser.add_mutually_exclusive_group()
    for name, text in zip(LEVELS, ("for tests: minutes", "within 40 minutes on two cores (the default)",
                                   "the paper's sizes: hours to days")):
        level.add_argument(f"--{name}", dest="level", action="store_const", const=name, help=text)
    parser.add_argument("--device", default="auto", help="auto or cpu: experiments run on the CPU only")
    parser.add_argument("--out", default=os.path.join(ROOT, "out", "reproduce"), help="folder of all results")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="runs at once (default: cores)")
    parser.add_argument("--bin", default=os.path.join(ROOT, "build", "release", "bin"),
                        help="folder of the programs")
    parser.add_argument("--systems", default=HERE, help=argparse.SUPPRESS)  # for tests
    parser.set_defaults(level="coarse")
    return parser.parse_args()


def load(folder, name):
    """The module FOLDER/NAME/system.py; None where it is not there."""
    path = os.path.join(folder, name, "system.py")
    if not os.path.exists(path):
        return None
    spec = importlib.util.spec_from_file_location(f"system_{name}", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def choose(arguments):
    """{name: module} of what is to be run, and the names that are not there."""
    if arguments.device not in ("auto", "cpu"):
        raise Refused(f"--device {arguments.device}: experiments run on the CPU only, expected auto or cpu")
    if arguments.jobs < 1:
        raise Refused(f"--jobs {arguments.jobs}: expected at least 1")
    known = (*SYSTEMS, "all") if arguments.systems == HERE else (*os.listdir(arguments.systems), "all")
    if arguments.system not in known:
        raise Refused(f"unknown system '{arguments.system}', expected one of {', '.join(known)}")
    names = [n for n in known if n != "all"] if arguments.system == "all" else [arguments.system]
    modules = {name: load(arguments.systems, name) for name in names}
    missing = [name for name, module in modules.items() if module is None]
    if len(missing) == len(names):
        raise Refused(f"{', '.join(missing)}: not there yet")
    return {name: module for name, module in modules.items() if module}, missing


def plans_of(module, level):
    folder = os.path.dirname(module.__file__)
    plans = [Plan(name, os.path.join(folder, file), sets) for name, file, sets in module.runs(level)]
    assert len({plan.name for plan in plans}) == len(plans), "names of runs must differ"
    return plans


def reproduce(name, module, arguments, processes):
    """Runs one system; returns whether every row holds."""
    folder = os.path.join(arguments.out, name)
    program = os.path.join(arguments.bin, "grouser-dem")
    results = Execution(folder, program, arguments.jobs, processes, say).run(
        plans_of(module, arguments.level))
    rows = module.rows(results, arguments.level)
    write_atomically(os.path.join(folder, "rows.json"), json.dumps(
        {"system": name, "level": arguments.level, "rows": [row.as_json() for row in rows]}, indent=1) + "\n")
    write_atomically(os.path.join(folder, "rows.md"), page.markdown(name, arguments.level, rows))
    command = ["./grouser", "reproduce", name, "--" + arguments.level]
    report = os.path.join(folder, "report.html")
    write_atomically(report, page.render(module, arguments.level, rows, results, command))
    for row in rows:
        word = {True: "holds", False: "FAILS", None: "printed"}[row.passed]
        print(f"{name}: {word:8} {row.row}: {page.show(row.got)} (expected {page.show(row.expected)}; "
              f"{row.limit}) {row.note}", flush=True)
    say(f"{name}: {report}")
    return all(row.passed is not False for row in rows) and all(r.done for r in results.values())


def work():
    """Whether all systems are there and every row holds."""
    arguments = parse_arguments()
    arguments.out = os.path.abspath(arguments.out)
    arguments.systems = os.path.abspath(arguments.systems)
    modules, missing = choose(arguments)
    lock = lock_of(arguments.out)
    for name in missing:
        say(f"{name}: not there yet")
    good = not missing
    for name, module in modules.items():
        logs = os.path.join(arguments.out, name, "logs")
        os.makedirs(logs, exist_ok=True)
        with Processes(logs, inherited=[lock.fileno()]) as processes:
            good &= reproduce(name, module, arguments, processes)
    return good


def main():
    raise_on_signals()
    return exit_code_of(work, Refused, say)


if __name__ == "__main__":
    sys.exit(main())
