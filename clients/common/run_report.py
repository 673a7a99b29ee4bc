"""Parts of a page about runs of experiment files: what each took and ended with, and its command."""

import html
import math
import os
import shlex

from html_page import table

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))


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


def command_list(results, command):
    """As typed in the top folder of the project."""
    lines = [shlex.join(command)]
    lines += [shlex.join(["./grouser", "dem", "run", os.path.relpath(r.plan.file, ROOT), *r.plan.options(), "--out",
                          r.plan.name + ".run.h5"]) for r in results.values()]
    return "<pre style='white-space:pre-wrap;font-size:12px'>" + html.escape("\n".join(lines)) + "</pre>"
