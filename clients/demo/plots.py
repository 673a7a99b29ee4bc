"""The plots of the demo's report; each returns a matplotlib figure."""

import math

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  (the back end is chosen first)
import numpy as np  # noqa: E402

from html_page import STYLE  # noqa: E402
from records import AXES, NEAR_SLIP, PREDICTED, number  # noqa: E402

DEM, SURROGATE, MEASURED, BEFORE = "#1b4965", "#d1495b", "#2a9d5c", "#9a8c98"
SHOWN = ("f_x", "f_y", "torque", "sinkage")
plt.rcParams.update(STYLE)


def axis_label(output):
    label, unit, _ = AXES[output]
    return f"{label} [{unit}]"


def draw_runs(axes, runs, x, output, label, **style):
    """DEM means with 90 % bars (1.645 standard errors)."""
    scale = AXES[output][2]
    axes.errorbar([x(run) for run in runs], [scale * run.mean[output] for run in runs],
                  yerr=[1.645 * scale * run.standard_error[output] for run in runs],
                  fmt="o", ms=4, lw=1.2, capsize=2, label=label, **style)


def draw_curve(axes, x, responses, output, color, label):
    scale = AXES[output][2]
    low, high, value = (scale * np.array(responses.array(output, field))
                        for field in ("low", "high", "value"))
    axes.fill_between(x, low, high, color=color, alpha=0.16, lw=0)
    axes.plot(x, value, color=color, lw=1.5, label=label)


def legend_above(figure, axes, columns=4):
    entries = {}
    for one in axes.flat:
        for handle, label in zip(*one.get_legend_handles_labels()):
            entries.setdefault(label, handle)
    figure.legend(entries.values(), entries.keys(), loc="upper center", ncol=columns,
                  bbox_to_anchor=(0.5, 1.0))


def against_slip(curves, runs, measured, load_n):
    """Rows: outputs; columns: attack angles. `curves`: {angle_deg: Responses}.
    Runs and measurements of other loads are not drawn."""
    figure, axes = plt.subplots(len(SHOWN), len(curves), figsize=(3.3 * len(curves), 9.4),
                                sharex=True, sharey="row", squeeze=False)
    for column, (angle, responses) in enumerate(curves.items()):
        here = [run for run in runs if abs(run.angle_deg - angle) < 0.5
                and abs(run.load_n / load_n - 1) < 0.02]
        for row, output in enumerate(SHOWN):
            one = axes[row, column]
            draw_curve(one, responses.slip, responses, output, SURROGATE,
                       f"surrogate, {100 * responses.level:.0f} % interval for a DEM mean")
            train = [run for run in here if run.role != "test"]
            test = [run for run in here if run.role == "test"]
            draw_runs(one, train, lambda run: run.slip, output, "DEM (training), 90 % bars",
                      color=DEM)
            draw_runs(one, test, lambda run: run.slip, output, "DEM (held out)",
                      color=DEM, mfc="white")
            draw_measured(one, [row for row in measured if
                                abs(number(row["attack_angle_deg"]) - angle) < 0.5], output)
            if row == 0:
                one.set_title(f"attack angle {angle:g}°", fontsize=10)
            if column == 0:
                one.set_ylabel(axis_label(output))
            if row == len(SHOWN) - 1:
                one.set_xlabel("slip [-]")
    limit_to_data(axes, runs)
    figure.tight_layout(rect=(0, 0, 1, 0.96))
    legend_above(figure, axes)
    return figure


def limit_to_data(axes, runs):
    """A wide interval outside the data must not flatten the rest of a row."""
    for row, output in enumerate(SHOWN):
        seen = [AXES[output][2] * run.mean[output] for run in runs]
        for one in axes[row]:
            for line in one.get_lines():
                seen += [y for y in line.get_ydata() if math.isfinite(y)]
        margin = 0.25 * (max(seen) - min(seen)) or 1.0
        axes[row, 0].set_ylim(min(seen) - margin, max(seen) + margin)


def draw_measured(axes, rows, output):
    scale = AXES[output][2]
    points = [(number(row["slip"]), scale * number(row["measured"][output]["value"]),
               scale * number(row["measured"][output]["sd"])) for row in rows]
    points = [point for point in points if math.isfinite(point[1])]
    if points:
        slip, value, sd = zip(*points)
        axes.errorbar(slip, value, yerr=sd, fmt="s", ms=4, lw=1, color=MEASURED, mfc="white",
                      label="measured wheel, ± sd of 3 repeats")


def against_angle(curves, runs, load_n):
    """`curves`: {slip: Responses over attack angle}."""
    figure, axes = plt.subplots(1, len(SHOWN), figsize=(12.4, 3.5))
    colors = plt.cm.viridis(np.linspace(0.1, 0.8, len(curves)))
    for one, output in zip(axes, SHOWN):
        for color, (slip, responses) in zip(colors, curves.items()):
            draw_curve(one, responses.angle_deg, responses, output, color, f"surrogate, slip {slip:g}")
            here = [run for run in runs if abs(run.slip - slip) <= NEAR_SLIP
                    and abs(run.load_n / load_n - 1) < 0.02]
            draw_runs(one, here, lambda run: run.angle_deg, output, f"DEM, slip {slip:g} ± {NEAR_SLIP:g}",
                      color=color)
        one.set_xlabel("attack angle [°]")
        one.set_ylabel(axis_label(output))
    figure.tight_layout(rect=(0, 0, 1, 0.86))
    legend_above(figure, axes, columns=2 * len(curves))
    return figure


def parity(pairs):
    """`pairs`: [(Run, {output: (value, low, high)})] of runs never fitted."""
    figure, axes = plt.subplots(2, 3, figsize=(10.4, 6.6))
    axes[1, 2].set_visible(False)
    for one, output in zip(axes.flat, PREDICTED):
        scale = AXES[output][2]
        dem = scale * np.array([run.mean[output] for run, _ in pairs])
        error = scale * np.array([run.standard_error[output] for run, _ in pairs])
        value, low, high = (scale * np.array([answer[output][k] for _, answer in pairs])
                            for k in range(3))
        one.errorbar(dem, value, xerr=1.645 * error, fmt="o", ms=4, color=SURROGATE,
                     yerr=[np.maximum(value - low, 0), np.maximum(high - value, 0)], lw=1, capsize=2)
        ends = [np.nanmin([dem.min(), low.min()]), np.nanmax([dem.max(), high.max()])]
        one.plot(ends, ends, color="#888888", lw=0.8, zorder=0)
        one.set_xlabel(f"DEM: {axis_label(output)}")
        one.set_ylabel("surrogate")
    figure.tight_layout()
    return figure


def pressure(run):
    """Normal stress under the wheel: by width and central angle, and its mean
    over the width. Angle: from straight down, positive forward."""
    stress = run.record["stress"]
    bins = int(stress["width_bins"])
    normal = np.array([number(x) for x in stress["normal_pa"]]).reshape(-1, bins) / 1000
    step = math.degrees(number(stress["angle_step_rad"]))
    edges = math.degrees(number(stress["first_angle_rad"])) + step * np.arange(len(normal) + 1)
    width_mm = 1000 * number(run.record["spec"]["wheel"]["width_m"])
    shown = np.flatnonzero(normal.max(axis=1) > 0)
    first, last = (shown[0], shown[-1] + 1) if len(shown) else (0, len(normal))
    figure, (heat, line) = plt.subplots(1, 2, figsize=(10.4, 3.6), gridspec_kw={"wspace": 0.3})
    mesh = heat.pcolormesh(edges[first:last + 1], np.linspace(-width_mm / 2, width_mm / 2, bins + 1),
                           normal[first:last].T, cmap="magma_r", vmin=0)
    figure.colorbar(mesh, ax=heat, label="normal stress [kPa]")
    heat.set_xlabel("central angle [°], forward positive")
    heat.set_ylabel("across the rim [mm], left positive")
    heat.grid(False)
    middle = (edges[first:last] + edges[first + 1:last + 1]) / 2
    shear = np.array([number(x) for x in stress["shear_tangential_pa"]]).reshape(-1, bins) / 1000
    line.plot(middle, normal[first:last].mean(axis=1), "o-", ms=3, color=DEM, label="normal")
    line.plot(middle, shear[first:last].mean(axis=1), "s-", ms=3, color=SURROGATE, label="shear along the rim")
    for name, position in (("entry", "entry_angle_rad"), ("exit", "exit_angle_rad")):
        angle = math.degrees(number(stress[position]))
        line.axvline(angle, color="#888888", lw=0.8, ls="--")
        line.annotate(name, (angle, 1), xycoords=("data", "axes fraction"), fontsize=8,
                      ha="center", va="bottom", color="#555555")
    line.set_xlabel("central angle [°], forward positive")
    line.set_ylabel("mean over the width [kPa]")
    line.legend()
    figure.subplots_adjust(left=0.07, right=0.98, bottom=0.15, top=0.92)
    return figure


def refinement(before, after, held_out, worker):
    """Answers at one state before and after: {output: (value, low, high)};
    `held_out`: a DEM run that no fit has seen; `worker`: the job's own run."""
    figure, axes = plt.subplots(1, len(PREDICTED), figsize=(11.4, 3.2))
    for one, output in zip(axes, PREDICTED):
        scale = AXES[output][2]
        for x, answer, color in ((0, before, BEFORE), (1, after, SURROGATE)):
            value, low, high = (scale * number for number in answer[output])
            one.errorbar([x], [value], yerr=[[value - low], [high - value]], fmt="o", ms=6,
                         color=color, capsize=4, lw=1.6)
        for x, run, marker, face in ((2, worker, "D", DEM), (3, held_out, "D", "white")):
            one.errorbar([x], [scale * run.mean[output]], fmt=marker, ms=5, color=DEM, mfc=face,
                         yerr=[1.645 * scale * run.standard_error[output]], capsize=4)
        one.axhline(scale * held_out.mean[output], color=DEM, lw=0.8, ls=":")
        one.set_xticks([0, 1, 2, 3], ["before", "after", "job's\nDEM", "held-\nout"], fontsize=8)
        one.set_xlim(-0.5, 3.5)
        one.set_title(axis_label(output), fontsize=9)
    figure.tight_layout()
    return figure
