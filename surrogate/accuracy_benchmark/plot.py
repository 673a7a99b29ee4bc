#!/usr/bin/python3
"""Error against time of every kind, log-log, a panel a pair (`./grouser ladder docs` draws it).

  ./grouser ladder --json > rows.json
  /usr/bin/python3 surrogate/accuracy_benchmark/plot.py rows.json picture.svg
"""

import json
import sys

import matplotlib

matplotlib.use("svg")
matplotlib.rcParams["svg.hashsalt"] = "grouser"  # the same file for the same numbers
from matplotlib import pyplot  # noqa: E402

OUTPUTS = {"f_x": "o", "f_y": "s", "torque": "^", "sinkage": "D"}
TICKS = {1: "1 ns", 1e3: "1 us", 1e6: "1 ms", 1e9: "1 s", 1e12: "1000 s"}


MEASURED_REGION = "not locked"


def panel(axes, title, rows):
    for k, (output, marker) in enumerate(OUTPUTS.items()):
        own = [r for r in rows if r["output"] == output]
        if own:  # the measured wheel has no torque
            axes.plot([r["ns_per_answer"] for r in own], [100 * r["p95_over_load"] for r in own],
                      marker, color=f"C{k}", label=output, markersize=6)
    models = {}
    for row in rows:
        at = models.setdefault(row["kind"], [row["ns_per_answer"], 0.0])
        at[1] = max(at[1], 100 * row["p95_over_load"])
    for k, (kind, (time, error)) in enumerate(sorted(models.items(), key=lambda kv: kv[1][0])):
        axes.annotate(kind, (time, error), xytext=(0, 8 + 11 * (k % 2)), fontsize=8,
                      textcoords="offset points", ha="center", color="0.3")
    axes.set(xscale="log", yscale="log", title=title, xlabel="time of an answer, one core",
             ylabel="95th percentile of error / load [%]")
    low, high = axes.get_xlim()
    axes.set_xlim(low / 4, high * 6)
    axes.set_xticks([t for t in TICKS], [TICKS[t] for t in TICKS])
    axes.set_xlim(low / 4, high * 6)
    bottom, top = axes.get_ylim()
    percents = [0.5, 1, 2, 5, 10, 20, 50, 100, 200]
    axes.set_yticks(percents, [f"{p:g}" for p in percents])
    axes.yaxis.set_minor_formatter(matplotlib.ticker.NullFormatter())
    axes.set_ylim(bottom / 1.2, top * 1.6)
    axes.grid(True, which="both", linewidth=0.3)
    axes.legend(fontsize=8)


def draw(rows, path):
    """A panel for each pair against DEM, and one against its measured wheel where there is one."""
    rows = [r for r in rows if r["output"] in OUTPUTS]
    panels = []
    for pair in sorted({r["pair"] for r in rows}):
        own = [r for r in rows if r["pair"] == pair]
        panels.append((f"{pair}: against DEM",
                       [r for r in own if r["reference"] == "dem" and r["region"] == "all"]))
        measured = [r for r in own if r["reference"] == "measured" and r["region"] == MEASURED_REGION]
        if measured:
            panels.append((f"{pair}: against the measured wheel, {MEASURED_REGION}", measured))
    figure, axes = pyplot.subplots(len(panels), 1, figsize=(8, 4.2 * len(panels)), squeeze=False)
    for axis, (title, shown) in zip(axes[:, 0], panels):
        panel(axis, title, shown)
    figure.tight_layout()
    figure.savefig(path, metadata={"Date": None})


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    with open(sys.argv[1], encoding="utf-8") as file:
        draw(json.load(file), sys.argv[2])


if __name__ == "__main__":
    main()
