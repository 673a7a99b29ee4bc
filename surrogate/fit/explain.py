#!/usr/bin/python3
"""One picture of why a model answers a state as it does, beside the program's own output.

  explain.py --plot FILE.png|.svg|.pdf -- PROGRAM ARGUMENTS
      runs the program (grouser-fit explain, grouser-client query --explain), prints what it prints
      and writes the picture; exit code of the program
  explain.py --plot FILE --from FILE.json
      the picture of what --json printed before
"""

import argparse
import json
import math
import pathlib
import subprocess
import sys
import textwrap

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "clients" / "common"))
import html_page  # noqa: E402

DEGREE = math.pi / 180
SHOWN_RUNS = 5  # with colours of their own
SUFFIXES = (".png", ".svg", ".pdf")
OUTPUTS = ("f_x", "f_y", "torque", "m_z", "sinkage")


class Refused(Exception):
    """The reason in its text."""


def number(value):
    """Of protobuf's JSON, which names what JSON cannot hold."""
    return float(value)


def scale(output, load, radius):
    return radius if output == "sinkage" else load * radius if output in ("torque", "m_z") else load


def runs_of(explanation):
    """(run, colour, mark) of those that are drawn, the nearest first."""
    colors = [f"C{i}" for i in range(10)]
    fitted = [(run, colors[i], "o") for i, run in enumerate(explanation["nearest"][:SHOWN_RUNS])]
    held = [(run, colors[SHOWN_RUNS + i], "D") for i, run in enumerate(explanation["held_out"][:2])]
    return fitted + held


def short(run):
    return run["run_id"][:6] or run["sha256"][:6] or "?"


def draw_interval(axes, o, row):
    value, low, high = (number(o[k]) for k in ("value", "low", "high"))
    if math.isnan(value):
        axes.text(0.99, row - 0.42, "not answered", fontsize=7, va="center", ha="right", color="0.4",
                  transform=axes.get_yaxis_transform())
        return
    measured = [number(o[k]) for k in ("measured_low", "measured_high")]
    size = o["size"]
    if not math.isnan(measured[0]):
        axes.barh(row, (measured[1] - measured[0]) / size, left=measured[0] / size, height=0.62, color="0.93")
    axes.barh(row, (high - low) / size, left=low / size, height=0.5, color="#c6dbef")
    axes.plot([value / size] * 2, [row - 0.25, row + 0.25], color="#08519c", linewidth=1.8)


def outputs_panel(axes, e):
    shown = [o for o in e["outputs"] if o["output"] in OUTPUTS]
    for row, o in enumerate(shown):
        o["size"] = scale(o["output"], number(e["load_n"]) or 1, number(e["radius_m"]))
        draw_interval(axes, o, row)
        index = [p["output"] for p in e["outputs"]].index(o["output"])
        for k, (near, color, mark) in enumerate(runs_of(e)):
            if len(near["mean"]) != 6:
                continue
            at = scale(o["output"], number(near["run"]["load_n"]), number(e["radius_m"]))
            axes.plot([number(near["mean"][index]) / at], [row + 0.34 - 0.1 * k], mark, color=color, markersize=4)
    axes.set_yticks(range(len(shown)), [o["output"] for o in shown])
    axes.invert_yaxis()
    axes.use_sticky_edges = False
    axes.autoscale_view()
    axes.axvline(0, color="0.7", linewidth=0.6, zorder=0)
    axes.grid(axis="y", visible=False)
    level = 100 * number(e["interval_level"])
    axes.set_title(f"answer and its {level:.0f} % interval (blue: DEM; grey: a measurement);\n"
                   "points: means of the runs", fontsize=8.5)
    axes.set_xlabel("over load, load x radius, radius", fontsize=8)


def parts_panel(axes, e):
    shown = [o for o in e["outputs"] if o["output"] in OUTPUTS]
    names = (("sd_fit_inside", "#6baed6", "fit near its runs"),
             ("sd_fit_beyond", "#fd8d3c", "fit, grown with the hull distance"),
             ("sd_patch", "#74c476", "one placement of the bed"))
    drawn = False
    for row, o in enumerate(shown):
        sds = [number(o[name]) for name, _, _ in names]
        most = max(sds)  # over it first, so that no square overflows
        parts = [(sd / most) ** 2 for sd in sds] if most > 0 else []
        total = sum(parts)
        if not total > 0:
            continue
        left = 0
        for part, (_, color, label) in zip(parts, names):
            axes.barh(row, part / total, left=left, height=0.6, color=color, label=None if drawn else label)
            left += part / total
        drawn = True
    axes.set_yticks(range(len(shown)), [o["output"] for o in shown])
    axes.set_ylim(len(shown) - 0.5, -0.9)
    axes.set_xlim(0, 1)
    axes.grid(visible=False)
    if drawn:
        axes.legend(fontsize=7, loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=3, columnspacing=0.8,
                    handlelength=1.2)
    else:
        axes.text(0.5, 0.5, "no parts: not answered, or hard ground", fontsize=8, ha="center",
                  transform=axes.transAxes, color="0.4")
    axes.set_title("what the DEM interval's variance is made of", fontsize=8.5)


def place(near, e):
    """(slip, attack angle [deg]) of a run beside the state, which is drawn where the training domain
    is; beyond 90 degrees where the mirror in x takes over between the two."""
    box = {axis["quantity"]: number(axis["value"]) for axis in e["axes"]}
    turned = abs(box["slip"] - number(e["slip"])) > 1e-9 or (
        abs(box["attack_angle_rad"] - abs(number(e["attack_angle_rad"]))) > 1e-9)
    slip, angle = number(near["run"]["slip"]), abs(number(near["run"]["attack_angle_rad"])) / DEGREE
    return (-slip, 180 - angle) if near["mirrored_x"] != turned else (slip, angle)


def domain_panel(axes, e):
    box = {axis["quantity"]: axis for axis in e["axes"]}
    if not box:
        axes.set_axis_off()
        axes.text(0.5, 0.5, "no training domain", fontsize=8, ha="center", transform=axes.transAxes, color="0.4")
        return
    slip, angle, load = (box[k] for k in ("slip", "attack_angle_rad", "load_n"))
    corners = [number(slip[k]) for k in ("low", "low", "high", "high")]
    axes.fill(corners, [0] + 2 * [number(angle["high"]) / DEGREE] + [0], facecolor="#f0f0f0", edgecolor="0.7", zorder=0)
    for runs, mark, color in ((e["overloads"], "x", "0.6"), (e["held_out"], "D", "0.75"), (e["nearest"], "o", "0.6")):
        for near in runs:
            axes.plot(*place(near, e), mark, color=color, markersize=4)
    here = number(slip["value"]), number(angle["value"]) / DEGREE
    moves = not math.isnan(here[0])
    for near, color, mark in runs_of(e):
        at = place(near, e)
        if moves:
            axes.plot([here[0], at[0]], [here[1], at[1]], color=color, linewidth=0.7)
        axes.plot(*at, mark, color=color, markersize=5.5,
                  label=f"{short(near['run'])}: {number(near['distance']):.2f}, {number(near['run']['load_n']):.3g} N")
    if moves:
        axes.plot(*here, "*", color="black", markersize=12, label=f"state, {number(load['value']):.3g} N")
    axes.set_xlabel("slip", fontsize=8)
    axes.set_ylabel("attack angle [deg]", fontsize=8)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize=6.5, title="run: distance, load", title_fontsize=6.5, loc="center left",
                    bbox_to_anchor=(1, 0.5))
    axes.set_title(f"where the runs are (grey: training domain, {number(load['low']):.3g} to "
                   f"{number(load['high']):.3g} N;\ndiamonds: held out; crosses: overloads)", fontsize=8.5)


def curve(axes, stress, **style):
    for key, dashes in (("normal_pa", "-"), ("shear_tangential_pa", "--")):
        values = [number(v) / 1e3 for v in stress[key]]
        first, step = number(stress["first_angle_rad"]), number(stress["angle_step_rad"])
        axes.plot([(first + (i + 0.5) * step) / DEGREE for i in range(len(values))], values, dashes, **style)
        style.pop("label", None)


def stress_panel(axes, e):
    stresses = [(run, color) for run, color, _ in runs_of(e) if "stress" in run and run["stress"]]
    for near, color in stresses:
        curve(axes, near["stress"], color=color, linewidth=1.2, label=short(near["run"]))
    if e.get("physics_stress"):
        curve(axes, e["physics_stress"], color="black", linewidth=0.9, alpha=0.7, label="physics, at the state")
    if axes.lines:
        axes.legend(fontsize=6.5)
    why = {near["no_stress"] for near, _, _ in runs_of(e)} - {""}
    axes.set_xlim(-120, 120)
    axes.axhline(0, color="0.7", linewidth=0.6, zorder=0)
    axes.set_xlabel("angle from straight down, forward positive [deg]", fontsize=8)
    axes.set_ylabel("stress on the rim [kPa]", fontsize=8)
    missing = "; ".join(sorted(why)) or "; ".join(e["notes"]) or "no runs"
    title = "rims of the runs: normal solid, shear dashed" if stresses else f"rims of the runs: none\n{missing}"
    axes.set_title("\n".join(line for part in title.split("\n") for line in textwrap.wrap(part, 78)), fontsize=8.5)


def load_pyplot():
    import matplotlib  # here: what is refused needs no half second for it
    matplotlib.use("agg")
    matplotlib.rcParams.update(html_page.STYLE)
    matplotlib.rcParams["svg.hashsalt"] = "grouser"  # the same file for the same numbers
    matplotlib.rcParams["text.parse_math"] = False  # a "$" in a name is one
    from matplotlib import pyplot
    return pyplot


def heading(e):
    lines = [e["model"]]
    angle, slip = number(e["attack_angle_rad"]) / DEGREE, number(e["slip"])
    lines.append(f"slip {slip:.4g}, attack angle {angle:.4g} deg, load {number(e['load_n']):.4g} N, "
                 f"{number(e['speed_m_per_s']):.4g} m/s; hull distance {number(e['hull_distance']):.2f}; "
                 f"{e['runs_fitted']} runs fitted")
    for reason in e["reasons"]:
        flag = str(reason["flag"]).removeprefix("STATE_FLAG_")
        lines += textwrap.wrap(f"{flag}: {reason['text']}", 150)
    if not e["reasons"]:
        lines.append("no flags")
    return [line.replace("\n", " ") for line in lines]


def draw(e, path):
    pyplot = load_pyplot()
    lines = heading(e)
    height = 7.4 + 0.16 * len(lines)
    figure, ((a, b), (c, d)) = pyplot.subplots(2, 2, figsize=(11, height), layout="constrained")
    outputs_panel(a, e)
    parts_panel(b, e)
    domain_panel(c, e)
    stress_panel(d, e)
    figure.suptitle(lines[0], fontsize=9, x=0.01, ha="left")
    figure.get_layout_engine().set(rect=(0, 0, 1, 1 - (0.16 * len(lines) + 0.1) / height))
    for i, line in enumerate(lines[1:]):
        figure.text(0.01, 1 - (0.3 + 0.16 * i + 0.05) / height, line, fontsize=8, va="top")
    metadata = {"Date": None} if path.suffix == ".svg" else {}
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110, metadata=metadata)


def told(command):
    """Runs the program and prints what it prints; (exit code, its --json), nothing where it failed and has said why."""
    first = subprocess.run(command, stdout=subprocess.PIPE, check=False)
    sys.stdout.buffer.write(first.stdout)
    sys.stdout.flush()
    if "--json" in command or not first.stdout:
        return first.returncode, first.stdout
    again = subprocess.run([*command, "--json"], capture_output=True, check=False)  # warnings were seen before
    if not again.stdout:
        sys.stderr.buffer.write(again.stderr)
    return first.returncode or again.returncode, again.stdout


def draw_told(text, path):
    """The picture of what --json printed. Refused is what is none of it, whatever Python makes of that."""
    try:
        data = json.loads(text)
        explanation = data.get("explanation", data)
        if "reasons" not in explanation:
            raise Refused("--plot goes with `query --explain` or `model explain`")
        draw(explanation, path)
    except (ArithmeticError, AttributeError, LookupError, RecursionError, TypeError, ValueError) as error:
        raise Refused(f"expected what --json prints: {type(error).__name__}: {error}") from error


def main():
    own, command = sys.argv[1:], []
    if "--" in own:
        own, command = own[:own.index("--")], own[own.index("--") + 1:]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plot", type=pathlib.Path, required=True)
    parser.add_argument("--from", dest="source", type=pathlib.Path)
    options = parser.parse_args(own)
    if options.plot.suffix not in SUFFIXES:
        parser.error(f"--plot: {options.plot}, expected a name that ends with {', '.join(SUFFIXES)}")
    if bool(command) == bool(options.source):
        parser.error("expected either --from FILE or -- PROGRAM ARGUMENTS")
    code, text = (0, options.source.read_bytes()) if options.source else told(command)
    if not text.strip() and not options.source:
        return code or 1  # the program has said why
    try:
        draw_told(text, options.plot)
    except Refused as refused:
        print(f"explain: {options.source or command[0]}: no explanation to draw: {refused}", file=sys.stderr)
        return 2
    print(f"explain: wrote {options.plot}", file=sys.stderr)
    return code


if __name__ == "__main__":
    try:
        sys.exit(main())
    except OSError as error:
        print(f"explain: {error.filename}: {error.strerror}", file=sys.stderr)
        sys.exit(1)
