"""Sphinx's settings for ./grouser docs: docs/*.md as they stand, with a table of contents from
docs/README.md, and references made of the headers, the Python package, the messages and --help.

GROUSER_SITE_XML: Doxygen's output; GROUSER_SITE_PYTHON: the built package's folder, or empty.
"""

import os
import pathlib
import re
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
PYTHON_PACKAGE = os.environ.get("GROUSER_SITE_PYTHON", "")

project = "Grouser"
copyright = author = "the Grouser authors"
version = release = re.search(r"project\(grouser VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text())[1]
extensions = ["myst_parser", "breathe", "sphinx.ext.autodoc"]
root_doc = "docs/README"
include_patterns = [
    "README.md",
    "CHANGELOG.md",
    "docs/**.md",
    "dem_offline/reproduce/*/known.md",
    "surrogate/measured_vehicles/data/README.md",
]
exclude_patterns = ["build"]
myst_heading_anchors = 6
highlight_language = "none"
html_theme = "furo"
html_title = f"Grouser {release}"
html_show_copyright = False
breathe_projects = {"grouser": os.environ.get("GROUSER_SITE_XML", "")}
breathe_default_project = "grouser"
# Names of the C++ library, and of Boost, Eigen and the standard library, are not documented here.
nitpicky = False
suppress_warnings = ["myst.header"]  # tables that a command writes below a title of the first level
if PYTHON_PACKAGE:
    sys.path.insert(0, PYTHON_PACKAGE)
autodoc_member_order = "bysource"
autodoc_default_options = {"no-value": True}  # paths of the machine that made this, say

REFERENCES = ["site/commands", "site/cpp", "site/python", "site/messages"]
LINK = re.compile(r"\[([^\]]+)\]\(([^)#\s]+\.md)\)")


def contents(table):
    """The table of docs/README.md as Sphinx's toctrees, a caption a row."""
    captions = re.findall(r"^\| \*\*(.+?)\*\* \| (.*) \|$", table, re.M)
    if not captions:
        raise ValueError("docs/README.md: expected a table of rows '| **caption** | [page](page.md), ... |'")
    blocks = []
    for caption, row in captions:
        pages = [target.removesuffix(".md") for _, target in LINK.findall(row)]
        if caption == "look up":
            pages += REFERENCES
        blocks.append(f"```{{toctree}}\n:hidden:\n:caption: {caption.capitalize()}\n\n" + "\n".join(pages) + "\n```\n")
    listed = {page for block in blocks for page in block.splitlines()}
    rest = [p for p in sorted((ROOT / "docs").glob("results/*.md")) if f"results/{p.stem}" not in listed]
    rest = [p.relative_to(ROOT / "docs").with_suffix("").as_posix() for p in rest]
    blocks.append("```{toctree}\n:hidden:\n:caption: Results\n\n" + "\n".join([*rest, "../CHANGELOG"]) + "\n```\n")
    return "\n".join(blocks)


def messages():
    """Every message file with its comments."""
    files = sorted((ROOT / "proto/grouser/v1alpha1").glob("*.proto"))
    return "\n".join(
        f"## {f.name}\n\n```{{literalinclude}} ../../{f.relative_to(ROOT)}\n:language: protobuf\n```\n" for f in files
    )


# Verbs that the front door itself knows, which no --help lists below "Subcommands:".
VERBS = {"model": None, "jobs": None, "campaign": ["adapt", "converge"], "vehicle": ["plot", "measured"],
         "calibrate": ["grains"]}


def help_of(*words):
    """What --help prints; what the front door says instead where something is missing here."""
    run = subprocess.run([str(ROOT / "grouser"), *words, "--help"], capture_output=True, text=True, timeout=60)
    if run.returncode and "missing packages" not in run.stderr:
        raise RuntimeError(f"./grouser {' '.join(words)} --help: exit code {run.returncode}\n{run.stderr}")
    return run.stdout if run.returncode == 0 else f"Not in this copy: {run.stderr}"


def verbs_of(words, text):
    """Names of what stands below a word."""
    listed = re.search(r"^Subcommands:\n((?: .*\n)+)", text, re.M)
    found = re.findall(r"^  (\S+)", listed[1], re.M) if listed else []
    if len(words) == 1 and words[0] in VERBS:
        own = VERBS[words[0]] or re.findall(r"^  ([a-z][\w-]*)(?: [\w|]+)?  +\S", text.split("Examples:")[0], re.M)
        found += [verb for verb in own if verb not in found]
    return found


def commands():
    """What --help of every word prints, and of what stands below it."""
    pages = []

    def add(words):
        text = help_of(*words)
        pages.append(f"{'#' * (len(words) + 1)} {' '.join(words)}\n\n````text\n{text.rstrip()}\n````\n")
        for verb in verbs_of(words, text):
            add([*words, verb])

    for word in re.findall(r"^  (\S+) +\S", help_of().split("\n\nOn a fresh")[0], re.M):
        if word != "help":
            add([word])
    return "\n".join(pages)


def python_reference():
    if not PYTHON_PACKAGE:
        return "Not in this copy: the Python package was not built (it needs the packages of the group `python`)."
    return "```{eval-rst}\n.. automodule:: grouser\n   :members:\n   :imported-members:\n```\n"


MADE = {"messages": messages, "commands": commands, "python": python_reference}


def read_source(app, name, source):
    text = source[0]
    if name == root_doc:
        text = text.replace("[results](results)", "`docs/results`") + "\n" + contents(text)
    made = MADE.get(name.removeprefix("docs/site/")) if name.startswith("docs/site/") else None
    if made:
        text += "\n" + made()
    if not name.startswith("docs/") and name not in ("README", "CHANGELOG"):
        text = "---\norphan: true\n---\n" + text  # reached by links alone
    # Pages of results that are HTML already are copied as they are.
    source[0] = re.sub(r"\[([^\]]+)\]\((validation/[\w.-]+\.html)\)", r'<a href="\2">\1</a>', text)


def plain_docstring(app, what, name, object_, options, lines):
    """Docstrings are plain text, not reStructuredText: paragraphs, and lists of "name: text" kept as they stand."""
    paragraphs = re.split(r"\n\s*\n", "\n".join(re.sub(r"([\\|*`_])", r"\\\1", line) for line in lines).strip("\n"))
    lines.clear()
    for paragraph in paragraphs:
        kept = re.search(r"^( +\S|[\w, \\]+: )", paragraph, re.M)
        lines.extend([*("| " + line for line in paragraph.split("\n"))] if kept else paragraph.split("\n"))
        lines.append("")


def finish(app, problem):
    if problem or app.builder.format != "html":
        return
    out = pathlib.Path(app.outdir)
    (out / "docs/validation").mkdir(parents=True, exist_ok=True)
    for page in (ROOT / "docs/validation").glob("*.html"):
        shutil.copy(page, out / "docs/validation")
    (out / "index.html").write_text(
        f'<!doctype html><meta charset="utf-8"><title>{html_title}</title>'
        '<meta http-equiv="refresh" content="0; url=docs/README.html"><a href="docs/README.html">Grouser</a>\n'
    )


def setup(app):
    app.connect("source-read", read_source)
    app.connect("autodoc-process-docstring", plain_docstring)
    app.connect("build-finished", finish)
