#!/usr/bin/python3
"""`grouser-fit eval` of several states at once, ./grouser model plot and ./grouser vehicle plot: pictures with what
they show as text in them; clear refusals. Usage: plots_test.py ROOT FOLDER-OF-PROGRAMS"""

import json
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT, BIN = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
FIT = str(BIN / "grouser-fit")
PAIR = ROOT / "surrogate" / "pairs" / "cmu-smooth-62.5-8mm"
MODEL = str(PAIR / "hybrid.model")


def run(*arguments):
    return subprocess.run(arguments, capture_output=True, text=True, check=False)


def plot(*arguments):
    return run(sys.executable, str(ROOT / "surrogate" / "fit" / "plot_model.py"), "--program", FIT, *arguments)


def expect(condition, what):
    if not condition:
        sys.exit(f"failed: {what}")


def check_eval():
    """A line a state, each the bits of the state alone."""
    lists = run(FIT, "eval", "--slip=-0.2,0.3", "--angle-deg=0,30", "--load=20,24.5", MODEL, "--json")
    expect(lists.returncode == 0, lists.stderr)
    lines = lists.stdout.splitlines()
    alone = [run(FIT, "eval", MODEL, "--slip", slip, "--angle-deg", angle, "--load", load, "--json").stdout.strip()
             for load in ("20", "24.5") for angle in ("0", "30") for slip in ("-0.2", "0.3")]
    expect(lines == alone, f"{len(lines)} lines, expected those of the eight states alone")
    expect(run(FIT, "eval", MODEL, "--slip=0.1", "--load=-1").returncode == 2, "a negative load")
    many = run(FIT, "eval", MODEL, "--slip=" + ",".join(["0.1"] * 400), "--load=" + ",".join(["20"] * 400))
    expect(many.returncode == 2 and "160000 states" in many.stderr, many.stderr)


def check_pictures(folder):
    picture = folder / "new" / "curves.svg"
    done = plot(MODEL, str(PAIR / "lookup.model"), "--out", str(picture), "--angle-deg", "0,30", "--load", "23",
                "--measured", str(PAIR / "measured.csv"))
    expect(done.returncode == 0, done.stderr)
    shown = "\n".join(re.findall(r"<!-- (.*?) -->", picture.read_text(), re.S))
    name = json.loads(run(FIT, "show", MODEL, "--json").stdout)["model"]["name"]
    for text in (f"{name} hybrid, 30 deg", f"{name}-lookup, 0 deg", "load 23 N", "sinkage [mm]"):
        expect(text in shown, f"{text!r} in the picture")
    rows = [line.split(",") for line in (PAIR / "measured.csv").read_text().splitlines() if line[:1] in "-0123456789"]
    near = sum(float(r[1]) in (0, 30) and abs(float(r[2]) / 23 - 1) <= 0.1 for r in rows)
    expect(0 < near < len(rows) and f"points: measured, {near} of {len(rows)} rows" in shown, f"{near} points")


def check_refusals(folder):
    for what, arguments in {
        "expected a name that ends with": (MODEL, "--out", str(folder / "curves.jpg")),
        "expected 3 at most": (MODEL,) * 4 + ("--out", str(folder / "a.svg")),
        "not a Grouser model file": (str(PAIR / "measured.csv"), "--out", str(folder / "a.svg")),
        "measured.csv: File exists": (MODEL, "--out", str(PAIR / "measured.csv" / "a.svg")),
    }.items():
        done = plot(*arguments)
        expect(done.returncode in (1, 2) and what in done.stderr and "Traceback" not in done.stderr,
               f"{what}: {done.returncode} {done.stderr}")
    expect(not list(folder.glob("a.*")), "no picture of what is refused")


def check_vehicle(folder):
    husky = ROOT / "surrogate" / "vehicle" / "shipped" / "husky.vehicle.yaml"
    program = [sys.executable, str(ROOT / "clients" / "vehicle" / "plot_vehicle.py"), "--program",
               str(BIN / "grouser-vehicle"), str(husky), "--out"]
    picture = folder / "energy.svg"
    done = run(*program, str(picture))
    expect(done.returncode == 0, done.stderr)
    shown = "\n".join(re.findall(r"<!-- (.*?) -->", picture.read_text(), re.S))
    for text in ("asphalt", "ice", "turning in place [W]", "where it goes, straight on asphalt [J/m]"):
        expect(text in shown, f"{text!r} in the picture")
    for more, what in {("--soil", "mud"): "--soil mud: expected one of asphalt",
                       ("--speed", "0"): "got 0, expected a"}.items():
        done = run(*program, str(folder / "a.svg"), *more)
        expect(done.returncode == 2 and what in done.stderr and "Traceback" not in done.stderr, done.stderr)


with tempfile.TemporaryDirectory() as name:
    check_eval()
    check_vehicle(pathlib.Path(name))
    check_pictures(pathlib.Path(name))
    check_refusals(pathlib.Path(name))
