#!/usr/bin/python3
"""Checks that documents and comments cite only what this repository holds: links, their
anchors, paths in backticks, citations. Usage: check_docs.py ROOT | --self-test"""

import pathlib
import re
import subprocess
import sys
import tempfile

LINK = re.compile(r"(?<!!)\[[^\]]*\]\(([^)\s]+)\)|!\[[^\]]*\]\(([^)\s]+)\)")
HEADING = re.compile(r"^#{1,6} +(.*)$", re.M)
FENCE = re.compile(r"^```.*?^```", re.M | re.S)
TOP = ("server/", "proto/", "dem_offline/", "surrogate/", "clients/", "tests/", "docs/", "cmake/", "packaging/")
PATH = re.compile(r"`((?:" + "|".join(TOP) + r")[\w./-]*)`")
# Notes that only the people who wrote the project have, and numbers of their tasks.
OUTSIDE = re.compile(r"\bDESIGN(\.md)?\b(?! *=)|\bVALIDATION(\.md)?\b(?!_)|GPU-DEM|RPC-LATENCY|"
                     r"STYLE-ANCHORS|\.\./shared|\bissue \d|\bthis session\b|\bno session\b")
# "reference 3" and "Author & Author 1999" stand in docs/references.md.
REFERENCE = re.compile(r"\breference(?: system)? ([1-9])\b")
TEXT = {".md", ".h", ".cc", ".cu", ".inl", ".proto", ".lcm", ".py", ".sh", ".yaml", ".csv", ".txt", ".cmake"}


def anchors(text):
    """The anchors that a forge makes of a page's headings."""
    names = set()
    for heading in HEADING.findall(FENCE.sub("", text)):
        plain = re.sub(r"[`*]|\[([^\]]*)\]\([^)]*\)", r"\1", heading).strip().lower()
        names.add(re.sub(r"[^\w\- ]", "", plain).replace(" ", "-"))
    return names


def check_links(root, page, text, tracked):
    for match in LINK.finditer(FENCE.sub("", text)):
        target = match[1] or match[2]
        if re.match(r"https?://|mailto:", target):
            continue
        file, _, anchor = target.partition("#")
        path = (page.parent / file).resolve() if file else page.resolve()
        if not path.exists() or (path.is_file() and str(path.relative_to(root)) not in tracked):
            yield f"link to {target}, which is not in the repository"
        elif anchor and path.suffix == ".md" and anchor not in anchors(path.read_text()):
            yield f"link to {target}: no such heading"


def check_page(root, page, tracked, systems):
    """What is wrong with one text file, as strings."""
    text = page.read_text(errors="replace")
    for number, line in enumerate(text.splitlines(), 1):
        match = OUTSIDE.search(line)
        if match:
            yield f"{number}: cites {match[0]!r}, which is not in the repository"
        for system in REFERENCE.findall(line):
            if system not in systems:
                yield f"{number}: reference system {system} is not in docs/references.md"
    if page.suffix != ".md":
        return
    yield from check_links(root, page, text, tracked)
    for path in PATH.findall(text):
        if not (root / path).exists():
            yield f"names `{path}`, which is not in the repository"


def check(root):
    root = root.resolve()
    listed = subprocess.run(["git", "-C", root, "ls-files", "-co", "--exclude-standard"],
                            capture_output=True, text=True, check=True).stdout.split("\n")
    tracked = {f for f in listed if f and (root / f).is_file()}
    listing = root / "docs/references.md"
    systems = set(re.findall(r"\| reference system (\d)", listing.read_text())) if listing.exists() else set()
    errors = []
    for name in sorted(tracked):
        page = root / name
        if page.suffix in TEXT and page.resolve() != pathlib.Path(__file__).resolve():
            errors += [f"{name}: {e}" for e in check_page(root, page, tracked, systems)]
    return errors


def self_test():
    bad = {
        "docs/a.md": ["[x](gone.md)", "[x](b.md#gone)", "see `server/gone.cc`", "as DESIGN says",
                      "reference 7"],
        "server/a.h": ["// VALIDATION: 0.68", "// .." "/shared/data"],
    }
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        subprocess.run(["git", "init", "-q", folder], check=True)
        for name in bad:
            (root / name).parent.mkdir(exist_ok=True)
        (root / "docs/b.md").write_text("# Two words\n[up](#two-words) [a](a.md) `docs/b.md`\n")
        (root / "docs/references.md").write_text("| reference system 1 | x |\n")
        for name in bad:
            (root / name).write_text("reference 1\n")
        assert check(root) == [], check(root)
        for name, lines in bad.items():
            for line in lines:
                (root / name).write_text(line + "\n")
                assert len(check(root)) == 1, (line, check(root))
            (root / name).write_text("")
    print("self-test passed")


if __name__ == "__main__":
    if sys.argv[1:] == ["--self-test"]:
        self_test()
        sys.exit()
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    found = check(pathlib.Path(sys.argv[1]))
    print("\n".join(found) if found else "documents cite nothing that is not here")
    sys.exit(bool(found))
