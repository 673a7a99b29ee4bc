"""The page of a reproduced system: rows, what was changed, figures, runs, commands."""

import html
import math
import shlex

from html_page import document, picture, reading, section, table


def show(value):
    if value is None:
        return "–"
    if isinstance(value, str):
        return html.escape(value)
    return "–" if not math.isfinite(value) else f"{value:.4g}"


def row_table(rows):
    head = ("row", "got", "standard error", "beds", "expected", "limit", "", "changed against the paper",
            "note")
    words = {True: "<b style='color:#1a7f37'>holds</b>", False: "<b style='color:#c1121f'>fails</b>",
             None: "<span style='color:#666'>printed</span>"}
    body = "".join(
        "<tr>" + "".join(f"<td style='white-space:normal;text-align:left;vertical-align:top'>{text}</td>" for text in (
            html.escape(r.row), show(r.got), show(r.standard_error), str(r.beds), show(r.expected),
            html.escape(r.limit), words[r.passed], html.escape(r.changed), html.escape(r.note)))
        + "</tr>\n" for r in rows)
    return ("<div class=scroll><table><tr>" + "".join(f"<th>{text}</th>" for text in head)
            + f"</tr>\n{body}</table></div>")


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


def render(system, level, rows, results, command, program):
    """`system`: the module of a system, with TITLE and ABOUT, perhaps changed() and figures()."""
    failing = sum(r.passed is False for r in rows)
    held = sum(r.passed is True for r in rows)
    lead = reading(f"Level {level}: {held} rows hold, {failing} fail, "
                   f"{sum(r.passed is None for r in rows)} are printed only.") + reading(system.ABOUT)
    parts = [section("Rows", row_table(rows))]
    if hasattr(system, "changed"):
        items = "".join(f"<li>{html.escape(text)}</li>" for text in system.changed(level))
        parts.append(section("Changed against the paper", f"<ul>{items}</ul>"))
    if hasattr(system, "figures"):
        for title, figure, text in system.figures(results, level):
            parts.append(section(title, picture(figure, title), reading(text)))
    engines = sorted({r.numerics["engine_version"] for r in results.values()})
    parts.append(section("Runs", run_table(results), reading("Engine version " + ", ".join(engines) + ".")))
    parts.append(section("Commands", command_list(program, results, command)))
    return document(f"{system.TITLE}: reproduction", lead, "".join(parts))
