"""The page of a calibration of grains."""

import math

import html_page as hp
import numpy
from check import band

OUTPUT = {"f_x": ("drawbar pull", 1, "N"), "f_y": ("side force", 1, "N"), "torque": ("torque", 1, "N m"),
          "sinkage": ("sinkage", 1e3, "mm")}


def number(value):
    return math.nan if value is None else value


def pairs(found, inference):
    """Samples of every pair of parameters within their ranges, histograms on the diagonal; red: what is written."""
    import identify
    from matplotlib import pyplot
    values = identify.physical(inference.vary, inference.posterior.u)
    names = inference.vary.names
    n = len(names)
    figure, axes = pyplot.subplots(n, n, figsize=(1.9 * n + 0.6, 1.9 * n + 0.4), squeeze=False)
    best = found["best"]["values"]
    for i, row in enumerate(names):
        for k, column in enumerate(names):
            axis = axes[i][k]
            if k > i:
                axis.axis("off")
                continue
            low, high = inference.vary.ranges[column]
            axis.set_xlim(low, high)
            if i == k:
                axis.hist(values[:, k], bins=24, range=(low, high), color="#7d9bc1")
                axis.axvline(best[column], color="#c1121f", lw=1)
                axis.set_yticks([])
            else:
                axis.plot(values[:, k], values[:, i], ".", ms=1.5, color="#1d4e89", alpha=0.35)
                axis.plot(best[column], best[row], "o", ms=4, color="#c1121f")
                axis.set_ylim(*inference.vary.ranges[row])
            if i == n - 1:
                axis.set_xlabel(column, fontsize=8)
            if k == 0:
                axis.set_ylabel(row, fontsize=8)
            axis.tick_params(labelsize=7)
    figure.tight_layout()
    return hp.picture(figure, "posterior of pairs of parameters")


def curve_figure(rows, name):
    """Force against sinkage: measured, predicted with its band."""
    from matplotlib import pyplot
    figure, axis = pyplot.subplots(figsize=(5.2, 3.4))
    rows = sorted((row for row in rows if "model" in row), key=lambda row: row["sinkage"])
    at = [1e3 * row["sinkage"] for row in rows]
    axis.plot(at, [row["model"] for row in rows], color="#c1121f", label="posterior")
    axis.fill_between(at, [row["low90"] for row in rows], [row["high90"] for row in rows], color="#c1121f", alpha=0.15,
                      lw=0)
    for held_out, face in ((False, "black"), (True, "white")):
        some = [row for row in rows if row["held_out"] is held_out]
        if some:
            axis.errorbar([1e3 * row["sinkage"] for row in some], [row["value"] for row in some],
                          [row["sd"] or 0 for row in some], fmt="o", ms=4, color="black", mfc=face, lw=0.8,
                          label="held out" if held_out else "fitted")
    axis.set_xlabel("sinkage [mm]")
    axis.set_ylabel("force [N]")
    axis.set_title(name, fontsize=9)
    axis.set_ylim(bottom=0)
    axis.legend(fontsize=8)
    figure.tight_layout()
    return hp.picture(figure, f"{name}: measured and predicted")


def wheel_figure(rows):
    """Predicted against measured, an axis for each output."""
    from matplotlib import pyplot
    outputs = [name for name in OUTPUT if any(row["measured"] == name and "model" in row for row in rows)]
    figure, axes = pyplot.subplots(1, len(outputs), figsize=(3.2 * len(outputs) + 0.4, 3.3), squeeze=False)
    for axis, name in zip(axes[0], outputs):
        word, scale, unit = OUTPUT[name]
        own = [row for row in rows if row["measured"] == name and "model" in row]
        for held_out, face in ((False, "#1d4e89"), (True, "white")):
            some = [row for row in own if row["held_out"] is held_out]
            if some:
                y = scale * numpy.array([row["model"] for row in some])
                ends = [y - scale * numpy.array([row["low90"] for row in some]),
                        scale * numpy.array([row["high90"] for row in some]) - y]
                axis.errorbar([scale * row["value"] for row in some], y, numpy.maximum(ends, 0), fmt="o", ms=4,
                              color="#1d4e89", mfc=face, lw=0.8, capsize=2, label="held out" if held_out else "fitted")
        ends = [scale * row[key] for row in own for key in ("value", "low90", "high90")]
        axis.plot([min(ends), max(ends)], [min(ends), max(ends)], color="#888888", lw=0.8)
        axis.set_xlabel(f"{word} measured [{unit}]")
        axis.set_ylabel(f"predicted [{unit}]")
        axis.legend(fontsize=8)
    figure.tight_layout()
    return hp.picture(figure, "wheel tests: predicted against measured")


def left_out_figure(found):
    """Each run from all others, in units of the spread of the block's runs."""
    from matplotlib import pyplot
    groups = list(dict.fromkeys(one["group"] for one in found["emulators"]))
    figure, axes = pyplot.subplots(1, len(groups), figsize=(2.5 * len(groups) + 0.4, 2.8), squeeze=False)
    for axis, group in zip(axes[0], groups):
        for one in (one for one in found["emulators"] if one["group"] == group):
            middle, spread = numpy.mean(one["run"]), one["sd_of_runs"] or 1.0
            x, y = ((numpy.array(one[key]) - middle) / spread for key in ("run", "predicted"))
            axis.plot(x, y, ".", ms=4)
        axis.plot([-3, 3], [-3, 3], color="#888888", lw=0.8)
        axis.set_title(group, fontsize=9)
        axis.set_xlabel("run")
        axis.set_xlim(-3, 3)
        axis.set_ylim(-3, 3)
    axes[0][0].set_ylabel("from the other runs")
    figure.tight_layout()
    return hp.picture(figure, "leave-one-out of the emulators")


def parameters_table(found):
    rows = [(one["name"], one["meaning"], one["unit"], found["best"]["values"][one["name"]], one["mean"], one["sd"],
             one["low90"], one["high90"], f"{one['range'][0]:g} to {one['range'][1]:g}",
             f"{100 * one['share_left']:.0f} %", "yes" if one["identified"] else "no") for one in found["parameters"]]
    return hp.table(("parameter", "what", "unit", "written", "mean", "sd", "90 % from", "to", "range (uniform before)",
                     "uncertainty left", "identified"), rows)


def correlation_table(found):
    names = [one["name"] for one in found["parameters"]]
    return hp.table(("correlation", *names), [(name, *(f"{value:+.2f}" for value in line))
                                              for name, line in zip(names, found["correlation"])])


def errors_table(found):
    rows = []
    for one in found["errors"]:
        line = [one["test"], one["measured"]]
        for part in (one["fitted"], one["held_out"]):
            relative = "" if part["relative_rms"] is None else f" ({100 * part['relative_rms']:.0f} %)"
            line += [part["n"], "–" if part["rms"] is None else f"{part['rms']:.3g}{relative}",
                     "–" if part["covered90"] is None else f"{100 * part['covered90']:.0f} %"]
        rows.append((*line, one["not_run"]))
    return hp.table(("test", "measured", "fitted", "rms of fitted", "in 90 %", "held out", "rms of predicted",
                     "in 90 %", "not run"), rows, "Units: N, N m, m. Rows that were not run, or that too few points "
                    "reached: ./grouser validate and ./grouser bevameter with the calibrated files, or --predict.")


def predictive(found):
    curves = [name for name in dict.fromkeys(row["test"] for row in found["rows"])]
    parts = []
    for name in curves:
        own = [row for row in found["rows"] if row["test"] == name and "model" in row]
        if own:
            parts.append(wheel_figure(own) if own[0]["kind"] == "wheel" else curve_figure(own, name))
    return parts


def told(found):
    lines = [one["text"] + f" ({100 * one['share_left']:.0f} % of what was uncertain is left)."
             for one in found["not_identified"]] or ["All parameters are told by the data."]
    tests = [(one["test"], one["rows"], f"{100 * one['share_left']:.0f} %") for one in found["next_tests"]]
    parts = [hp.reading(line[0].upper() + line[1:]) for line in lines]
    if tests:
        parts.append(hp.table(("test of the file, were it fitted", "rows", "left of the most uncertain direction"),
                              tests))
    return parts


def runs_part(found):
    share = found["runs_share"]
    points = [(", ".join(f"{name} {value:.4g}" for name, value in one["values"].items()), f"{100 * one['takes']:.0f} %")
              for one in found["next_points"]]
    rows = [(one["block"], one["runs"], one["sd_of_runs"], one["rms"], one["noise_sd"], f"{100 * one['in_90']:.0f} %")
            for one in found["emulators"]]
    return [hp.reading(f"{found['design']['used']} points of {found['design']['points']} (failed: "
                       f"{', '.join(found['design']['failed']) or 'none'}), {found['design']['beds']} bed(s) each, "
                       f"{found['design']['core_hours']:.2f} hours of a core. Of the variance that measured values are "
                       f"compared with, {100 * share['emulator']:.0f} % is the emulators' and "
                       f"{100 * share['beds']:.0f} % the beds'."),
            left_out_figure(found),
            hp.table(("fitted block", "runs", "sd of the runs", "rms of leave-one-out", "sd of beds and runs",
                      "in 90 %"), rows, "Curves: natural logarithm of the force. Wheels: N, m."),
            hp.table(("next DEM point", "takes of the emulators' variance, one after the other"), points)]


def truth_words(checked):
    distances = {one["label"]: number(one["distance"]) for one in checked}
    outside = [f"{label} ({distance:.1f})" for label, distance in distances.items() if not distance <= 1]
    inside, (low, high) = len(checked) - len(outside), band(len(checked))
    return (f"DEM as truth: of {len(checked)} points of the design, each calibrated from its own runs by the emulators "
            f"of the others, {inside} lie in their 90 % region (of regions that hold 90 %: {low} to {high} in 95 % of "
            f"cases); outside, squared distance over the region's edge: {', '.join(outside) or 'none'}")


def page_of(found, inference):
    import matplotlib
    matplotlib.use("Agg")
    matplotlib.rcParams.update(hp.STYLE)
    form = [(one["group"], one["blocks"], f"{100 * one['median']:.1f} %", f"{100 * one['low90']:.1f} %",
             f"{100 * one['high90']:.1f} %", f"{100 * one['typical']:.0f} %") for one in found["form_errors"]]
    files = [(one["file"], one["sha256"]) for one in found["files"]]
    body = (hp.section("Parameters", parameters_table(found), hp.reading(
                f"Written to calibrated.soil.yaml and calibrated.scene.yaml: the {found['best']['is']}."),
                pairs(found, inference), correlation_table(found))
            + hp.section("What the data do not tell", *told(found))
            + hp.section("Measured against predicted", hp.reading(
                "Full marks were fitted, open ones are held out and never reached the fit; bands and bars are 90 % for "
                "one measurement."), *predictive(found))
            + hp.section("What was fitted and what was predicted", errors_table(found),
                         hp.table(("error of the form", "fitted blocks", "median", "90 % from", "to", "typical"), form,
                                  "Share of the value (curves), of load, load x radius or radius (wheels)."))
            + hp.section("The runs and their emulators", *runs_part(found), *(
                [hp.reading(truth_words(found["dem_as_truth"]) + ".")] if "dem_as_truth" in found else []))
            + hp.section("Made from", hp.reading(found["command"]), hp.reading(found["source"]),
                         hp.table(("file", "SHA-256"), files), *map(hp.reading, found["notes"])))
    return hp.document(f"Grains: {found['soil']}", "", body)
