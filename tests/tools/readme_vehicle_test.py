#!/usr/bin/python3
"""The README's blocks of "A vehicle: how fast, at what cost, and where", run as they stand there, in a
checkout that has nothing but its files and its programs. Usage: readme_vehicle_test.py ROOT BIN"""

import csv
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

SECTION = re.compile(r"^## A vehicle: .*?(?=^## )", re.M | re.S)
BLOCK = re.compile(r"^```\n(.*?)^```$", re.M | re.S)
# As git has them, and copied, as it finds the root by its own place: the front door.
LINKED = ("CMakeLists.txt", "clients", "cmake", "surrogate")


def checkout(root, programs, folder):
    for name in LINKED:
        (folder / name).symlink_to(root / name)
    shutil.copy(root / "grouser", folder / "grouser")
    (folder / "build/release").mkdir(parents=True)
    (folder / "build/release/bin").symlink_to(programs)


def run(block, folder):
    """What a block prints; no command of it may fail."""
    done = subprocess.run(["bash", "-euo", "pipefail", "-c", block], cwd=folder, capture_output=True, text=True,
                          stdin=subprocess.DEVNULL, check=False)
    assert done.returncode == 0, f"exit code {done.returncode} of\n{block}\n{done.stdout}\n{done.stderr}"
    return done.stdout


def check_speed(out, folder):
    with open(folder / "out/path.csv", newline="") as file:
        points = list(csv.DictReader(file))
    assert len(points) > 2
    rows = [line for line in out.splitlines() if re.match(r" *[\d.]+ ", line)]
    assert len(rows) == len(points), out


def check_energy(out, _):
    for word in ("rolling", "scrub", "slip", "J/m", "wheel_separation_multiplier"):
        assert word in out, f"no {word} in\n{out}"


def check_map(_, folder):
    folder = folder / "out"
    counts = json.loads((folder / "map/map.json").read_text())
    assert counts["grid"]["columns"] > 100
    for name in ("map/speed.tif", "map/energy.tif", "map/binding.tif", "map/speed.png", "routes/routes.png"):
        assert (folder / name).stat().st_size > 1000, name
    with open(folder / "routes/routes.csv", newline="") as file:
        assert {row["route"] for row in csv.DictReader(file)} == {"fastest", "least_energy"}


def main(root, programs):
    section = SECTION.search((root / "README.md").read_text())
    assert section, "README.md has no section '## A vehicle: ...'"
    blocks = BLOCK.findall(section[0])
    tasks = {"./grouser speed ": check_speed, "./grouser energy ": check_energy, "./grouser map ": check_map}
    assert len(blocks) == len(tasks), f"{len(blocks)} blocks, expected {len(tasks)}"
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        checkout(root, programs, folder)
        for block, (command, check) in zip(blocks, tasks.items()):
            assert command in block, f"no {command}in\n{block}"
            check(run(block, folder), folder)


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve())
