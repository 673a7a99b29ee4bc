"""The page of a reproduced system: rows, what was changed, figures, runs, commands."""

import html
import math
import os
import re

from html_page import document, picture, reading, section
from run_report import command_list, run_table


def show(value):
    """A number or a text, as plain text."""
    if value is None:
        return "–"
    if isinstance(value, str):
        return value
    return "–" if not math.isfinite(value) else f"{value:.4g}"


def markdown(system, level, rows):
    """The rows for docs/reproductions.md."""
    words = {True: "holds", False: "**fails**", None: "printed"}
    lines = ["| row | got | standard error | beds | expected | limit | |", "| --- | --- | --- | --- | --- | --- | --- |"]
    lines += ["| " + " | ".join((r.row, show(r.got), show(r.standard_error), str(r.beds), show(r.expected), r.limit,
                                 words[r.passed])) + " |" for r in rows]
    changed = sorted({r.changed for r in rows if r.changed})
    return (f"## {system}, {level}\n\n" + "\n".join(lines) + "\n\nChanged against the paper: "
            + ("; ".join(changed) or "nothing") + ".\n")


def row_table(rows):
    head = ("row", "got", "standard error", "beds", "expected", "limit", "", "changed against the paper",
            "note")
    words = {True: "<b style='color:#1a7f37'>holds</b>", False: "<b style='color:#c1121f'>fails</b>",
             None: "<span style='color:#666'>printed</span>"}
    body = "".join(
        "<tr>" + "".join(f"<td style='white-space:normal;text-align:left;vertical-align:top'>{text}</td>" for text in (
            html.escape(r.row), html.escape(show(r.got)), show(r.standard_error), str(r.beds),
            html.escape(show(r.expected)),
            html.escape(r.limit), words[r.passed], html.escape(r.changed), html.escape(r.note)))
        + "</tr>\n" for r in rows)
    return ("<div class=scroll><table><tr>" + "".join(f"<th>{text}</th>" for text in head)
            + f"</tr>\n{body}</table></div>")


def known(system):
    """What is known of the rows that fail: known.md beside the system, as a section; empty without one."""
    path = os.path.join(os.path.dirname(system.__file__), "known.md")
    if not os.path.exists(path):
        return []
    with open(path, encoding="utf-8") as file:
        text = html.escape(file.read())
    paragraphs = re.sub(r"`([^`]*)`", r"<code>\1</code>", text).split("\n\n")
    return [section("What is known of the coarse form", "".join(f"<p>{one}</p>" for one in paragraphs))]


def render(system, level, rows, results, command):
    """`system`: the module of a system, with TITLE and ABOUT, perhaps changed() and figures()."""
    failing = sum(r.passed is False for r in rows)
    held = sum(r.passed is True for r in rows)
    lead = reading(f"Level {level}: {held} rows hold, {failing} fail, "
                   f"{sum(r.passed is None for r in rows)} are printed only.") + reading(system.ABOUT)
    parts = [section("Rows", row_table(rows)), *known(system)]
    if hasattr(system, "changed"):
        items = "".join(f"<li>{html.escape(text)}</li>" for text in system.changed(level))
        parts.append(section("Changed against the paper", f"<ul>{items}</ul>"))
    if hasattr(system, "figures"):
        for title, figure, text in system.figures(results, level):
            parts.append(section(title, picture(figure, title), reading(text)))
    engines = sorted({r.numerics["engine_version"] for r in results.values()})
    parts.append(section("Runs", run_table(results), reading("Engine version " + ", ".join(engines) + ".")))
    parts.append(section("Commands", command_list(results, command)))
    return document(f"{system.TITLE}: reproduction", lead, "".join(parts))
