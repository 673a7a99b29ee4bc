#!/usr/bin/python3
"""Calibrates a soil by plates and a wheel that is pressed down, predicts wheel tests that it never saw, and shows how
well the data tell each parameter. Full marks were fitted, open ones are predicted; bands: 90 % for one measurement."""

import argparse
import pathlib
import sys

import matplotlib.pyplot as plt
import numpy as np

import grouser

MEASURED = pathlib.Path(__file__).resolve().parents[3] / "surrogate/calibrate/measured/cmu_plates.yaml"
# kind, what is measured: abscissa with label and scale, label and scale of the ordinate
PANELS = {("plate", "pressure"): ("sinkage_m", "sinkage [mm]", 1e3, "pressure under plates [kPa]", 1e-3),
          ("press", "force"): ("sinkage_m", "sinkage [mm]", 1e3, "force on the pressed wheel [N]", 1),
          ("wheel", "f_x"): ("slip", "slip [-]", 1, "drawbar pull [N]", 1)}


def curve_of(row):
    return f"{row['attack_angle_deg']:.0f} deg" if row["kind"] == "wheel" else row["test"]


def draw(axis, rows, x, x_label, x_scale, label, scale):
    for k, name in enumerate(dict.fromkeys(map(curve_of, rows))):
        own = sorted((r for r in rows if curve_of(r) == name), key=lambda r: r[x])
        at, value, model, sd = (np.array([r[key] for r in own]) for key in (x, "value", "model", "sd_total"))
        fitted, half = ~np.array([r["held_out"] for r in own]), 1.645 * sd
        axis.plot(x_scale * at, scale * model, f"C{k}", label=name)
        axis.fill_between(x_scale * at, scale * (model - half), scale * (model + half), color=f"C{k}", alpha=0.15, lw=0)
        axis.plot(x_scale * at[fitted], scale * value[fitted], "o", color=f"C{k}", ms=4)
        axis.plot(x_scale * at[~fitted], scale * value[~fitted], "o", color=f"C{k}", ms=4, mfc="white")
    axis.set(xlabel=x_label, ylabel=label)
    axis.legend(fontsize=8, loc="upper left")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", metavar="OUT.png")
    parser.add_argument("data", nargs="*", default=[MEASURED], help="measurement files; default: cmu_plates.yaml")
    asked = parser.parse_args()
    found = grouser.calibrate_soil(asked.data, on_line=lambda line: print(line, file=sys.stderr))
    figure, axes = plt.subplots(2, 2, figsize=(11, 8), constrained_layout=True)
    for axis, (group, panel) in zip(axes.flat, PANELS.items()):
        draw(axis, [r for r in found["observations"] if (r["kind"], r["measured"]) == group], *panel)
    for p in reversed(found["parameters"]):
        axes.flat[3].barh(p["name"], 100 * p["share_left"], color="C2" if p["identified"] else "0.7")
    axes.flat[3].set(xlabel="uncertainty that the data leave [%]; green: identified")
    next_test = found["next_tests"][0]["test"]
    figure.suptitle(f"{found['soil']}: {found['why_form']}\nthe next test: {next_test}", fontsize=10)
    figure.savefig(asked.out, dpi=90)


if __name__ == "__main__":
    main()
