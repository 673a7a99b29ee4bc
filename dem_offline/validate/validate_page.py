"""The page of a validation: rms by region, every row, figures."""

import shlex

import numpy
from html_page import document, picture, reading, section, table
from matplotlib import pyplot

UNIT = {"f_x": (1, "N"), "f_y": (1, "N"), "torque": (1, "N m"), "sinkage": (1000, "mm")}
NAME = {"f_x": "drawbar pull f_x", "f_y": "side force f_y", "torque": "drive torque", "sinkage": "sinkage"}
SOURCE = {"dem": "DEM", "model": "model"}


def model_outputs(answer):
    """Of `grouser-fit eval --json`."""
    outputs = answer["outputs"]
    return {"outputs": {name: {"value": float(outputs[name]["value"]), "standard_error": None}
                        for name in UNIT if outputs.get(name, {}).get("value") is not None},
            "flags": answer["flag_names"]}


def bed_of(record):
    """What the preparation of a bed reached."""
    bed = record["bed"]
    names = ("solid_fraction", "top_solid_fraction", "surface_m", "bulk_density_kg_per_m3", "coordination",
             "preparation_friction", "preparation_rolling_friction")
    return {name: float(bed[name]) for name in names if name in bed}


def beds_table(beds):
    names = list(next(iter(beds.values())))
    return table(["seed", *names], [[seed, *(one.get(name) for name in names)] for seed, one in sorted(beds.items())])


def with_error(one, output):
    if not one:
        return "–"
    scale, _ = UNIT[output]
    error = one.get("standard_error")
    return f"{scale * one['value']:.2f}" + ("" if error is None else f" ± {scale * error:.2f}")


def error_rows(result):
    return [(one["region"], NAME[one["output"]], SOURCE[one["of"]], one["rows"],
             f"{UNIT[one['output']][0] * one['rms']:.2f} ± {UNIT[one['output']][0] * one['standard_error']:.2f}"
             f" {UNIT[one['output']][1]}", f"{UNIT[one['output']][0] * one['mean']:+.2f}") for one in result["errors"]]


def outputs_in(result):
    return [name for name in UNIT if any(name in row["measured"] for row in result["rows"])]


def row_rows(result):
    sources = ["measured", "DEM"] + (["model"] if any("model" in row for row in result["rows"]) else [])
    head = ["row", "slip", "angle deg", "load N"]
    head += [f"{name} {UNIT[name][1]}, {source}" for name in outputs_in(result) for source in sources]
    rows = []
    for row in result["rows"]:
        line = [row["row"], f"{row['slip']:+.3f}", f"{row['attack_angle_deg']:g}", f"{row['load_n']:.2f}"]
        for name in outputs_in(result):
            line.append(with_error(row["measured"].get(name), name))
            line.append(with_error(row["dem"]["outputs"].get(name), name))
            if "model" in sources:
                line.append(with_error(row.get("model", {}).get("outputs", {}).get(name), name))
        dem = row["dem"]
        rows.append(line + [dem["beds"], "equal travel" if dem["equal_travel"] else "own window",
                            ", ".join(dem["statuses"])])
    return head + ["beds", "means over", "runs ended"], rows


ERROR_HEAD = ("region", "output", "of", "rows", "rms ± standard error", "mean error")


def markdown(result):
    def lines(head, rows):
        return ["| " + " | ".join(str(one) for one in head) + " |", "| " + " | ".join("---" for _ in head) + " |",
                *("| " + " | ".join(str(one) for one in row) + " |" for row in rows)]
    reached = "; ".join(f"{one['solid_fraction']:.4f}" for one in result["bed_reached"].values())
    return "\n".join([f"## {result['table']}: soil {result['soil']}, scene {result['scene']}", "",
                      f"Engine {result['engine_version']}, {result['beds']} beds of solid fraction {reached}.", "",
                      *lines(ERROR_HEAD, error_rows(result)), "", *lines(*row_rows(result))]) + "\n"


def series_of(rows, source, output):
    points = [(row["slip"], one["value"], one.get("standard_error") or 0.0)
              for row in rows for one in [(row["measured"] if source == "measured" else
                                           row.get(source, {}).get("outputs", {})).get(output)] if one]
    return numpy.array(sorted(points)).reshape(-1, 3)


def figure_of(result, output):
    """Against slip, a panel for each slip angle."""
    angles = sorted({round(row["attack_angle_deg"], 3) for row in result["rows"]})
    scale, unit = UNIT[output]
    figure, axes = pyplot.subplots(1, len(angles), figsize=(3.4 * len(angles) + 0.8, 3.2), sharey=True, squeeze=False)
    style = {"measured": dict(color="black", marker="o", ls="none", label="measured"),
             "dem": dict(color="#c1121f", marker="s", ls="none", label="DEM"),
             "model": dict(color="#1d4e89", marker="", ls="-", label="model")}
    for axis, angle in zip(axes[0], angles):
        rows = [row for row in result["rows"] if round(row["attack_angle_deg"], 3) == angle]
        for source, look in style.items():
            points = series_of(rows, source, output)
            if len(points):
                if source == "model" and len(points) == 1:
                    look = dict(look, marker="^")
                axis.errorbar(points[:, 0], scale * points[:, 1], 2 * scale * points[:, 2], ms=4, lw=1.2, capsize=2,
                              **look)
        axis.set_title(f"{angle:g}°")
        axis.set_xlabel("slip")
    axes[0][0].set_ylabel(f"{NAME[output]}, {unit}")
    handles = {label: handle for axis in axes[0] for handle, label in zip(*axis.get_legend_handles_labels())}
    axes[0][-1].legend(handles.values(), handles.keys())
    figure.tight_layout()
    return figure


def worst(result):
    """What stands out, in words."""
    lines = []
    for name in outputs_in(result):
        pairs = [(abs(row["dem"]["outputs"][name]["value"] - row["measured"][name]["value"]), row)
                 for row in result["rows"] if name in row["dem"]["outputs"] and name in row["measured"]]
        if pairs:
            error, row = max(pairs, key=lambda pair: pair[0])
            scale, unit = UNIT[name]
            lines.append(f"{NAME[name]}: farthest off by {scale * error:.2f} {unit} in row {row['row']} (slip "
                         f"{row['slip']:+.3f}, {row['attack_angle_deg']:g} degrees)")
    return "; ".join(lines) + "."


def render(result, command):
    lead = reading(f"{len(result['rows'])} rows of {result['table']} beside DEM runs on {result['beds']} beds: soil "
                   f"{result['soil']}, scene {result['scene']}, engine {result['engine_version']}. {worst(result)}")
    short = [row["row"] for row in result["rows"] if not row["dem"]["equal_travel"]]
    note = ("All rows are compared over the same stretch of hub travel." if not short else
            "Rows that ended before the stretch of equal travel, and stand for their own windows: "
            + ", ".join(map(str, short)) + ".")
    parts = [section("Error by region", table(ERROR_HEAD, error_rows(result)),
                     reading("Error: DEM or model less measurement. Braking is told by the rim's speed over the hub's "
                             "whole speed, at least 0.8 in the first two regions; locked: the rim stands. Standard "
                             "errors: of the beds and of the repeats of the measurement.")),
             *(section(NAME[name], picture(figure_of(result, name), NAME[name] + " against slip"))
               for name in outputs_in(result)),
             section("Rows", table(*row_rows(result)), reading(note)),
             section("Beds", beds_table(result["bed_reached"]),
                     reading("Sinkage counts from surface_m, the plane of equal mass. Models of engine 5 and before "
                             "count from the cut plane, which lies so much higher.")),
             section("Command", f"<pre style='white-space:pre-wrap'>{shlex.join(command)}</pre>")]
    return document("Measured wheel tests beside DEM" if not any("model" in row for row in result["rows"]) else
                    "Measured wheel tests beside DEM and a model", lead, "".join(parts))

