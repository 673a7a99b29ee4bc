#!/usr/bin/python3
"""docs/tutorial.md as somebody new types it, in a checkout that has nothing but its files and its programs: the known
soil, the measured soil, and of the DEM road all but its hours, for which runs of such a wheel and soil stand in that
were made before. Answers are held to what they must have whatever is fitted. Usage: tutorial_test.py ROOT BIN"""

import csv
import json
import math
import pathlib
import re
import sys
import tempfile

from as_typed import FENCED, checkout, commands, number, option, run

RUNS = "surrogate/pairs/cmu-smooth-62.5-8mm/runs.json"
KEPT = {"RUN_ROLE_TRAIN": 24, "RUN_ROLE_TEST": 8, "RUN_ROLE_PATCH": 4}


def section(text, heading):
    found = re.search(rf"^## {heading}\n(.*?)(?=^## |\Z)", text, re.M | re.S)
    assert found, f"no section {heading}"
    return commands(found[1])


def write_files(text, folder):
    """Each file that is spelled out, by the last name before it that has its ending."""
    for block in FENCED.finditer(text):
        if block[1] not in ("yaml", "csv"):
            continue
        name = re.findall(rf"`([\w-]+\.{block[1]})`", text[:block.start()])[-1]
        (folder / name).write_text(block[2])


def answer(shown):
    """What `model eval` prints: flags, and value, low and high of each output."""
    rows = dict(re.findall(r"^(f_x|f_y|f_z|torque|m_z|sinkage) +(.*) N?m?(?: m)?$", shown, re.M))
    assert len(rows) == 6, shown
    flags = re.search(r"^flags: (.*)$", shown, re.M)
    return flags[1].split() if flags else [], {name: [float(x) for x in row.split()[:3]] for name, row in rows.items()}


def check_driven(shown, load):
    """At slip 0.2: the motor drives the wheel, which sinks in by less than its radius and carries its load."""
    radius = number(r"radius ([\d.]+) m", shown)
    outputs = answer(shown)[1]
    assert all(low < value < high for value, low, high in outputs.values()), shown
    assert abs(outputs["f_z"][0] - load) < 1e-3 * load and abs(outputs["f_x"][0]) < load, shown
    assert 0 < outputs["torque"][0] < load * radius, shown
    assert 0 < outputs["sinkage"][0] < radius, shown
    return outputs


def check_known_soil(blocks, folder):
    assert len(blocks) == 1, blocks
    shown = run(blocks[0], folder)
    assert "my-wheel-loam@sha256:" in shown, shown
    assert answer(shown)[0] == ["FORM_UNKNOWN", "UNTUNED"], shown  # and within the loads of the model
    check_driven(shown, option(blocks[0], "load"))


def check_measured_soil(blocks, folder):
    """The exponent is the slope of the readings in logarithms."""
    assert len(blocks) == 1, blocks
    shown = run(blocks[0], folder)
    assert "my-wheel-sand@sha256:" in shown, shown
    assert answer(shown)[0] == ["FORM_UNKNOWN", "UNTUNED"], shown
    check_driven(shown, option(blocks[0], "load"))
    with open(folder / "my-plate.csv", newline="") as file:
        points = [(math.log(float(row["sinkage_mm"])), math.log(float(row["force_N"]))) for row in csv.DictReader(file)]
    x, y = (sum(p[k] for p in points) / len(points) for k in (0, 1))
    slope = sum((p[0] - x) * (p[1] - y) for p in points) / sum((p[0] - x) ** 2 for p in points)
    table = [line for line in (folder / "out/my-sand/soil.csv").read_text().splitlines() if line[:1] != "#"]
    (soil,) = csv.DictReader(table)
    assert soil["soil"] == "my sand" and abs(float(soil["n"]) - slope) < 0.1, (soil, slope)
    assert (folder / "out/my-sand/report.html").stat().st_size > 1000


def write_runs(root, path):
    """In place of the campaign's folder the summary of another one of this wheel, as large as a small campaign."""
    summary, left = json.loads((root / RUNS).read_text()), dict(KEPT)
    kept = []
    for one in summary["runs"]:
        left[one["role"]] -= 1
        if left[one["role"]] >= 0:
            kept.append(one)
    path.write_text(json.dumps({**summary, "runs": kept}))


def check_dem(blocks, folder, root):
    """The commands of campaign design and run get as far as their files; a model of runs, and one with the measured
    rows, answer at the state of the query."""
    design, runs, fit, measured = blocks
    out = folder / "out/my-campaign"
    out.mkdir(parents=True)
    (out / "my-wheel.scene.yaml").touch()
    assert "my-wheel.scene.yaml: stands there" in run(design, folder, code=2)
    assert "my-campaign/my-wheel.campaign.yaml: " in run(runs, folder, code=2)
    write_runs(root, out / "runs")
    shown = run(fit, folder)
    assert f"{KEPT['RUN_ROLE_TRAIN']} training" in shown and f"{KEPT['RUN_ROLE_TEST']} held out" in shown, shown
    flags, _ = answer(shown)
    outputs = check_driven(shown, option(fit, "load"))
    assert flags == ["FORM_UNKNOWN"] and outputs["f_y"][2] < 0, shown  # pushed to the left, held by the soil
    assert (out / "curves.png").stat().st_size > 1000
    assert re.search(r"^straight +f_x +\d+ +[\d.]+", run(measured, folder), re.M)


def check_names(block, folder):
    """What is served has the names that are asked for."""
    shipped = re.search(r"--shipped (\S+) &", block)[1]
    asked = set(re.findall(r"--model (\S+)", block))
    there = {path.stem for path in (folder / shipped).glob("*.model")}
    assert asked and asked <= there, f"{asked} asked for, {there} in {shipped}"
    for name in there:
        assert f"{name}@sha256:" in run(f"./grouser model show {shipped}/{name}.model", folder)


def main(root, programs):
    text = (root / "docs/tutorial.md").read_text()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        checkout(root, programs, folder)
        write_files(text, folder)
        check_known_soil(section(text, "A known soil"), folder)
        check_measured_soil(section(text, "A soil that you measured"), folder)
        check_dem(section(text, "DEM"), folder, root)
        check_names(section(text, "Serve and query")[0], folder)


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve())
