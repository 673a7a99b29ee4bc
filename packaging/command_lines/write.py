#!/usr/bin/python3
"""Manual pages and completions for bash of all programs and of ./grouser, from what they tell of their command
lines. Usage: write.py --build BUILD --out OUT [--programs]    (OUT/man1/NAME.1.gz, OUT/completions/NAME)"""

import argparse
import concurrent.futures
import gzip
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

import collect
import completion
import man_page


def install(build, prefix):
    """What is installed of ./grouser, with the programs of the build; the programs' names."""
    for component in ("words", "data"):
        subprocess.run(["cmake", "--install", build, "--prefix", prefix, "--component", component], check=True,
                       stdout=subprocess.DEVNULL)
    table = (prefix / "share" / "grouser" / "cmake" / "programs").read_text().splitlines()
    names = [line.split()[0] for line in table if not line.startswith("#")]
    for name in names:
        if (build / "bin" / name).exists():
            (prefix / "bin" / name).symlink_to(build / "bin" / name)
    return [name for name in names if (build / "bin" / name).exists()]


def commands(build, programs_alone):
    """All command lines, and the version."""
    with tempfile.TemporaryDirectory() as folder:
        prefix, home = pathlib.Path(folder, "prefix"), pathlib.Path(folder, "home")
        home.mkdir()
        names = install(build, prefix)
        collector = collect.Collector(prefix, home)
        words = [] if programs_alone else [collector.words()]
        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            found = list(pool.map(collector.program, names))
        version = subprocess.run([prefix / "bin" / "grouser", "--version"], check=True, capture_output=True,
                                 text=True).stdout.split()[1]
        return [*words, *found], version


def write(path, text, packed=False):
    data = gzip.compress(text.encode(), mtime=0) if packed else text.encode()
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", required=True, type=pathlib.Path, help="folder of a build, such as build/release")
    parser.add_argument("--out", required=True, type=pathlib.Path, help="folder to write, anew")
    parser.add_argument("--programs", action="store_true", help="not of ./grouser")
    arguments = parser.parse_args()
    found, version = commands(arguments.build.resolve(), arguments.programs)
    names = [command["name"] for command in found]
    shutil.rmtree(arguments.out, ignore_errors=True)
    for command in found:
        page = man_page.words_page if command["name"] == "grouser" else man_page.program_page
        write(arguments.out / "man1" / f"{command['name']}.1.gz", page(command, version, names), packed=True)
        write(arguments.out / "completions" / command["name"], completion.completion(command))
    print(f"{len(names)} commands: {arguments.out}")


if __name__ == "__main__":
    sys.exit(main())
