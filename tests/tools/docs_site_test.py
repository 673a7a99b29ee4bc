#!/usr/bin/python3
"""./grouser docs --strict: no warning, every page of docs/ in the contents, every local link of the
HTML leads to a file and an anchor that are there. Usage: docs_site_test.py ROOT"""

import html.parser
import importlib.util
import pathlib
import shutil
import subprocess
import sys
import tempfile
import urllib.parse

SKIPPED = 77


class Page(html.parser.HTMLParser):
    """The links and the anchors of one page."""

    def __init__(self, path):
        super().__init__()
        self.links, self.anchors = set(), set()
        self.feed(path.read_text())

    def handle_starttag(self, tag, attributes):
        for name, value in attributes:
            if name in ("href", "src") and value:
                self.links.add(value)
            elif name == "id":
                self.anchors.add(value)


def dead_links(folder):
    pages = {p.resolve(): Page(p) for p in folder.rglob("*.html")}
    for path, page in pages.items():
        for link in page.links:
            parts = urllib.parse.urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (path.parent / urllib.parse.unquote(parts.path)).resolve() if parts.path else path
            if not target.exists():
                yield f"{path.relative_to(folder)}: {link}: no such file"
            elif target in pages and parts.fragment not in ("", *map(urllib.parse.quote, pages[target].anchors)):
                yield f"{path.relative_to(folder)}: {link}: no such anchor"


def main():
    root = pathlib.Path(sys.argv[1])
    lacking = [m for m in ("sphinx", "myst_parser", "breathe", "furo") if not importlib.util.find_spec(m)]
    if lacking or not shutil.which("doxygen"):
        print(f"skipped: not installed: {' '.join(lacking) or 'doxygen'} (group docs of cmake/packages.debian)")
        return SKIPPED
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder).resolve() / "site"
        subprocess.run([root / "grouser", "docs", "--strict", "--out", out], check=True)
        dead = sorted(dead_links(out))
        missing = [p.name for p in (root / "docs").glob("*.md") if not (out / "docs" / f"{p.stem}.html").exists()]
        index = Page(out / "docs/README.html")
        unlisted = [
            p.name for p in (root / "docs").glob("*.md")
            if p.stem != "README" and not {f"{p.stem}.html"} & index.links
        ]
        commands = (out / "docs/site/commands.html").read_text()
    for line in [*dead, *(f"{m}: not built" for m in missing), *(f"{u}: not in the contents" for u in unlisted)]:
        print(line)
    absent = [t for t in ("--slip", "campaign adapt", "jobs rollback", "model plot", "vehicle measured", "jobs submit-campaign")
              if t not in commands]
    for text in absent:
        print(f"commands.html: expected {text!r}")
    return bool(dead or missing or unlisted or absent)


if __name__ == "__main__":
    sys.exit(main())
