#!/usr/bin/python3
"""surrogate/fit/explain.py: a picture of real explanations, with what they say as text in it; clear
refusals. Usage: explain_picture_test.py ROOT FOLDER-OF-PROGRAMS"""

import json
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT, BIN = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
EXPLAIN = [sys.executable, str(ROOT / "surrogate" / "fit" / "explain.py")]
CMU = str(ROOT / "surrogate" / "pairs" / "cmu-smooth-62.5-8mm" / "hybrid.model")
SHIPPED = str(ROOT / "surrogate" / "shipped" / "cmu-smooth-62.5.model")


def run(*arguments):
    return subprocess.run([*EXPLAIN, *arguments], capture_output=True, text=True, check=False)


def texts(path):
    """The texts of a picture: Matplotlib draws letters as paths and leaves what they say as a comment."""
    return "\n".join(re.findall(r"<!-- (.*?) -->", path.read_text(), re.S))


def expect(condition, what):
    if not condition:
        sys.exit(f"failed: {what}")


def check_picture(folder):
    picture = folder / "why.svg"
    state = ["--slip", "0.95", "--angle-deg", "10", "--load", "40", "--json"]
    done = run("--plot", str(picture), "--", str(BIN / "grouser-fit"), "explain", CMU, *state)
    expect(done.returncode == 0, done.stderr)
    told = json.loads(done.stdout)
    shown = texts(picture)
    expect(told["model"] in shown, "the model's digest")
    for run_beside in told["nearest"]:
        name = f"{run_beside['run']['run_id'][:6]}: {run_beside['distance']:.2f}"
        expect(name in shown, f"run and distance {name}")
    expect("EXTRAPOLATED: load 40 N is above" in shown, "flags with their reasons")
    expect("physics, at the state" in shown and "shear dashed" in shown, "stresses")
    return folder / "told.json", done.stdout


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        saved, text = check_picture(folder)
        saved.write_text(text)
        old = folder / "old.svg"  # of a file that holds no stresses, and text on stdout
        done = run("--plot", str(old), "--", str(BIN / "grouser-fit"), "explain", SHIPPED, "--vx", "0.1", "--vy",
                   "0.02", "--rim", "0.1", "--load", "20")
        expect(done.returncode == 0 and "nearest that were fitted" in done.stdout, done.stderr)
        expect("this model file holds no stresses of its runs" in texts(old), "what is missing is said")
        expect(run("--plot", str(folder / "why.bmp"), "--from", str(saved)).returncode == 2, "another suffix")
        (folder / "other.json").write_text('{"responses": {}}')
        done = run("--plot", str(old), "--from", str(folder / "other.json"))
        expect(done.returncode == 2 and "--explain" in done.stderr, "no explanation")
        (folder / "broken.json").write_text('{"reasons": [')
        expect(run("--plot", str(old), "--from", str(folder / "broken.json")).returncode == 1, "broken JSON")
        done = run("--plot", str(old), "--", str(BIN / "grouser-fit"), "explain", CMU, "--load", "20")
        expect(done.returncode == 2 and "--slip" in done.stderr, "the program's own refusal")
    print("ok")


main()
