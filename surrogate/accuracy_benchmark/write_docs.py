#!/usr/bin/python3
"""Times and compares every kind of model and writes what docs/speed-vs-error.md shows of it: its table
against time, its picture, and all tables into docs/results, in place of the ones before. A pair's converge.json
(./grouser campaign converge) is printed there as well.

  ./grouser ladder docs
"""

import argparse
import datetime
import glob
import json
import os
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path[:0] = [os.path.join(ROOT, "dem_offline", "convergence"), os.path.join(ROOT, "clients", "common")]

import converge  # noqa: E402

BEGIN, END = "<!-- written by ./grouser ladder docs -->", "<!-- end -->"
SUMMARY = ": rms error against time (states)"


def read(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


def write(path, text):
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)


def summary_of(tables):
    """The sections whose heading ends with SUMMARY."""
    sections = ["### " + one.strip() for one in tables.split("### ")[1:]]
    return "\n\n".join(one for one in sections if one.split("\n", 1)[0].endswith(SUMMARY))


def numerics_of(pairs):
    """What time step, box and window do to each pair's runs, where its folder says so."""
    text = ""
    for path in sorted(glob.glob(os.path.join(pairs, "*", "converge.json"))):
        kept = json.loads(read(path))
        text += (f"\n### {os.path.basename(os.path.dirname(path))}: time step, box and window of its runs (differences)\n"
                 f"`{converge.command_of(kept)}`\n\n"
                 f"{converge.text_of(kept['rows'])}\n")
    return text


def between_marks(page, text, path):
    begin, mark, rest = page.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not mark or not end:
        sys.exit(f"{path}: expected the lines '{BEGIN}' and '{END}'")
    return f"{begin}{BEGIN}\n\n{text}\n\n{END}{after}"


def replace_results(docs, tables, today):
    """docs/results/speed-vs-error-DATE.md with today's tables; links to earlier ones lead there."""
    name = f"speed-vs-error-{today.isoformat()}"
    heading = (f"# Speed against error: tables of {today.day} {today:%B %Y}\n\nMade by `./grouser ladder docs`; how to "
               "read them: [speed against error](../speed-vs-error.md).\n\n")
    earlier = [os.path.splitext(os.path.basename(path))[0]
               for path in glob.glob(os.path.join(docs, "results", "speed-vs-error-*.md"))]
    write(os.path.join(docs, "results", name + ".md"), heading + tables.replace("### ", "## ").strip() + "\n")
    for old in set(earlier) - {name}:
        for path in glob.glob(os.path.join(docs, "*.md")):
            page = read(path)
            if old in page:
                write(path, page.replace(old, name))
        os.remove(os.path.join(docs, "results", old + ".md"))


def main():
    parser = argparse.ArgumentParser(prog="./grouser ladder docs", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--docs", default=os.path.join(ROOT, "docs"), help="folder to write to")
    parser.add_argument("--pairs", default=os.path.join(ROOT, "surrogate", "pairs"), help="folder of pairs")
    parser.add_argument("--seconds", default="0.5", help="spent on the timing of each kind")
    parser.add_argument("--bin", default=os.path.join(ROOT, "build", "release", "bin"), help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    page = os.path.join(arguments.docs, "speed-vs-error.md")
    between_marks(read(page), "", page)  # says at once what is missing
    with tempfile.TemporaryDirectory() as folder:
        tables = os.path.join(folder, "tables.md")
        done = subprocess.run([os.path.join(arguments.bin, "grouser-ladder"), arguments.pairs, "--json", "--markdown",
                               tables, "--seconds", arguments.seconds], stdout=subprocess.PIPE, check=False, text=True)
        if done.returncode != 0:
            return done.returncode
        tables = read(tables)
    write(page, between_marks(read(page), summary_of(tables), page))
    replace_results(arguments.docs, tables.rstrip() + "\n" + numerics_of(arguments.pairs), datetime.date.today())
    import plot  # matplotlib, last: it takes a second
    plot.draw(json.loads(done.stdout), os.path.join(arguments.docs, "speed-vs-error.svg"))
    return 0


if __name__ == "__main__":
    sys.exit(main())
