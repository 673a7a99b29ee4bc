"""The table and the page of a virtual bevameter."""

import math
import os
import sys

from html_page import document, picture, reading, section, table
from measured import OVERLAP
from run_report import command_list, run_table

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.append(os.path.join(ROOT, "surrogate", "calibrate"))

import calibrate as calibration_page  # noqa: E402

LAST = "shear_modulus"  # of the soil's own parameters; what follows is a wheel's
SHOWN = {"cohesion": (1e-3, "kPa"), "friction_angle": (180 / math.pi, "deg"), "shear_modulus": (1e3, "mm"),
         "k_c": (1e-3, "kN/m^(n+1)"), "k_phi": (1e-3, "kN/m^(n+2)")}
DENSITIES = {"soil_file": "the soil file says", "bed": "bed, as prepared", "poured": "poured, grains' own friction",
             "tapped": "tapped (30 times, 3 g)"}
HEAD = ("parameter", "bevameter (DEM)", "90 %", "identified")
BESIDE_HEAD = ("measured", "90 %", "identified", "intervals meet")


def own(parameters):
    """Without those of a wheel."""
    return parameters[:1 + [one["name"] for one in parameters].index(LAST)]


def reece_of(found):
    """The soil's own of Reece's form; None where it was not fitted: plates of one width."""
    return own(found["reece_parameters"]) if found and found["reece_parameters"] else None


def parameters_of(found):
    """The soil's own of calibration.json: Bekker's form, and Reece's where it is the better one."""
    if not found:
        return None
    result = own(found["bekker_parameters"])
    names = {one["name"] for one in result}
    if found["form"] == "reece":
        result += [one for one in found["parameters"] if one["name"].startswith("reece") and one["name"] not in names]
    return result


def shown(one):
    """(value, interval, whether the tests tell it) as text."""
    scale, unit = SHOWN.get(one["name"], (1, one["unit"]))

    def text(value, unknown):
        return unknown if value is None else f"{scale * value:.4g}"
    interval = f"{text(one['low90'], '-inf')} to {text(one['high90'], 'inf')}"
    value = f"{text(one['value'], '–')} {unit if unit != '-' else ''}".strip()
    return value, interval, "yes" if one["identified"] else "no"


def meet(a, b):
    if not (a["identified"] and b["identified"]):
        return "not told"  # wide intervals always meet

    def low(one):
        return -math.inf if one["low90"] is None else one["low90"]

    def high(one):
        return math.inf if one["high90"] is None else one["high90"]
    return "yes" if low(a) <= high(b) and low(b) <= high(a) else "NO"


def parameter_rows(summary):
    """(header, rows); with what was measured, where that stands beside."""
    beside = {one["name"]: one for one in summary["beside"] or []}
    rows = []
    for one in summary["parameters"] or []:
        other = beside.get(one["name"])
        more = (*shown(other), meet(one, other)) if other else ("–",) * len(BESIDE_HEAD) if beside else ()
        rows.append((one["name"], *shown(one), *more))
    return HEAD + BESIDE_HEAD if beside else HEAD, rows


def pressure(found, width, sinkage):
    """Of Bekker's law p = (k_c/b + k_phi) z^n [Pa]."""
    p = {one["name"]: one["value"] for one in found["bekker_parameters"]}
    return (p["k_c"] / width + p["k_phi"]) * sinkage ** p["n"]


def pressure_rows(bench, found, beside):
    """(header, rows): the moduli's units depend on n; pressures do not."""
    laws = [one for one in (found, beside) if one]
    rows = [(f"pressure under the {mm} mm plate at {1e3 * z:g} mm, kPa",
             *(f"{1e-3 * pressure(law, 5e-4 * mm, z):.3g}" for law in laws))
            for mm in bench.plates for z in (0.01, 0.02) if laws]
    return ("Bekker's law", "bevameter (DEM)", "measured")[:1 + len(laws)], rows


def with_sd(one, scale=1.0):
    sd = "" if one["sd_of_beds"] is None else f" ± {scale * one['sd_of_beds']:.2g}"
    return f"{scale * one['value']:.4g}{sd}"


def force_rows(summary):
    """(header, rows) of what was measured beside."""
    rows = [(f"{one['test']} at {1e3 * one['sinkage_m']:g} mm", f"{one['measured_n']:.4g}", with_sd(one), one["beds"],
             f"{100 * (one['value'] / one['measured_n'] - 1):+.0f} %") for one in summary["forces"]]
    return ("force, N", "measured", "bevameter (DEM) ± sd over beds", "beds", "difference"), rows


def number_rows(summary):
    """(header, rows)."""
    rows = [(f"bulk density, {DENSITIES[key]}, kg/m^3", with_sd(one), one["beds"])
            for key, one in summary["bulk_density"].items()]
    if summary["cone_index"]:
        one = summary["cone_index"]
        rows.append((f"cone index, mean over 0 to {1e3 * one['to_depth_m']:.0f} mm, kPa", with_sd(one, 1e-3),
                     one["beds"]))
        rows.append(("its gradient with depth, kPa/m", with_sd(one["gradient"], 1e-3), one["beds"]))
    if summary["angle_of_repose"]:
        one = summary["angle_of_repose"]
        rows.append(("angle of repose, deg", with_sd(one), one["beds"]))
    return ("number", "value ± sd over beds", "beds"), rows


def markdown(summary, bench, found, beside):
    def lines(head, rows):
        return ["| " + " | ".join(map(str, row)) + " |" for row in (head, ["---"] * len(head), *rows)] if rows else []
    what = (f"{summary['soil']}: grains of {1e3 * summary['grain_diameter_m']:.3g} mm, {summary['beds']} "
            f"bed{'s' if summary['beds'] > 1 else ''}, engine {summary['engine_version']}")
    tables = parameter_rows(summary), pressure_rows(bench, found, beside), force_rows(summary), number_rows(summary)
    blocks = [lines(*one) for one in tables]
    return "\n".join([what, *("\n" + "\n".join(block) for block in blocks if block)])


def curves(found, beside):
    """Figures of every kind of test: measured rows stand beside, with open marks."""
    rows = [dict(row) for row in found["observations"]]
    for row in (beside or {"observations": []})["observations"]:
        if row["kind"] in ("plate", "press", "shear"):
            rows.append({**row, "test": "measured: " + row["test"], "held_out": True})
    groups = dict.fromkeys((row["kind"], row["measured"]) for row in rows)
    return [calibration_page.plot([row for row in rows if (row["kind"], row["measured"]) == group], *group)
            for group in groups]


def cone_figure(cone):
    from matplotlib import pyplot
    figure, axes = pyplot.subplots(figsize=(6.4, 3.4))
    for seed, curve in cone.items():
        axes.plot(1e-3 * curve[:, 1], 1e3 * curve[:, 0], lw=1, label=f"bed {seed}")
    axes.invert_yaxis()
    axes.set_xlabel("penetration resistance [kPa]")
    axes.set_ylabel("depth of the cone's base [mm]")
    axes.legend(fontsize=8)
    figure.tight_layout()
    return picture(figure, "penetration resistance against depth")


def sizes(bench):
    d = 1e3 * bench.soil.diameter
    inner, outer = (1e3 * r for r in bench.ring_radii)
    rows = [("bed, length = width x depth", f"{1e3 * bench.side:.4g} x {1e3 * bench.depth:.4g}",
             f"{1e3 * bench.depth / d:.1f} (depth)")]
    rows += [(f"plate{mm}, diameter", mm, f"{mm / d:.1f}") for mm in bench.plates]
    wheel = {"radius": 1e3 * bench.wheel_radius, "width": 1e3 * bench.wheel_width}
    rows += [(f"pressed wheel, {what}", f"{size:.4g}", f"{size / d:.1f}") for what, size in wheel.items()]
    rows += [("ring, inner to outer radius", f"{inner:.4g} to {outer:.4g}", f"{(outer - inner) / d:.1f} (width)"),
             ("cone, radius of its base", f"{1e3 * bench.cone_radius:.4g}", f"{1e3 * bench.cone_radius / d:.1f}")]
    return table(("what", "mm", "mean grain diameters"), rows)


def overlap_words(overlap):
    return (f"overlaps of {100 * overlap:.1f} % of the radius (99th percentile), expected at most "
            f"{100 * OVERLAP:.0f} %: these grains are too soft for its pressure")


def render(summary, bench, results, found, beside, cone, command):
    lead = reading(f"Soil file {summary['soil_file']}, grains of {1e3 * summary['grain_diameter_m']:.3g} mm, beds: "
                   f"{summary['beds']}, engine {summary['engine_version']}. Friction of the tools: "
                   f"{summary['tool_friction']:g}. Parameters belong to this grain size.")
    parts = []
    if summary["failed"]:
        parts.append(section("Runs that failed", table(("run", "reason"), [(f["run"], f["reason"])
                                                                         for f in summary["failed"]])))
    if found:
        parts.append(section("Parameters", reading(found["why_form"] + ". The table has Bekker's."),
                             table(*parameter_rows(summary),
                                   "Intervals of 90 % by profile likelihood; not identified: rests on what is "
                                   "typical of published soils. More: calibrated/report.html."),
                             table(*pressure_rows(bench, found, beside))))
        parts.append(section("Curves", reading("Marks: means over bins of one bed; lines and bands: the fit, 90 % "
                                               "for one more row. Open marks are measured, beside."),
                             *curves(found, beside)))
    if cone:
        parts.append(section("Cone", cone_figure(cone)))
    if summary["forces"]:
        parts.append(section("Forces beside measured ones", table(*force_rows(summary))))
    parts += [section("Numbers", table(*number_rows(summary))),
              section("Sizes", sizes(bench)), section("Runs", run_table(results),
                                               *(reading(f"{run}: {overlap_words(overlap)}.")
                                                 for run, overlap in summary["large_overlaps"].items())),
              section("Commands", command_list(results, command))]
    return document(f"Virtual bevameter: {summary['soil']}", lead, "".join(parts))
