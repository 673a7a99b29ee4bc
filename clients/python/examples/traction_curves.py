#!/usr/bin/python3
"""Drawbar pull, drive torque and sinkage of a wheel by slip, with their intervals, at three attack angles."""

import argparse

import matplotlib.pyplot as plt
import numpy as np

import grouser

PANELS = (("f_x", "drawbar pull [N]", 1), ("torque", "drive torque [N m]", 1), ("sinkage", "sinkage [mm]", 1000))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", metavar="OUT.png")
    parser.add_argument("model", nargs="?", default=grouser.MODEL_DIR / "cmu-smooth-62.5.model")
    asked = parser.parse_args()
    model = grouser.Model.open(asked.model)
    domain = model.domain
    load = (domain.load_min_n * domain.load_max_n) ** 0.5
    slip = np.linspace(-0.6, 0.8, 141)
    figure, axes = plt.subplots(1, len(PANELS), figsize=(12, 4), constrained_layout=True)
    for degrees in (0, 15, 30):
        answers = model.evaluate(grouser.States.from_slip(slip, np.radians(degrees), domain.speed_m_per_s, load))
        outside = (answers.flags & grouser.Flag.EXTRAPOLATED) != 0
        for axis, (name, label, scale) in zip(axes, PANELS):
            output = getattr(answers, name)
            line, = axis.plot(slip, np.where(outside, np.nan, scale * output.value), label=f"{degrees} deg")
            axis.plot(slip, scale * output.value, ":", color=line.get_color())
            axis.fill_between(slip, scale * output.low, scale * output.high, color=line.get_color(), alpha=0.15)
            axis.set(xlabel="slip [-]", ylabel=label)
    axes[0].legend(title="attack angle")
    figure.suptitle(f"{model.wheel} on {model.soil}, {load:.0f} N; bands: {100 * model.interval_level:.0f} % for DEM; "
                    "dotted: outside of the training runs")
    figure.savefig(asked.out, dpi=90)


if __name__ == "__main__":
    main()
