#!/usr/bin/python3
"""Curves of one model or of several over slip, with their intervals against a fresh DEM run.

  plot_model.py --program GROUSER-FIT --out FILE.png|.svg|.pdf MODEL... [--load N] [--angle-deg DEG,...]

Lines are drawn where the model answers without a flag but FORM_UNKNOWN, dotted where it has one. Measured tests
(--measured) are points, of those rows alone that stand at the curve's angle and load (within 2 degrees and 10 %).
"""

import argparse
import json
import math
import pathlib
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "clients" / "common"))
import html_page  # noqa: E402
from picture_options import Refused, check_picture, end_with, positive, save  # noqa: E402

DEGREE = math.pi / 180
SLIPS = 81
STYLES = ("-", "--", "-.")
OUTPUTS = (("f_x", "drawbar pull [N]", 1), ("f_y", "lateral force [N]", 1), ("torque", "drive torque [N m]", 1),
           ("m_z", "moment about the vertical [N m]", 1), ("sinkage", "sinkage [mm]", 1000))
NEAR_ANGLE, NEAR_LOAD = 2.0, 0.1


def number(value):
    """Of JSON that names what JSON cannot hold."""
    return float(value)


def told(program, *arguments):
    done = subprocess.run([program, *arguments, "--json"], stdout=subprocess.PIPE, text=True, check=False)
    if done.returncode:
        raise Refused
    return [json.loads(line) for line in done.stdout.splitlines()]


class Curves:
    """Answers of one model at all slips of its domain, by angle."""

    def __init__(self, program, file, options, like=None):
        shown = told(program, "show", str(file))[0]["model"]
        domain = shown.get("domain", {})
        low, high = (number(domain.get(k, d)) for k, d in (("slip_min", -1), ("slip_max", 0.95)))
        low = max(low, -1.0)  # which every attack angle has a motion of
        slips = [low + (high - low) * i / (SLIPS - 1) for i in range(SLIPS)]
        loads = [number(domain.get(k, 0)) for k in ("load_min_n", "load_max_n")]
        middle = like.load if like else float(f"{math.sqrt(loads[0] * loads[1]):.3g}")
        self.load = middle if options.load is None else options.load
        if not self.load > 0:
            raise Refused(f"{file}: no training loads in it; expected --load")
        speed = [] if options.speed is None else ["--speed", str(options.speed)]
        kind = shown.get("kind", "").removeprefix("MODEL_KIND_").lower()
        self.name = shown["name"] if shown["name"].endswith(kind) else f"{shown['name']} {kind}"
        self.answers = {}
        for answer in told(program, "eval", str(file), "--slip=" + ",".join(f"{s:.6g}" for s in slips),
                           "--angle-deg=" + ",".join(map(str, options.angle_deg)), "--load", str(self.load), *speed):
            self.answers.setdefault(round(answer["attack_angle_rad"] / DEGREE, 6), []).append(answer)


def flagged(answer):
    return bool(set(answer["flag_names"]) - {"FORM_UNKNOWN"})


def draw(axes, answers, output, unit, color, style, label):
    slips = [a["slip"] for a in answers]
    value, low, high = ([unit * number(a["outputs"][output][k]) for a in answers] for k in ("value", "low", "high"))
    axes.fill_between(slips, low, high, color=color, alpha=0.13, linewidth=0)
    clean = [math.nan if flagged(a) else v for a, v in zip(answers, value)]
    axes.plot(slips, value, ":", color=color, linewidth=1)
    axes.plot(slips, clean, style, color=color, linewidth=1.4, label=label)


def measured_points(program, file, options, load):
    """(rows at the curve's load, number of all)."""
    rows = told(program, "compare", str(file), "--measured", str(options.measured))[0]["rows"]
    return [r for r in rows if abs(r["load_n"] / load - 1) <= NEAR_LOAD], len(rows)


def picture(curves, options):
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    pyplot.rcParams.update(html_page.STYLE)
    figure, panels = pyplot.subplots(2, 3, figsize=(11, 6.2), layout="constrained")
    points, of = (measured_points(options.program, options.models[0], options, curves[0].load)
                  if options.measured else ([], 0))
    drawn = set()
    for axes, (output, title, unit) in zip(panels.flat, OUTPUTS):
        for style, model in zip(STYLES, curves):
            for i, (angle, answers) in enumerate(model.answers.items()):
                draw(axes, answers, output, unit, f"C{i}", style, f"{model.name}, {angle:g} deg")
        for i, angle in enumerate(curves[0].answers):
            for place, row in enumerate(points):
                near = abs(row["attack_angle_deg"] - angle) <= NEAR_ANGLE
                value = number(row["measured"].get(output, {}).get("value", math.nan))
                if near and not math.isnan(value):
                    axes.plot(row["slip"], unit * value, "o", color=f"C{i}", markersize=4,
                              markeredgecolor="black", markeredgewidth=0.5)
                    drawn.add(place)
        axes.set_title(title, fontsize=9)
        axes.set_xlabel("slip", fontsize=8)
    note_panel(panels.flat[-1], panels.flat[0], curves, len(drawn), of)
    save(figure, options.out, dpi=130)


def note_panel(axes, source, curves, drawn, of):
    axes.set_axis_off()
    axes.legend(*source.get_legend_handles_labels(), loc="upper left", fontsize=8)
    notes = [f"load {curves[0].load:g} N", "bands: 90 % intervals against a fresh DEM run",
             "dotted: the answer has a flag"]
    if of:
        notes.append(f"points: measured, {drawn} of {of} rows (those within\n"
                     f"{NEAR_ANGLE:g} degrees of a curve and {NEAR_LOAD:.0%} of its load)")
    axes.text(0, 0, "\n".join(notes), fontsize=8, va="bottom", transform=axes.transAxes)


def degrees(text):
    return [float(part) for part in text.split(",")]


def main():
    parser = argparse.ArgumentParser(prog="grouser model plot", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("models", nargs="+", type=pathlib.Path, metavar="MODEL", help="model files, 3 at most")
    parser.add_argument("--program", required=True, help=argparse.SUPPRESS)
    parser.add_argument("--out", type=pathlib.Path, required=True, help="picture: .png, .svg or .pdf")
    parser.add_argument("--load", type=positive, help="[N]; the middle of the training loads if not given")
    parser.add_argument("--angle-deg", type=degrees, default=[0.0, 30.0, 60.0],
                        help="attack angles, 0,30,60 if not given; negative ones as --angle-deg=-30,0")
    parser.add_argument("--speed", type=positive, help="[m/s]; the training speed if not given")
    parser.add_argument("--measured", type=pathlib.Path, help="CSV of measured tests")
    options = parser.parse_args()
    check_picture(parser, options.out)
    if len(options.models) > len(STYLES):
        parser.error(f"got {len(options.models)} models, expected {len(STYLES)} at most")
    curves = []
    for file in options.models:
        curves.append(Curves(options.program, file, options, curves[0] if curves else None))
    picture(curves, options)
    print(f"grouser: wrote {options.out}", file=sys.stderr)
    return 0


if __name__ == "__main__":
    end_with(main)
