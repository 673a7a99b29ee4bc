#!/usr/bin/python3
"""What the gate says of refits that are honest: committed runs against the same without a few of the training runs.

Usage: honest_refits.py --fit build/release/bin/grouser-fit [--runs FILE] [--sets "0;20;40;60;5,30,55"] [--out DIR]
Each fit takes 10 s on a quiet core. Prints a line a set: number and limit of each check, and the counts behind 'coverage'."""

import argparse
import json
import pathlib
import subprocess
import sys
import tempfile


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fit", required=True, help="grouser-fit")
    parser.add_argument("--runs", default="tests/data/dense_pair/runs.json", help="a campaign's summary")
    parser.add_argument("--sets", default="0;20;40;60;5,30,55",
                        help="places of the training runs that the base lacks; sets by ';'")
    parser.add_argument("--out", help="folder that keeps the models")
    asked = parser.parse_args()

    summary = json.loads(pathlib.Path(asked.runs).read_text())
    training = [run["run_id"] for run in summary["runs"]
                if run.get("role") == "RUN_ROLE_TRAIN" and run["status"] == "RUN_STATUS_STEADY"]
    sets = [[int(place) for place in one.split(",")] for one in asked.sets.split(";")]
    if any(not 0 <= place < len(training) for one in sets for place in one):
        sys.exit(f"--sets: expected places from 0 to {len(training) - 1}")
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(asked.out or temporary)
        folder.mkdir(parents=True, exist_ok=True)

        def fitted(name, without):
            runs, model = folder / f"{name}.json", folder / f"{name}.model"
            kept = [run for run in summary["runs"] if run["run_id"] not in without]
            runs.write_text(json.dumps({**summary, "runs": kept}))
            if not model.exists():
                subprocess.run([asked.fit, "fit", "--runs", runs, "--name", "honest", "--out", model],
                               check=True, stdout=subprocess.DEVNULL)
            return model

        candidate = fitted("candidate", set())
        for places in sets:
            name = "-".join(map(str, places))
            base = fitted(f"without-{name}", {training[place] for place in places})
            gate = subprocess.run([asked.fit, "gate", "--base", base, "--candidate", candidate, "--json"],
                                  capture_output=True, text=True)
            if gate.returncode not in (0, 3):
                sys.exit(gate.stderr)
            checks = json.loads(gate.stdout)
            print(f"without {name}:", "passes" if gate.returncode == 0 else "stopped", flush=True)
            for check in checks:
                said = check["detail"] if check["name"] == "coverage" else check["detail"].split(":")[0]
                print(f"  {check['name']:14} {said}")


if __name__ == "__main__":
    main()
