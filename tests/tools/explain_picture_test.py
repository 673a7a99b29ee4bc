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
EARLIER = str(ROOT / "tests" / "data" / "small_model" / "cmu-smooth-62.5.model")


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


def check_refusals(folder, text):
    told = json.loads(text)
    wrong = {"broken": b'{"reasons": [', "empty": b"", "list": b"[]", "number": b"3", "latin": b'{"model": "\xff"}',
             "deep": b"[" * 200000, "types": json.dumps(told | {"reasons": 3}).encode(),
             "digits": json.dumps(told | {"slip": "much"}).encode(),
             "huge": json.dumps(told | {"load_n": 10**400}).encode()}
    for name, content in wrong.items():
        file = folder / f"{name}.json"
        file.write_bytes(content)
        done = run("--plot", str(folder / "none.svg"), "--from", str(file))
        expect(done.returncode == 2 and f"{file}: no explanation" in done.stderr and "Traceback" not in done.stderr,
               f"{name}: {done.returncode} {done.stderr}")
    expect(not (folder / "none.svg").exists(), "no picture of what is refused")
    for output in told["outputs"]:
        output["sd_patch"] = 1e200  # whose square no double holds
    (folder / "wide.json").write_text(json.dumps(told))
    done = run("--plot", str(folder / "wide.svg"), "--from", str(folder / "wide.json"))
    expect(done.returncode == 0, done.stderr)


def check_second_call(folder, text):
    """A program whose --json fails where its text did not."""
    program = folder / "program"
    program.write_text('#!/bin/sh\nif [ "$1" = --json ]; then echo gone away >&2; exit 4; fi\necho the text\n')
    program.chmod(0o755)
    done = run("--plot", str(folder / "none.svg"), "--", str(program))
    expect((done.returncode, done.stdout) == (4, "the text\n") and "gone away" in done.stderr, "why it failed")


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        saved, text = check_picture(folder)
        saved.write_text(text)
        old = folder / "old.svg"  # of a file that holds no stresses, and text on stdout
        done = run("--plot", str(old), "--", str(BIN / "grouser-fit"), "explain", EARLIER, "--vx", "0.1", "--vy",
                   "0.02", "--rim", "0.1", "--load", "20")
        expect(done.returncode == 0 and "nearest that were fitted" in done.stdout, done.stderr)
        expect("this model file holds no stresses of its runs" in texts(old), "what is missing is said")
        expect(run("--plot", str(folder / "why.bmp"), "--from", str(saved)).returncode == 2, "another suffix")
        (folder / "other.json").write_text('{"responses": {}}')
        done = run("--plot", str(old), "--from", str(folder / "other.json"))
        expect(done.returncode == 2 and "--explain" in done.stderr, "no explanation")
        check_refusals(folder, text)
        check_second_call(folder, text)
        done = run("--plot", str(old), "--", str(BIN / "grouser-fit"), "explain", CMU, "--load", "20")
        expect(done.returncode == 2 and "--slip" in done.stderr, "the program's own refusal")
    print("ok")


main()
