"""Parts of a self-contained HTML page: tables, pictures, sections."""

import base64
import html
import io
import math
import os

HERE = os.path.dirname(os.path.abspath(__file__))
STYLE = {  # of matplotlib
    "font.size": 9, "axes.spines.top": False, "axes.spines.right": False,
    "axes.grid": True, "grid.color": "#e6e6e6", "axes.axisbelow": True,
    "axes.edgecolor": "#888888", "legend.frameon": False, "figure.dpi": 110,
}


def cell(value, digits=3):
    if isinstance(value, float):
        return "–" if math.isnan(value) else f"{value:.{digits}g}"
    return html.escape(str(value))


def table(header, rows, note=""):
    head = "".join(f"<th>{html.escape(text)}</th>" for text in header)
    body = "".join("<tr>" + "".join(f"<td>{cell(value)}</td>" for value in row) + "</tr>\n"
                   for row in rows)
    note = f"<p class=note>{html.escape(note)}</p>" if note else ""
    return f"<div class=scroll><table><tr>{head}</tr>\n{body}</table></div>{note}"


def picture(figure, alt):
    """A figure of matplotlib as a PNG inside the page; closes it."""
    from matplotlib import pyplot  # here: a page without figures needs none
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=130)
    pyplot.close(figure)
    data = base64.b64encode(buffer.getvalue()).decode()
    return f'<img alt="{html.escape(alt)}" src="data:image/png;base64,{data}">'


def section(title, *parts):
    return f"<section><h2>{html.escape(title)}</h2>\n" + "\n".join(parts) + "</section>\n"


def reading(text):
    return f"<p>{html.escape(text)}</p>"


def document(title, lead, body):
    """`lead` and `body` are HTML."""
    with open(os.path.join(HERE, "page.css")) as file:
        style = file.read()
    return f"""<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{html.escape(title)}</title>
<meta name="viewport" content="width=device-width, initial-scale=1"><style>{style}</style></head>
<body><h1>{html.escape(title)}</h1>
{lead}
{body}</body></html>
"""
