#!/usr/bin/python3
"""What driving takes: electric energy of a vehicle over speed, radius and yaw rate, on each of its soils.

  plot_vehicle.py --program GROUSER-VEHICLE --out FILE.png|.svg|.pdf VEHICLE [--soil SOIL ...]

Bands: 90 % intervals of the ground. Dotted: some limit of the vehicle does not hold, or the soil's model was not
trained there. A line ends where the ground gives no balance.
"""

import argparse
import csv
import io
import json
import math
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "common"))
import html_page  # noqa: E402
from picture_options import Refused, check_picture, end_with, positive, save  # noqa: E402

POINTS = 24
PARTS = (("drive_w", "drive losses"), ("rolling_w", "rolling"), ("slip_w", "slip"), ("scrub_w", "lateral scrub"))


def number(value):
    return math.nan if value is None else float(value)


def spaced(low, high):
    return [low * (high / low) ** (i / (POINTS - 1)) for i in range(POINTS)]


def sweeps_of(options):
    """{name: (places on the axis, [(speed, yaw rate)])}"""
    speeds = [options.most_speed * (i + 1) / POINTS for i in range(POINTS)]
    radii = spaced(options.least_radius, 20 * options.least_radius)
    rates = [options.most_yaw_rate * (i + 1) / POINTS for i in range(POINTS)]
    return {"speed": (speeds, [(v, 0) for v in speeds]),
            "radius": (radii, [(options.speed, options.speed / r) for r in radii]),
            "turn": (rates, [(0, w) for w in rates])}


def answers(options, soils, motions):
    """{soil: [row of JSON]} of all motions, in one call."""
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(("speed_m_per_s", "yaw_rate_rad_per_s", "soil"))
    for soil in soils:
        writer.writerows((f"{v!r}", f"{w!r}", soil) for v, w in motions)
    with tempfile.NamedTemporaryFile("w", suffix=".csv") as file:
        file.write(text.getvalue())
        file.flush()
        done = subprocess.run([options.program, "energy", str(options.vehicle), "--drive", file.name, "--json"],
                              stdout=subprocess.PIPE, text=True, check=False)
    if not done.stdout:
        raise Refused
    rows = json.loads(done.stdout)["rows"]
    return {soil: rows[i * len(motions):(i + 1) * len(motions)] for i, soil in enumerate(soils)}


def line(axes, places, rows, keys, color, label):
    value, low, high = ([number(row[k]) if row["balanced"] else math.nan for row in rows] for k in keys)
    axes.fill_between(places, low, high, color=color, alpha=0.15, linewidth=0)
    axes.plot(places, value, ":", color=color, linewidth=1)
    within = [v if not row["reasons"] else math.nan for v, row in zip(value, rows)]
    axes.plot(places, within, color=color, linewidth=1.5, label=label)


def parts_panel(axes, speeds, rows, soil):
    below = [0.0] * len(rows)
    for i, (key, label) in enumerate(PARTS):
        share = [number(r[key]) / v if r["balanced"] else math.nan for r, v in zip(rows, speeds)]
        above = [b + max(s, 0) for b, s in zip(below, share)]
        axes.fill_between(speeds, below, above, color=f"C{i + 4}", alpha=0.6, linewidth=0, label=label)
        below = above
    axes.set_title(f"where it goes, straight on {soil} [J/m]", fontsize=9)
    axes.legend(fontsize=7, loc="upper right")
    axes.set_xlabel("speed [m/s]", fontsize=8)


def picture(options, soils, sweeps, found):
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    pyplot.rcParams.update(html_page.STYLE)
    figure, panels = pyplot.subplots(2, 2, figsize=(10, 7), layout="constrained")
    metre = ("joules_per_metre", "joules_per_metre_low", "joules_per_metre_high")
    watts = ("electric_w", "electric_low_w", "electric_high_w")
    titles = {"speed": ("straight [J/m]", "speed [m/s]", metre),
              "radius": (f"on a circle at {options.speed:g} m/s [J/m]", "radius [m]", metre),
              "turn": ("turning in place [W]", "yaw rate [rad/s]", watts)}
    for axes, name in zip((panels[0][0], panels[1][0], panels[1][1]), sweeps):
        title, label, keys = titles[name]
        for i, soil in enumerate(soils):
            line(axes, sweeps[name][0], found[name][soil], keys, f"C{i}", soil)
        axes.set_title(title, fontsize=9)
        axes.set_xlabel(label, fontsize=8)
        axes.set_ylim(bottom=0)
        if not any(row["balanced"] for soil in soils for row in found[name][soil]):
            axes.text(0.5, 0.5, "nothing balances", ha="center", transform=axes.transAxes, color="0.4")
    panels[1][0].set_xscale("log")
    panels[0][0].legend(fontsize=8)
    parts_panel(panels[0][1], sweeps["speed"][0], found["speed"][soils[0]], soils[0])
    figure.suptitle(f"{options.vehicle.name.split('.')[0]}: electric energy; bands: 90 % of the ground; dotted: "
                    "beyond a limit or the model's runs", fontsize=9)
    save(figure, options.out, dpi=130)


def main():
    parser = argparse.ArgumentParser(prog="grouser vehicle plot", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("vehicle", type=pathlib.Path, help="vehicle file")
    parser.add_argument("--program", required=True, help=argparse.SUPPRESS)
    parser.add_argument("--out", type=pathlib.Path, required=True, help="picture: .png, .svg or .pdf")
    parser.add_argument("--soil", action="append", help="one of its soils, once each (default: all)")
    parser.add_argument("--speed", type=positive, default=0.5, help="on circles [m/s] (default: 0.5)")
    parser.add_argument("--most-speed", type=positive, default=1.5, help="[m/s] (default: 1.5)")
    parser.add_argument("--least-radius", type=positive, default=0.5, help="[m] (default: 0.5, to 20 times that)")
    parser.add_argument("--most-yaw-rate", type=positive, default=1.5, help="[rad/s] (default: 1.5)")
    options = parser.parse_args()
    check_picture(parser, options.out)
    soils = soils_of(options)
    for soil in options.soil or []:
        if soil not in soils:
            raise Refused(f"--soil {soil}: expected one of {', '.join(soils)}")
    soils = options.soil or soils
    sweeps = sweeps_of(options)
    found = {name: answers(options, soils, motions) for name, (_, motions) in sweeps.items()}
    picture(options, soils, sweeps, found)
    print(f"grouser: wrote {options.out}", file=sys.stderr)
    return 0


def soils_of(options):
    done = subprocess.run([options.program, "climb", str(options.vehicle), "--json"], stdout=subprocess.PIPE, text=True,
                          check=False)
    if not done.stdout:
        raise Refused
    return [one["soil"] for one in json.loads(done.stdout)]


if __name__ == "__main__":
    end_with(main)
