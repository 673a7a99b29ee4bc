#!/usr/bin/python3
"""The README's blocks of "A vehicle: how fast, at what cost, and where", run as they stand there, in a
checkout that has nothing but its files and its programs: three newcomers, who ask for speed, energy and a map. What
each of them gets is held to bounds of physics that it would miss if it were wrong. Usage: readme_vehicle_test.py
ROOT BIN"""

import csv
import json
import math
import pathlib
import re
import sys
import tempfile

from as_typed import checkout, commands, number, option, run

SECTION = re.compile(r"^## A vehicle: .*?(?=^## )", re.M | re.S)


def check_speed(block, out, folder):
    """A plan that could be driven: below the limit and the safe speeds, from rest to rest, v_2^2 = v_1^2 + 2 a d, and
    in curves within the largest friction of asphalt that is published (0.9 g)."""
    with open(folder / "out/path.csv", newline="") as file:
        points = list(csv.DictReader(file))
    assert len(points) > 2
    rows = [line.split() for line in out.splitlines() if re.match(r" *[\d.]+ ", line)]
    assert len(rows) == len(points), out
    limit = option(block, "limit")
    way, safe, speed, rate = ([float(row[k]) for row in rows] for k in range(4))
    for i, point in enumerate(points):
        assert abs(way[i] - float(point["s_m"])) < 1e-3
        assert rows[i][4] == "yes", f"point {i} does not hold:\n{out}"
        assert 0.3 * limit < safe[i] <= limit, f"point {i}: safe speed {safe[i]}"
        assert 0 <= speed[i] <= safe[i] + 1e-3, f"point {i}: {speed[i]} above {safe[i]}"
        assert safe[i] ** 2 * abs(float(point["curvature_per_m"])) < 0.9 * 9.81
    assert speed[0] == speed[-1] == 0 and max(speed) > 0.3 * limit
    assert safe[1] < safe[-1], "uphill in a curve as fast as downhill"
    for i in range(len(rows) - 1):
        gained = speed[i + 1] ** 2 - speed[i] ** 2
        assert abs(gained - 2 * rate[i] * (way[i + 1] - way[i])) < 0.02, f"step {i} of\n{out}"


def check_energy(block, out, _):
    """Power that adds up; at least what rolls and scrubs, at most all of the weight dragged at friction 1 by motors of
    an efficiency of a fifth. Multipliers of a skid-steered robot: it turns less than without slip, and does turn."""
    weight, speed = 70 * 9.81, option(block, "speed")
    power = number(r"electric ([\d.]+) W", out)
    low, high = number(r"W \(90 %: ([\d.]+) to", out), number(r"W \(90 %: [\d.]+ to ([\d.]+)\)", out)
    assert 0 < low < power < high < 3 * low, out
    per_metre = number(r"([\d.]+) J/m", out)
    assert abs(per_metre * speed - power) < 2e-3 * power, out
    assert 0.02 * weight < per_metre < weight / 0.2, out
    parts = {name: number(rf"{name} +(-?[\d.]+) W", out)
             for name in ("drive losses", "rolling", "slip", "lateral scrub", "grade", "acceleration")}
    assert abs(sum(parts.values()) - power) < 0.01 * power, out
    assert all(parts[name] > 0 for name in ("drive losses", "rolling", "slip", "lateral scrub")), out
    assert parts["grade"] == parts["acceleration"] == 0, out
    multipliers = [float(x) for x in re.findall(r"wheel_separation_multiplier: ([\d.]+)", out)]
    assert len(multipliers) >= 2 and all(1.05 < x < 5 for x in multipliers), out
    radii = [float(x) for x in re.findall(r"left_wheel_radius_multiplier: ([\d.]+)", out)]
    assert len(radii) == len(multipliers) and all(0.8 < x < 1.2 for x in radii), out
    pulls = [float(x) for x in re.findall(r"pull_over_weight: ([\d.]+)", out)]
    assert all(0.05 < x < 1 for x in pulls), out


def check_map(block, out, folder):
    """Some of the terrain is driven and some is not; both routes lead from one place to the other by steps to
    neighbouring cells, none faster than the limit, the fastest in the least time and the other by the least energy."""
    folder = folder / "out"
    made = json.loads((folder / "map/map.json").read_text())
    cells = made["cells"]
    assert made["grid"]["columns"] > 100 and cells["all"] == made["grid"]["columns"] * made["grid"]["rows"]
    assert 0 < cells["holes"] < 0.2 * cells["all"]
    assert 0.2 * cells["all"] < cells["driven_on_all_headings"] < cells["all"] - cells["holes"]
    assert 0 < cells["driven_on_none"] < 0.5 * cells["all"]
    for name in ("map/speed.tif", "map/energy.tif", "map/binding.tif", "map/speed.png", "routes/routes.png"):
        assert (folder / name).stat().st_size > 1000, name
    ends = [float(x) for x in re.search(r"map_route out/map ((?:[\d.]+ ){4})", block)[1].split()]
    width = abs(made["grid"]["geotransform"][1])
    routes = {}
    with open(folder / "routes/routes.csv", newline="") as file:
        for row in csv.DictReader(file):
            routes.setdefault(row["route"], []).append([float(row[k]) for k in ("x_m", "y_m", "time_s", "energy_j")])
    assert set(routes) == {"fastest", "least_energy"}, out
    for name, route in routes.items():
        for end, at in ((route[0], ends[:2]), (route[-1], ends[2:])):
            assert math.dist(end[:2], at) < width, f"{name} ends at {end[:2]}, expected {at}"
        length = sum(math.dist(a[:2], b[:2]) for a, b in zip(route, route[1:]))
        assert all(math.dist(a[:2], b[:2]) < 1.5 * width for a, b in zip(route, route[1:])), name
        assert math.dist(ends[:2], ends[2:]) - 2 * width < length < 3 * math.dist(ends[:2], ends[2:]), name
        assert route[-1][2] >= length / option(block, "limit"), f"{name}: {route[-1][2]} s for {length} m"
        assert 0.02 * 70 * 9.81 < route[-1][3] / length < 5 * 70 * 9.81, f"{name}: {route[-1][3]} J for {length} m"
    assert routes["fastest"][-1][2] <= routes["least_energy"][-1][2]
    assert routes["least_energy"][-1][3] <= routes["fastest"][-1][3]


def main(root, programs):
    section = SECTION.search((root / "README.md").read_text())
    assert section, "README.md has no section '## A vehicle: ...'"
    blocks = commands(section[0])
    tasks = {"./grouser speed ": check_speed, "./grouser energy ": check_energy, "./grouser map ": check_map}
    assert len(blocks) == len(tasks), f"{len(blocks)} blocks, expected {len(tasks)}"
    for block, (command, check) in zip(blocks, tasks.items()):
        with tempfile.TemporaryDirectory() as name:  # each begins with a checkout of his own
            folder = pathlib.Path(name)
            checkout(root, programs, folder)
            assert command in block, f"no {command}in\n{block}"
            check(block, run(block, folder), folder)


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve())
