"""Blocks of a document, run as they stand there in a checkout that has nothing but its files and its programs."""

import re
import shutil
import subprocess

FENCED = re.compile(r"^```(\w*)\n(.*?)^```$", re.M | re.S)
# As git has them, and copied, as it finds the root by its own place: the front door.
LINKED = ("CMakeLists.txt", "clients", "cmake", "dem_offline", "surrogate")


def commands(text):
    """Blocks without a language."""
    return [block for language, block in FENCED.findall(text) if not language]


def checkout(root, programs, folder):
    for name in LINKED:
        (folder / name).symlink_to(root / name)
    shutil.copy(root / "grouser", folder / "grouser")
    (folder / "build/release").mkdir(parents=True)
    (folder / "build/release/bin").symlink_to(programs)


def run(block, folder, code=0):
    """What a block prints; no command of it may fail, or where another code is expected, the last one with that."""
    done = subprocess.run(["bash", "-euo", "pipefail", "-c", block], cwd=folder, capture_output=True, text=True,
                          stdin=subprocess.DEVNULL, check=False)
    assert done.returncode == code, f"exit code {done.returncode} of\n{block}\n{done.stdout}\n{done.stderr}"
    return done.stdout if code == 0 else done.stderr


def option(block, name):
    """The number after an option of a block."""
    return float(re.search(rf"--{name} ([\d.]+)", block)[1])


def number(pattern, text):
    found = re.search(pattern, text)
    assert found, f"no {pattern} in\n{text}"
    return float(found[1])
