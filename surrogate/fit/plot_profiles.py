#!/usr/bin/python3
"""Stresses on the rim, DEM beside physics with and without them in the fit.

  grouser-fit profiles --runs RUNS --model with.model --json > with.json
  grouser-fit profiles --runs RUNS --model without.model --json > without.json
  /usr/bin/python3 surrogate/fit/plot_profiles.py with.json without.json docs/stress-profiles.svg
"""

import json
import sys

import matplotlib

matplotlib.use("svg")
matplotlib.rcParams["svg.hashsalt"] = "grouser"  # the same file for the same numbers
from matplotlib import pyplot  # noqa: E402

# slip, attack angle [deg]: the test states next to these are drawn
WANTED = [(0.8, 35), (0.6, 45), (0.3, 55), (-0.35, 0), (-0.55, 25), (-0.9, 15)]
LOW, HIGH = -50, 90  # degrees


def nearest(runs, slip, angle):
    return min(runs, key=lambda r: (r["slip"] - slip) ** 2 +
               ((r["attack_angle_deg"] - angle) / 45) ** 2)


def panel(axes, run, fits):
    shown = [i for i, angle in enumerate(run["angle_deg"]) if LOW - 5 < angle < HIGH + 5]
    for kind, style in (("normal", "-"), ("tangential", "--")):
        def draw(values, color, label, width, style=style):
            axes.plot([run["angle_deg"][i] for i in shown], [values[i] / 1e3 for i in shown], style,
                      color=color, linewidth=width, label=label if style == "-" else None)
        draw(run[f"measured_{kind}_pa"], "0.2", "DEM", 1.6)
        for fit, color, label in fits:
            draw(fit[f"model_{kind}_pa"], color, label, 1.2)
    axes.set_title(f"slip {run['slip']:.2f}, {run['attack_angle_deg']:.0f} deg, "
                   f"{run['load_n']:.0f} N", fontsize=9)
    axes.set_xlim(LOW, HIGH)
    axes.axhline(0, color="0.8", linewidth=0.6, zorder=0)


def main():
    with_profiles, without = (json.load(open(path))["runs"] for path in sys.argv[1:3])
    figure, grid = pyplot.subplots(2, 3, figsize=(10, 5.6), sharex=True)
    twins = {run["run_id"]: run for run in without}
    for axes, wanted in zip(grid.flat, WANTED):
        run = nearest(with_profiles, *wanted)
        panel(axes, run, [(run, "C0", "fit with profiles"),
                          (twins[run["run_id"]], "C3", "fit to totals alone")])
    grid[0][2].legend(fontsize=7, loc="upper left")
    for axes in grid[1]:
        axes.set_xlabel("angle from straight down, forward positive [deg]", fontsize=8)
    for row in grid:
        row[0].set_ylabel("stress [kPa]: normal -, shear --", fontsize=8)
    figure.tight_layout()
    figure.savefig(sys.argv[3], metadata={"Date": None})


main()
