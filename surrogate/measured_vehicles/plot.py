#!/usr/bin/python3
"""Measured vehicles beside the solver: yaw rates, and power by terrain.

  ./grouser vehicle measured --ways --json > measured.json
  /usr/bin/python3 surrogate/measured_vehicles/plot.py measured.json docs/validation
"""

import json
import pathlib
import sys

import matplotlib

matplotlib.use("agg")
from matplotlib import pyplot, ticker  # noqa: E402

COLORS = {"ASPHALT": "#444444", "FLOORING": "#b8860b", "ICE": "#1f77b4", "SANDY_LOAM": "#8b4513",
          "SNOW": "#6a5acd"}
MARKS = {"straight": "o", "turn": "^", "pivot": "s"}


def yaw_panel(axes, name, fit, ground):
    held = [p for p in fit["points"] if not p["fitted"]]
    reach = 1.08 * max(abs(p["measured"]) for p in held)
    axes.plot([-reach, reach], [-reach, reach], color="0.6", linewidth=0.8, zorder=0)
    axes.errorbar([p["measured"] for p in held], [p["predicted"] for p in held],
                  [p["half_width"] for p in held], fmt=".", markersize=5, linewidth=0.5, color="#1f77b4")
    axes.set_title(f"{name}, {ground}: friction {fit['friction']:.2f}; windows held back\n"
                   f"rms {fit['rms']:.3f}; windows alike differ by {fit['repeat_rms']:.3f} rad/s", fontsize=8)
    axes.set_xlabel("measured yaw rate [rad/s]")
    axes.set_ylabel("predicted, 90 % interval [rad/s]")
    axes.set_xlim(-reach, reach)


def draw_yaw(data, path):
    figure, axes = pyplot.subplots(2, 2, figsize=(8.4, 7.6), layout="constrained")
    for row, (name, fits) in enumerate(data["yaw"].items()):
        for column, kind in enumerate(("hard", "soil")):
            yaw_panel(axes[row, column], name, fits[kind], fits[kind]["ground"])
    figure.savefig(path, dpi=80)


def draw_power(data, path):
    figure, (left, right) = pyplot.subplots(1, 2, figsize=(10, 4.8), layout="constrained")
    for p, ranged in zip(data["power"]["points"], data["power_all_soils"]["points"]):
        low, _, high = ranged["power_w"]
        middle = p["power_w"][1]
        if middle is None:
            left.plot([p["measured_power_w"]], [25], "x", color=COLORS[p["terrain"]])
            continue
        style = {"color": COLORS[p["terrain"]], "marker": MARKS[p["motion"]],
                 "markerfacecolor": "white" if p["fitted"] else COLORS[p["terrain"]]}
        left.errorbar([p["measured_power_w"]], [middle], [[middle - low], [high - middle]], markersize=5,
                      linewidth=0.7, **style)
    for name, color in COLORS.items():
        left.plot([], [], "o", color=color, label=name.lower().replace("_", " "))
    left.plot([20, 400], [20, 400], color="0.6", linewidth=0.8, zorder=0)
    left.fill_between([20, 400], [16, 320], [24, 480], color="0.9", zorder=-1, label="20 %")
    left.set_xscale("log")
    left.set_yscale("log")
    for axis in (left.xaxis, left.yaxis):
        axis.set_major_locator(ticker.FixedLocator([20, 50, 100, 200, 400]))
        axis.set_major_formatter(ticker.ScalarFormatter())
        axis.set_minor_locator(ticker.NullLocator())
    left.set_xlabel("measured power [W] (estimated from currents)")
    left.set_ylabel("predicted [W]; bars: all published soils of the name")
    left.set_title("straight o, turn ^, pivot square; open: fitted;\nx: snow, no answer (wheels sink in)",
                   fontsize=9)
    left.legend(fontsize=8)
    for comparison, mark, label in (("power", "o", "rims as recorded"), ("power_rescaled", "^", "times 1.27")):
        points = [p for p in data[comparison]["points"]
                  if p["measured_yaw_ratio"] is not None and p["motion"] != "straight"]
        right.scatter([p["measured_yaw_ratio"] for p in points], [p["yaw_ratio"][1] for p in points],
                      marker=mark, s=26, facecolors="none", label=label,
                      edgecolors=[COLORS[p["terrain"]] for p in points])
    right.plot([0.25, 0.75], [0.25, 0.75], color="0.6", linewidth=0.8, zorder=0)
    right.set_xlabel("measured yaw rate over that without slip")
    right.set_ylabel("predicted")
    right.legend(fontsize=8)
    figure.savefig(path, dpi=80)


def ways_panel(axes, ways, value, title, unit):
    for number, way in enumerate(ways, 1):
        y = value(way)
        if y is None:
            continue
        axes.plot([way["motion_us"]], [y], "o", color="#1f77b4")
        axes.annotate(str(number), (way["motion_us"], y), textcoords="offset points", xytext=(5, 4), fontsize=9)
    axes.set_xscale("log")
    axes.set_ylim(0, 1.1 * axes.get_ylim()[1])
    axes.set_title(title, fontsize=9)
    axes.set_xlabel("a motion [us]")
    axes.set_ylabel(unit)


def draw_ways(data, path):
    ways = data["ways"]
    figure, axes = pyplot.subplots(2, 2, figsize=(9, 6.6), layout="constrained")
    ways_panel(axes[0][0], ways, lambda w: w["robots"]["husky"]["yaw_rms_rad_per_s"], "Husky: yaw rate",
               "rms, rows held back [rad/s]")
    ways_panel(axes[0][1], ways, lambda w: w["robots"]["husky"]["speed_rms_m_per_s"], "Husky: forward speed",
               "rms, rows held back [m/s]")
    ways_panel(axes[1][0], ways, lambda w: w["robots"]["warthog"]["yaw_rms_rad_per_s"], "Warthog: yaw rate",
               "rms, rows held back [rad/s]")
    ways_panel(axes[1][1], ways, lambda w: w["power"]["SANDY_LOAM"]["rms_w"], "Husky: power on sandy loam",
               "rms [W]")
    figure.text(0.01, -0.01, "\n".join(f"{n}  {w['way']}" for n, w in enumerate(ways, 1)), fontsize=8, va="top")
    figure.savefig(path, dpi=80, bbox_inches="tight")


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    with open(sys.argv[1], encoding="utf-8") as file:
        data = json.load(file)
    folder = pathlib.Path(sys.argv[2])
    draw_yaw(data, folder / "vehicles-yaw.png")
    draw_power(data, folder / "vehicles-power.png")
    if data["ways"]:
        draw_ways(data, folder / "vehicles-ways.png")


main()
