#!/usr/bin/python3
"""Runs grouser-calibrate and writes a page of what it found.

Usage: calibrate.py --bin FOLDER soil DATA... [--out FOLDER] [options of grouser-calibrate]
FOLDER (default: out/calibrate) gets soil.csv, calibration.json and report.html."""

import json
import math
import os
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "clients", "common"))

import html_page as hp  # noqa: E402
from processes import write_atomically  # noqa: E402

Z90 = 1.645  # two-sided 90 % of a normal distribution
# kind: (abscissa, its label, its scale; scale of the ordinate, its unit)
AXES = {"plate": ("sinkage_m", "sinkage [mm]", 1e3, 1e-3, "kPa"),
        "press": ("sinkage_m", "sinkage [mm]", 1e3, 1, "N"),
        "shear": ("displacement_m", "displacement [mm]", 1e3, 1e-3, "kPa"),
        "wheel": ("slip", "slip", 1, 1, "")}


def curve_of(row):
    """What is held equal along one curve of a plot."""
    if row["kind"] == "wheel":
        return f"{row['attack_angle_deg']:.0f} deg"
    if row["kind"] == "shear":
        return f"{row['test']}, {row['pressure_pa'] / 1e3:.3g} kPa"
    return row["test"]


def plot(rows, kind, measured):
    from matplotlib import pyplot
    x, label, x_scale, scale, unit = AXES[kind]
    figure, axes = pyplot.subplots(figsize=(6.4, 3.8))
    if measured == "sinkage":
        scale, unit = 1e3, "mm"
    for i, name in enumerate(dict.fromkeys(curve_of(r) for r in rows)):
        own = sorted((r for r in rows if curve_of(r) == name), key=lambda r: r[x])
        colour = f"C{i}"
        at = [x_scale * r[x] for r in own]
        model = [scale * r["model"] for r in own]
        half = [scale * Z90 * r["sd_total"] for r in own]
        axes.plot(at, model, color=colour, label=name)
        axes.fill_between(at, [m - h for m, h in zip(model, half)],
                          [m + h for m, h in zip(model, half)], color=colour, alpha=0.15, lw=0)
        for held_out, face in ((False, colour), (True, "white")):
            some = [r for r in own if r["held_out"] is held_out]
            axes.plot([x_scale * r[x] for r in some], [scale * r["value"] for r in some], "o",
                      ms=4, color=colour, mfc=face)
    axes.set_xlabel(label)
    axes.set_ylabel(f"{measured} [{unit or rows[0]['unit']}]")
    axes.legend(fontsize=8)
    figure.tight_layout()
    return hp.picture(figure, f"{kind}: {measured}, measured and model")


def number(value):
    return math.nan if value is None else value


def parameters_table(found):
    rows = [(p["name"], p["unit"], number(p["value"]), number(p["sd"]),
             "-inf" if p["low90"] is None else f"{p['low90']:.4g}" + (" (bound)" if p["low_open"] else ""),
             "inf" if p["high90"] is None else f"{p['high90']:.4g}" + (" (bound)" if p["high_open"] else ""),
             number(p["typical"]), f"{100 * p['share_left']:.0f} %",
             "yes" if p["identified"] else "no: rests on what is typical") for p in found["parameters"]]
    return hp.table(("parameter", "unit", "value", "sd", "90 % from", "to", "typical",
                     "uncertainty left", "identified"), rows,
                    "Intervals: profile likelihood; sd: from the Jacobian. Uncertainty left: after over "
                    "before the data.")


def errors_table(found):
    rows = []
    for e in found["errors"]:
        fitted, held = e["fitted"], e["held_out"]
        rows.append((e["test"], e["measured"], e["unit"], fitted["n"], number(fitted["rms"]), held["n"],
                     number(held["rms"]), "–" if held["n"] == 0 else f"{100 * held['covered90']:.0f} %"))
    return hp.table(("test", "measured", "unit", "fitted", "rms of fitted", "held out", "rms of predicted",
                     "held out in 90 %"), rows)


def correlation_table(found):
    names = [p["name"] for p in found["parameters"]]
    rows = [(name, *(f"{number(v):.2f}" for v in line))
            for name, line in zip(names, found["correlation"])]
    return hp.table(("", *names), rows)


def page_of(found):
    groups = dict.fromkeys((r["kind"], r["measured"]) for r in found["observations"])
    plots = [plot([r for r in found["observations"] if (r["kind"], r["measured"]) == group], *group)
             for group in groups]
    told = [d["text"] + f" ({100 * d['share_left']:.0f} % of what was uncertain is left)."
            for d in found["not_identified"]] or ["All parameters are told by the data."]
    following = [(t["test"], f"{100 * t['share_left']:.0f} %", t["gains"],
                  f"{100 * t['interval_left']:.0f} %") for t in found["next_tests"]]
    files = [(f["file"], f["sha256"]) for f in found["files"]]
    body = (hp.section("Parameters", hp.reading(found["why_form"] + "."), parameters_table(found))
            + hp.section("Measured against model", hp.reading(
                "Full marks were fitted, open ones are held out; bands are 90 % for one measurement."),
                *plots)
            + hp.section("What was fitted and what was predicted", errors_table(found),
                         *map(hp.reading, found["law_errors"] + found["notes"]))
            + hp.section("What the data do not tell", *map(hp.reading, told))
            + hp.section("The next test", hp.table(
                ("test", "left of the most uncertain direction", "gains most", "its uncertainty then"),
                following))
            + hp.section("Correlation", correlation_table(found))
            + hp.section("Made from", hp.reading(found["command"]), hp.reading(found["source"]),
                         hp.table(("file", "SHA-256"), files)))
    return hp.document(f"Soil: {found['soil']}", "", body)


def main(arguments):
    if len(arguments) < 3 or arguments[0] != "--bin":
        print(__doc__, file=sys.stderr)
        return 2
    program, rest = os.path.join(arguments[1], "grouser-calibrate"), arguments[2:]
    if any(a in ("-h", "--help", "--version") for a in rest) or rest[:1] != ["soil"]:
        return subprocess.call([program, *rest])
    out = next((a.split("=", 1)[1] for a in rest if a.startswith("--out=")), None)
    if "--out" in rest[:-1]:
        out = rest[rest.index("--out") + 1]
    if out is None:
        out = os.path.join("out", "calibrate")
        rest += ["--out", out]
    code = subprocess.call([program, *rest])
    if code != 0:
        return code
    import matplotlib
    matplotlib.use("Agg")
    matplotlib.rcParams.update(hp.STYLE)
    with open(os.path.join(out, "calibration.json"), encoding="utf-8") as file:
        found = json.load(file)
    report = os.path.join(out, "report.html")
    write_atomically(report, page_of(found))
    print(f"grouser: {report}", file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
