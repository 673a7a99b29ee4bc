#!/usr/bin/python3
"""Draws the routes of map_route over its hillshade: OUT/routes.png.
Usage: map_route.py MAP OUT"""

import csv
import json
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

COLOURS = {"fastest": "#d62728", "least_energy": "#1f77b4"}


def main(arguments):
    if len(arguments) != 2:
        print(__doc__, file=sys.stderr)
        return 2
    out = pathlib.Path(arguments[1])
    grid = json.loads((pathlib.Path(arguments[0]) / "map.json").read_text())["grid"]
    x, width, _, y, _, height = grid["geotransform"]
    routes = {}
    with open(out / "routes.csv", newline="") as file:
        for row in csv.DictReader(file):
            routes.setdefault(row["route"], []).append([float(row[k]) for k in ("x_m", "y_m", "time_s", "energy_j")])
    figure, axis = plt.subplots(figsize=(7, 6.4), constrained_layout=True)
    axis.imshow(plt.imread(out / "backdrop.png"), extent=(0, grid["columns"] * width, grid["rows"] * height, 0),
                interpolation="nearest")
    for name, points in routes.items():
        _, _, time, energy = points[-1]
        axis.plot([p[0] - x for p in points], [p[1] - y for p in points], color=COLOURS[name], linewidth=2,
                  label=f"{name.replace('_', ' ')}: {time:.0f} s, {energy / 1000:.1f} kJ")
    axis.set_xlabel(f"m east of {x:.0f}")
    axis.set_ylabel(f"m north of {y:.0f}")
    axis.set_title("red: driven on no heading")
    axis.legend(loc="lower right")
    figure.savefig(out / "routes.png", dpi=90)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
