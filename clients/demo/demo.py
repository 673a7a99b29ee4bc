#!/usr/bin/python3
"""The road end to end: campaign, fit, server, queries, one refinement, report.

All files go to out/demo (--out): campaign/ and its runs, model/, state/, logs/,
data.json and report.html. A campaign that was interrupted is resumed. Ctrl-C
ends every process. Exit code: 0 all stages passed, 1 one failed (by name on
stderr), 2 bad usage, 130 Ctrl-C.

Examples:
  ./grouser demo
  ./grouser demo --out /tmp/grouser-demo --jobs 4
"""

import argparse
import fcntl
import os
import shutil
import sys
import time

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "clients", "common"))

from demo_context import Demo, StageFailed  # noqa: E402  (needs the path)
from processes import Interrupted, Processes, ProgramFailed, raise_on_signals  # noqa: E402
from stages import STAGES  # noqa: E402


def say(text):
    print(text, file=sys.stderr, flush=True)


def parse_arguments():
    parser = argparse.ArgumentParser(prog="./grouser demo", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", default=os.path.join(ROOT, "out", "demo"), help="folder of all results")
    parser.add_argument("--bin", default=os.path.join(ROOT, "build", "release", "bin"),
                        help="folder of the programs")
    parser.add_argument("--campaign", help="campaign file (default: the shipped demo)",
                        default=os.path.join(ROOT, "dem_offline", "campaigns", "demo.campaign.yaml"))
    parser.add_argument("--measured", help="measured wheel (default: the shipped table)",
                        default=os.path.join(ROOT, "dem_offline", "campaigns", "measured",
                                             "cmu_smooth_wheel.csv"))
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="DEM runs at once")
    return parser.parse_args()


def prepare_folder(out):
    """Makes the folder, refuses a second demo in it, clears what is remade."""
    os.makedirs(os.path.join(out, "logs"), exist_ok=True)
    lock = open(os.path.join(out, ".lock"), "w")
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise StageFailed(f"another demo is running in {out}") from None
    for name in ("state", "logs"):
        shutil.rmtree(os.path.join(out, name), ignore_errors=True)
    for name in ("data.json", "report.html"):
        if os.path.exists(os.path.join(out, name)):
            os.unlink(os.path.join(out, name))
    os.makedirs(os.path.join(out, "logs"))
    return lock


def run_stages(demo):
    times = demo.data["stages"] = []
    for index, (name, stage) in enumerate(STAGES, 1):
        say(f"demo: [{index}/{len(STAGES)}] {name}")
        started = time.monotonic()
        try:
            stage(demo)
        except Exception as error:  # every failure gets its stage's name
            raise StageFailed(f"stage {name}: {error}") from error
        times.append({"name": name, "seconds": time.monotonic() - started})
        say(f"demo: [{index}/{len(STAGES)}] {name}: {times[-1]['seconds']:.1f} s")
    return sum(entry["seconds"] for entry in times)


def main():
    arguments = parse_arguments()
    arguments.out = os.path.abspath(arguments.out)
    raise_on_signals()
    processes = Processes(os.path.join(arguments.out, "logs"))
    code = 0
    try:
        lock = prepare_folder(arguments.out)
        demo = Demo(arguments, processes)
        total = run_stages(demo)
        say(f"demo: all stages passed in {total / 60:.1f} minutes: {demo.path('report.html')}")
        lock.close()
    except Interrupted as signal_:
        say(f"demo: ended by {signal_}")
        code = 128 + signal_.number
    except (StageFailed, ProgramFailed, OSError) as error:
        say(f"demo: FAILED: {error}")
        code = 1
    finally:
        processes.stop_all()
    return code


if __name__ == "__main__":
    sys.exit(main())
