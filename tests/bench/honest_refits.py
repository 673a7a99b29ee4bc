#!/usr/bin/python3
"""What the gate says of refits that are honest: committed runs against the same without a few of the training runs.

Usage: honest_refits.py --fit build/release/bin/grouser-fit [--runs FILE] [--sets "0;20;40;60;5,30,55"] [--out DIR] [--spoil 2]
Each fit takes 10 s on a quiet core. Prints a line a set: number and limit of each check, and what stands behind
'coverage', 'interval_width' and 'domain_change'. With --spoil FACTOR the candidates are dishonest: forces and sinkage of
the runs that the base lacks are that many times what DEM found, and each is fitted anew."""

import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

F_Z = 2  # place among the six outputs; it is the load


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fit", required=True, help="grouser-fit")
    parser.add_argument("--runs", default="tests/data/dense_pair/runs.json", help="a campaign's summary")
    parser.add_argument("--sets", default="0;20;40;60;5,30,55",
                        help="places of the training runs that the base lacks; sets by ';'")
    parser.add_argument("--spoil", type=float, help="factor of the new runs' means")
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

        def fitted(name, without, spoiled=frozenset()):
            runs, model = folder / f"{name}.json", folder / f"{name}.model"
            kept = [run if run["run_id"] not in spoiled else {**run, "mean": [
                        mean if output == F_Z else asked.spoil * mean for output, mean in enumerate(run["mean"])]}
                    for run in summary["runs"] if run["run_id"] not in without]
            runs.write_text(json.dumps({**summary, "runs": kept}))
            if not model.exists():
                subprocess.run([asked.fit, "fit", "--runs", runs, "--name", "honest", "--out", model],
                               check=True, stdout=subprocess.DEVNULL)
            return model

        for places in sets:
            name = "-".join(map(str, places))
            added = {training[place] for place in places}
            base = fitted(f"without-{name}", added)
            candidate = (fitted("candidate", set()) if asked.spoil is None else
                         fitted(f"spoiled-{asked.spoil:g}-{name}", set(), added))
            gate = subprocess.run([asked.fit, "gate", "--base", base, "--candidate", candidate, "--json"],
                                  capture_output=True, text=True)
            if gate.returncode not in (0, 3):
                sys.exit(gate.stderr)
            checks = json.loads(gate.stdout)
            print("without" if asked.spoil is None else f"spoiled by {asked.spoil:g}:", f"{name}:",
                  "passes" if gate.returncode == 0 else "stopped", flush=True)
            for check in checks:
                whole = check["name"] in ("coverage", "interval_width", "domain_change")
                said = check["detail"] if whole else check["detail"].split(":")[0]
                print(f"  {check['name']:14} {said}")


if __name__ == "__main__":
    main()
