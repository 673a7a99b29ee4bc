"""Parts of a page about runs of experiment files: what each took and ended with, and its command."""

import html
import math
import shlex

from html_page import table


def run_table(results):
    rows = []
    for r in results.values():
        n = r.numerics
        work = abs(float(r.record["energy"]["input_j"]))
        residual = abs(float(r.record["energy"]["residual_j"])) / work if work > 0 else math.nan
        rows.append((r.plan.name, r.record["status"].replace("RUN_STATUS_", ""),
                     int(r.record["bed"]["grains"]), float(n["dt_s"]), int(n["steps"]), float(n["wall_s"]),
                     float(r.record["bed"]["solid_fraction"]), float(n["overlap_p99_over_radius"]),
                     residual, r.reason))
    return table(("run", "status", "grains", "step s", "steps", "wall s", "solid fraction",
                  "overlap p99/r", "energy residual/work", "reason"), rows)


def command_list(program, results, command):
    lines = [shlex.join(command)]
    for r in results.values():
        lines.append(shlex.join([program, "run", r.plan.file, *r.plan.options(), "--out",
                                 r.stem + ".run.h5"]))
    return "<pre style='white-space:pre-wrap;font-size:12px'>" + html.escape("\n".join(lines)) + "</pre>"
