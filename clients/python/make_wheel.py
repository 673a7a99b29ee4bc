#!/usr/bin/python3
"""Packs the Python package of a build into a wheel, without a network: what `cmake --install BUILD --component python`
installs, with what pip wants to know. It runs where that build runs: with its Python and its system's libraries."""

import argparse
import os
import pathlib
import re
import subprocess
import sys
import sysconfig
import tempfile

try:
    from wheel.wheelfile import WheelFile
except ImportError:
    sys.exit("make_wheel.py: needs the Python module wheel (Debian: python3-wheel)")

# numpy: pybind11 2.10 of Debian 12 finds no arrays in NumPy 2.
METADATA = """Metadata-Version: 2.1
Name: grouser
Version: {version}
Summary: What will this wheel do on this soil? Terramechanics in microseconds, with the error bar of DEM
License: Apache-2.0
Requires-Python: =={python}.*
Requires-Dist: numpy<2
Provides-Extra: client
Requires-Dist: grpcio; extra == 'client'
Requires-Dist: protobuf (>=4.21); extra == 'client'
"""
WHEEL = """Wheel-Version: 1.0
Generator: make_wheel.py
Root-Is-Purelib: false
Tag: {tag}
"""


def cached(build, name):
    """An entry of a build's CMake cache."""
    cache = build / "CMakeCache.txt"
    if not cache.is_file():
        sys.exit(f"make_wheel.py: {cache}: no such file, expected the folder of a build")
    found = re.search(rf"^{name}:[A-Z]+=(.+)$", cache.read_text(), re.M)
    if found is None:
        sys.exit(f"make_wheel.py: {cache}: no {name}; was the build configured with pybind11?")
    return found[1]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("build", type=pathlib.Path, help="folder of a build, as build/release")
    parser.add_argument("out", type=pathlib.Path, help="folder for the wheel")
    asked = parser.parse_args()
    version, packages = cached(asked.build, "CMAKE_PROJECT_VERSION"), cached(asked.build, "GROUSER_PYTHON_DIR")
    asked.out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=asked.out) as aside:
        prefix = pathlib.Path(aside, "installed")
        done = subprocess.run([cached(asked.build, "CMAKE_COMMAND"), "--install", asked.build, "--component", "python",
                               "--prefix", prefix.absolute()], stdout=subprocess.DEVNULL, check=False)
        if done.returncode != 0:
            sys.exit(f"make_wheel.py: cmake --install {asked.build} --component python: failed, is it built?")
        package = prefix / packages
        module = package / f"grouser/_core{sysconfig.get_config_var('EXT_SUFFIX')}"
        if not module.is_file():
            sys.exit(f"make_wheel.py: {asked.build}: no {module.name} in it, it is for another Python than "
                     f"{sys.executable}")
        python = f"cp{sys.version_info.major}{sys.version_info.minor}"
        tag = f"{python}-{python}-{re.sub('[-.]', '_', sysconfig.get_platform())}"
        about = package / f"grouser-{version}.dist-info"
        about.mkdir()
        (about / "METADATA").write_text(METADATA.format(version=version, python=sysconfig.get_python_version()))
        (about / "WHEEL").write_text(WHEEL.format(tag=tag))
        name = f"grouser-{version}-{tag}.whl"
        with WheelFile(f"{aside}/{name}", "w") as wheel:  # writes RECORD, with hashes of the files
            wheel.write_files(str(package))
        with open(f"{aside}/{name}", "rb") as written:
            os.fsync(written.fileno())
        os.replace(f"{aside}/{name}", asked.out / name)
    print(asked.out / name)


if __name__ == "__main__":
    main()
