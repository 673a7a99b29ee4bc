#!/usr/bin/python3
"""Writes the demo's report: one HTML file with its plots inside.

Usage: report.py DATA.json REPORT.html      (DATA.json: written by demo.py)
"""

import csv
import html
import json
import math
import os
import statistics
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))),
                                "common"))

import plots  # noqa: E402  (needs the path)
import readings  # noqa: E402
from html_page import document, picture, reading, section, table  # noqa: E402
from processes import write_atomically  # noqa: E402
from records import AXES, EXTRAPOLATED, OUTPUTS, PREDICTED, Responses, Run, number  # noqa: E402


def mean_of(runs, *path):
    def value(run):
        node = run.record
        for key in path:
            node = node[key]
        return number(node)
    return statistics.fmean(value(run) for run in runs)


def setup_section(runs, data):
    steady = [run for run in runs if run.steady]
    spec = steady[0].record["spec"]
    rig, wheel, grains = spec["rig"], spec["wheel"], spec["soil"]["grains"]
    box = " × ".join(f"{1000 * number(rig[key]):.0f}" for key in
                     ("bed_length_m", "bed_width_m", "bed_depth_m"))
    facts = [
        ("wheel", f"{wheel['name']}: radius {1000 * number(wheel['radius_m']):.1f} mm, "
                  f"width {1000 * number(wheel['width_m']):.1f} mm, smooth, rigid"),
        ("soil", f"{spec['soil']['name']}: bulk density "
                 f"{number(spec['soil']['bulk_density_kg_per_m3']):.0f} kg/m³ wanted, "
                 f"{mean_of(steady, 'bed', 'bulk_density_kg_per_m3'):.0f} settled, "
                 f"solid fraction {mean_of(steady, 'bed', 'solid_fraction'):.3f}"),
        ("mean grain diameter d", f"{1000 * mean_of(steady, 'bed', 'mean_diameter_m'):.2f} mm, "
                                  f"{mean_of(steady, 'bed', 'grains'):.0f} grains"),
        ("box", f"{box} mm (periodic along and across)"),
        ("speed", f"max(|r w|, V) = {number(rig['speed_m_per_s']):g} m/s, inertial number "
                  f"{mean_of(steady, 'numerics', 'inertial_number'):.2g}"),
        ("stiffness", f"E {number(grains['youngs_modulus_pa']):.2g} Pa; 99th-percentile overlap "
                      f"{100 * mean_of(steady, 'numerics', 'overlap_p99_over_radius'):.1f} % of the radius"),
        ("time step", f"{1e6 * mean_of(steady, 'numerics', 'dt_s'):.0f} µs, "
                      f"{mean_of(steady, 'numerics', 'particle_steps'):.2g} particle-steps a run, "
                      f"{mean_of(steady, 'numerics', 'wall_s'):.0f} s of one core"),
        ("energy", "largest residual "
                   f"{100 * max(energy_residual(run) for run in steady):.2g} % of the work put in"),
    ]
    rows = "".join(f"<tr><th>{name}</th><td>{html.escape(text)}</td></tr>" for name, text in facts)
    return section("What was run", f"<table class=facts>{rows}</table>",
                   reading(readings.campaign(runs)), broken_rules_table(runs),
                   standard_error_table(steady))


def energy_residual(run):
    energy = run.record["energy"]
    return abs(number(energy["residual_j"])) / max(abs(number(energy["input_j"])), 1e-12)


def broken_rules_table(runs):
    broken = {}
    for run in runs:
        for rule in run.broken_rules():
            broken.setdefault(rule["name"], []).append(rule)
    if not broken:
        return reading("No size rule was broken.")
    rows = [(name, len(rules), span(rules, "value"), span(rules, "limit"))
            for name, rules in broken.items()]
    return "<h3>Size rules broken</h3>" + table(
        ("rule", f"runs of {len(runs)}", "value", "limit"), rows,
        "These runs are small enough for two cores; what a broken rule costs in accuracy is not in the intervals.")


def span(rules, key):
    low, high = (f(number(rule[key]) for rule in rules) for f in (min, max))
    return f"{low:.3g}" if f"{low:.3g}" == f"{high:.3g}" else f"{low:.3g} to {high:.3g}"


def standard_error_table(steady):
    rows = []
    for output in OUTPUTS:
        label, unit, scale = AXES[output]
        errors = [scale * run.standard_error[output] for run in steady]
        rows.append((output, unit, statistics.median(errors), max(errors)))
    return "<h3>Standard errors of the steady means (block averages)</h3>" + table(
        ("output", "unit", "median", "largest"), rows)


def runs_section(runs):
    rows = [(run.role, run.status, run.slip, run.angle_deg, run.load_n, run.seed,
             *(AXES[o][2] * run.mean.get(o, math.nan) for o in OUTPUTS),
             run.record.get("reason", "")) for run in runs]
    header = ("role", "status", "slip", "angle °", "load N", "seed", "f_x N", "f_y N", "f_z N",
              "torque N m", "m_z N m", "sinkage mm", "reason")
    return section("All runs", table(header, rows))


def response_sections(runs, data):
    steady = [run for run in runs if run.steady]
    load = data["load_n"]
    slip_curves = {float(k): Responses(v) for k, v in data["curves_over_slip"].items()}
    angle_curves = {float(k): Responses(v) for k, v in data["curves_over_angle"].items()}
    rows = data["compare"]["rows"]
    near = [row for row in rows if abs(number(row["load_n"]) / load - 1) < 0.15
            and any(abs(number(row["attack_angle_deg"]) - angle) < 0.5 for angle in slip_curves)]
    yield section(f"Forces, torque and sinkage against slip, load {load:g} N",
                  picture(plots.against_slip(slip_curves, steady, near, load), "forces against slip"),
                  reading(readings.against_slip(steady, len(near), len(rows), load)))
    yield section(f"Against attack angle, load {load:g} N",
                  picture(plots.against_angle(angle_curves, steady, load), "forces against attack angle"),
                  reading(readings.against_angle(angle_curves)))
    held_out = held_out_pairs(runs, data)
    if held_out:
        yield section("Surrogate against held-out DEM",
                      picture(plots.parity(held_out), "parity plot"),
                      reading(readings.parity(held_out, data["interval_level"])),
                      error_table(data["model"]))
    shown = readings.pressure_run(steady)
    yield section("Pressure under the wheel", picture(plots.pressure(shown), "contact stress"),
                  reading(readings.pressure(shown)))


def held_out_pairs(runs, data):
    by_id = {run.run_id: run for run in runs if run.steady}
    held_out = data["held_out"]
    return [(by_id[run_id], answer_of(held_out["responses"], index))
            for index, run_id in enumerate(held_out["run_ids"])]


def answer_of(message, index=0):
    responses = Responses(message)
    return {output: tuple(responses.array(output, field)[index]
                          for field in ("value", "low", "high")) for output in OUTPUTS}


def error_table(model):
    rows = [(row["region"].replace("REGION_", "").lower(), f"{row['output']} {AXES[row['output']][1]}",
             row["set"].replace("_", " "), int(row["n"]),
             *(AXES[row["output"]][2] * number(row[key]) for key in ("rmse", "max_abs")),
             f"{100 * number(row['covered90']):.0f} %")
            for row in model["errors"] if int(row["n"]) > 0]
    return "<h3>Error table of the model</h3>" + table(
        ("region", "output", "set", "n", "rmse", "largest", "inside the interval"), rows,
        "Where n is small, the numbers beside it say little.")


def compare_section(compare):
    """What `grouser-fit compare --json` gives, row by row, and by region."""
    rows = []
    for row in compare["rows"]:
        state = (f"{number(row['slip']):.2f}", f"{number(row['attack_angle_deg']):.0f}",
                 f"{number(row['load_n']):.1f}")
        for output, entry in row["measured"].items():
            if math.isnan(number(entry["value"])):
                continue
            scale, dem = AXES[output][2], row["dem"]
            rows.append((*state, f"{output} {AXES[output][1]}",
                         with_error(dem[output], "standard_error", scale) if dem else "–",
                         interval(row["surrogate"][output], scale),
                         "outside" if int(row["flags"]) & EXTRAPOLATED else "",
                         with_error(entry, "sd", scale)))
    errors = [(e["region"], f"{e['output']} {AXES[e['output']][1]}", e["n"],
               *(AXES[e["output"]][2] * number(e[key]) for key in ("mean_measured", "rmse", "rmse_dem")),
               e["n_dem"]) for e in compare["errors"]]
    return section("DEM, surrogate and measurement",
                   table(("region", "output", "n", "mean measured", "surrogate rms off", "DEM rms off",
                          "n DEM"), errors),
                   reading(readings.measured(compare["rows"])), "<h3>Point by point</h3>",
                   table(("slip", "angle °", "load N", "output", "DEM ± se", "surrogate [interval]",
                          "training hull", "measured ± sd"), rows))


def with_error(entry, error, scale):
    return f"{scale * number(entry['value']):.3g} ± {scale * number(entry[error]):.2g}"


def interval(entry, scale):
    value, low, high = (scale * number(entry[key]) for key in ("value", "low", "high"))
    return f"{value:.3g} [{low:.3g}, {high:.3g}]"


def latency_section(rows):
    return section("Latency", table(
        ("transport", "states a message", "fields", "messages", "p50 µs", "p99 µs", "p50 over an echo"),
        [(r["transport"], r["states"], r["fields"], r["samples"], f"{r['p50']['server_us']:.0f}",
          f"{r['p99']['server_us']:.0f}", f"{r['p50']['ratio']:.2f}") for r in rows]),
        reading("Round trips as a client on this machine sees them, one message at a time, by turns with those "
                "of an echo of the same messages, client and servers sharing its cores."))


def refinement_section(data):
    item = data["refinement"]
    before, after = answer_of(item["before"]), answer_of(item["after"])
    held_out, worker = Run(item["held_out"]), Run(item["job"]["run"])
    rows = [(f"{o} {AXES[o][1]}", *(AXES[o][2] * x for x in (
        before[o][0], (before[o][2] - before[o][1]) / 2, abs(before[o][0] - held_out.mean[o]),
        after[o][0], (after[o][2] - after[o][1]) / 2, abs(after[o][0] - held_out.mean[o]),
        held_out.mean[o], held_out.standard_error[o]))) for o in PREDICTED]
    gate = [(check["name"], "passed" if check["passed"] else "failed", check["detail"])
            for check in item["job"]["gate"]]
    where = (f"slip {worker.slip:.2f}, attack angle {worker.angle_deg:.0f}°, load {worker.load_n:g} N")
    return section("One refinement", reading(f"At {where}, a state that no run of the campaign has."),
                   picture(plots.refinement(before, after, held_out, worker), "refinement"),
                   table(("output", "before", "± half width", "error", "after", "± half width", "error",
                          "held-out DEM", "its se"), rows),
                   reading(readings.refinement(before, after, held_out)),
                   "<h3>Gate</h3>", table(("check", "result", "detail"), gate),
                   reading(f"Job {item['job']['job_id']}: run file {item['job']['run_file']}, SHA-256 "
                           f"{item['job']['run_sha256']}, verified on disk and found in the provenance of "
                           f"candidate {item['job']['candidate_digest'][:12]}, which was promoted "
                           f"{item['promotion']}."))


def mission_section(mission):
    names, values = csv.reader(mission["soil"])
    return section("A mission", reading(
        f"A speed plan and an energy estimate of the vehicle {mission['vehicle']}, asked {mission['asked']} times while "
        f"the job {mission['job']} calibrated a soil for the same servers: each was the answer without the job, and "
        "the soil is the one that grouser-calibrate finds alone."),
        table(("parameter", "value"), list(zip(names, values))))


def stage_section(stages):
    return section("Stages", table(("stage", "seconds"), [(s["name"], f"{s['seconds']:.1f}") for s in stages]))


def render(data):
    runs = [Run(entry["record"], entry["role"]) for entry in data["runs"]]
    body = "".join([setup_section(runs, data), *response_sections(runs, data), compare_section(data["compare"]),
                    refinement_section(data), mission_section(data["mission"]), latency_section(data["latency"]),
                    runs_section(runs), stage_section(data["stages"])])
    model = data["model"]
    lead = f"""<p>Model {html.escape(model['name'])}, {len(runs)} DEM runs, made by <code>./grouser demo</code>
(version {html.escape(data['version'])}). Conventions: contact frame x forward, y left, z up; wrench of
the soil on the wheel at its centre; slip = (r w − v_x) / max(|r w|, V); bars of DEM means are 90 %.</p>"""
    return document("Grouser demo", lead, body)


def main():
    if len(sys.argv) != 3 or sys.argv[1] in ("-h", "--help"):
        print(__doc__, file=sys.stderr)
        return 2
    with open(sys.argv[1]) as file:
        data = json.load(file)
    write_atomically(sys.argv[2], render(data))
    return 0


if __name__ == "__main__":
    sys.exit(main())
